"""Schema of the job file: every key with its unit, meaning, default and range, stated once.

Keys of strategies, cutters, regions, orientations, gouges and tool limits are declared there, beside the SI fields that
they set (`Key`); all others here. Parser, error messages, `pentapod new` and the reference are made from them. Units
are in the names; values are as in the file (mm, degrees, mm/min), and in SI at `table.si`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, cast

from pydantic import Field, model_validator

from pentapod.base.tables import Positive, Table, Vector, extended, wrong
from pentapod.job.schema.placement import FixtureTable, PlacementTable
from pentapod.job.schema.strategies import ToolpathTable, strategy_table
from pentapod.job.schema.tool import AnyTool, tool_table
from pentapod.machine.tool_limits import ToolLimits
from pentapod.mesh.region import Region
from pentapod.toolpath.axis.orientation import Orientation
from pentapod.toolpath.gouge.report import GougeOptions


class MeshTable(Table):
    """The workpiece: its mesh, and which side of it is machined."""

    mesh: str = Field(
        min_length=1,
        description="mesh file (.stl, .ply, .obj); relative to this job file, ${VARIABLE} is expanded",
    )
    unit: Literal["mm", "cm", "m", "inch"] | None = Field(
        default=None, description="unit of the numbers in the mesh file: compulsory, for no format says it"
    )
    scale: Positive = Field(default=1.0, description="factor applied to the mesh after its unit")
    repair: bool = Field(
        default=False,
        description="turn facets so that all are wound alike (doubled or empty ones are left out anyway, and told)",
    )

    @model_validator(mode="after")
    def _region(self) -> MeshTable:
        box = self.si.region_box
        if box is not None and (box[0] == box[1]).any():
            wrong("region_box_mm", "the box is flat", "corners that differ in x, y and z")
        if not any(self.si.region_direction):
            wrong("region_direction", "the direction is zero", "a direction such as [0, 0, 1]")
        return self


if TYPE_CHECKING:
    PartTable = MeshTable
else:
    PartTable = extended("PartTable", MeshTable, Region)


class MachineTable(Table):
    """The machine: one that ships, by name, or a machine file."""

    name: str | None = Field(default=None, min_length=1, description='a shipped machine, such as "desk"')
    file: str | None = Field(default=None, min_length=1, description="a machine file, relative to this one")

    @model_validator(mode="after")
    def _one(self) -> MachineTable:
        if (self.name is None) == (self.file is None):
            wrong("name", "name the machine once", 'either name = "desk" or file = "machine.toml"')
        return self


class ModeTable(Table):
    """Tool axis: nominal direction, tilt cone, lead and side angle, smoothing."""

    tilt_deg: float = Field(
        default=15.0,
        ge=0.0,
        le=60.0,
        description="largest angle of the tool axis to the nominal one (the normal, unless it is set below)",
    )
    mode: Literal["normal", "fixed", "toward", "from", "between"] = Field(
        default="normal",
        description='nominal axis: "normal", "fixed", "toward" or "from" a point or line, "between" given directions',
    )
    direction: Vector | None = Field(default=None, description="fixed: from the tip to the spindle, mesh frame")
    point_mm: Vector | None = Field(default=None, description="toward, from: a point, mesh frame")
    line: Vector | None = Field(default=None, description="toward, from: direction of a line through the point")
    places_mm: tuple[Vector, ...] | None = Field(default=None, description="between: where the directions hold")
    directions: tuple[Vector, ...] | None = Field(default=None, description="between: one direction for each place")

    @model_validator(mode="after")
    def _mode_keys(self) -> ModeTable:
        needed = _MODE_KEYS[self.mode]
        for key in ("direction", "point_mm", "places_mm", "directions"):
            given = getattr(self, key) is not None
            if given != (key in needed):
                what = "missing for" if not given else "means nothing for"
                wrong(key, f'{what} axis mode "{self.mode}"', ", ".join(needed) or "none of these keys")
        if self.line is not None and self.mode not in ("toward", "from"):
            wrong("line", f'means nothing for axis mode "{self.mode}"', 'mode = "toward" or "from"')
        for key in ("direction", "line"):
            if getattr(self, key) is not None and not any(getattr(self, key)):
                wrong(key, "the direction is zero", "a direction such as [0, 0, 1]")
        if self.places_mm is not None and len(self.places_mm) != len(self.directions or ()):
            wrong("directions", "as many directions as places are needed", f"{len(self.places_mm)} directions")
        return self


if TYPE_CHECKING:
    AxisTable = ModeTable
else:
    AxisTable = extended("AxisTable", ModeTable, Orientation)

_MODE_KEYS: dict[str, tuple[str, ...]] = {
    "normal": (),
    "fixed": ("direction",),
    "toward": ("point_mm",),
    "from": ("point_mm",),
    "between": ("places_mm", "directions"),
}


class RemedyTable(Table):
    """Gouge check: what is done where cutter, shank or holder would cut into the part."""

    remedy: tuple[Literal["tilt", "lift", "drop", "report"], ...] | None = Field(
        default=None,
        min_length=1,
        description='tried in this order: "tilt", "lift", "drop"; or "report" alone, and the verdict fails where it'
        ' gouges; when left out "drop", for a toolpath from a file "report"',
    )


if TYPE_CHECKING:
    GougeTable = RemedyTable
else:
    GougeTable = extended("GougeTable", RemedyTable, GougeOptions)


class SpeedTable(Table):
    """Feed rates of the tool tip, exact stops, and limits of tip and tool axis in addition to the machine's."""

    cut_mm_min: Positive = Field(le=100_000.0, description="feed while cutting")
    link_mm_min: Positive | None = Field(
        default=None, le=100_000.0, description="feed of approaches and links; the cutting feed when left out"
    )
    lowest_share: float | None = Field(
        default=None,
        ge=0.0,
        le=1.0,
        description="share of the feed that cuts and links must reach where no limit of machine or job is active; "
        "below it the verdict fails. 0.9 when left out, 0.95 for laser and spray; 0 asks for none",
    )
    dwell_s: float | None = Field(
        default=None,
        ge=0.0,
        le=3600.0,
        description="dwell in an exact stop at the end of each cut; no stop when left out",
    )
    stop_angle_deg: float = Field(
        default=135.0,
        gt=0.0,
        le=180.0,
        description="exact stop at corners where the toolpath turns by more; other corners are blended",
    )


