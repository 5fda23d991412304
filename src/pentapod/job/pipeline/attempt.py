"""Attempt: a job's toolpath planned once, and its program judged; the files of what becomes of a run."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Self

from pentapod.base.refusal import Refusal
from pentapod.job.advice.options import Tried
from pentapod.job.artefacts import ARRAYS, PROGRAM, VERDICT, WITHHELD, write_arrays, write_json
from pentapod.job.build.left import FORESIGHT, foreseen
from pentapod.job.build.limits import pose_limits
from pentapod.job.build.pieces import job_piece
from pentapod.job.build.toolpath import Reports, job_toolpath
from pentapod.job.mending import Mend
from pentapod.job.outcome import Outcome, Stage, refusal_verdict
from pentapod.job.plan_arrays import array_parts
from pentapod.job.plan_before import PlanBefore
from pentapod.job.run_folder import unstaged
from pentapod.job.schema.job import Job
from pentapod.job.stage_runner import StageRunner
from pentapod.job.task import Task
from pentapod.job.ways.claims import with_ways
from pentapod.job.ways.ways import remove_ways, ways, write_ways
from pentapod.job.withheld import STAGE, failures, withheld
from pentapod.machine.machine import Machine
from pentapod.numerics.memory import give_back
from pentapod.planning import PlacedPath
from pentapod.program import Program
from pentapod.toolpath import Mesh, Toolpath
from pentapod.toolpath.linking.partition import Piece
from pentapod.verify import Verdict, judged
from pentapod.verify.surface.surface_left_along import surface_left_along

Writer = Callable[[Outcome, Path], object]

FORESEEN = "foreseen"
"""Name of the stage that refuses a toolpath before it is planned."""


def made_toolpath(
    job: Job,
    machine: Machine,
    mesh: Mesh,
    runner: StageRunner,
    piece: Piece | None = None,
    before: PlanBefore | None = None,
) -> Toolpath:
    """Return the job's toolpath, or a piece of it, as a stage of the run."""

    def made() -> tuple[Toolpath, object]:
        if before is not None:
            return before.toolpath, "toolpath of the run before"
        if piece is None:
            return job_toolpath(job, mesh, runner.progress, machine=machine)
        return job_piece(job, mesh, piece, runner.progress, machine=machine), piece

    return runner.run("toolpath", made, remark=lambda it: str(it[1]))[0]


