"""Other attempts: what a run goes back for after one that failed, and what is told of those that fail as well."""

from __future__ import annotations

import dataclasses
from functools import partial

from pentapod.base.errors import InputError
from pentapod.job.build.left import FORBIDDEN
from pentapod.job.build.other_ways import ends, may_stand, stands
from pentapod.job.build.pieces import job_without
from pentapod.job.build.specification import job_specification
from pentapod.job.mending import OPTIONS, FailedMend, FailedWay, Mend, mend_of, most_left_out, other_way
from pentapod.job.outcome import Outcome, Stage
from pentapod.job.pipeline.attempt import FORESEEN, Attempt, made_toolpath
from pentapod.job.schema.job import Job
from pentapod.job.stage_runner import StageRunner
from pentapod.job.withheld import failures
from pentapod.planning import PlacedPath
from pentapod.planning.placement.placed_path import UnplacedPath
from pentapod.toolpath import Toolpath
from pentapod.verify.surface.surface_left import SURFACE_LEFT

LEFT = "left"
"""Name of the stage that says what an upright tool does not reach."""

ANOTHER_WAY = "another way"
"""Name of the stage that says in which other way a job is done."""


def first_that_passes(attempt: Attempt, outcome: Outcome | None = None) -> Outcome:
    """Return the outcome of a job that may be done in other ways: the first that passes, else why it failed as asked.

    The stages of that run are those of the attempt's runner afterwards. A bull or flat end whose axes along the normals
    would leave out much stands upright at first. outcome: of the job as asked, where it is known.
    """
    upright = ends(attempt.task.job) and may_stand(attempt.task.job)
    outcome = outcome or attempt.foreseen(upright=upright)
    if outcome is None and attempt.left_first:
        outcome = attempt.judged_on_toolpath()
    outcome = outcome or attempt.planned()
    if outcome.refusal is None:
        return outcome
    outcome = mended(attempt, outcome)
    if not outcome.passed and (other := other_way(attempt.task.job, outcome)) is not None:
        outcome = _otherwise(attempt, outcome, *other)
    if outcome.refusal is not None and outcome.refusal.stage == FORBIDDEN and upright:
        # Only foreseen so far, and an upright tool does not do it either: that is told where this fails as well.
        runner = attempt.runner
        ways = [stage for stage in runner.stages if stage.name == ANOTHER_WAY]
        runner.stages = [stage for stage in runner.stages if stage.name not in (FORESEEN, ANOTHER_WAY)]
        outcome = attempt.planned()
        outcome = outcome if outcome.passed else mended(attempt, outcome)
        if not outcome.passed:
            runner.stages += ways
            outcome = attempt.ended(outcome.verdict)
    return outcome


def mended(attempt: Attempt, failed: Outcome) -> Outcome:
    """Go back after a run that failed: do in another way what can be, and plan again from there.

    Returns the first outcome that passes, else the failed one.
    """
    whole, program, outcome, mend = attempt.task.toolpath, attempt.withheld(), failed, None
    runner = attempt.runner
    for _ in range(OPTIONS.rounds):
        before, mend = mend, mend_of(whole, mend, outcome, most_left_out(attempt.task.job))
        if mend is None:
            break
        again = _changed(attempt, outcome, Mend() if before is None else before, mend)
        outcome = attempt.unplaced[mend] if mend in attempt.unplaced else again.planned()
        if outcome.refusal is not None and outcome.refusal.stage == "placement":
            attempt.unplaced[mend] = outcome
        if outcome.passed:
            runner.stages = again.runner.stages
            return outcome
        if (way := FailedMend.of(outcome)) is not None:
            runner.stages.append(Stage("failed mend", 0.0, way, f"{mend}. It failed, too{_why(outcome)}"))
    return failed if outcome is failed else attempt.put_back(failed, program)


