"""PlannedRun: a run as its set-up sheet shows it, from an outcome or read back from a folder."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.values import Value
from pentapod.cutters.tool import Tool
from pentapod.geometry.polyline import arc_length
from pentapod.geometry.rigid import RigidTransform
from pentapod.job.build.tool import job_tool
from pentapod.job.build.values import is_compensated
from pentapod.job.outcome import Outcome
from pentapod.job.schema.job import Job
from pentapod.machine.machine import Machine
from pentapod.mesh.mesh import Mesh
from pentapod.planning.placement.placed_path import PlacedPath
from pentapod.program.commands import counted
from pentapod.program.program import Program
from pentapod.report.drawings.held import Held, held_at
from pentapod.timing.time_law.trajectory import Trajectory
from pentapod.toolpath.toolpath import Toolpath

UPRIGHT = 5e-5
"""Radians up to which a part counts as not tilted."""

_RUNS: WeakKeyDictionary[PlacedPath, tuple[tuple[Any, ...], PlannedRun]] = WeakKeyDictionary()
"""The run of each placed path that is in use, with the other things of its outcome."""


@dataclass(frozen=True, eq=False)
class Pose(Value):
    """The machine at a pose of the tool: tip, axis (3,), machine frame; legs (n_legs,) as drives count. Metres."""

    tip: Floats
    axis: Floats
    legs: Floats


@dataclass(frozen=True, eq=False)
class Stand(Value):
    """How the part stands: the direction of the mesh (3,) that is nearest to upwards, and how far it leans.

    lean: radians. azimuth: radians from the machine's x towards its y, where it leans to. turn: that of the mesh's x
    axis in plan, of its y axis where x stands upright; turned: which of them.
    """

    up: Floats
    lean: float
    azimuth: float
    turn: float
    turned: str

    @property
    def is_tilted(self) -> bool:
        """Whether the part needs a wedge, or a rest of its own."""
        return self.lean > UPRIGHT


@dataclass(frozen=True, eq=False)
class PlannedRun(Value):
    """A run whose part has a place, metres.

    machine: with its guides as in the program. placement: workpiece → machine. tips, axes (N, 3): of the waypoints,
    machine frame. program: None where the job was refused later. clock: times (T,) and stations (T,) along the tip's
    path, of the time law; None where there is none. margin: the smallest.
    """

    job: Job
    machine: Machine
    mesh: Mesh
    tool: Tool
    toolpath: Toolpath
    placement: RigidTransform
    tips: Floats
    axes: Floats
    program: Program | None = None
    clock: tuple[Floats, Floats] | None = None
    margin: float | None = None

    @staticmethod
    def of(outcome: Outcome) -> PlannedRun | None:
        """Return the run of an outcome; None where its part has no place. Of the same outcome it is the same."""
        placed, mesh, toolpath = outcome.find(PlacedPath), outcome.find(Mesh), outcome.find(Toolpath)
        if placed is None or mesh is None or toolpath is None:
            return None
        law, program = outcome.find(Trajectory), outcome.find(Program)
        job, machine = outcome.job, outcome.machine
        about = (job, machine, mesh, toolpath, law, program)
        known, run = _RUNS.get(placed, ((), None))
        if run is None or any(one is not other for one, other in zip(about, known, strict=True)):
            run = PlannedRun(
                job, machine, mesh, job_tool(job, machine), toolpath, placed.placement.transform, placed.tips,
                placed.axes, program, None if law is None else (law.profile.times, law.profile.stations),
                placed.smallest_margin,
            )  # fmt: skip
            _RUNS[placed] = about, run
        return run

    @property
    def hangs(self) -> bool:
        """Whether the base is above the work, so that the machine's z points down."""
        return bool(self.machine.work.centre[2] > 0.0)

    @property
    def upwards(self) -> Floats:
        """The direction (3,) of up, machine frame."""
        return np.array([0.0, 0.0, -1.0 if self.hangs else 1.0])

    @cached_property
    def vertices(self) -> Floats:
        """The mesh's vertices (V, 3), machine frame."""
        return self.placement.apply(self.mesh.vertices)

    @cached_property
    def held(self) -> Held | None:
        """The fixture or table."""
        return held_at(self.job, self.placement)

    @property
    def table(self) -> float | None:
        """Height z of the table's surface, where the job names it; metres."""
        keys = self.job.placement
        return 1e-3 * keys.table_z_mm if keys.mode == "table" else None

    @property
    def lowest(self) -> float:
        """Height z of the part's lowest point; metres."""
        z = self.vertices[:, 2]
        return float(z.max() if self.hangs else z.min())

    @cached_property
    def stand(self) -> Stand:
        """How the part stands."""
        rotation, upwards = self.placement.rotation, self.upwards
        given = np.asarray(self.job.placement.up, dtype=np.float64)
        if self.job.placement.mode == "table":
            up = given / np.linalg.norm(given)
        else:
            along = rotation.T @ upwards
            axis = int(np.abs(along).argmax())
            up = np.sign(along[axis]) * np.eye(3)[axis]
        there = rotation @ up
        lean = float(np.arctan2(np.linalg.norm(np.cross(there, upwards)), there @ upwards))
        plan = np.linalg.norm(rotation[:2], axis=0)
        turned = 0 if plan[0] > 0.5 else 1
        turn = float(np.arctan2(rotation[1, turned], rotation[0, turned]))
        return Stand(up, lean, float(np.arctan2(there[1], there[0])), turn, "xyz"[turned])

    @cached_property
    def first(self) -> Pose:
        """The first pose: of the program, else of the toolpath."""
        return self._row(0)

    @cached_property
    def last(self) -> Pose:
        """The last pose."""
        return self._row(-1)

    @cached_property
    def home(self) -> Pose:
        """The tool upright in the middle of the work volume, tip there."""
        return self.pose(self.machine.work.centre, self.upwards)

    @cached_property
    def park(self) -> Pose | None:
        """Where the machine waits; None where its file does not say so."""
        park = self.machine.park.pose
        return None if park is None else self.pose(*park)

    def pose(self, tip: Floats, axis: Floats) -> Pose:
        """Return the pose with a tip and a tool axis (3,), machine frame."""
        return Pose(tip, axis, self.counted(tip[None], axis[None])[0])

    def counted(self, tips: Floats, axes: Floats) -> Floats:
        """Return what drives count (N, n_legs) at rest with tips and tool axes (N, 3), machine frame; metres."""
        position = tips + self.machine.tool_length * axes
        return counted(self.machine, position, -axes, loaded=is_compensated(self.job, self.machine))

    @cached_property
    def segment_times(self) -> Floats | None:
        """Seconds (S,) that each segment of the toolpath takes, stops included; None without a program."""
        if self.clock is None or self.program is None:
            return None
        times, stations = self.clock
        travelled = arc_length(self.tips)
        starts = travelled[self.toolpath.starts] * (stations[-1] / travelled[-1] if travelled[-1] > 0.0 else 0.0)
        at = np.interp(starts, stations, times)
        at[0], at[-1] = 0.0, self.program.duration
        return np.diff(at)

    def _row(self, row: int) -> Pose:
        if self.program is None:
            return self.pose(self.tips[row], self.axes[row])
        (position,), (direction,) = self.machine.robot.pose(self.program.legs[row][None], self.program.component)
        return self.pose(position + self.machine.tool_length * direction, -direction)
