"""Mending: what a run goes back for, once it is known that its toolpath cannot be done as it is.

Cuts at places where no placement and tool axis keeps the limits, or at which a claim of the verdict fails, are left
out, and the rest is linked and planned again. Whether what is left there is acceptable is for the verdict to say.
Where the program is slower than it has to be, its time law is searched for longer. `other_way` makes another toolpath.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.base.refusal import Refusal
from pentapod.base.units import from_si
from pentapod.base.values import Value
from pentapod.geometry.polyline import arc_length
from pentapod.geometry.runs import marked_runs
from pentapod.job.advice.options import OPTIONS as ADVICE
from pentapod.job.advice.settings import TOUCHES, met_below
from pentapod.job.build.other_ways import (
    ends,
    made_upright,
    may_come_nearer,
    may_stand,
    nearer,
    nearer_share,
    nearer_words,
    stepover_share,
)
from pentapod.job.build.region import covers_region
from pentapod.job.outcome import Outcome
from pentapod.job.schema.job import Job
from pentapod.job.withheld import STAGE, failures
from pentapod.machine.machine import Machine
from pentapod.mesh.mesh import Mesh
from pentapod.planning import PlacedPath
from pentapod.program import Program
from pentapod.timing import JerkOptions
from pentapod.toolpath import Toolpath
from pentapod.toolpath.linking.partition import cutting_intervals
from pentapod.verify.surface.surface_left import SURFACE_LEFT
from pentapod.verify.verdict.verdict import Certificate


@dataclass(frozen=True)
class MendOptions:
    """When and how a run goes back.

    rounds: how often at most. around: length of cut left out on either side of a place, metres. most: length of cut
    that may be left out in all, as a multiple of the share of the region that may be left; ever: share of all cuts that
    is never exceeded. places: beginnings of the names of claims about places that may be left out. slow: claims that a
    better time law keeps; law: options of the search for it. apart: claims that a leg path nearer to the toolpath
    keeps; closer: its share of the tolerances. loaded: claims that a time law within less than the legs' limits keeps,
    since drives are told more than the legs' own motion where they compensate for what these yield; gentler: its share.
    helps: passes come nearer together once more only if what is left fell below this share of what was left before.
    """

    rounds: int = 5
    around: float = 0.5e-3
    most: float = 4.0
    ever: float = 0.05
    places: tuple[str, ...] = (
        "gouge",
        "legs clear",
        "spindle clear",
        "tool body",
        "clearance",
        "base joint",
        "platform joint",
    )
    slow: tuple[str, ...] = ("lowest feed", "no unasked stop")
    apart: tuple[str, ...] = ("tip deviation", "axis deviation", "toolpath covered")
    closer: float = 0.8
    loaded: tuple[str, ...] = ("leg rates", "leg accelerations", "leg jerks")
    gentler: float = 0.97
    helps: float = 0.5
    law: JerkOptions = field(default_factory=lambda: JerkOptions(passes=24, rough_passes=4, min_gain=1e-5))


OPTIONS = MendOptions()


@dataclass(frozen=True, eq=False)
class Mend(Value):
    """What a run does in another way, and why: limits or claims, in words.

    left_out: cuts of the job's toolpath that are not made, between pairs of waypoints. length: of these cuts, metres;
    share: of all cuts. law: whether the time law is searched for longer. closer: whether the motion
    keeps a share of the tolerances. gentler: whether the time law keeps a share of the legs' limits.
    """

    left_out: tuple[tuple[int, int], ...] = ()
    length: float = 0.0
    share: float = 0.0
    why: tuple[str, ...] = ()
    law: bool = False
    closer: bool = False
    gentler: bool = False

    def __str__(self) -> str:
        if not self.left_out:
            ways = ["the time law was searched for longer"] if self.law else []
            ways += ["the motion keeps nearer to the toolpath"] if self.closer else []
            ways += ["the legs keep below their limits"] if self.gentler else []
            return f"second attempt: {' and '.join(ways)}, because the verdict would fail: {'; '.join(self.why)}"
        places = f"{len(self.left_out)} place{'s' if len(self.left_out) > 1 else ''}"
        return (
            f"second attempt: {from_si(self.length, 'mm'):.3g} mm of cut ({100.0 * self.share:.2g} %) at {places} are "
            f"left out, because they cannot be done: {'; '.join(self.why)}"
        )


@dataclass(frozen=True)
class FailedWay(Value):
    """Another way in which a run planned its job, and that failed. claims: that do not hold, by name.

    left: percent of the region that is left, where nothing else stands against its program. meets: heights below which
    the tool or the spindle touch the part, as of `met_below`.
    """

    claims: frozenset[str]
    left: float | None = None
    meets: tuple[float, ...] = ()

    @classmethod
    def of(cls, outcome: Outcome) -> FailedWay:
        """Return the way whose run ended with an outcome."""
        failed, short = failures(outcome.verdict), () if outcome.refusal is None else outcome.refusal.diagnosis
        left = _value(failed) if set(failed) == {SURFACE_LEFT} else None
        about = outcome.job, outcome.find(Mesh), outcome.find(Toolpath)
        return cls(frozenset(failed), left, met_below(*about, short, ADVICE))


@dataclass(frozen=True)
class FailedMend(Value):
    """A mend after which a program fails in one thing alone. left: percent of the region that it leaves."""

    left: float

    @classmethod
    def of(cls, outcome: Outcome) -> FailedMend | None:
        """Return the mend whose run ended with an outcome; None where more stands against it than what is left."""
        failed = failures(outcome.verdict)
        return cls(_value(failed)) if set(failed) == {SURFACE_LEFT} else None


def most_left_out(job: Job, options: MendOptions = OPTIONS) -> float:
    """Return the share of its cuts that a job's program may leave out: none where no claim judges what is left."""
    if not covers_region(job) and job.tolerance.si.left is None:
        return 0.0
    return min(options.most * job.tolerance.left_share, options.ever)


