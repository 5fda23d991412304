"""Planning pipeline: run the stages of a job in order and write their results."""

from __future__ import annotations

import dataclasses
import tempfile
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

from pentapod.base.progress import Progress, silent
from pentapod.base.refusal import Refusal
from pentapod.base.version import __version__, library_versions, processor_kind
from pentapod.job.advice.options import OPTIONS, AdviceOptions
from pentapod.job.advice.search import advised
from pentapod.job.artefacts import ARRAYS, PROGRAM, VERDICT, WITHHELD, check_folder, write_arrays, write_json
from pentapod.job.build.limits import placement_limits, timing_limits
from pentapod.job.build.placement import job_weights
from pentapod.job.build.specification import job_specification
from pentapod.job.build.toolpath import drops_gouges, job_link_style, job_part, job_piece, job_toolpath
from pentapod.job.build.values import job_machine, job_mesh
from pentapod.job.outcome import Outcome, SetUp, SetUps, Stage, refusal_verdict
from pentapod.job.placed_check import Ranges, meetings, refusal_of
from pentapod.job.plan_arrays import arrays_of
from pentapod.job.plan_before import PlanBefore
from pentapod.job.remarks import STRAIGHT, UPRIGHT, explanation, placement_remarks
from pentapod.job.run_folder import staged, unstaged
from pentapod.job.schema.job import Job
from pentapod.job.stage_runner import StageRunner
from pentapod.job.withheld import STAGE, withheld
from pentapod.machine.clearance.collision_world import NOTHING
from pentapod.machine.machine import Machine
from pentapod.planning import LegPath, PlacedPath, Placement, leg_path, plan
from pentapod.planning.placement.common_axes import FIXED
from pentapod.planning.plan import PlacementOptions, fits
from pentapod.planning.problem.constraints import FREE
from pentapod.planning.setups import setups
from pentapod.program import Program, Provenance, sample, write_csv
from pentapod.timing import Limit, Trajectory, retime
from pentapod.timing.reuse import retime_as_before
from pentapod.toolpath import Mesh, Toolpath
from pentapod.toolpath.linking.partition import Piece, missed_cuts
from pentapod.verify import Claim, Specification, Verdict, judged

Writer = Callable[[Outcome, Path], object]


def run(
    job: Job,
    out: str | Path,
    progress: Progress = silent,
    *,
    machine: Machine | None = None,
    piece: Piece | None = None,
    before: PlanBefore | None = None,
    writers: Mapping[str, Writer] | None = None,
    limits: Sequence[Limit] = (),
    claims: Sequence[Claim] = (),
    advice: AdviceOptions | None = OPTIONS,
) -> Outcome:
    """Plan a job, write program.csv, plan.npz and verdict.json into `out`, and return the outcome.

    machine: to be used instead of the one that the job names, with the job's tool length and controller settings.
    piece: plan only this piece of the job's toolpath, in one set-up. before: the run of the same job with its part
    elsewhere, of which as much is kept as fits. writers: further files, by name, each written from the outcome.
    limits: further limits on the time law. claims: further claims of the verdict. advice: how changes are searched for
    with which a job that cannot be done is planned, and passes; the refusal holds them. None for no search.
    The program is judged from the file, as it was written; if it fails, it is called withheld.csv. A job that cannot be
    done gives an outcome with a refusal, a verdict.json that says so, and no program. The folder changes when the run
    ends: an error or an interruption leaves it as it was. Raises InputError for a bad job, mesh, machine or folder, and
    where another run is writing into the folder.
    """
    folder = Path(out)
    check_folder(folder)
    runner = StageRunner(progress)
    with staged(folder) as staging:  # from the start: a second run on the folder fails at once
        used, own_machine = job_machine(job, machine), machine is not None
        mesh = runner.run("mesh", lambda: job_mesh(job, progress), remark=lambda mesh: str(mesh.diagnosis))
        specification = job_specification(
            job, used, mesh, lambda: _toolpath(job, used, mesh, piece, runner, before), own_machine=own_machine
        )
        if piece is not None:  # the caller plans the other pieces elsewhere
            specification = dataclasses.replace(specification, setups=max(specification.setups, 2))
        task = _Task(job, specification, runner, piece, (*timing_limits(job, used), *limits), tuple(claims), before)
        outcome = _planned(task, staging, writers or {})
        refusal, splits = outcome.refusal, piece is None and job.placement.setups > 1
        if refusal is not None and refusal.stage == "placement" and splits:
            outcome = _split(task, mesh, refusal, staging, writers or {})
        refusal = outcome.refusal
        if refusal is not None and refusal.stage != STAGE and piece is None and advice is not None:
            again = partial(passes, machine=machine, limits=limits, claims=claims)
            search = (job, used, mesh, task.toolpath, again, advice, progress)
            found = runner.run("advice", lambda: advised(*search))
            better = dataclasses.replace(refusal, advice=found.advice, remedy=found.sentence)
            runner.stages = [s if s.value is not refusal else s.with_value(better) for s in runner.stages]
            outcome = _written(task, refusal_verdict(better, specification.sources), staging, writers or {})
    return outcome


