"""Specification: everything that a program is judged against."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Required, TypedDict

import numpy as np

from pentapod.base.errors import ArrayError
from pentapod.base.values import Value
from pentapod.machine.machine import Machine
from pentapod.toolpath.toolpath import Toolpath
from pentapod.verify.verdict.cutting import Cutting
from pentapod.verify.verdict.verdict import NO_SOURCES, Sources

if TYPE_CHECKING:
    from pentapod.kinematics.component import Component
    from pentapod.machine.clearance.collision_world import CollisionWorld
    from pentapod.planning.problem.constraints import PlacementConstraints


@dataclass(frozen=True, eq=False)
class Specification(Value):
    """What a program is judged against. A field that is None is not given: claims that need it are not judged.

    machine: with its tool length and controller. toolpath: in the workpiece frame, as the job asks for it. tilt: half
    angle in radians of the cone about the nominal axis in which the tool may tilt; axis_tolerance: radians beyond that;
    path_tolerance: metres. job_digest: of the job that the header must name. collision_world: what legs, spindle and
    tool must not touch. cutting: what cuts, and into which part. constraints: the allowed placements. component: in
    which the program must be; None where any is allowed. compensation: the loads that drives must compensate
    for, "gravity", "process" (gravity, and the machine's cutting force against the motion on cuts) or "" for nothing;
    None where any is allowed. deflection: largest of the tip, metres; None where it is only
    told. lowest_share: of the feed, that cuts and links must reach where no limit is used; None for the default of the
    tool, 0 for no lowest feed. stop_angle: radians; where the toolpath turns by more the program may stop, as it may
    from 20 degrees on. setups: largest number of programs into which the job may be split; missed: number of intervals
    of the whole toolpath that are cut in none of them, or in more than one; None where the others are not known.
    waived: names of claims without which the verdict may pass where they cannot be judged. sources: its files.
    Raises ArrayError where a tolerance is not a positive number.
    """

    machine: Machine
    toolpath: Toolpath
    tilt: float
    path_tolerance: float
    axis_tolerance: float
    job_digest: str | None = None
    collision_world: CollisionWorld | None = None
    cutting: Cutting | None = None
    constraints: PlacementConstraints | None = None
    component: Component | None = None
    compensation: str | None = None
    deflection: float | None = None
    lowest_share: float | None = None
    stop_angle: float | None = None
    setups: int = 1
    missed: int | None = None
    waived: tuple[str, ...] = ()
    sources: Sources = NO_SOURCES

    def __post_init__(self) -> None:
        for name in ("tilt", "path_tolerance", "axis_tolerance"):
            value = getattr(self, name)
            if not (np.isfinite(value) and (value >= 0.0 if name != "path_tolerance" else value > 0.0)):
                raise ArrayError("must be a positive number", key=name, value=value)
        if self.deflection is not None and not self.deflection > 0.0:
            raise ArrayError("must be a positive number", key="deflection", value=self.deflection)
        if self.lowest_share is not None and not 0.0 <= self.lowest_share <= 1.0:
            raise ArrayError("must be a share", key="lowest_share", value=self.lowest_share, expected="0 to 1")
        if self.stop_angle is not None and not 0.0 < self.stop_angle <= np.pi:
            raise ArrayError("must be an angle", key="stop_angle", value=self.stop_angle, expected="above 0, at most π")


class Asked(TypedDict, total=False):
    """The fields of a `Specification` after machine and toolpath, as keywords."""

    tilt: Required[float]
    path_tolerance: Required[float]
    axis_tolerance: Required[float]
    job_digest: str | None
    collision_world: CollisionWorld | None
    cutting: Cutting | None
    constraints: PlacementConstraints | None
    component: Component | None
    compensation: str | None
    deflection: float | None
    lowest_share: float | None
    stop_angle: float | None
    setups: int
    missed: int | None
    waived: tuple[str, ...]
    sources: Sources
