"""ToolLimits: how fast tip and tool axis may change their motion, where something limits that."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Annotated

from pentapod.base.errors import MachineError
from pentapod.base.keys import Key
from pentapod.base.values import Value

_NONE = float("inf")


@dataclass(frozen=True)
class ToolLimits(Value):
    """Limits of the tool's own motion, infinite where there is none: spindles, hoses and workpieces may set them.

    max_tip_acceleration in m/s², max_tip_jerk in m/s³; max_axis_velocity in rad/s and max_axis_acceleration in rad/s²,
    of the direction of the tool axis. Raises MachineError: not positive.
    """

    max_tip_acceleration: Annotated[
        float, Key("mm_s2", "largest acceleration of the tip; of machine and job the smaller", gt=0.0)
    ] = _NONE
    max_tip_jerk: Annotated[float, Key("mm_s3", "largest jerk of the tip; of machine and job the smaller", gt=0.0)] = (
        _NONE
    )
    max_axis_velocity: Annotated[
        float, Key("deg_s", "largest angular velocity of the tool axis; of machine and job the smaller", gt=0.0)
    ] = _NONE
    max_axis_acceleration: Annotated[
        float, Key("deg_s2", "largest angular acceleration of the tool axis; of machine and job the smaller", gt=0.0)
    ] = _NONE

    def __post_init__(self) -> None:
        for name, value in self.given(all_fields=True).items():
            if not value > 0.0:
                raise MachineError("must be positive", key=name, value=value)

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
        return self.max_tip_acceleration < _NONE

    @property
    def limits_tip_jerk(self) -> bool:
        """Whether the tip's jerk is limited."""
        return self.max_tip_jerk < _NONE

    @property
    def limits_axis_acceleration(self) -> bool:
        """Whether the axis's angular acceleration is limited."""
        return self.max_axis_acceleration < _NONE

    @property
    def limits_axis(self) -> bool:
        """Whether the axis's angular velocity or acceleration is limited."""
        return self.limits_axis_acceleration or self.max_axis_velocity < _NONE