def more_left_out(job: Job, whole: Toolpath, outcome: Outcome, most: float) -> float | None:
    """Return the share of its cuts to leave out where a job's placement exceeds limits at few places, up to `most`.

    At least what a run leaves out by itself: it did so, and other places were out of limits then. None where it is
    more, or where no claim judges what is left.
    """
    own = most_left_out(job)
    if own == 0.0 or outcome.refusal is None or outcome.refusal.stage != "placement":
        return None
    mend = mend_of(whole, None, outcome, most)
    return max(mend.share, own) if mend is not None and own <= most else None


def other_way(
    job: Job, outcome: Outcome, before: Outcome | None = None, options: MendOptions = OPTIONS
) -> tuple[Job, str] | None:
    """Return the job done in another way after a run that failed, and what is said of it; None where none is known.

    before: the run of which this one was another way.
    """
    if outcome.refusal is None:
        return None
    failed = failures(outcome.verdict)
    limits = [each.constraint for each in outcome.refusal.diagnosis]
    touches = any(name.startswith(TOUCHES) for name in (*limits, *failed))
    if may_stand(job) and (touches or ends(job)):
        return made_upright(job)
    share = nearer_share(job)
    if share is None or outcome.refusal.stage != STAGE or set(failed) != {SURFACE_LEFT}:
        return None
    if not may_come_nearer(job, failed[SURFACE_LEFT]):
        return None  # a ball leaves that much where no pass is
    last = {} if before is None or stepover_share(job) == 1.0 else failures(before.verdict)
    if SURFACE_LEFT in last and not _value(failed) < options.helps * _value(last):
        return None  # passes that came nearer already did not help
    made = nearer(job, share)
    return made, nearer_words(made)


def _value(failed: Mapping[str, Certificate]) -> float:
    """Return the share of the region that is left, percent."""
    return failed[SURFACE_LEFT].value or 0.0