if TYPE_CHECKING:
    FeedTable = SpeedTable
else:
    FeedTable = extended("FeedTable", SpeedTable, ToolLimits)


class ToleranceTable(Table):
    """Tolerances of the path, of the tool axis and of the material left."""

    chordal_mm: Positive = Field(default=0.01, description="between the waypoints' chords and the mesh")
    path_mm: Positive = Field(
        default=0.02,
        description="between the motion of the tool's tilt centre (a ball's centre, a beam's spot) and the toolpath",
    )
    axis_deg: float = Field(
        default=0.5,
        gt=0.0,
        le=10.0,
        description="largest angle by which the axis may leave the tilt cone between waypoints",
    )
    left_mm: Positive | None = Field(
        default=None,
        description="material above the surface that counts as none; for a stand-off tool, distance from its lines;"
        " when left out, a ridge (half a stepover) and a quarter, and chordal_mm and path_mm",
    )
    left_share: float = Field(
        default=0.001,
        ge=0.0,
        le=1.0,
        description="share of the region's area, 0 to 1, on which more may be left where the cutter can reach",
    )


class OutputTable(Table):
    """Sampling of the program; the machine's controller settings when left out."""

    period_ms: Positive | None = Field(default=None, ge=0.1, le=100.0, description="time between rows")
    interpolation: Literal["linear", "cubic"] | None = Field(
        default=None, description="how the controller moves between rows"
    )


class VerifyTable(Table):
    """Claims that the verdict may waive."""

    waive: tuple[str, ...] = Field(default=(), description="claims that may stay unjudged without failing the verdict")


class JobTables(Table):
    """All tables of a job file, in the order of the flow."""

    part: PartTable
    machine: MachineTable = Field(default=MachineTable(name="desk"))
    tool: AnyTool
    toolpath: ToolpathTable
    axis: AxisTable = Field(default=AxisTable())
    gouge: GougeTable = Field(default=GougeTable())
    feed: FeedTable
    tolerance: ToleranceTable = Field(default=ToleranceTable())
    placement: PlacementTable = Field(default=PlacementTable())
    fixture: FixtureTable = Field(default=FixtureTable())
    output: OutputTable = Field(default=OutputTable())
    verify: VerifyTable = Field(default=VerifyTable())

    @model_validator(mode="after")
    def _leaning(self) -> JobTables:
        if self.tool.type in ("bull", "flat") and self.axis.tilt_deg > 0.0:
            wrong("axis.tilt_deg", f'a tool of type "{self.tool.type}" cannot lean without digging in', "tilt_deg = 0")
        return self


def table_model(name: str, strategy: str = "raster", tool: str = "ball") -> type[Table]:
    """Return the model of a table of job files. strategy: whose keys [toolpath] has; tool: type whose keys [tool] has.

    Raises KeyError: no such table.
    """
    if name == "toolpath":
        return strategy_table(strategy)
    return tool_table(tool) if name == "tool" else cast("type[Table]", JobTables.model_fields[name].annotation)
