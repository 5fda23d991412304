"""Planning pipeline: runs the stages of a job in order and writes their results."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from pentapod.base.progress import Progress, silent
from pentapod.base.refusal import Refusal
from pentapod.base.version import __version__, library_versions, processor_kind
from pentapod.job.artefacts import ARRAYS, PROGRAM, VERDICT, check_folder, write_arrays, write_json
from pentapod.job.build.placement import job_weights
from pentapod.job.build.specification import job_specification
from pentapod.job.build.tool import job_link_style
from pentapod.job.build.values import job_machine, job_mesh, job_piece, job_toolpath
from pentapod.job.outcome import Outcome, SetUp, SetUps, Stage, refusal_verdict
from pentapod.job.plan_arrays import arrays_of
from pentapod.job.run_folder import staged, unstaged
from pentapod.job.schema.job import Job
from pentapod.job.stage_runner import StageRunner
from pentapod.machine.clearance.collision_world import NOTHING
from pentapod.machine.machine import Machine
from pentapod.planning import LegPath, PlacedPath, Placement, leg_path, plan
from pentapod.planning.plan import PlacementOptions, fits
from pentapod.planning.problem.constraints import FREE
from pentapod.planning.setups import setups
from pentapod.program import Program, Provenance, sample, write_csv
from pentapod.timing import Explanation, Limit, Trajectory, certify, explain, retime, unheld
from pentapod.toolpath import Mesh, Toolpath
from pentapod.toolpath.linking.links import LinkStyle
from pentapod.toolpath.linking.partition import Piece, missed_cuts, part_of
from pentapod.verify import Claim, Specification, judged

Writer = Callable[[Outcome, Path], object]


def run(
    job: Job,
    out: str | Path,
    progress: Progress = silent,
    *,
    piece: Piece | None = None,
    writers: Mapping[str, Writer] | None = None,
    limits: Sequence[Limit] = (),
    claims: Sequence[Claim] = (),
) -> Outcome:
    """Plan a job, write program.csv, plan.npz and verdict.json into `out`, and return the outcome.

    piece: of the job's toolpath, where only that is to be planned, in one set-up. writers: further files, by name,
    each made from the outcome (the report, which stands above this floor). limits: further ones for the time law;
    claims: further ones for the verdict.
    The program is judged from the file, as it was written. What cannot be done ends in an outcome with a
    refusal: verdict.json says so, and there is no program. The folder changes when the run ends: an
    error or an interruption leaves it as it was. Raises InputError for a bad job, mesh, machine or folder, and where
    another run is writing into the folder.
    """
    folder = Path(out)
    check_folder(folder)
    runner = StageRunner(progress)
    with staged(folder) as staging:  # from the start: a second run on the folder fails at once
        machine = job_machine(job)
        mesh = runner.time("mesh", lambda: job_mesh(job, progress), says=lambda mesh: str(mesh.diagnosis))
        asked = job_specification(job, machine, mesh, lambda: _toolpath(job, mesh, piece, runner))
        if piece is not None:  # the caller plans the other pieces elsewhere
            asked = dataclasses.replace(asked, setups=max(asked.setups, 2))
        task = _Task(job, asked, runner, piece, tuple(limits), tuple(claims))
        outcome = _reached(task, staging, writers or {})
        refusal, splits = outcome.refusal, piece is None and job.placement.setups > 1
        if refusal is not None and refusal.stage == "placement" and splits:
            style = job_link_style(job, mesh, task.toolpath)
            outcome = _split(task, style, refusal, staging, writers or {})
    return outcome


def _toolpath(job: Job, mesh: Mesh, piece: Piece | None, runner: StageRunner) -> Toolpath:
    """Return the job's toolpath, or a piece of it, as a stage of the run."""
    if piece is None:
        return runner.time("toolpath", lambda: job_toolpath(job, mesh, runner.progress), says=lambda it: str(it[1]))[0]
    made = runner.time(
        "toolpath", lambda: (job_piece(job, mesh, piece, runner.progress), piece), says=lambda _: str(piece)
    )
    return made[0]


def _reached(task: _Task, staging: Path, writers: Mapping[str, Writer]) -> Outcome:
    """Run the stages after the toolpath, verify, write the files, and return the outcome."""
    program, runner = task.program(staging / PROGRAM), task.runner
    if isinstance(program, Refusal):
        verdict = refusal_verdict(program, task.asked.sources)
    else:
        file = staging / PROGRAM
        verdict = runner.time("verify", lambda: judged(file, task.asked, claims=task.claims, progress=runner.progress))
    outcome = Outcome(task.job, task.machine, tuple(runner.stages), verdict)
    if (placed := outcome.find(PlacedPath)) is not None:
        outcome = dataclasses.replace(outcome, machine=task.on(placed.placement).machine)
    return _written(outcome, staging, writers, runner.progress)


def _written(outcome: Outcome, staging: Path, writers: Mapping[str, Writer], progress: Progress) -> Outcome:
    write_arrays(arrays_of(outcome, unstaged(staging)), staging / ARRAYS)
    for name, write in writers.items():
        progress("report", 0.0, name)
        write(outcome, staging / name)
    write_json(outcome.to_dict(), staging / VERDICT)
    return outcome


