"""The general family in machine files: platform joints anywhere along the line, forward kinematics by a quartic."""

from __future__ import annotations

from pentapod.base.errors import MachineError
from pentapod.kinematics.families.general import GeneralPentapod
from pentapod.machine.families import Family, GeometryTable


def _robot(table: GeometryTable) -> GeneralPentapod:
    if table.delta is not None:
        raise MachineError(
            "the general family has no delta",
            key="delta",
            value=table.delta,
            expected="platform_mm with five numbers",
            remedy='leave delta out, or family = "quadratic"',
        )
    if table.platform_mm is None:
        raise MachineError("the platform is missing", key="geometry", expected="platform_mm with five numbers")
    return GeneralPentapod(table.si.base, table.si.platform)


FAMILY = Family(_robot)
