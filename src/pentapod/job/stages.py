"""Stages of a job after its mesh was read: toolpath, plan, verdict, what is mended, set-ups, advice."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

from pentapod.base.errors import InputError
from pentapod.base.refusal import Refusal
from pentapod.job.advice.options import AdviceOptions, Tried
from pentapod.job.advice.search import advised
from pentapod.job.artefacts import ARRAYS, PROGRAM, VERDICT, WITHHELD, write_arrays, write_json
from pentapod.job.build.left import FORBIDDEN, foreseen
from pentapod.job.build.limits import pose_limits, timing_limits
from pentapod.job.build.other_ways import ends, may_stand, stands
from pentapod.job.build.pieces import job_part, job_piece, job_without
from pentapod.job.build.region import covers_region
from pentapod.job.build.specification import job_specification
from pentapod.job.build.toolpath import Reports, job_link_style, job_toolpath
from pentapod.job.mending import OPTIONS as MENDING
from pentapod.job.mending import FailedWay, mend_of, most_left_out, other_way
from pentapod.job.outcome import Outcome, SetUp, SetUps, Stage, refusal_verdict
from pentapod.job.plan_arrays import arrays_of
from pentapod.job.plan_before import PlanBefore
from pentapod.job.run_folder import unstaged
from pentapod.job.schema.job import Job
from pentapod.job.stage_runner import StageRunner
from pentapod.job.task import Task
from pentapod.job.ways.claims import with_ways
from pentapod.job.ways.names import FILES
from pentapod.job.ways.ways import remove_ways, ways, write_ways
from pentapod.job.withheld import STAGE, failures, withheld
from pentapod.machine.machine import Machine
from pentapod.planning import PlacedPath
from pentapod.planning.placement.placed_path import UnplacedPath
from pentapod.planning.setups import setups
from pentapod.program import Program
from pentapod.timing import Limit
from pentapod.toolpath import Mesh, Toolpath
from pentapod.toolpath.linking.partition import Piece, missed_cuts
from pentapod.verify import Claim, Verdict, judged
from pentapod.verify.surface.surface_left import SURFACE_LEFT

Writer = Callable[[Outcome, Path], object]

FORESEEN = "foreseen"
"""Name of the stage that refuses a toolpath before it is planned."""

ANOTHER_WAY = "another way"
"""Name of the stage that says in which other way a job is done."""


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
) -> tuple[Task, Outcome]:
    """Plan a job whose mesh was read, write the files into `staging`, and return its task and its outcome.

    machine, mesh: those of the job. own_machine: whether the machine is a value of the caller, of no file. Else as in
    `pipeline.run`. Raises InputError.
    """
    specification = job_specification(
        job, machine, mesh, lambda: _toolpath(job, machine, mesh, piece, runner, before), own_machine=own_machine
    )
    if piece is not None:  # the caller plans the other pieces elsewhere
        specification = dataclasses.replace(specification, setups=max(specification.setups, 2))
    left_out = () if before is None else before.made_from.left_out
    task = Task(job, specification, runner, piece, (*timing_limits(job, machine), *limits), claims, before, left_out)
    alone = piece is None and before is None and job.placement.setups == 1
    upright = alone and ends(job) and may_stand(job)
    outcome = _foreseen(task, staging, writers, upright=upright) or _planned(task, staging, writers)
    if outcome.refusal is not None and alone and covers_region(job):
        outcome = _mended(task, mesh, outcome, staging, writers)
        if not outcome.passed and (other := other_way(job, outcome)) is not None:
            outcome = _otherwise(task, mesh, outcome, *other, staging, writers)
        if outcome.refusal is not None and outcome.refusal.stage == FORBIDDEN and upright:
            # Only foreseen so far, and an upright tool does not do it either: that is told where this fails as well.
            ways = [stage for stage in task.runner.stages if stage.name == ANOTHER_WAY]
            task.runner.stages = [s for s in task.runner.stages if s.name not in (FORESEEN, ANOTHER_WAY)]
            outcome = _planned(task, staging, writers)
            outcome = outcome if outcome.passed else _mended(task, mesh, outcome, staging, writers)
            if not outcome.passed:
                task.runner.stages += ways
                outcome = _written(task, outcome.verdict, staging, writers)
    refusal, splits = outcome.refusal, piece is None and job.placement.setups > 1
    if refusal is not None and refusal.stage == "placement" and splits:
        outcome = _split(task, mesh, refusal, staging, writers)
    return task, outcome


def with_advice(
    task: Task,
    mesh: Mesh,
    outcome: Outcome,
    again: Callable[..., Tried],
    options: AdviceOptions,
    staging: Path,
    writers: Mapping[str, Writer],
) -> Outcome:
    """Search for changes with which a refused job is planned, and return the outcome whose refusal holds them.

    again: plans a job and returns how that ends, as `pipeline.tried`.
    """
    refusal, runner = outcome.refusal, task.runner
    if refusal is None or refusal.stage in FILES:  # a way is refused by the machine's file, not by the job
        return outcome
    search = (task.job, task.machine, mesh, task.toolpath, again, options, runner.progress)
    failed = failures(outcome.verdict) if refusal.stage == STAGE else {}
    forbidden = refusal.stage == FORBIDDEN
    otherwise = outcome.find(FailedWay)
    own = frozenset[str]() if otherwise is None else otherwise.claims
    found = runner.run("advice", lambda: advised(*search, failed, refusal.diagnosis, own, forbidden=forbidden))
    better = refusal.with_advice(found.advice, found.sentence)
    runner.stages = [s if s.value is not refusal else s.with_value(better) for s in runner.stages]
    verdict = outcome.verdict if failed else refusal_verdict(better, task.specification.sources)
    return _written(task, verdict, staging, writers)


def _toolpath(
    job: Job, machine: Machine, mesh: Mesh, piece: Piece | None, runner: StageRunner, before: PlanBefore | None
) -> Toolpath:
    """Return the job's toolpath, or a piece of it, as a stage of the run."""

    def made() -> tuple[Toolpath, object]:
        if before is not None:
            return before.toolpath, "toolpath of the run before"
        if piece is None:
            return job_toolpath(job, mesh, runner.progress, machine=machine)
        return job_piece(job, mesh, piece, runner.progress, machine=machine), piece

    return runner.run("toolpath", made, remark=lambda it: str(it[1]))[0]


