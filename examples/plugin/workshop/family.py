"""A robot family: platform joints anywhere along the line, not at heights proportional to the base."""

from __future__ import annotations

from typing import Any

from pentapod.base.errors import MachineError
from pentapod.kinematics import GeneralPentapod
from pentapod.machine.families import Family


def _robot(table: Any) -> GeneralPentapod:
    if table.si.platform is None:
        raise MachineError("the platform is missing", key="offsets", expected="platform_mm with five numbers")
    return GeneralPentapod(table.si.base, table.si.platform)


FAMILY = Family(_robot)
