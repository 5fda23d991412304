"""The table [process] of a job file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from pentapod.base.keys import Key
from pentapod.base.tables import table_of


@dataclass(frozen=True, kw_only=True)
class ProcessKeys:
    """Spindle, coolant, tool and laser. A key counts instead of what a toolpath file says; 0 or "off" says none."""

    spindle_rpm: Annotated[
        float | None, Key("", "turns a minute of the spindle, from start to end (S, M3, M5)", ge=0.0, le=1_000_000.0)
    ] = None
    coolant: Annotated[
        Literal["off", "mist", "flood", "both"] | None, Key("", "coolant, from start to end (M7, M8, M9)")
    ] = None
    tool_number: Annotated[int | None, Key("", "number of the tool in the changer (T, M6)", ge=0, le=99_999_999)] = None
    laser_power: Annotated[
        float | None,
        Key("", "share of the laser's full power while cutting, 0 to 1, on top of that of a picture", ge=0.0, le=1.0),
    ] = None


ProcessTable = table_of(ProcessKeys)