def _foreseen(task: Task, staging: Path, writers: Mapping[str, Writer], *, upright: bool) -> Outcome | None:
    """Return the outcome of a toolpath whose program would fail its verdict; None where that is not known yet.

    upright: as for `foreseen`.
    """
    made = next((stage.value for stage in task.runner.stages if stage.name == "toolpath"), None)
    if made is None or not isinstance(made[1], Reports):  # a piece, or the toolpath of the run before
        return None
    refusal = foreseen(task.job, made[1], task.toolpath, task.specification.cutting, upright=upright)
    if refusal is None:
        return None
    task.runner.stages.append(Stage(FORESEEN, 0.0, refusal))
    return _written(task, refusal_verdict(refusal, task.specification.sources), staging, writers)


def _planned(task: Task, staging: Path, writers: Mapping[str, Writer]) -> Outcome:
    """Run the stages after the toolpath and the verification, write the files, and return the outcome."""
    file, runner = staging / PROGRAM, task.runner
    program = task.program(file)
    refused = program if isinstance(program, Refusal) else _with_ways(task, program, staging)
    if refused is not None:
        file.unlink(missing_ok=True)
        verdict = refusal_verdict(refused, task.specification.sources)
    else:
        specification, claims = with_ways(task.specification, staging)
        claims = (*claims, *task.claims)
        verdict = runner.run("verify", lambda: judged(file, specification, claims=claims, progress=runner.progress))
        if (fails := withheld(verdict)) is not None:
            runner.stages.append(Stage("withheld", 0.0, fails))
            file.rename(staging / WITHHELD)
            remove_ways(staging)
    return _written(task, verdict, staging, writers)


def _with_ways(task: Task, program: Program, staging: Path) -> Refusal | None:
    """Make the ways of a program and write them beside it, where the machine has a park pose; or return a refusal."""
    remove_ways(staging)
    if task.machine.park.pose is None:
        return None
    machine = program.machine(task.machine)
    specification, kinds = dataclasses.replace(task.specification, machine=machine), pose_limits(task.job)
    made = task.runner.run("ways", lambda: ways(program, specification, limits=task.limits, kinds=kinds))
    if isinstance(made, Refusal):
        return made
    write_ways(made, staging)
    return None


def _mended(task: Task, mesh: Mesh, failed: Outcome, staging: Path, writers: Mapping[str, Writer]) -> Outcome:
    """Go back after a run that failed: do in another way what can be, and plan again from there.

    Returns the first outcome that passes, else the failed one.
    """
    job, whole, outcome, mend, runner = task.job, task.toolpath, failed, None, task.runner
    file = staging / WITHHELD
    first = file.read_bytes() if file.is_file() else None
    for _ in range(MENDING.rounds):
        before, mend = mend, mend_of(whole, mend, outcome, most_left_out(job))
        if mend is None:
            break
        own, placed, refused = StageRunner(runner.progress), outcome.find(PlacedPath), outcome.find(UnplacedPath)
        start = placed if refused is None else refused.attempt
        own.stages += [stage for stage in outcome.stages if stage.name in ("mesh", "toolpath", "placement")]
        path = outcome.find(Toolpath) or whole
        if mend.left_out != (() if before is None else before.left_out):
            path, placed = job_without(job, mesh, whole, mend.left_out, machine=task.machine), None
            own.stages = [
                stage.with_value((path, *stage.value[1:])) if stage.name == "toolpath" else stage
                for stage in own.stages
                if stage.name != "placement"
            ]
        own.stages.append(Stage("mended", 0.0, mend, str(mend)))
        specification = dataclasses.replace(task.specification, toolpath=path)
        law, share = MENDING.law if mend.law else task.law, MENDING.closer if mend.closer else 1.0
        again = dataclasses.replace(
            task, specification=specification, runner=own, left_out=mend.left_out,
            law=law, closer=share, gentler=MENDING.gentler if mend.gentler else 1.0, placed=placed, start=start,
        )  # fmt: skip
        file.unlink(missing_ok=True)
        outcome = _planned(again, staging, writers)
        if outcome.passed:
            runner.stages = own.stages
            return outcome
    if outcome is failed:
        return failed
    file.unlink(missing_ok=True)
    if first is not None:
        file.write_bytes(first)
    return _written(task, failed.verdict, staging, writers)


