"""Claims that the component is kept, proven for all times on every interval between rows.

The robot names what its proof bounds: |w| and |S| in the quadratic family, the roll of a platform with a sixth leg,
elsewhere the stiffness of the pose.
"""

from __future__ import annotations

import math
from functools import partial

from pentapod.kinematics.proof_results import ProvenMeasure
from pentapod.verify.replay.claim import MM, Claim, Finding, Idle
from pentapod.verify.replay.replay import Replay

_METHOD = (
    "{answer}; component {component}: {what} for all times, {how}, even if each leg is off by {error:g} mm at any time"
)


def kept(replay: Replay, *, measure: str) -> Finding | Idle:
    """Judge that the measure of this name keeps the sign of the component; idle for a robot with other measures.

    The claim without a name judges all measures that have no claim of their own.
    """
    found = [
        _finding(replay, proven, column)
        for column, proven in enumerate(replay.machine.robot.proven_measures)
        if proven.name == measure or (not measure and proven.name not in NAMED)
    ]
    if not found:
        return Idle("this kind of robot proves its component by another measure")
    return next((finding for finding in found if not finding.passed), found[0])


def _finding(replay: Replay, measure: ProvenMeasure, column: int) -> Finding:
    found = replay.interval_bounds.component
    least, interval = -float(found.lower.values[column]), int(found.lower.at[column])
    least = math.degrees(math.asin(min(least, 1.0))) if measure.unit == "deg" else measure.scale * least
    answer, passed = "proven", least > 0.0
    if not passed:
        doubtful = found.first_refuted or found.first_undecided
        answer = "refuted: the leg lengths have no pose" if found.first_refuted else "undecided: too near a singularity"
        if doubtful is not None:
            interval, start, stop = doubtful
            period = replay.program.period
            answer += f", first from {(interval + start) * period:.6f} to {(interval + stop) * period:.6f} s"
            answer += f"; {found.refuted} intervals refuted, {found.undecided} undecided"
    method = _METHOD.format(
        answer=answer,
        component=replay.program.component,
        what=measure.meaning,
        how=measure.method,
        error=MM * replay.path_tolerance,
    )
    return Finding(passed, least, 0.0, measure.unit, replay.place(2 * interval), method, at_least=True)


NAMED = ("w", "S", "roll")
"""Measures with a claim of their own."""

COMPONENT_KEPT = "component kept"
"""How the names of these claims begin."""

CLAIMS = tuple(
    Claim(f"{COMPONENT_KEPT}{', ' if measure else ''}{measure}", partial(kept, measure=measure), needs_pose=False)
    for measure in (*NAMED, "")
)