def passes(
    job: Job, *, machine: Machine | None = None, limits: Sequence[Limit] = (), claims: Sequence[Claim] = ()
) -> bool:
    """Return whether a job is planned, with a verdict that passes; nothing is kept. Raises InputError as `run`."""
    with tempfile.TemporaryDirectory() as folder:
        return run(job, folder, machine=machine, limits=limits, claims=claims, advice=None).passed


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


def _planned(task: _Task, staging: Path, writers: Mapping[str, Writer]) -> Outcome:
    """Run the stages after the toolpath and the verification, write the files, and return the outcome."""
    program, runner = task.program(staging / PROGRAM), task.runner
    if isinstance(program, Refusal):
        verdict = refusal_verdict(program, task.specification.sources)
    else:
        file = staging / PROGRAM
        verdict = runner.run(
            "verify", lambda: judged(file, task.specification, claims=task.claims, progress=runner.progress)
        )
        if (fails := withheld(verdict)) is not None:
            runner.stages.append(Stage("withheld", 0.0, fails))
            file.rename(staging / WITHHELD)
    return _written(task, verdict, staging, writers)


def _written(task: _Task, verdict: Verdict, staging: Path, writers: Mapping[str, Writer]) -> Outcome:
    """Write the files of a run but its program, and return the outcome."""
    outcome = Outcome(task.job, task.machine, tuple(task.runner.stages), verdict)
    if (placed := outcome.find(PlacedPath)) is not None:
        outcome = dataclasses.replace(outcome, machine=task.on(placed.placement).machine)
    write_arrays(arrays_of(outcome, unstaged(staging)), staging / ARRAYS)
    for name, write in writers.items():
        task.runner.progress("report", 0.0, name)
        write(outcome, staging / name)
    write_json(outcome.to_dict(), staging / VERDICT)
    return outcome


def _split(task: _Task, mesh: Mesh, refusal: Refusal, staging: Path, writers: Mapping[str, Writer]) -> Outcome:
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


