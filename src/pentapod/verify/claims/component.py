"""Claims about the component: proven in continuous time, for every interval between rows."""

from __future__ import annotations

import math

from pentapod.verify.replay.claim import MM, Claim, Finding
from pentapod.verify.replay.replay import Replay

_METHOD = (
    "{answer}; component {component}: {what} for all times, by Bernstein coefficients of the discriminants of the "
    "forward kinematics, rounded outwards, even if each leg is off by {error:g} mm at any time"
)


def axis_upright(replay: Replay) -> Finding:
    """Judge that w keeps the sign of the component: the platform line never falls into the base plane."""
    found = replay.survey.component.upright
    least = math.degrees(math.asin(min(-float(found.values.item()), 1.0)))
    what = "least angle between platform line and base plane,"
    return _finding(replay, least, int(found.at.item()), "deg", what)


def off_singular_plane(replay: Replay) -> Finding:
    """Judge that S keeps the sign of the component: no configuration with det J = 0 because of S = 0."""
    found = replay.survey.component.away
    # |S| / √(δ²w² + (1 − δu)²) is the distance to S = 0 at fixed orientation; the root is ≤ 1 + |δ|.
    least = -MM * float(found.values.item()) / (1.0 + abs(replay.machine.robot.delta))
    what = "lower bound of the position's distance to S = 0,"
    return _finding(replay, least, int(found.at.item()), "mm", what)


def _finding(replay: Replay, least: float, interval: int, unit: str, what: str) -> Finding:
    found, passed = replay.survey.component, least > 0.0
    answer = "held"
    if not passed:
        doubtful = found.first_refuted or found.first_undecided
        answer = "refuted: the legs have no pose" if found.first_refuted else "undecided: too near a singularity"
        if doubtful is not None:
            interval, start, stop = doubtful
            period = replay.program.period
            answer += f", first from {(interval + start) * period:.6f} to {(interval + stop) * period:.6f} s"
            answer += f"; {found.refuted} intervals refuted, {found.undecided} undecided"
    method = _METHOD.format(
        answer=answer, component=replay.program.component, what=what, error=MM * replay.path_tolerance
    )
    return Finding(passed, least, 0.0, unit, replay.place(2 * interval), method)


CLAIMS = (
    Claim("component kept, w", axis_upright, needs_pose=False),
    Claim("component kept, S", off_singular_plane, needs_pose=False),
)
