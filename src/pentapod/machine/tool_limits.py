"""ToolLimits: how fast tip and tool axis may change their motion, where something limits that."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from math import radians
from typing import Protocol

from pentapod.base.errors import MachineError
from pentapod.base.values import Value


class ToolLimitKeys(Protocol):
    """The keys of a file's table that limit the tool's motion, in millimetres and degrees; None: no limit."""

    @property
    def max_tip_acceleration_mm_s2(self) -> float | None: ...  # noqa: D102 (described above)
    @property
    def max_tip_jerk_mm_s3(self) -> float | None: ...  # noqa: D102
    @property
    def max_axis_velocity_deg_s(self) -> float | None: ...  # noqa: D102
    @property
    def max_axis_acceleration_deg_s2(self) -> float | None: ...  # noqa: D102


@dataclass(frozen=True)
class ToolLimits(Value):
    """Limits of the tool's own motion, infinite where there is none: spindles, hoses and workpieces may set them.

    max_tip_acceleration in m/s², max_tip_jerk in m/s³; max_axis_velocity in rad/s and max_axis_acceleration in rad/s²,
    of the direction of the tool axis. Raises MachineError: not positive.
    """

    max_tip_acceleration: float = float("inf")
    max_tip_jerk: float = float("inf")
    max_axis_velocity: float = float("inf")
    max_axis_acceleration: float = float("inf")

    def __post_init__(self) -> None:
        for name, value in self.given(all_fields=True).items():
            if not value > 0.0:
                raise MachineError("must be positive", key=name, value=value)

    @classmethod
    def of(cls, table: ToolLimitKeys) -> ToolLimits:
        """Return the limits that a table of a machine or job file sets."""

        def metres(value: float | None) -> float:
            return float("inf") if value is None else value / 1000.0

        def angle(value: float | None) -> float:
            return float("inf") if value is None else radians(value)

        return cls(
            metres(table.max_tip_acceleration_mm_s2),
            metres(table.max_tip_jerk_mm_s3),
            angle(table.max_axis_velocity_deg_s),
            angle(table.max_axis_acceleration_deg_s2),
        )

    def given(self, *, all_fields: bool = False) -> dict[str, float]:
        """Return the limits that are set, by name; or all of them."""
        values = {item.name: float(getattr(self, item.name)) for item in dataclasses.fields(self)}
        return {name: value for name, value in values.items() if all_fields or value < float("inf")}

    def and_(self, other: ToolLimits) -> ToolLimits:
        """Return the stricter of both, limit by limit."""
        mine, theirs = self.given(all_fields=True), other.given(all_fields=True)
        return ToolLimits(**{name: min(value, theirs[name]) for name, value in mine.items()})

    @property
    def limits_tip_acceleration(self) -> bool:
        """Whether the tip's acceleration is limited."""
        return self.max_tip_acceleration < float("inf")

    @property
    def limits_tip_jerk(self) -> bool:
        """Whether the tip's jerk is limited."""
        return self.max_tip_jerk < float("inf")

    @property
    def limits_axis_acceleration(self) -> bool:
        """Whether the axis's angular acceleration is limited."""
        return self.max_axis_acceleration < float("inf")

    @property
    def limits_axis(self) -> bool:
        """Whether the axis's angular velocity or acceleration is limited."""
        return self.limits_axis_acceleration or self.max_axis_velocity < float("inf")