def _split(task: _Task, style: LinkStyle, refusal: Refusal, staging: Path, writers: Mapping[str, Writer]) -> Outcome:
    """Split a job that one placement cannot reach into set-ups, each in a folder of its own; or refuse it."""
    job, toolpath, runner = task.job, task.toolpath, task.runner
    # The refusal is not part of the outcome.
    runner.stages = [stage for stage in runner.stages if stage.value is not refusal]
    search = (task.toolpath, task.fits, style, job.placement.setups, refusal, runner.progress)
    found = runner.time("set-ups", lambda: setups(*search))
    if isinstance(found, Refusal):
        verdict = refusal_verdict(found, task.asked.sources)
        return _written(Outcome(job, task.machine, tuple(runner.stages), verdict), staging, writers, runner.progress)
    cutting, missed = missed_cuts(toolpath, found)
    parts: list[SetUp] = []
    before = [stage for stage in runner.stages if stage.name not in ("toolpath", "set-ups")]
    for number, piece in enumerate(found, start=1):
        runner.progress("set-ups", (number - 1) / len(found), f"planning {number} of {len(found)}")
        own, part = StageRunner(runner.progress), part_of(toolpath, piece, style)
        own.stages += [*before, Stage("toolpath", 0.0, (part, piece), f"set-up {number} of {len(found)}: {piece}")]
        folder = staging / SetUp.folder_of(number)
        folder.mkdir()
        own_task = dataclasses.replace(
            task, asked=dataclasses.replace(task.asked, toolpath=part, missed=missed), runner=own, piece=piece
        )
        parts.append(SetUp(number, piece, _reached(own_task, folder, writers)))
    done = SetUps(tuple(parts), cutting, missed, job.placement.setups)
    runner.stages.append(Stage("set-ups planned", sum(part.seconds for part in parts), done, str(done)))
    return _written(Outcome(job, task.machine, tuple(runner.stages), done.verdict), staging, writers, runner.progress)


@dataclasses.dataclass(frozen=True)
class _Task:
    """What the stages after the toolpath need. asked: all that the job asks, of the plan as of the program."""

    job: Job
    asked: Specification
    runner: StageRunner
    piece: Piece | None = None
    limits: tuple[Limit, ...] = ()
    claims: tuple[Claim, ...] = ()

    @property
    def machine(self) -> Machine:
        return self.asked.machine

    @property
    def toolpath(self) -> Toolpath:
        return self.asked.toolpath

    def program(self, file: Path) -> Program | Refusal:
        """Plan, write the program to `file` and return it; or return the first refusal."""
        placed = self.runner.time("placement", self._placed, says=_remarks)
        if isinstance(placed, Refusal):
            return placed
        return self.on(placed.placement).written(placed, file)

    def on(self, placement: Placement) -> _Task:
        """Return the task with the machine's guides where a placement wants them."""
        if placement.rail_positions is None:
            return self
        machine = self.machine.at(placement.rail_positions)
        return dataclasses.replace(self, asked=dataclasses.replace(self.asked, machine=machine))

    def written(self, placed: PlacedPath, file: Path) -> Program | Refusal:
        """Write the program of a placed path to `file` and return it; or return the first refusal."""
        path = self.runner.time("leg path", lambda: self._path(placed))
        if isinstance(path, Refusal):
            return path
        machine, progress = self.machine, self.runner.progress
        trajectory = self.runner.time("timing", lambda: retime(path, machine, limits=self.limits, progress=progress))
        if isinstance(trajectory, Refusal):
            return trajectory
        program = self.runner.time("program", lambda: self._program(placed, trajectory, file))
        self.runner.time("explain", lambda: self._explanation(path, trajectory, program), says=str)
        return program

    def fits(self, part: Toolpath) -> bool:
        """Return whether a placement for a part of the toolpath is found."""
        return fits(part, self.machine, **self._options())

    def _placed(self) -> PlacedPath | Refusal:
        objective, progress = self.job.placement.then, self.runner.progress
        return plan(self.toolpath, self.machine, **self._options(), secondary_objective=objective, progress=progress)

    def _options(self) -> PlacementOptions:
        return {
            "tilt": self.asked.tilt,
            "constraints": self.asked.constraints or FREE,
            "component": self.asked.component,
            "collision_world": self.asked.collision_world or NOTHING,
            "weights": job_weights(self.job),
            "solver": self.job.placement.solver,
        }

    def _path(self, placed: PlacedPath) -> LegPath | Refusal:
        return leg_path(
            placed,
            self.machine,
            path_tolerance=self.asked.path_tolerance,
            axis_tolerance=self.asked.axis_tolerance,
            stop_angle=self.job.feed.si.stop_angle,
        )

    def _program(self, placed: PlacedPath, trajectory: Trajectory, file: Path) -> Program:
        made_on = (processor_kind(), library_versions())
        source = Provenance(self.machine.name, self.machine.digest, self.job.digest, __version__, self.piece, *made_on)
        program = sample(trajectory, self.machine, placed.placement.transform, placed.component, source)
        write_csv(program, file)
        return program

    def _explanation(self, path: LegPath, trajectory: Trajectory, program: Program) -> Explanation:
        position, direction = self.machine.robot.pose(program.legs, program.component)
        tips = position + self.machine.tool_length * direction
        # A beam or a spray needs constant speed on the surface; a cutter only has an upper bound.
        beam, period = self.toolpath.tilt_centre < 0.0, self.machine.controller.period
        slow = unheld(trajectory, period, path.surface_rate) if beam else ()
        spot = self.toolpath.tilt_centre if beam else 0.0
        uses = certify(trajectory, self.machine, legs=program.legs, tips=tips, axes=-direction, spot=spot)
        return explain(trajectory, self.machine, uses, slow)


def _remarks(placed: PlacedPath | Refusal) -> str:
    """Return the positions of guides, and the result of an interrupted search."""
    if isinstance(placed, Refusal):
        return ""
    chosen = placed.placement
    lines = [f"guides 1 to 5 at {chosen.guides}"] if chosen.guides else []
    if "interrupted" in chosen.chosen_by:
        lines.append(f"placement: {chosen.chosen_by}; smallest margin {placed.smallest_margin:.3f}")
    return "\n".join(lines)