@dataclasses.dataclass(frozen=True, eq=False)
class Attempt:
    """A plan of a job in one way.

    mesh: of the job's part. staging: the folder for its files. writers: further files, by name. left_first: whether
    what its toolpath leaves is judged before it is planned. unplaced: outcomes of mends for which no placement was
    found, whatever may be left of the region.
    """

    task: Task
    mesh: Mesh
    staging: Path
    writers: Mapping[str, Writer]
    left_first: bool = False
    unplaced: dict[Mend, Outcome] = dataclasses.field(default_factory=dict)

    @property
    def runner(self) -> StageRunner:
        """What runs the stages of the attempt."""
        return self.task.runner

    def with_task(self, **changes: Any) -> Self:
        """Return the attempt at a task with some fields changed."""
        return dataclasses.replace(self, task=dataclasses.replace(self.task, **changes), unplaced={})

    def foreseen(self, *, upright: bool) -> Outcome | None:
        """Return the outcome of a toolpath whose program would fail its verdict; None where that is not known yet.

        upright: as for `build.left.foreseen`.
        """
        task = self.task
        made = next((stage.value for stage in self.runner.stages if stage.name == "toolpath"), None)
        if made is None or not isinstance(made[1], Reports):  # a piece, or the toolpath of the run before
            return None
        refusal = foreseen(task.job, made[1], task.toolpath, task.specification.cutting, upright=upright)
        if refusal is None:
            return None
        self.runner.stages.append(Stage(FORESEEN, 0.0, refusal))
        return self.refused(refusal)

    def judged_on_toolpath(self) -> Outcome | None:
        """Return the outcome of a toolpath that leaves so much that its program fails; None where that is not known.

        The claim about it is judged on the toolpath.
        """
        self.runner.progress("toolpath", 1.0, "what it leaves")
        left = surface_left_along(self.task.specification)
        if left is None or (left.value or 0.0) <= FORESIGHT.leaves * (left.bound or 0.0):
            return None
        verdict = Verdict((left,), sources=self.task.specification.sources)
        self.runner.stages.append(Stage(FORESEEN, 0.0, withheld(verdict, foreseen=True)))
        return self.ended(verdict)

    def planned(self) -> Outcome:
        """Run the stages after the toolpath and the verification; write the program, and return the outcome."""
        file, runner = self.staging / PROGRAM, self.runner
        (self.staging / WITHHELD).unlink(missing_ok=True)
        program = self.task.program(file)
        made = program if isinstance(program, Refusal) else self._with_ways(program)
        if isinstance(made, Refusal):
            file.unlink(missing_ok=True)
            return self.refused(made)
        specification, claims = with_ways(self.task.specification, self.staging)
        claims = (*claims, *self.task.claims)
        verdict = runner.run(
            "verify", lambda: judged(file, specification, claims=claims, progress=runner.progress, in_memory=made)
        )
        if (fails := withheld(verdict)) is not None:
            runner.stages.append(Stage("withheld", 0.0, fails))
            file.rename(self.staging / WITHHELD)
            remove_ways(self.staging)
        return self.ended(verdict)

    def refused(self, refusal: Refusal) -> Outcome:
        """Return the outcome of a refused run."""
        return self.ended(refusal_verdict(refusal, self.task.specification.sources))

    def ended(self, verdict: Verdict) -> Outcome:
        """Return the outcome of a run with its stages till now."""
        task = self.task
        outcome = Outcome(task.job.asked or task.job, task.machine, tuple(self.runner.stages), verdict)
        if (placed := outcome.find(PlacedPath)) is not None:
            outcome = dataclasses.replace(outcome, machine=task.on(placed.placement).machine)
        return outcome

    def write(self, outcome: Outcome) -> None:
        """Write the files of a run but its program."""
        staging = self.staging
        write_arrays(array_parts(outcome, unstaged(staging)), staging / ARRAYS)
        give_back()
        for name, write in self.writers.items():
            self.runner.progress("report", 0.0, name)
            write(outcome, staging / name)
        write_json(outcome.to_dict(), staging / VERDICT)

    def withheld(self) -> bytes | None:
        """Return the program that failed its verdict; None where none was written."""
        file = self.staging / WITHHELD
        return file.read_bytes() if file.is_file() else None

    def tried_with(self, share: float, outcome: Outcome) -> Tried:
        """Return how the job ends where a share of the region may be left: a plan writes the program that is withheld.

        outcome: of the job, whose program fails in this alone.
        """
        specification = self.task.specification
        cutting = specification.cutting
        if cutting is not None and cutting.coverage is not None:
            cutting = dataclasses.replace(cutting, coverage=dataclasses.replace(cutting.coverage, share=share))
        specification = dataclasses.replace(specification, cutting=cutting)
        verdict = judged(self.staging / WITHHELD, specification, claims=self.task.claims)
        failed = frozenset(failures(verdict))
        return Tried(None, outcome.margin) if verdict.passed else Tried(STAGE, failed=failed)

    def put_back(self, failed: Outcome, program: bytes | None) -> Outcome:
        """Write the program of a failed run again, which was withheld; return the outcome."""
        file = self.staging / WITHHELD
        file.unlink(missing_ok=True)
        if program is not None:
            file.write_bytes(program)
        return self.ended(failed.verdict)

    def _with_ways(self, program: Program) -> Program | Refusal:
        """Make the ways of a program and write them beside it, if the machine has a park pose.

        Return the program, or a refusal.
        """
        remove_ways(self.staging)
        task = self.task
        if task.machine.park.pose is None:
            return program
        machine = program.machine(task.machine)
        specification, kinds = dataclasses.replace(task.specification, machine=machine), pose_limits(task.job)
        made = self.runner.run("ways", lambda: ways(program, specification, limits=task.limits, kinds=kinds))
        if isinstance(made, Refusal):
            return made
        write_ways(made, self.staging)
        return program