def mend_of(
    whole: Toolpath, before: Mend | None, outcome: Outcome, most: float, options: MendOptions = OPTIONS
) -> Mend | None:
    """Return what to do in another way after a run of the job's toolpath that failed; None where nothing helps.

    before: what that run did in another way already. most: share of the cuts that may be left out.
    """
    current, refusal, before = outcome.find(Toolpath), outcome.refusal, before or Mend()
    if current is None or refusal is None or refusal.stage not in ("placement", STAGE):
        return None
    failed = [each for each in outcome.verdict.certificates if not each.passed] if refusal.stage == STAGE else []
    slow = [each for each in failed if each.claim in options.slow]
    apart = [each for each in failed if each.claim in options.apart]
    loaded = [each for each in failed if each.claim in options.loaded]
    placed = [each for each in failed if each.claim.startswith(options.places) and each.where.row is not None]
    if len(slow) + len(apart) + len(loaded) + len(placed) < len(failed):
        return None
    if (slow and before.law) or (apart and before.closer) or (loaded and before.gentler):
        return None
    why = [each.constraint for each in refusal.diagnosis[:3]] + [each.claim for each in failed[:3]]
    mend = replace(
        before,
        why=tuple(dict.fromkeys((*before.why, *why))),
        law=before.law or bool(slow),
        closer=before.closer or bool(apart),
        gentler=before.gentler or bool(loaded),
    )
    bad = _unplaced(current, refusal) if not failed else _waypoints(placed, outcome)
    if not bad.any():
        return mend if slow or apart or loaded else None
    places, cutting = arc_length(whole.tilt_centres), cutting_intervals(whole)
    kept = cutting.copy()
    for first, last in before.left_out:
        kept[first:last] = False
    # The k-th cut of the current toolpath is the k-th that the whole one keeps.
    rows = np.flatnonzero(kept)[np.cumsum(cutting_intervals(current))[_cuts_at(current, bad)] - 1]
    firsts = np.searchsorted(places[1:], places[rows] - options.around)
    lasts = np.searchsorted(places[:-1], places[rows + 1] + options.around, side="right")
    for first, last in zip(firsts.tolist(), lasts.tolist(), strict=True):
        kept[first:last] = False
    length = np.diff(places)
    lost, all_of_it = float(length[cutting & ~kept].sum()), float(length[cutting].sum())
    if not kept.any() or lost > most * all_of_it:
        return None
    runs = tuple((int(a), int(b)) for a, b in marked_runs(cutting & ~kept).tolist())
    return replace(mend, left_out=runs, length=lost, share=lost / all_of_it)


def _unplaced(toolpath: Toolpath, refusal: Refusal) -> Bools:
    """Return the waypoints (N,) that a refused placement names."""
    bad = np.zeros(len(toolpath), dtype=np.bool_)
    for shortfall in refusal.diagnosis:
        for first, last in shortfall.waypoints:
            bad[first : last + 1] = True
    return bad


def _waypoints(failed: list[Certificate], outcome: Outcome) -> Bools:
    """Return the waypoints (N,) nearest to the places of claims."""
    program, placed = outcome.find(Program), outcome.find(PlacedPath)
    if program is None or placed is None:
        return np.zeros(0, dtype=np.bool_)
    bad = np.zeros(len(placed.tips), dtype=np.bool_)
    for each in failed:
        bad[_waypoint(each, program, placed, outcome.machine)] = True
    return bad


def _waypoint(certificate: Certificate, program: Program, placed: PlacedPath, machine: Machine) -> int:
    """Return the waypoint nearest to the place of a claim."""
    toolpath, where = placed.toolpath, certificate.where
    row = program.legs[where.row or 0]
    position, direction = machine.robot.pose(row[None], program.component)
    centre: Floats = (position + (machine.tool_length - toolpath.tilt_centre) * direction)[0]
    away = np.linalg.norm(placed.tips + toolpath.tilt_centre * placed.axes - centre, axis=1)
    if where.segment is not None:
        first, last = int(toolpath.starts[where.segment]), int(toolpath.starts[where.segment + 1])
        return first + int(away[first : last + 1].argmin())
    return int(away.argmin())


def _cuts_at(toolpath: Toolpath, bad: Bools) -> Ints:
    """Return the intervals that are cuts at waypoints (N,); for those of a link, the cuts before and after it."""
    cutting = cutting_intervals(toolpath)
    touched = bad[1:] | bad[:-1]
    cuts = np.flatnonzero(cutting)
    beside = np.searchsorted(cuts, np.flatnonzero(touched & ~cutting))
    ends = np.concatenate([cuts[np.maximum(beside - 1, 0)], cuts[np.minimum(beside, len(cuts) - 1)]])
    return np.union1d(np.flatnonzero(touched & cutting), ends)
