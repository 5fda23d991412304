"""The report of a run as one self-contained HTML file: verdict, time and set-up first, then motion and provenance."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from pentapod.geometry.rigid import RigidTransform
from pentapod.job.artefacts import SHEET
from pentapod.job.build.limits import placement_limits
from pentapod.job.build.placement import job_at, placement_toml
from pentapod.job.build.specification import job_collision_world
from pentapod.job.outcome import Outcome, SetUps
from pentapod.job.plan_arrays import matrix_mm
from pentapod.job.schema.job import Job
from pentapod.kinematics.mode import Mode
from pentapod.machine.clearance.collision_world import NOTHING, CollisionWorld
from pentapod.machine.machine import Machine
from pentapod.mesh.mesh import Mesh
from pentapod.planning.placement.placed_path import PlacedPath
from pentapod.program.program import Program
from pentapod.report import words
from pentapod.report.drawings.colours import RAMP, leg_colour
from pentapod.report.pack import Packed
from pentapod.report.page.causes import Kind, kind_of, kinds_of, sentence
from pentapod.report.page.claims import grouped, used_share
from pentapod.report.page.keys import SEGMENT_KINDS, Keys
from pentapod.report.page.plots import bucket_words, plots_of
from pentapod.report.page.preparations import facts, preparations, provenance
from pentapod.report.page.scene import scene_of
from pentapod.report.setup_sheet import margins_along_path, setup_sheet
from pentapod.report.signals import Signals, TimeLaw
from pentapod.report.template import write_page
from pentapod.report.worst import worst_places
from pentapod.timing.explain import Explanation
from pentapod.timing.time_law.trajectory import Trajectory
from pentapod.toolpath.linking.partition import Piece
from pentapod.toolpath.toolpath import Toolpath
from pentapod.verify.surface.surface_left import SURFACE_LEFT

TEMPLATE = "page.html.j2"


def write_report(outcome: Outcome, path: str | Path) -> Path:
    """Write report.html on a run and return its path. Raises InputError where it cannot be written."""
    run = ReportedRun(outcome)
    page, packed, context = contents(run)
    sheet = SHEET if run.outcome.find(Program) is not None else ""
    return write_page(path, TEMPLATE, page, packed, **context, sheet_file=sheet)


def contents(run: ReportedRun) -> tuple[dict[str, Any], Packed, dict[str, Any]]:
    """Return what the page's script draws, the arrays for it, and the variables of the template."""
    packed = Packed()
    motion, signals = run.motion(packed), run.signals
    page = {
        "scene": scene_of(packed, run.outcome, signals, run.machine),
        "motion": motion,
        "plots": None if signals is None else plots_of(packed, signals, run.machine),
    }
    return page, packed, _context(run, motion)


@dataclass(frozen=True, eq=False)
class ReportedRun:
    """A run, and what is computed from it once."""

    outcome: Outcome

    @property
    def law(self) -> TimeLaw | None:
        """Its time law."""
        return self.outcome.find(Trajectory)

    @cached_property
    def machine(self) -> Machine:
        """The machine as the program moves it: on its guides, where it has some."""
        program = self.outcome.find(Program)
        return self.outcome.machine if program is None else program.machine(self.outcome.machine)

    @cached_property
    def signals(self) -> Signals | None:
        """The motion of the program, if there is one."""
        find = self.outcome.find
        program, law, toolpath = find(Program), self.law, find(Toolpath)
        if program is None or law is None or toolpath is None:
            return None
        world, limits = self._collision_world, placement_limits(self.outcome.job)
        return Signals.of(program, self.machine, law, toolpath, world, limits)

    @property
    def _collision_world(self) -> CollisionWorld:
        """The collision world of the planner."""
        mesh = self.outcome.find(Mesh)
        return NOTHING if mesh is None else job_collision_world(self.outcome.job, self.outcome.machine, mesh)

    @cached_property
    def kinds(self) -> list[Kind]:
        """What limits the motion, by kind."""
        return [] if self.signals is None else kinds_of(self.signals, self.outcome.find(Explanation))

    @property
    def least(self) -> tuple[float, str, float]:
        """The smallest margin, its limit, and its time."""
        signals = self.signals
        if signals is None:
            raise ValueError("there is no program")
        row = int(signals.smallest_margins.argmin())
        name = signals.margin_names[int(signals.margins[row].argmin())]
        return float(signals.smallest_margins[row]), name, float(signals.times[signals.margin_rows[row]])

    @cached_property
    def keys(self) -> Keys | None:
        """The keys of the motion; None without a program."""
        placed = self.outcome.find(PlacedPath)
        if self.signals is None or placed is None:
            return None
        tolerance = self.outcome.job.tolerance.si.path
        return Keys.of(self.signals, self.machine, placed, tolerance, self.outcome.verdict.left)

    def motion(self, packed: Packed) -> dict[str, Any] | None:
        """Add the arrays of the motion to the page's and return the rest; None without a program."""
        signals, keys, find = self.signals, self.keys, self.outcome.find
        toolpath, program = find(Toolpath), find(Program)
        if signals is None or keys is None or toolpath is None or program is None:
            return None
        tolerance, left = self.outcome.job.tolerance.si, self.outcome.verdict.left
        keys.pack(packed, signals, [segment.kind for segment in toolpath.segments], program.period)
        return {
            "start": self.least[2],
            "ramp": RAMP,
            "causes": [{"name": name, "kind": kind_of(name)} for name in signals.cause_names],
            "kinds": [
                {
                    "name": kind.name,
                    "colour": kind.colour,
                    "seconds": kind.seconds,
                    "told": words.duration(kind.seconds),
                }
                for kind in self.kinds
            ],
            "kind_names": [kind.value for kind in SEGMENT_KINDS],
            "margins": signals.margin_names,
            "scales": keys.scales(tolerance.path, tolerance.deflection, None if left is None else left.allowed),
        }


