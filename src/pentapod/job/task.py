"""Task: the stages of a run after the toolpath, and what they say of placement and time law."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import lru_cache, partial
from pathlib import Path

import numpy as np

from pentapod.base.refusal import Refusal
from pentapod.base.units import from_si
from pentapod.base.version import __version__, library_versions, processor_kind
from pentapod.job.build.limits import placement_limits
from pentapod.job.build.other_ways import stands, stepover_share
from pentapod.job.build.placed_check import Ranges, meetings, refusal_of
from pentapod.job.build.placement import job_weights
from pentapod.job.build.toolpath import drops_gouges
from pentapod.job.build.values import is_compensated
from pentapod.job.plan_before import PlanBefore
from pentapod.job.schema.job import Job
from pentapod.job.stage_runner import INTERRUPTED, StageRunner
from pentapod.machine.clearance.collision_world import NOTHING
from pentapod.machine.machine import Machine
from pentapod.machine.parts import WorkVolume
from pentapod.planning import LegPath, PlacedPath, Placement, leg_path, plan
from pentapod.planning.leg_path.tolerances import tolerances_beside
from pentapod.planning.placement.common_axes import FIXED
from pentapod.planning.plan import PlacementOptions, fits
from pentapod.planning.problem.constraints import FREE
from pentapod.program import Program, Provenance, sample, write_csv
from pentapod.program.commands import compensation_sentence
from pentapod.program.process import with_process, with_process_force
from pentapod.program.program import GRAVITY, PROCESS
from pentapod.timing import Explanation, JerkOptions, Limit, Trajectory, certify, explain, retime, slow_cuts
from pentapod.timing.jerk.options import DEFAULTS
from pentapod.timing.reuse import retime_as_before
from pentapod.toolpath import Toolpath
from pentapod.toolpath.linking.partition import Piece
from pentapod.verify import Claim, Specification

UPRIGHT = "the tool does not lean, because it would touch the part"
"""What is said of a placement with the toolpath's axes."""

STRAIGHT = "the tool keeps one direction, because it would touch the part"
"""What is said of a placement with one axis everywhere."""

LEANS_DEG = 0.05
"""Lean of a part from which it is told that it needs a wedge."""

RIGHT_PLACE = {
    "free": "box_mm keeps it near",
    "table": "is table_z_mm right? table_x_mm and table_y_mm bound where the part stands",
    "fixture": "are poses_mm_deg right?",
    "fixed": "is its place right?",
}
"""What is said of a path far outside the work volume, by the mode of the placement."""

FAR_OUTSIDE = 0.5
"""Distance of a path from the work volume, by the volume's diameter, beyond which it is told."""


def explanation(
    path: LegPath, trajectory: Trajectory, program: Program, machine: Machine, toolpath: Toolpath
) -> Explanation:
    """Return which limits hold a program's motion, and where a beam is slower than its feed."""
    position, direction = machine.robot.pose(program.legs, program.component)
    tips = position + machine.tool_length * direction
    # A beam or a spray needs constant speed on the surface; a cutter only has an upper bound.
    beam, period = toolpath.tilt_centre < 0.0, machine.controller.period
    slow = slow_cuts(trajectory, period, path.surface_rate) if beam else ()
    spot = toolpath.tilt_centre if beam else 0.0
    uses = certify(trajectory, machine, legs=program.legs, tips=tips, axes=-direction, spot=spot)
    return explain(trajectory, machine, uses, slow)


def placement_remarks(placed: PlacedPath | Refusal, work: WorkVolume, mode: str) -> str:
    """Return the positions of guides, a common direction of the tool, and what the choice of placement has to tell.

    A path far outside the work volume is no error where it keeps all limits; but a height may be mistyped. mode: of the
    placement; where the part may lean as it likes it is told that it does.
    """
    if isinstance(placed, Refusal):
        return ""
    chosen = placed.placement
    lines = [f"guides 1 to 5 at {chosen.guides}"] if chosen.guides else []
    lines += [f"tool axis: {placed.common_axis}; {placed.lean}"] if placed.common_axis is not None else []
    if any(word in chosen.chosen_by for word in (INTERRUPTED, UPRIGHT, STRAIGHT)):
        lines.append(f"placement: {chosen.chosen_by}; smallest margin {placed.smallest_margin:.3f}")
    lean = from_si(float(np.arccos(min(float(np.abs(chosen.transform.rotation[2]).max()), 1.0))), "deg")
    if mode == "free" and lean > LEANS_DEG:
        lines.append(
            f'  note: the part leans by {lean:.1f} deg, on a wedge: [placement] mode = "table" keeps it flat on a table'
        )
    outside = work.outside(placed.tips)
    if outside > FAR_OUTSIDE * work.diameter:
        far = f"{from_si(outside, 'mm'):.0f} mm"
        lines.append(f"  note: the path is up to {far} outside the machine's work volume; {RIGHT_PLACE[mode]}")
    return "\n".join(lines)


