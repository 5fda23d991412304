"""The tables of a machine file, made from the keys that the parts of a machine declare beside their fields.

Values are as in the file: millimetre, degree, mm/min, the unit in the key's name.
"""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, create_model

from pentapod.base.keys import declared
from pentapod.base.tables import Positive, Table, extended, table_of
from pentapod.machine.drives import Drives, Masses
from pentapod.machine.families import OfFamily
from pentapod.machine.fields import FIVE_PAIRS, LEGS, PER_LEG
from pentapod.machine.parts import Bodies, ControllerSettings, JointLimits, LegLimits, WorkVolume
from pentapod.machine.tool_limits import ToolLimits


class GuidesTable(Table):
    """Guides of a reconfigurable machine: the base joints are set along them before a program runs."""

    direction: FIVE_PAIRS = Field(
        default=[[0.0, 1.0]] * LEGS,
        description="of each guide in the base plane, unit [x, y]; [0, 0] for a fixed joint",
    )
    least_mm: PER_LEG = Field(default=[0.0] * LEGS, description="least slide from base_mm along it")
    greatest_mm: PER_LEG = Field(default=[0.0] * LEGS, description="greatest slide; no guides where none can move")


class ToolTable(Table):
    """The tool that the machine comes with."""

    length_mm: Positive = Field(description="from the platform line's origin (offset 0) to the tip")
    rapid_mm_min: Positive = Field(description="largest tip speed on rapids")


class JointsTable(Table):
    """How far the joints turn."""

    platform_min_deg: PER_LEG = Field(description="least angle of leg (seen from its platform joint) and tool axis")
    platform_max_deg: PER_LEG = Field(description="largest angle between leg and tool axis")


class NamedTable(Table):
    """A machine file."""

    name: Annotated[str, Field(min_length=1, pattern=r"^[\w .+-]+$")] = Field(description="what it is called")
    description: str = Field(default="", description="one sentence")
    geometry: OfFamily
    guides: GuidesTable = Field(default_factory=GuidesTable, description="on which base joints can be set, if they can")


PARTS: dict[str, type] = {
    "legs": LegLimits,
    "joints": JointLimits,
    "bodies": Bodies,
    "tool": ToolLimits,
    "controller": ControllerSettings,
    "work": WorkVolume,
    "drives": Drives,
    "masses": Masses,
}
"""The parts of a machine whose keys a table has, by the table's name."""

_MORE = {"tool": ToolTable, "joints": JointsTable}
_FOR_SIMULATION = {"drives": "what moves the legs, for simulation", "masses": "what the drives move, for simulation"}


def _table(name: str, part: type) -> Any:
    """Return type and field of a table; those for simulation may be left out."""
    model: Any = extended(_MORE[name].__name__, _MORE[name], part) if name in _MORE else table_of(part, Table)
    if name in _FOR_SIMULATION:
        return model, Field(default_factory=model, description=_FOR_SIMULATION[name])
    return model, ...


_TABLES: dict[str, Any] = {name: _table(name, part) for name, part in PARTS.items()}
MachineTables = create_model("MachineTables", __base__=NamedTable, __doc__=NamedTable.__doc__, **_TABLES)
"""A whole machine file."""

FILE_KEYS = {
    **{item.field: f"{table}.{item.file_key}" for table, part in PARTS.items() for item in declared(part)},
    "platform_range": "joints.platform_min_deg",
    "base": "geometry.base_mm",
    "delta": "geometry.delta",
    "offsets": "geometry.platform_mm",
    "guides": "guides.direction",
    "travel": "guides.least_mm",
    "tool_length": "tool.length_mm",
    "rapid_velocity": "tool.rapid_mm_min",
}
"""The key that sets a field of the parts of a machine."""