def _context(run: ReportedRun, motion: dict[str, Any] | None) -> dict[str, Any]:
    """Return the variables of the template."""
    outcome, signals = run.outcome, run.signals
    placed, program, verdict = outcome.find(PlacedPath), outcome.find(Program), outcome.verdict
    total = 0.0 if program is None else program.duration
    drawings, below = setup_sheet(outcome)
    return {
        "job": outcome.job,
        "title": words.job_title(outcome.job.path),
        "machine": outcome.machine,
        "status": "refused" if outcome.refusal is not None else "passed" if outcome.passed else "failed",
        "certificates": verdict.certificates,
        "groups": grouped(verdict.certificates, verdict.not_judged),
        "used_share": used_share,
        "failed": [c for c in verdict.certificates if not c.passed],
        "unjudged": [entry for entry in verdict.not_judged if not entry.waived],
        "waived": [entry for entry in verdict.not_judged if entry.waived],
        "refusal": outcome.refusal,
        "facts": facts(outcome),
        "total": total,
        "kinds": [kind for kind in run.kinds if kind.seconds > 0.0],
        "sentence": sentence(run.kinds, total) if run.kinds else "",
        "least": None if signals is None else run.least,
        "left": next((c for c in verdict.certificates if c.claim == SURFACE_LEFT), None),
        "scales": [] if motion is None else motion["scales"],
        "legs": [leg_colour(k) for k in range(outcome.machine.robot.n_legs)],
        "worst": [] if signals is None else worst_places(signals, run.machine),
        "story": outcome.find(Explanation),
        "sheet": preparations(outcome, signals),
        "placement": None if placed is None else _placement(outcome.job, placed.placement.transform),
        "setups": outcome.find(SetUps),
        "one_of_several": outcome.find(Piece) is not None,
        "drawings": drawings,
        "setup_sheet": below,
        "margins": margins_along_path(outcome),
        "chosen_by": "" if placed is None else placed.placement.chosen_by,
        "component": "" if placed is None else str(placed.component),
        "component_signs": (
            "signs of the singularity polynomial and of w"
            if placed is not None and isinstance(placed.component, Mode)
            else "signs of w and S"
        ),
        "stages": outcome.stages,
        "moves": signals is not None,
        "plays": motion is not None,
        "buckets": "" if signals is None else bucket_words(signals),
        "provenance": provenance(outcome),
    }


def _placement(job: Job, transform: RigidTransform) -> dict[str, Any]:
    rows = matrix_mm(transform).tolist()
    return {
        "sentences": words.placement_sentences(transform),
        "matrix": [[f"{round(value, 6) + 0.0:.6f}".replace("-", "−") for value in row] for row in rows],
        "toml": placement_toml(job_at(job, transform).placement),
    }
