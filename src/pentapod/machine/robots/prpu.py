"""The 5-UPS+PRPU family: five legs to a platform, and a passive limb on a rail that decides the platform's turn."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import Field

from pentapod.base.errors import MachineError
from pentapod.kinematics.platforms.constrained import ConstrainedPlatform
from pentapod.machine.bars import PassiveLimb
from pentapod.machine.families import Family
from pentapod.machine.fields import LEG_PAIRS, LIST_OF_2
from pentapod.machine.robots.spr import SprTable, platform_joints


class PrpuTable(SprTable):
    """All legs end beside the tool axis; platform_mm: where their arms meet it. The passive limb ends on the axis."""

    beside_mm: LEG_PAIRS = Field(
        description="joints [x, y] across the tool axis, leg by leg: x against the rail's direction, y across it, "
        "tool upright"
    )
    rail_direction: Annotated[LIST_OF_2, Field(description="direction [x, y] of the rail in the base plane")]
    rail_origin_mm: Annotated[LIST_OF_2, Field(description="point [x, y] of the rail where its carriage is at 0")]
    rail_travel_mm: Annotated[LIST_OF_2, Field(description="least and greatest position of the carriage")]
    strut_mm: Annotated[LIST_OF_2, Field(description="least and greatest length of the strut, rail to universal joint")]
    strut_joint_mm: float = Field(description="place of the strut's universal joint along the tool axis")
    strut_angle_deg: Annotated[LIST_OF_2, Field(description="least and greatest angle between strut and tool axis")]
    strut_diameter_mm: float = Field(gt=0.0, description="diameter of the strut, a cylinder with round ends")


def _robot(table: Any) -> ConstrainedPlatform:
    if not np.hypot(*table.rail_direction) > 0.0:
        raise MachineError("no direction", key="rail", value=table.rail_direction, expected="[x, y], not both 0")
    joints, home = platform_joints(table), np.array(table.si.home)
    return ConstrainedPlatform(np.array(table.si.base), joints, "universal joint", home, table.rail_direction)


def _limb(table: Any) -> PassiveLimb:
    si, rail = table.si, np.array([*table.rail_direction, 0.0])
    return PassiveLimb(
        rail=rail / np.linalg.norm(rail),
        origin=np.array([*si.rail_origin, 0.0]),
        joint=si.strut_joint,
        carriage=si.rail_travel,
        strut=si.strut,
        joint_range=si.strut_angle,
        radius=0.5 * si.strut_diameter,
    )


FAMILY = Family(_robot, PrpuTable, limb=_limb)
