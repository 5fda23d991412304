"""The tables of a machine file as models, made from the keys that its parts declare beside their fields."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, create_model

from pentapod.base.arrays import Floats
from pentapod.base.keys import Key, declared
from pentapod.base.tables import TomlTable, extended, table_of
from pentapod.machine.drives import DriveForces, Drives, Masses
from pentapod.machine.families import OfFamily
from pentapod.machine.fields import LEG_PAIRS, PER_LEG, each_leg
from pentapod.machine.leg_model import LegModel
from pentapod.machine.parts import (
    Bodies,
    ControllerSettings,
    Guard,
    JointLimits,
    JointStiffness,
    LegLimits,
    LegStiffness,
    Park,
    ToolLimits,
    WorkVolume,
)


@dataclass(frozen=True, eq=False)
class GuideKeys:
    """Guides of a reconfigurable machine: the base joints are set along them before a program runs."""

    direction: Annotated[
        Floats,
        Key("", "direction of each guide in the base plane, unit [x, y]; [0, 0] for a fixed joint", kind=LEG_PAIRS),
    ] = field(default_factory=each_leg([0.0, 1.0]))
    least: Annotated[Floats, Key("mm", "least position on the guide, from base_mm", kind=PER_LEG)] = field(
        default_factory=each_leg(0.0)
    )
    greatest: Annotated[
        Floats, Key("mm", "greatest position on the guide; where no joint can move there are no guides", kind=PER_LEG)
    ] = field(default_factory=each_leg(0.0))


@dataclass(frozen=True, eq=False)
class PlatformJointKeys:
    """The angles of the platform joints: `JointLimits.platform_range`."""

    platform_min: Annotated[
        Floats, Key("deg", "least angle between leg (seen from its platform joint) and tool axis", kind=PER_LEG)
    ]
    platform_max: Annotated[Floats, Key("deg", "largest angle between leg and tool axis", kind=PER_LEG)]


@dataclass(frozen=True)
class MachineToolKeys:
    """The tool that the machine comes with."""

    tool_length: Annotated[
        float, Key("mm", "distance from the platform line's origin (offset 0) to the tip", "length", gt=0.0)
    ]
    rapid_velocity: Annotated[float, Key("mm_min", "largest tip speed on rapids", "rapid", gt=0.0)]


@dataclass(frozen=True)
class CalibrationKeys:
    """The machine as it was measured. Without it the machine counts as built exactly as designed."""

    file: Annotated[
        Path | None, Key("", "calibration file, relative to this file: programs are for the geometry in it", kind=Path)
    ] = None


PARTS: dict[str, tuple[type, ...]] = {
    "calibration": (CalibrationKeys,),
    "guides": (GuideKeys,),
    "legs": (LegLimits, LegStiffness),
    "leg_model": (LegModel,),
    "joints": (JointLimits, PlatformJointKeys, JointStiffness),
    "bodies": (Bodies,),
    "tool": (MachineToolKeys, ToolLimits),
    "controller": (ControllerSettings,),
    "work": (WorkVolume,),
    "park": (Park,),
    "guard": (Guard,),
    "drives": (Drives, DriveForces),
    "masses": (Masses,),
}
"""The dataclasses whose keys a table has, by the table's name."""


class NamedTable(TomlTable):
    """A machine file."""

    name: Annotated[str, Field(min_length=1, pattern=r"^[\w .+-]+$")] = Field(description="name of the machine")
    description: str = Field(default="", description="one sentence")
    geometry: OfFamily


def _table(first: type, *more: type) -> Any:
    """Return type and field of the table of some dataclasses; it may be left out where all its keys have defaults."""
    model: Any = table_of(first, TomlTable)
    for part in more:
        model = extended(model.__name__, model, part)
    needed = any(item.is_needed for part in (first, *more) for item in declared(part))
    return model, ... if needed else Field(default_factory=model)


_TABLES: dict[str, Any] = {name: _table(*parts) for name, parts in PARTS.items()}
MachineTables = create_model("MachineTables", __base__=NamedTable, __doc__=NamedTable.__doc__, **_TABLES)
"""A whole machine file."""

FILE_KEYS = {
    **{
        item.field: f"{table}.{item.file_key}"
        for table, parts in PARTS.items()
        for part in parts
        for item in declared(part)
    },
    "platform_range": "joints.platform_min_deg",
    "base": "geometry.base_mm",
    "delta": "geometry.delta",
    "offsets": "geometry.platform_mm",
    "home": "geometry.home_mm",
    "rail": "geometry.rail_direction",
    "carriage": "geometry.rail_travel_mm",
    "strut": "geometry.strut_mm",
    "joint_range": "geometry.strut_angle_deg",
    "guides": "guides.direction",
    "travel": "guides.least_mm",
}
"""The key of a machine file by the field that an error names."""
