"""The pentakins family: base joints anywhere in space, platform joints on rings around the tool axis."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from pentapod.base.errors import MachineError
from pentapod.kinematics.families.ringed import RingedPentapod
from pentapod.machine.families import Family, GeometryTable
from pentapod.machine.fields import LEG_POINTS, LIST_OF_3, PER_LEG


class PentakinsTable(GeometryTable):
    """The geometry of LinuxCNC's pentakins; platform_mm: where the planes of the rings meet the tool axis."""

    base_mm: LEG_POINTS = Field(description="base joints [x, y, z], leg by leg")
    ring_mm: PER_LEG = Field(description="radii of the rings on which the legs end; 0 is a joint on the tool axis")
    home_mm: Annotated[
        LIST_OF_3, Field(description="origin of the tool axis, tool along +z, where the machine can stand at home")
    ]


def _robot(table: Any) -> RingedPentapod:
    if table.delta is not None or table.platform_mm is None:
        raise MachineError(
            "the platform is missing", key="geometry", expected="platform_mm with five numbers, no delta"
        )
    return RingedPentapod(table.si.base, table.si.platform, table.si.ring, table.si.home)


FAMILY = Family(_robot, PentakinsTable)