@dataclasses.dataclass(frozen=True)
class _Task:
    """The inputs of the stages after the toolpath. specification: the job's requirements on plan and program."""

    job: Job
    specification: Specification
    runner: StageRunner
    piece: Piece | None = None
    limits: tuple[Limit, ...] = ()
    claims: tuple[Claim, ...] = ()
    before: PlanBefore | None = None

    @property
    def machine(self) -> Machine:
        return self.specification.machine

    @property
    def toolpath(self) -> Toolpath:
        return self.specification.toolpath

    def program(self, file: Path) -> Program | Refusal:
        """Plan, write the program to `file` and return it; or return the first refusal."""
        placed = self.runner.run("placement", self._placed, remark=placement_remarks)
        if isinstance(placed, Refusal):
            return placed
        return self.on(placed.placement).written(placed, file)

    def on(self, placement: Placement) -> _Task:
        """Return the task with the machine's guides at the rail positions of a placement."""
        if placement.rail_positions is None:
            return self
        machine = self.machine.at(placement.rail_positions)
        return dataclasses.replace(self, specification=dataclasses.replace(self.specification, machine=machine))

    def written(self, placed: PlacedPath, file: Path) -> Program | Refusal:
        """Write the program of a placed path to `file` and return it; or return the first refusal."""
        path = self.runner.run("leg path", lambda: self._path(placed))
        if isinstance(path, Refusal):
            return path
        trajectory = self.runner.run("timing", lambda: self._timed(path))
        if isinstance(trajectory, Refusal):
            return trajectory
        program = self.runner.run("program", lambda: self._program(placed, trajectory, file))
        self.runner.run(
            "explain", lambda: explanation(path, trajectory, program, self.machine, self.toolpath), remark=str
        )
        return program

    def fits(self, part: Toolpath) -> bool:
        """Return whether a placement for a part of the toolpath is found."""
        return fits(part, self.machine, **self._options())

    def _placed(self) -> PlacedPath | Refusal:
        """Return the placed path. Where leaning makes the tool meet the part, it keeps the toolpath's axes, or one."""
        options = self._options()
        if self.before is not None and (kept := self.before.kept(self.toolpath, self.machine, options)) is not None:
            return kept
        placed = self._planned(options)
        met = self._meetings(placed)
        if met and options["tilt"] > 0.0:
            common = bool(options["common_axis"])
            placed = self._planned({**options, "common_axis": FIXED} if common else {**options, "tilt": 0.0})
            met = self._meetings(placed)
            if isinstance(placed, PlacedPath):
                chosen = f"{placed.placement.chosen_by}; {STRAIGHT if common else UPRIGHT}"
                placed = dataclasses.replace(placed, placement=dataclasses.replace(placed.placement, chosen_by=chosen))
        return refusal_of(met) if met else placed

    def _timed(self, path: LegPath) -> Trajectory | Refusal:
        machine, progress = self.machine, self.runner.progress
        if self.before is not None:
            return retime_as_before(path, machine, self.before.laws, limits=self.limits, progress=progress)
        return retime(path, machine, limits=self.limits, progress=progress)

    def _planned(self, options: PlacementOptions) -> PlacedPath | Refusal:
        objective, progress = self.job.placement.then, self.runner.progress
        return plan(self.toolpath, self.machine, **options, secondary_objective=objective, progress=progress)

    def _meetings(self, placed: PlacedPath | Refusal) -> Ranges:
        """Return where the tool meets the part; nowhere for jobs that want gouges reported only."""
        cutting = self.specification.cutting
        if isinstance(placed, Refusal) or cutting is None or not drops_gouges(self.job):
            return ()
        return meetings(placed, cutting, self.specification.path_tolerance)

    def _options(self) -> PlacementOptions:
        return {
            "tilt": self.specification.tilt,
            "common_axis": self.job.axis.mode == "auto",
            "constraints": self.specification.constraints or FREE,
            "component": self.specification.component,
            "collision_world": self.specification.collision_world or NOTHING,
            "weights": job_weights(self.job),
            "limits": placement_limits(self.job),
            "solver": self.job.placement.solver,
        }

    def _path(self, placed: PlacedPath) -> LegPath | Refusal:
        return leg_path(
            placed,
            self.machine,
            path_tolerance=self.specification.path_tolerance,
            axis_tolerance=self.specification.axis_tolerance,
            stop_angle=self.job.feed.si.stop_angle,
        )

    def _program(self, placed: PlacedPath, trajectory: Trajectory, file: Path) -> Program:
        made_on = (processor_kind(), library_versions())
        machine = self.machine
        source = Provenance(
            machine.name, machine.digest, self.job.digest, __version__, self.piece, *made_on,
            calibration=machine.calibration_name,
        )  # fmt: skip
        program = sample(trajectory, self.machine, placed.placement.transform, placed.component, source)
        write_csv(program, file)
        return program