def _changed(attempt: Attempt, last: Outcome, before: Mend, mend: Mend) -> Attempt:
    """Return the attempt as a mend has it, from what is kept of the last outcome. before: the mend of that one."""
    task, placed, refused = attempt.task, last.find(PlacedPath), last.find(UnplacedPath)
    runner, path = StageRunner(attempt.runner.progress), last.find(Toolpath) or task.toolpath
    start = placed if refused is None else refused.attempt
    kept = [stage for stage in last.stages if stage.name in ("mesh", "toolpath", "placement")]
    if mend.left_out != before.left_out:
        path, placed = job_without(task.job, attempt.mesh, task.toolpath, mend.left_out, machine=task.machine), None
        kept = [
            stage.with_value((path, *stage.value[1:])) if stage.name == "toolpath" else stage
            for stage in kept
            if stage.name != "placement"
        ]
    runner.stages = [*kept, Stage("mended", 0.0, mend, str(mend))]
    return attempt.with_task(
        specification=dataclasses.replace(task.specification, toolpath=path),
        runner=runner,
        left_out=mend.left_out,
        law=OPTIONS.law if mend.law else task.law,
        closer=OPTIONS.closer if mend.closer else 1.0,
        gentler=OPTIONS.gentler if mend.gentler else 1.0,
        placed=placed,
        start=start,
    )


def _otherwise(attempt: Attempt, failed: Outcome, job: Job, words: str, before: Outcome | None = None) -> Outcome:
    """Go back after a run that failed, and plan the job as it is done in another way, of which `words` are said.

    Returns the failed outcome where that does not pass, which then says so. before: an earlier one that left too much.
    """
    task, runner, program = attempt.task, StageRunner(attempt.runner.progress), attempt.withheld()
    runner.stages += [stage for stage in attempt.runner.stages if stage.name in ("mesh", ANOTHER_WAY)]
    runner.stages.append(Stage(ANOTHER_WAY, 0.0, None, words))
    own_machine = task.specification.sources.machine is None
    make = partial(made_toolpath, job, task.machine, attempt.mesh, runner)
    try:
        specification = job_specification(job, task.machine, attempt.mesh, make, own_machine=own_machine)
    except InputError:  # no cut is left, or its surface is too large: the first refusal says more
        return failed
    again = attempt.with_task(job=job, specification=specification, runner=runner)
    start = failed.find(PlacedPath) if job.axis == task.job.axis else None
    outcome = again.judged_on_toolpath() or _planned(again, start)
    if not outcome.passed:
        outcome = mended(again, outcome)
    last = failed if SURFACE_LEFT in failures(failed.verdict) else before
    if not outcome.passed and (other := other_way(job, outcome, last)) is not None:
        outcome = _otherwise(again, outcome, *other, last)
    outcome = with_what_is_left(again, outcome)
    if outcome.passed:
        attempt.runner.stages = runner.stages
        return outcome
    attempt.runner.stages += [
        Stage(ANOTHER_WAY, 0.0, FailedWay.of(outcome), f"{words}. It failed, too{_why(outcome)}"),
        *(stage for stage in runner.stages if isinstance(stage.value, FailedWay | FailedMend)),
    ]
    return attempt.put_back(failed, program)


def with_what_is_left(attempt: Attempt, outcome: Outcome) -> Outcome:
    """Return an outcome; where an upright tool did the job, with a stage that says what it does not reach."""
    if not (outcome.passed and stands(attempt.task.job)) or any(stage.name == LEFT for stage in attempt.runner.stages):
        return outcome
    left = next(each.method for each in outcome.verdict.certificates if each.claim == SURFACE_LEFT)
    attempt.runner.stages.append(Stage(LEFT, 0.0, None, f"{SURFACE_LEFT}: {left.rsplit('; ', 1)[-1]}"))
    return attempt.ended(outcome.verdict)


def _planned(attempt: Attempt, start: PlacedPath | None) -> Outcome:
    """Return the outcome of an attempt; its placement is searched for from scratch only where `start` does not help.

    start: the plan of nearly the same path.
    """
    if start is not None:
        stages = list(attempt.runner.stages)
        outcome = attempt.with_task(start=start).planned()
        if outcome.refusal is None or outcome.refusal.stage != "placement":
            return outcome
        attempt.runner.stages = stages
    return attempt.planned()


def _why(failed: Outcome) -> str:
    """Return why a run failed, in words after a colon."""
    return "" if failed.refusal is None else f": {dataclasses.replace(failed.refusal, remedy='')}"
