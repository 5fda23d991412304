"""Restart: what is left of a program from a time on, planned from rest, with its way in and its way out.

It begins at the last waypoint that the tool had passed for certain, so that no cut is left out: the tool comes down to
it along its axis, on feed, and goes on from rest with the axes, the placement and the component of the run.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pentapod.base.errors import InputError
from pentapod.base.progress import Progress, silent
from pentapod.base.refusal import Refusal
from pentapod.base.values import Value
from pentapod.geometry.polyline import arc_length
from pentapod.job.artefacts import PROGRAM
from pentapod.job.build.limits import pose_limits, timing_limits
from pentapod.job.build.other_ways import as_made
from pentapod.job.build.specification import job_specification
from pentapod.job.build.toolpath import job_link_style
from pentapod.job.build.values import job_machine, job_mesh
from pentapod.job.mending import OPTIONS as MENDING
from pentapod.job.plan_before import PlanBefore
from pentapod.job.schema.job import Job
from pentapod.job.stage_runner import StageRunner
from pentapod.job.task import Task
from pentapod.job.ways.claims import way_claims
from pentapod.job.ways.posted import from_park
from pentapod.job.ways.route import placed_on
from pentapod.job.ways.ways import ways
from pentapod.job.withheld import withheld
from pentapod.machine.clearance.collision_world import NOTHING
from pentapod.machine.machine import Machine
from pentapod.planning.limits.limit import LimitKind
from pentapod.planning.limits.margins import Margins
from pentapod.program import Program, read_csv
from pentapod.toolpath import Segment, SegmentKind, Toolpath
from pentapod.toolpath.linking.partition import stretch
from pentapod.toolpath.process import Process
from pentapod.verify import Coverage, Replay, Specification, Verdict, judged

STAGE = "restart"
"""The stage of refusals, but those of the ways."""


@dataclass(frozen=True, eq=False)
class Restart(Value):
    """A program from the park pose through what is left and back. begins: seconds of the old program; waypoint: there.

    machine: for which it is made. verdict: on what is left and on both ways.
    """

    program: Program
    machine: Machine
    verdict: Verdict
    begins: float
    waypoint: int


def restart(job: Job, file: Path, seconds: float, progress: Progress = silent) -> Restart | Refusal:
    """Return what is left of a run's program from a time on, with its ways; or the refusal of the first that fails.

    file: program.csv in the folder of the run. Raises InputError: another job, a time outside the program, a machine
    without a park pose, a run of several set-ups or of a machine with guides.
    """
    if file.name != PROGRAM:
        raise InputError("a restart needs the program of a run", file=file, expected=f"DIR/{PROGRAM}")
    before, program = PlanBefore.of(file.parent), read_csv(file)
    if before.made_from.job_digest != job.digest:
        remedy = "give the job as it was planned, or plan it again"
        raise InputError(
            "the program was made from another job", file=file, value=before.made_from.job_digest, remedy=remedy
        )
    if not 0.0 < seconds < program.duration:
        raise InputError(
            "there is no such time in the program", key="--from", value=f"{seconds:g} s",
            expected=f"more than 0 and less than {program.duration:g} s",
        )  # fmt: skip
    job = as_made(job, before.made_from)
    machine, mesh = job_machine(job), job_mesh(job)
    if machine.park.pose is None:
        raise InputError(
            "a restart begins at the machine's park pose, and it has none", key="park.tip_mm", value=machine.name,
            remedy="write [park] tip_mm = [x, y, z] into the machine file",
        )  # fmt: skip
    whole = job_specification(job, machine, mesh, lambda: before.toolpath)
    waypoint, begins = _waypoint(program, whole, seconds)
    approach = job_link_style(job, mesh, before.toolpath)
    toolpath, axes = _left(before, waypoint, approach.approach, approach.feed)
    cutting = whole.cutting
    specification = replace(
        whole,
        toolpath=toolpath,
        cutting=None if cutting is None else replace(cutting, coverage=Coverage.nothing("the rest of a program")),
    )
    kinds = pose_limits(job)
    margins = Margins.of(machine, before.component, whole.collision_world or NOTHING, kinds)
    placed = placed_on(toolpath, program, margins, axes)[0]
    limits, runner = timing_limits(job, machine), StageRunner(progress)
    task = Task(job, specification, runner, limits=limits, placed=placed)
    found = _planned(task, kinds, begins, waypoint)
    if isinstance(found, Restart) or not program.provenance.compensation:
        return found
    # Drives that compensate are told more than the legs' own motion: the run may have been mended so.
    return _planned(replace(task, gentler=MENDING.gentler), kinds, begins, waypoint)


def _planned(task: Task, kinds: tuple[LimitKind, ...], begins: float, waypoint: int) -> Restart | Refusal:
    """Return the rest of a program by its task, with its ways, if it passes."""
    specification, limits = task.specification, task.limits
    with tempfile.TemporaryDirectory() as folder:
        left = task.program(Path(folder) / PROGRAM)
        if isinstance(left, Refusal):
            return replace(left, stage=STAGE)
        made = ways(left, specification, limits=limits, kinds=kinds)
        if isinstance(made, Refusal):
            return made
        verdict = judged(Path(folder) / PROGRAM, specification, claims=way_claims(made), progress=task.runner.progress)
    fails = withheld(verdict)
    if fails is not None or not verdict.passed:
        why = verdict.answer if fails is None else fails.cause
        cause = f"what is left of the program does not pass: from {begins:.3f} s, {why}"
        return Refusal(STAGE, cause, remedy="Choose another time, on a rapid where it can be")
    return Restart(from_park(left, made), specification.machine, verdict, begins, waypoint)


def _waypoint(program: Program, specification: Specification, seconds: float) -> tuple[int, float]:
    """Return the last waypoint that the tool had passed at a time, and the seconds at which it passed it."""
    replay, arcs = Replay(program, specification), arc_length(specification.toolpath.tilt_centres)
    row = min(int(np.ceil(seconds / program.period - 1e-6)), len(program.legs) - 1)
    travelled = replay.match.arcs[::2]
    passed = travelled[row] - replay.match_radius
    waypoint = min(max(int(np.searchsorted(arcs, passed, side="right")) - 1, 0), len(arcs) - 2)
    return waypoint, float(np.argmax(travelled >= arcs[waypoint])) * program.period


def _left(before: PlanBefore, waypoint: int, height: float, feed: float) -> tuple[Toolpath, np.ndarray]:
    """Return what is left of a toolpath from a waypoint on, and its planned axes (N, 3), workpiece frame.

    Where the waypoint is no rapid's, the tool first comes down to it along its own axis.
    """
    whole, axes = before.toolpath, before.axes[waypoint:]
    segments = stretch(whole, waypoint, len(whole) - 1)
    first, at = segments[0], int(whole.segment_of_interval[waypoint])
    words = Process().after(word for segment in whole.segments[:at] for word in segment.words).words
    if first.kind is not SegmentKind.RAPID:
        tips = np.stack([first.tips[0] + height * axes[0], first.tips[0]])
        down = Segment(SegmentKind.LINK, tips, np.tile(first.axes[0], (2, 1)), feed, words=words)
        return replace(whole, segments=(down, *segments), wait=0.0), np.concatenate([axes[:1], axes])
    segments[0] = replace(first, words=(*words, *first.words))
    return replace(whole, segments=tuple(segments), wait=0.0), axes
