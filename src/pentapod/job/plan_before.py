"""PlanBefore: what of an earlier run is kept when its part is found elsewhere: leans, component, time laws."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pentapod.base.archives import check_array, read_arrays
from pentapod.base.arrays import Floats
from pentapod.base.errors import InputError
from pentapod.base.units import to_si
from pentapod.base.values import Value
from pentapod.geometry.rigid import RigidTransform
from pentapod.job.artefacts import ARRAYS, PROGRAM
from pentapod.job.plan_arrays import (
    GUIDES,
    JOB_FILE,
    LAW_NAMES,
    PIECE_STARTS,
    PLACEMENT,
    PROFILE_FORMS,
    WAYPOINTS,
    profile_of,
)
from pentapod.job.run_folder import check_run
from pentapod.kinematics.component import Component
from pentapod.kinematics.robot import Branch
from pentapod.machine.clearance.collision_world import CollisionWorld
from pentapod.machine.machine import Machine
from pentapod.planning import PlacedPath, Placement
from pentapod.planning.limits.limit import LimitKind
from pentapod.planning.limits.margins import Margins
from pentapod.planning.plan import PlacementOptions
from pentapod.planning.problem.weights import NEEDED_MARGIN
from pentapod.program.csv import read_header
from pentapod.program.program import Provenance
from pentapod.timing.reuse import TimeLaws
from pentapod.timing.time_law.motion_law import MotionLaw
from pentapod.toolpath.formats import read_toolpath
from pentapod.toolpath.toolpath import Toolpath

CHOSEN = "where the part was found; leans of the plan before"
SAME_PATH = 1e-9
"""Metres by which a toolpath may differ from that of the plan before."""

_FORMS: dict[str, tuple[str, tuple[int | None, ...]]] = {
    PLACEMENT: ("f", (4, 4)),
    "placed.component": ("i", (2,)),
    "placed.axes": ("f", (None, 3)),
    "placed.tips_mm": ("f", (None, 3)),
    PIECE_STARTS: ("f", (None,)),
    **PROFILE_FORMS,
    LAW_NAMES[0]: ("i", (None,)),
    **dict.fromkeys(LAW_NAMES[1:], ("f", (None,))),
}
"""Arrays of plan.npz: kinds of numbers, as NumPy names them, and shapes."""


@dataclass(frozen=True, eq=False)
class PlanBefore(Value):
    """A run whose part is found elsewhere. job_file: of the run; placement: workpiece → machine.

    tips, axes (N, 3): of the tool, workpiece frame, axes unit. toolpath: as it was made.
    made_from: what the header of its program says.
    """

    job_file: Path
    placement: RigidTransform
    component: Branch
    tips: Floats
    axes: Floats
    laws: TimeLaws
    toolpath: Toolpath
    made_from: Provenance

    @classmethod
    def of(cls, folder: Path) -> PlanBefore:
        """Return the run in a folder. Raises InputError where there is none, or one without a program."""
        file = folder / ARRAYS
        if not file.is_file():
            remedy = "pentapod plan JOB.toml -o DIR"
            raise InputError("there is no run in this folder", file=folder, expected=ARRAYS, remedy=remedy)
        check_run(folder)
        arrays = read_arrays(file, (), InputError, optional=(JOB_FILE, WAYPOINTS, GUIDES, *_FORMS))
        for key, what in ((WAYPOINTS, "one of several set-ups"), (GUIDES, "a machine with guides")):
            if key in arrays:
                raise InputError(f"a run of {what} is planned anew", file=folder, remedy="pentapod plan --placement")
        missing = [name for name in (JOB_FILE, *_FORMS) if name not in arrays]
        if missing:
            raise InputError(
                "the run has no program, or is of an older version", file=file, key=missing[0],
                remedy="plan the job again",
            )  # fmt: skip
        for name, form in _FORMS.items():
            check_array(arrays[name], name, file, InputError, *form)
        matrix = arrays[PLACEMENT].copy()
        matrix[:3, 3] = to_si(matrix[:3, 3], "mm")
        placement = RigidTransform.from_matrix(matrix)
        back = placement.inverse()
        w, s = (int(sign) for sign in arrays["placed.component"])
        tips, axes = back.apply(to_si(arrays["placed.tips_mm"], "mm")), back.rotate(arrays["placed.axes"])
        job = folder / str(arrays[JOB_FILE])
        made_from, toolpath = read_header(folder / PROGRAM).provenance, read_toolpath(file, "npz")
        return cls(job, placement, Component(w, s), tips, axes, _laws(arrays), toolpath, made_from)

    def placed(
        self,
        toolpath: Toolpath,
        machine: Machine,
        placement: RigidTransform,
        world: CollisionWorld,
        limits: tuple[LimitKind, ...],
    ) -> PlacedPath | None:
        """Return the toolpath at a placement with its leans; None where it is another path, or a margin is short."""
        centres = self.tips + toolpath.tilt_centre * self.axes
        if centres.shape != toolpath.tips.shape or np.abs(centres - toolpath.tilt_centres).max() > SAME_PATH:
            return None
        tips, axes = placement.apply(self.tips), placement.rotate(self.axes)
        margins = Margins.of(machine, self.component, world, limits)
        values = margins(tips, axes, placement)
        if not values.min() >= NEEDED_MARGIN:
            return None
        chosen = Placement(placement, CHOSEN)
        return PlacedPath(toolpath, chosen, self.component, tips, axes, values, margins.limits)

    def kept(self, toolpath: Toolpath, machine: Machine, options: PlacementOptions) -> PlacedPath | None:
        """Return `placed` at the one placement that options allow; None where there is another choice."""
        poses = options["constraints"].poses
        if len(poses) != 1 or options["component"] not in (None, self.component):
            return None
        return self.placed(toolpath, machine, poses[0], options["collision_world"], tuple(options["limits"]))


def _laws(arrays: dict[str, NDArray[Any]]) -> TimeLaws:
    counts, *values = (arrays[name] for name in LAW_NAMES)
    ends = np.cumsum(counts)
    inner = np.cumsum(counts - 1)
    knots = (values[0], to_si(values[1], "mm"), to_si(values[2], "mm_s"))
    times, stations, speeds = (np.split(value, ends[:-1]) for value in knots)
    accelerations, jerks = (np.split(value, inner[:-1]) for value in values[3:])
    laws = tuple(MotionLaw(*each) for each in zip(times, stations, speeds, accelerations, jerks, strict=True))
    return TimeLaws(laws, arrays[PIECE_STARTS], profile_of(arrays))