def _otherwise(
    task: Task, mesh: Mesh, failed: Outcome, job: Job, words: str, staging: Path, writers: Mapping[str, Writer]
) -> Outcome:
    """Go back after a run that failed, and plan the job as it is done in another way, of which `words` are said.

    Returns the failed outcome where that does not pass, which then says so.
    """
    runner, file = StageRunner(task.runner.progress), staging / WITHHELD
    first = file.read_bytes() if file.is_file() else None
    runner.stages += [stage for stage in task.runner.stages if stage.name in ("mesh", ANOTHER_WAY)]
    runner.stages.append(Stage(ANOTHER_WAY, 0.0, None, words))
    own_machine = task.specification.sources.machine is None
    make = partial(_toolpath, job, task.machine, mesh, None, runner, None)
    try:
        specification = job_specification(job, task.machine, mesh, make, own_machine=own_machine)
    except InputError:  # no cut is left, or its surface is too large: the first refusal says more
        return failed
    again = dataclasses.replace(task, job=job, specification=specification, runner=runner)
    file.unlink(missing_ok=True)
    outcome = _planned(again, staging, writers)
    if not outcome.passed:
        outcome = _mended(again, mesh, outcome, staging, writers)
    if not outcome.passed and (other := other_way(job, outcome, failed)) is not None:
        outcome = _otherwise(again, mesh, outcome, *other, staging, writers)
        if outcome.passed:
            task.runner.stages = runner.stages
            return outcome
    if outcome.passed:
        if stands(job):  # what it does not reach
            left = next(each.method for each in outcome.verdict.certificates if each.claim == SURFACE_LEFT)
            runner.stages.append(Stage("left", 0.0, None, f"{SURFACE_LEFT}: {left.rsplit('; ', 1)[-1]}"))
        task.runner.stages = runner.stages
        return _written(again, outcome.verdict, staging, writers)
    file.unlink(missing_ok=True)
    if first is not None:
        file.write_bytes(first)
    why = "" if outcome.refusal is None else f": {dataclasses.replace(outcome.refusal, remedy='')}"
    task.runner.stages += [
        Stage(ANOTHER_WAY, 0.0, FailedWay(frozenset(failures(outcome.verdict))), f"{words}. It failed, too{why}"),
        *(stage for stage in runner.stages if isinstance(stage.value, FailedWay)),
    ]
    return _written(task, failed.verdict, staging, writers)


def _written(task: Task, verdict: Verdict, staging: Path, writers: Mapping[str, Writer]) -> Outcome:
    """Write the files of a run but its program, and return the outcome."""
    outcome = Outcome(task.job.asked or task.job, task.machine, tuple(task.runner.stages), verdict)
    if (placed := outcome.find(PlacedPath)) is not None:
        outcome = dataclasses.replace(outcome, machine=task.on(placed.placement).machine)
    write_arrays(arrays_of(outcome, unstaged(staging)), staging / ARRAYS)
    for name, write in writers.items():
        task.runner.progress("report", 0.0, name)
        write(outcome, staging / name)
    write_json(outcome.to_dict(), staging / VERDICT)
    return outcome


def _split(task: Task, mesh: Mesh, refusal: Refusal, staging: Path, writers: Mapping[str, Writer]) -> Outcome:
    """Split a job that one placement cannot reach into set-ups, each in a folder of its own; or refuse it."""
    job, toolpath, runner = task.job, task.toolpath, task.runner
    # The refusal is not part of the outcome.
    runner.stages = [stage for stage in runner.stages if stage.value is not refusal]
    style = job_link_style(job, mesh, toolpath)
    search = (toolpath, task.fits, style, job.placement.setups, refusal, runner.progress)
    found = runner.run("set-ups", lambda: setups(*search))
    if isinstance(found, Refusal):
        return _written(task, refusal_verdict(found, task.specification.sources), staging, writers)
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
        own_task = dataclasses.replace(task, specification=specification, runner=own, piece=piece)
        parts.append(SetUp(number, piece, _planned(own_task, folder, writers)))
    done = SetUps(tuple(parts), cutting, missed, job.placement.setups)
    runner.stages.append(Stage("set-ups planned", sum(part.seconds for part in parts), done, str(done)))
    return _written(task, done.verdict, staging, writers)
