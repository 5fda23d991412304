"""Stages of a job whose mesh was read: plan and verdict, other attempts, set-ups, advice."""

from __future__ import annotations

import dataclasses
import tempfile
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

import numpy as np

from pentapod.base.errors import InputError
from pentapod.base.progress import Progress
from pentapod.base.refusal import Refusal
from pentapod.job.advice.options import OPTIONS, AdviceOptions, Tried
from pentapod.job.advice.search import advised
from pentapod.job.advice.settings import LEFT_ALONE, met_below, touches_the_part
from pentapod.job.build.left import FORBIDDEN, may_leave_walls
from pentapod.job.build.limits import timing_limits
from pentapod.job.build.other_ways import made_upright, may_stand
from pentapod.job.build.pieces import job_part
from pentapod.job.build.region import covers_region
from pentapod.job.build.specification import job_specification
from pentapod.job.build.toolpath import job_link_style
from pentapod.job.build.words import NO_CUT
from pentapod.job.mending import FailedMend, FailedWay, more_left_out
from pentapod.job.outcome import Outcome, SetUp, SetUps, Stage
from pentapod.job.pipeline.attempt import Attempt, Writer, made_toolpath
from pentapod.job.pipeline.other_attempts import ANOTHER_WAY, first_that_passes, with_what_is_left
from pentapod.job.plan_before import PlanBefore
from pentapod.job.schema.job import Job
from pentapod.job.stage_runner import StageRunner, ending_when_interrupted
from pentapod.job.task import Task
from pentapod.job.ways.names import FILES
from pentapod.job.withheld import STAGE, failures
from pentapod.machine.machine import Machine
from pentapod.planning.setups import setups
from pentapod.timing import Limit
from pentapod.toolpath import Mesh, Toolpath
from pentapod.toolpath.linking.partition import Piece, cutting_intervals, missed_cuts
from pentapod.verify import Claim, Specification
from pentapod.verify.surface.surface_left import SURFACE_LEFT


def planned(
    job: Job,
    machine: Machine,
    mesh: Mesh,
    runner: StageRunner,
    staging: Path,
    writers: Mapping[str, Writer],
    *,
    own_machine: bool,
    piece: Piece | None,
    before: PlanBefore | None,
    limits: tuple[Limit, ...],
    claims: tuple[Claim, ...],
    left_first: bool,
) -> tuple[Attempt, Outcome]:
    """Plan a job whose mesh was read, write its program into `staging`, and return the attempt and its outcome.

    Of a job in several set-ups each has all its files in a folder of its own.
    machine, mesh: those of the job. own_machine: whether the machine is a value of the caller, of no file. left_first:
    as of `Attempt`. Else as in `run.run`. Raises InputError.
    """
    alone, asked = piece is None and before is None and job.placement.setups == 1, job

    def specified(job: Job) -> Specification:
        make = partial(made_toolpath, job, machine, mesh, runner, piece, before)
        return job_specification(job, machine, mesh, make, own_machine=own_machine)

    try:
        specification = specified(job)
    except InputError as error:
        if not (alone and may_stand(job) and error.key == NO_CUT):
            raise
        job, words = made_upright(job)
        runner.stages.append(Stage(ANOTHER_WAY, 0.0, None, words))
        specification = specified(job)
    if piece is not None:  # the caller plans the other pieces elsewhere
        specification = dataclasses.replace(specification, setups=max(specification.setups, 2))
    left_out = () if before is None else before.made_from.left_out
    task = Task(job, specification, runner, piece, (*timing_limits(job, machine), *limits), claims, before, left_out)
    attempt = Attempt(task, mesh, staging, writers, left_first or may_leave_walls(job, specification.cutting))
    if alone and covers_region(job):
        outcome = with_what_is_left(attempt, first_that_passes(attempt))
        return attempt if job is asked else attempt.with_task(job=asked), outcome  # advice is about the job as asked
    outcome = attempt.foreseen(upright=False) or attempt.planned()
    refusal = outcome.refusal
    if refusal is not None and refusal.stage == "placement" and piece is None and job.placement.setups > 1:
        in_vain = meets_wherever_it_stands(task, refusal)
        outcome = _refused_in_vain(attempt, refusal) if in_vain else _split(attempt, refusal)
    return attempt, outcome


def meets_wherever_it_stands(task: Task, refusal: Refusal) -> bool:
    """Return whether the tool or the spindle touches the part on a cut with axes that do not lean.

    Then set-ups do not help: that depends on the tool's pose on the part, and not on where the part stands.
    """
    if task.specification.tilt > 0.0 or task.job.axis.mode == "auto":
        return False
    cuts = cutting_intervals(task.toolpath)
    within = np.flatnonzero(cuts[1:] & cuts[:-1]) + 1
    met = (waypoints for each in refusal.diagnosis if touches_the_part(each) for waypoints in each.waypoints)
    return any(np.searchsorted(within, last, "right") > np.searchsorted(within, first) for first, last in met)


def _refused_in_vain(attempt: Attempt, refusal: Refusal) -> Outcome:
    """Return the refusal of a job for which more set-ups do not help."""
    why = "above its tip the tool touches the part, wherever that stands"
    told = dataclasses.replace(refusal, cause=f"set-ups do not help: {why}; in one set-up {refusal.cause}")
    runner = attempt.runner
    runner.stages = [s if s.value is not refusal else s.with_value(told) for s in runner.stages]
    return attempt.refused(told)