@dataclasses.dataclass(frozen=True)
class Task:
    """The inputs of the stages after the toolpath.

    specification: the job's requirements on plan and program. left_out: pairs of waypoints of the job's toolpath
    between which the toolpath of the specification makes no cut. law: options of the time law. closer: share of the
    tolerances of path and axis that the leg path keeps; gentler: of the legs' limits that the time law keeps. placed:
    the placed path, where it is known; start: that of nearly the same toolpath, from which the placement starts.
    """

    job: Job
    specification: Specification
    runner: StageRunner
    piece: Piece | None = None
    limits: tuple[Limit, ...] = ()
    claims: tuple[Claim, ...] = ()
    before: PlanBefore | None = None
    left_out: tuple[tuple[int, int], ...] = ()
    law: JerkOptions = DEFAULTS
    closer: float = 1.0
    gentler: float = 1.0
    placed: PlacedPath | None = None
    start: PlacedPath | None = None

    @property
    def machine(self) -> Machine:
        """The machine, with the job's tool length and controller settings."""
        return self.specification.machine

    @property
    def toolpath(self) -> Toolpath:
        """The toolpath to be planned, workpiece frame."""
        return self.specification.toolpath

    def program(self, file: Path) -> Program | Refusal:
        """Plan, write the program to `file` and return it; or return the first refusal."""
        placed = self.placed
        if placed is None:
            told = partial(placement_remarks, work=self.machine.work, mode=self.job.placement.mode)
            placed = self.runner.run("placement", self._placed, remark=told)
        if isinstance(placed, Refusal):
            return placed
        return self.on(placed.placement).written(placed, file)

    def on(self, placement: Placement) -> Task:
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
        told = partial(compensation_sentence, machine=self.machine)
        program = self.runner.run("program", lambda: self._program(placed, trajectory, file), remark=told)
        self.runner.run(
            "explain",
            lambda: explanation(path, trajectory, program, self.machine, self.toolpath),
            remark=Explanation.in_short,
        )
        return program

    def fits(self, part: Toolpath) -> bool:
        """Return whether a placement for a part of the toolpath is found."""
        return fits(part, self.machine, **self._options())

    def _placed(self) -> PlacedPath | Refusal:
        """Return the placed path. Where leaning makes the tool meet the part, it keeps the toolpath's axes, or one.

        A path that was planned before, but for some cuts, is not: what meets the part can be left out as well.
        """
        options = self._options()
        if self.before is not None and (kept := self.before.kept(self.toolpath, self.machine, options)) is not None:
            return kept
        meetings = lru_cache(maxsize=1)(self._meetings)
        placed = self._planned(options, self.start, meetings)
        met = meetings(placed)
        if met and options["tilt"] > 0.0 and self.start is None:
            common = bool(options["common_axis"])
            placed = self._planned({**options, "common_axis": FIXED} if common else {**options, "tilt": 0.0})
            met = self._meetings(placed)
            if isinstance(placed, PlacedPath):
                chosen = f"{placed.placement.chosen_by}; {STRAIGHT if common else UPRIGHT}"
                placed = dataclasses.replace(placed, placement=dataclasses.replace(placed.placement, chosen_by=chosen))
        return refusal_of(placed, met) if met and isinstance(placed, PlacedPath) else placed

    def _timed(self, path: LegPath) -> Trajectory | Refusal:
        legs, progress = self.machine.legs, self.runner.progress
        names = ("max_velocity", "max_acceleration", "max_jerk")
        legs = dataclasses.replace(legs, **{name: self.gentler * getattr(legs, name) for name in names})
        machine = dataclasses.replace(self.machine, legs=legs)
        if self.before is not None:
            return retime_as_before(path, machine, self.before.laws, limits=self.limits, progress=progress)
        return retime(path, machine, limits=self.limits, progress=progress, jerk_options=self.law)

    def _planned(
        self,
        options: PlacementOptions,
        start: PlacedPath | None = None,
        meetings: Callable[[PlacedPath], Ranges] | None = None,
    ) -> PlacedPath | Refusal:
        objective, progress = self.job.placement.then, self.runner.progress
        return plan(
            self.toolpath, self.machine, **options, secondary_objective=objective, start=start, meetings=meetings,
            progress=progress,
        )  # fmt: skip

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
        asked = self.specification
        tolerances = (self.closer * asked.path_tolerance, self.closer * asked.axis_tolerance)
        path, axis = tolerances_beside(placed, asked.collision_world or NOTHING, *tolerances)
        stop_angle = self.job.feed.si.stop_angle
        return leg_path(placed, self.machine, path_tolerance=path, axis_tolerance=axis, stop_angle=stop_angle)

    def _program(self, placed: PlacedPath, trajectory: Trajectory, file: Path) -> Program:
        made_on = (processor_kind(), library_versions())
        machine = self.machine
        source = Provenance(
            machine.name, machine.digest, self.job.digest, __version__, self.piece, *made_on,
            calibration=machine.calibration_name, compensation=GRAVITY if is_compensated(self.job, machine) else "",
            left_out=self.left_out, upright=stands(self.job), stepover_share=stepover_share(self.job),
        )  # fmt: skip
        program = sample(trajectory, self.machine, placed.placement.transform, placed.component, source)
        program = with_process(program, trajectory, self.toolpath)
        if self.job.output.compensation == PROCESS:
            program = with_process_force(program, trajectory, self.toolpath, machine.cutting_force)
        write_csv(program, file)
        return program
