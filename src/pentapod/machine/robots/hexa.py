"""The six-leg family: a linear pentapod whose platform is held against rolling by a sixth leg beside the line."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from pydantic import Field

from pentapod.base.errors import MachineError
from pentapod.kinematics.families.general import GeneralPentapod
from pentapod.kinematics.families.quadratic import LinearPentapod
from pentapod.kinematics.platforms.rolled_platform import RolledPlatform
from pentapod.kinematics.platforms.six_leg import SixLegPlatform
from pentapod.machine.families import Family, GeometryTable
from pentapod.machine.robots.quadratic import OFFSET_TOLERANCE_M


class HexaTable(GeometryTable):
    """Legs 1 to 5 end on the tool axis, leg 6 on an arm beside it; platform_mm of leg 6 is the foot of its arm.

    With delta legs 1 to 5 are of the quadratic family, without it of the general one.
    """

    arm_mm: float = Field(gt=0.0, description="length of the arm of leg 6, perpendicular to the tool axis")
    side: Literal[1, -1] = Field(default=1, description="on which side of the plane through axis and base joint 6")


def _robot(table: Any) -> RolledPlatform:
    if table.platform_mm is None:
        raise MachineError("the platform is missing", key="geometry", expected="platform_mm with six numbers")
    base, (*offsets, foot) = table.si.base, table.si.platform
    if table.delta is None:
        line = GeneralPentapod(base[:-1], np.array(offsets))
    else:
        line = LinearPentapod.from_offsets(base[:-1], offsets, table.delta, tolerance=OFFSET_TOLERANCE_M)
    return RolledPlatform(
        SixLegPlatform(line, np.array([*base[-1], 0.0]), np.array([table.si.arm, 0.0, foot])), table.side
    )


FAMILY = Family(_robot, HexaTable, n_legs=RolledPlatform.n_legs)
