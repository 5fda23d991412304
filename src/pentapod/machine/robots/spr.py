"""The 4-UPS+SPR family: four legs to a platform, a fifth in a revolute joint that decides the platform's turn."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import Field

from pentapod.base.arrays import Floats
from pentapod.base.errors import MachineError
from pentapod.kinematics.platforms.constrained import ConstrainedPlatform
from pentapod.machine.families import Family, GeometryTable
from pentapod.machine.fields import LEG_PAIRS, LIST_OF_3


class SprTable(GeometryTable):
    """Legs 1 to 4 end beside the tool axis, leg 5 on it; platform_mm: where their arms meet the tool axis."""

    beside_mm: LEG_PAIRS = Field(
        description="joints [x, y] across the tool axis, leg by leg: x towards leg 5, y along its revolute joint"
    )
    home_mm: Annotated[
        LIST_OF_3, Field(description="origin of the tool axis, tool upright, where the robot is mounted")
    ]


def platform_joints(table: Any) -> Floats:
    """Return where the legs end (5, 3) in the platform's frame, metres. Raises MachineError."""
    if table.delta is not None or table.platform_mm is None:
        raise MachineError(
            "the platform is missing", key="geometry", expected="platform_mm with five numbers, no delta"
        )
    return np.column_stack([table.si.beside, table.si.platform])


def _robot(table: Any) -> ConstrainedPlatform:
    joints = platform_joints(table)
    return ConstrainedPlatform(np.array(table.si.base), joints, "revolute leg", np.array(table.si.home))


FAMILY = Family(_robot, SprTable)
