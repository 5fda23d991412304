"""The quadratic family in machine files: platform offsets z_3 + delta (x_i − x_3)."""

from __future__ import annotations

from pentapod.base.errors import MachineError
from pentapod.kinematics.families.quadratic import LinearPentapod
from pentapod.machine.families import Family, GeometryTable

OFFSET_TOLERANCE_M = 1e-6  # offsets in a file are rounded; beyond a micrometre they mean another machine


def _robot(table: GeometryTable) -> LinearPentapod:
    base = table.si.base
    if table.platform_mm is None:
        if table.delta is None:
            raise MachineError(
                "the platform is missing", key="geometry", expected="delta, or platform_mm with five numbers"
            )
        return LinearPentapod.quadratic(base, table.delta)
    try:
        return LinearPentapod.from_offsets(base, table.si.platform, table.delta, tolerance=OFFSET_TOLERANCE_M)
    except MachineError as error:
        if table.delta is not None or error.key != "offsets":
            raise
        raise MachineError(
            f"not of the quadratic family, platform offsets z_3 + delta (x_i − x_3); {error.what}",
            key="offsets",
            value=error.value,
            expected=error.expected,
            remedy='family = "general" takes any platform_mm',
        ) from error


FAMILY = Family(_robot)