def with_advice(attempt: Attempt, outcome: Outcome, again: Callable[..., Tried], options: AdviceOptions) -> Outcome:
    """Search for changes with which a refused job is planned, and return the outcome whose refusal holds them.

    again: plans a job and returns how that ends, as `run.tried`. Where too much was left in the run, plans look first
    for what their toolpath leaves.
    """
    refusal, task, runner = outcome.refusal, attempt.task, attempt.runner
    if refusal is None or refusal.stage in FILES:  # a way is refused by the machine's file, not by the job
        return outcome
    failed = failures(outcome.verdict) if refusal.stage == STAGE else {}
    otherwise = outcome.find(FailedWay)
    claims = frozenset[str]() if otherwise is None else otherwise.claims
    again = partial(again, left_first=SURFACE_LEFT in failed or SURFACE_LEFT in claims)

    def tried(job: Job, progress: Progress) -> Tried:
        if job.with_(tolerance={"left_share": task.job.tolerance.left_share}).tables != task.job.tables:
            return again(job, progress)
        own, share = failed.get(SURFACE_LEFT), job.tolerance.left_share
        if own is not None and frozenset(failed) == LEFT_ALONE and (own.value or 0.0) <= 100.0 * share:
            return attempt.tried_with(share, outcome)
        if refusal.stage != "placement":
            return again(job, progress)
        # The plan does what this run did, and goes on from there.
        runner, own_machine = StageRunner(ending_when_interrupted(progress)), task.specification.sources.machine is None
        runner.stages = [stage for stage in outcome.stages if not isinstance(stage.value, FailedWay | FailedMend)]
        specification = job_specification(
            job, task.machine, attempt.mesh, lambda: task.toolpath, own_machine=own_machine
        )
        plan = attempt.with_task(job=job, specification=specification, runner=runner)
        with tempfile.TemporaryDirectory() as folder:
            plan = dataclasses.replace(plan, staging=Path(folder), unplaced=attempt.unplaced)
            return tried_of(first_that_passes(plan, outcome))

    search = (task.job, task.machine, attempt.mesh, task.toolpath, tried, options, runner.progress)
    forbidden = refusal.stage == FORBIDDEN
    ways = [stage.value for stage in runner.stages if isinstance(stage.value, FailedWay)]
    lefts = [stage.value.left for stage in runner.stages if isinstance(stage.value, FailedWay | FailedMend)]
    left = min((each for each in lefts if each is not None), default=None)
    meets = next((way.meets for way in ways if way.meets), ())
    about = (failed, refusal.diagnosis, claims, left, meets)
    mended = any(isinstance(stage.value, FailedMend) for stage in runner.stages)  # then it is known what is left
    leaves = None if mended else more_left_out(task.job, task.toolpath, outcome, options.little / options.more)
    found = runner.run("advice", lambda: advised(*search, *about, forbidden=forbidden, leaves=leaves))
    better = refusal.with_advice(found.advice, found.sentence)
    runner.stages = [s if s.value is not refusal else s.with_value(better) for s in runner.stages]
    return attempt.ended(outcome.verdict) if failed else attempt.refused(better)


def tried_of(outcome: Outcome) -> Tried:
    """Return how a plan ended, for the search for advice."""
    if outcome.passed:
        return Tried(None, outcome.margin)
    refusal, way, meets = outcome.refusal, outcome.find(FailedWay), tuple[float, ...]()
    if refusal is not None and refusal.stage == "placement":
        meets = met_below(outcome.job, outcome.find(Mesh), outcome.find(Toolpath), refusal.diagnosis, OPTIONS)
    stage, way = "verdict" if refusal is None else refusal.stage, way or FailedWay.of(outcome)
    return Tried(stage, failed=way.claims, meets=meets, left=way.left)


def _split(attempt: Attempt, refusal: Refusal) -> Outcome:
    """Split a job that one placement cannot reach into set-ups, each in a folder of its own; or refuse it."""
    task, runner, staging = attempt.task, attempt.runner, attempt.staging
    job, mesh, toolpath = task.job, attempt.mesh, task.toolpath
    # The refusal is not part of the outcome.
    runner.stages = [stage for stage in runner.stages if stage.value is not refusal]
    style = job_link_style(job, mesh, toolpath)
    search = (toolpath, task.fits, style, job.placement.setups, refusal, runner.progress)
    found = runner.run("set-ups", lambda: setups(*search))
    if isinstance(found, Refusal):
        return attempt.refused(found)
    cutting, missed = missed_cuts(toolpath, found)
    parts: list[SetUp] = []
    before = [stage for stage in runner.stages if stage.name not in ("toolpath", "set-ups")]
    for number, piece in enumerate(found, start=1):
        runner.progress("set-ups", (number - 1) / len(found), f"planning {number} of {len(found)}")
        own, part = StageRunner(runner.progress), job_part(job, mesh, toolpath, piece, machine=task.machine)
        own.stages += [*before, Stage("toolpath", 0.0, (part, piece), f"set-up {number} of {len(found)}: {piece}")]
        folder = staging / SetUp.folder_of(number)
        folder.mkdir()
        specification = dataclasses.replace(task.specification, toolpath=part, missed=missed)
        own_attempt = attempt.with_task(specification=specification, runner=own, piece=piece)
        own_attempt = dataclasses.replace(own_attempt, staging=folder)
        parts.append(SetUp(number, piece, own_attempt.planned()))
        own_attempt.write(parts[-1].outcome)
    done = SetUps(tuple(parts), cutting, missed, job.placement.setups)
    runner.stages.append(Stage("set-ups planned", sum(part.seconds for part in parts), done, str(done)))
    return attempt.ended(done.verdict)
