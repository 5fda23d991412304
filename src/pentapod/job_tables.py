"""The tables of a job file: every key with its unit, meaning, default and range.

Documentation and `pentapod new` are generated from the descriptions here, so that there is one source of
defaults. Units are in the names; values are as in the file (mm, degrees, mm/min), not yet SI.
"""

from __future__ import annotations

from typing import Any, Literal, cast

from pydantic import Field, model_validator

from pentapod.strategy_tables import ToolpathTable
from pentapod.table import Positive, Row, Table, Vector, wrong

Pose = tuple[float, float, float, float, float, float]
Range = tuple[float, float]


class PartTable(Table):
    """The workpiece: its mesh, and which side of it is machined."""

    mesh: str = Field(
        min_length=1,
        description="mesh file (.stl, .ply, .obj); relative to this job file, ${VARIABLE} is expanded",
    )
    unit: Literal["mm", "cm", "m", "inch"] | None = Field(
        default=None, description="unit of the numbers in the mesh file: compulsory, for no format says it"
    )
    scale: Positive = Field(default=1.0, description="factor applied to the mesh after its unit")
    repair: bool = Field(default=False, description="drop doubled and degenerate facets, unify the winding")
    region_box_mm: tuple[Vector, Vector] | None = Field(
        default=None,
        description="machine only inside this box: two opposite corners, mesh frame, scaled",
    )
    region_direction: Vector = Field(
        default=(0.0, 0.0, 1.0), description="direction that the machined side faces, mesh frame"
    )
    region_angle_deg: float = Field(
        default=80.0, gt=0.0, lt=90.0, description="machine only where the normal is within this angle of it"
    )

    @model_validator(mode="after")
    def _box(self) -> PartTable:
        if self.region_box_mm is not None:
            low, high = self.region_box_mm
            if any(a == b for a, b in zip(low, high, strict=True)):
                wrong("region_box_mm", "the box is flat", "corners that differ in x, y and z")
        if not any(self.region_direction):
            wrong("region_direction", "the direction is zero", "a direction such as [0, 0, 1]")
        return self


class MachineTable(Table):
    """The machine: one that ships, by name, or a machine file."""

    name: str | None = Field(default=None, min_length=1, description='a shipped machine, such as "desk"')
    file: str | None = Field(default=None, min_length=1, description="a machine file, relative to this one")

    @model_validator(mode="after")
    def _one(self) -> MachineTable:
        if (self.name is None) == (self.file is None):
            wrong("name", "name the machine once", 'either name = "desk" or file = "machine.toml"')
        return self


class ToolTable(Table):
    """The tool: a cutter that touches the surface, or a beam or spray that keeps its distance."""

    type: Literal["ball", "bull", "flat", "lollipop", "standoff"] = Field(
        description='"ball", "bull" (nose), "flat" or "lollipop" cutter, or "standoff" (laser, spray, water jet)'
    )
    diameter_mm: Positive | None = Field(default=None, le=100.0, description="diameter of the cutter, or of its ball")
    corner_mm: Positive | None = Field(default=None, le=50.0, description="bull: radius of the rounded corner")
    neck_mm: Positive | None = Field(default=None, le=100.0, description="lollipop: diameter of the neck")
    reach_mm: Positive | None = Field(default=None, le=500.0, description="lollipop: from the tip to the neck's end")
    flute_mm: Positive | None = Field(
        default=None, le=500.0, description="cutting length from the tip; above it the shank begins"
    )
    standoff_mm: Positive | None = Field(default=None, le=200.0, description="from the tip to the surface")
    shank_mm: tuple[Vector, ...] | None = Field(
        default=None, description="shank or nozzle: [height, lower diameter, upper diameter] of each piece, upwards"
    )
    holder_mm: tuple[Vector, ...] | None = Field(default=None, description="holder: pieces as of the shank, above it")
    length_mm: Positive | None = Field(
        default=None,
        le=1000.0,
        description="from the platform's origin to the tip; the machine's if left out",
    )

    @model_validator(mode="after")
    def _own_size(self) -> ToolTable:
        needed, possible = _TOOL_KEYS[self.type]
        for key in ("diameter_mm", "corner_mm", "neck_mm", "reach_mm", "flute_mm", "standoff_mm"):
            given = getattr(self, key) is not None
            if key in needed and not given:
                wrong(key, f'missing for a tool of type "{self.type}"', "a length in mm")
            if given and key not in needed + possible:
                wrong(key, f'means nothing for a tool of type "{self.type}"', f"{', '.join(needed)} alone")
        for key in ("shank_mm", "holder_mm"):
            for piece in getattr(self, key) or ():
                if piece[0] <= 0.0 or min(piece) < 0.0 or max(piece[1:]) <= 0.0:
                    wrong(key, "an impossible piece", "[height, lower diameter, upper diameter], all positive")
        return self


_TOOL_KEYS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "ball": (("diameter_mm",), ("flute_mm",)),
    "bull": (("diameter_mm", "corner_mm"), ("flute_mm",)),
    "flat": (("diameter_mm",), ("flute_mm",)),
    "lollipop": (("diameter_mm", "neck_mm", "reach_mm"), ()),
    "standoff": (("standoff_mm",), ()),
}
"""Of each type: the keys that it needs, and those that it may have."""


class AxisTable(Table):
    """How freely the tool axis may lean."""

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
    lead_deg: float = Field(default=0.0, ge=-80.0, le=80.0, description="leaning forwards, along the feed")
    side_deg: float = Field(default=0.0, ge=-80.0, le=80.0, description="leaning to the left of the feed")
    smoothing_deg: float = Field(default=0.0, ge=0.0, le=45.0, description="by which smoothing may turn an axis")
    smoothing_reach_mm: Positive = Field(default=5.0, description="over which it works, along and across the passes")
    rate_deg_mm: Positive | None = Field(default=None, description="most turning of the axis per mm of a cut")

    @model_validator(mode="after")
    def _mode_keys(self) -> AxisTable:
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


_MODE_KEYS: dict[str, tuple[str, ...]] = {
    "normal": (),
    "fixed": ("direction",),
    "toward": ("point_mm",),
    "from": ("point_mm",),
    "between": ("places_mm", "directions"),
}


class GougeTable(Table):
    """What is done where cutter, shank or holder would cut into the part."""

    remedy: tuple[Literal["tilt", "lift", "drop", "report"], ...] = Field(
        default=("report",), min_length=1, description='tried in this order: "tilt", "lift", "drop"; or "report" alone'
    )
    tolerance_mm: Positive = Field(default=0.05, description="depth that counts as none")
    cone_deg: float = Field(default=30.0, gt=0.0, lt=90.0, description="tilt: most that an axis may turn")
    highest_mm: Positive = Field(default=20.0, description="lift: most that a waypoint may rise")


class FeedTable(Table):
    """Speeds of the tool tip, and what this job asks of tip and axis beyond the machine's own limits."""

    cut_mm_min: Positive = Field(le=100_000.0, description="feed while cutting")
    link_mm_min: Positive | None = Field(
        default=None, le=100_000.0, description="feed of approaches and links; the cutting feed when left out"
    )
    max_tip_acceleration_mm_s2: Positive | None = Field(default=None, description="of the tip; the machine's if less")
    max_tip_jerk_mm_s3: Positive | None = Field(default=None, description="of the tip; the machine's if less")
    max_axis_velocity_deg_s: Positive | None = Field(
        default=None, description="of the tool axis; the machine's if less"
    )
    max_axis_acceleration_deg_s2: Positive | None = Field(default=None, description="of the tool axis, likewise")


class ToleranceTable(Table):
    """How far the motion may stray from the surface and from the chosen axis."""

    chordal_mm: Positive = Field(default=0.01, description="between the waypoints' chords and the mesh")
    path_mm: Positive = Field(default=0.02, description="between the tool tip's motion and the toolpath")
    axis_deg: float = Field(
        default=0.5, gt=0.0, le=10.0, description="by which the axis may leave the tilt cone on the way"
    )


class PlacementTable(Table):
    """Where the part stands in the machine: left to the planner, bounded, or fixed by you."""

    mode: Literal["free", "table", "fixture", "fixed"] = Field(
        default="free",
        description='"free", "table" (it stands on one), "fixture" (one of given poses), or "fixed": all but the last '
        "leave the choice to the planner",
    )
    position_mm: Vector | None = Field(
        default=None, description="fixed: where the mesh's origin goes, machine frame (base plane: z = 0)"
    )
    rotation_deg: Vector | None = Field(
        default=None,
        description="fixed: turns about the machine's fixed x, then y, then z axis; free: from where largest_turn_deg "
        "counts",
    )
    matrix: tuple[Row, Row, Row, Row] | None = Field(
        default=None,
        description="fixed: both as a 4x4 matrix, translation in mm",
    )
    box_mm: tuple[Vector, Vector] | None = Field(
        default=None, description="free: the mesh's origin stays in this box: two opposite corners, machine frame"
    )
    largest_turn_deg: float | None = Field(
        default=None, ge=0.0, le=180.0, description="free: by which the part may be turned from rotation_deg at most"
    )
    table_z_mm: float | None = Field(
        default=None, description="table: z of its surface, machine frame; the part's lowest point rests on it"
    )
    table_x_mm: Range | None = Field(default=None, description="table: least and greatest x of the mesh's origin")
    table_y_mm: Range | None = Field(default=None, description="table: least and greatest y of the mesh's origin")
    up: Vector = Field(default=(0.0, 0.0, 1.0), description="table: which direction is up (to the base), mesh frame")
    poses_mm_deg: tuple[Pose, ...] | None = Field(
        default=None, min_length=1, description="fixture: poses to choose from, each position_mm and rotation_deg"
    )
    component: Literal["++", "+-", "-+", "--"] | None = Field(
        default=None, description="signs of w and S of the assembly mode; the best one when left out"
    )
    solver: Literal["sequential", "ipopt"] = Field(
        default="sequential", description='"sequential" (quick), or "ipopt" (the slow reference)'
    )

    @model_validator(mode="after")
    def _numbers(self) -> PlacementTable:
        for mode, keys in _PLACEMENT_KEYS.items():
            for key in keys:
                if mode != self.mode and key not in _PLACEMENT_KEYS[self.mode] and key in self.model_fields_set:
                    wrong(key, f'means nothing when mode = "{self.mode}"', f'mode = "{mode}", or no {key}')
        if self.mode == "fixed" and self.matrix is None and self.position_mm is None:
            what = "a fixed placement needs " + ("a position" if self.rotation_deg is not None else "its numbers")
            wrong("position_mm", what, "position_mm and rotation_deg, or matrix")
        if self.matrix is not None and (self.position_mm is not None or self.rotation_deg is not None):
            wrong("matrix", "the placement is given twice", "matrix, or position_mm and rotation_deg")
        if self.mode == "free" and self.rotation_deg is not None and self.largest_turn_deg is None:
            wrong("largest_turn_deg", "a rotation alone bounds nothing", "the largest turn from rotation_deg")
        if self.mode == "table" and self.table_z_mm is None:
            wrong("table_z_mm", "the table's height is missing", "z of its surface in mm")
        if self.mode == "fixture" and self.poses_mm_deg is None:
            wrong("poses_mm_deg", "the fixture's poses are missing", "[[x, y, z, turn x, turn y, turn z], ...]")
        for key in ("table_x_mm", "table_y_mm"):
            ends = getattr(self, key)
            if ends is not None and ends[0] > ends[1]:
                wrong(key, "the range is empty", "[least, greatest]")
        if not any(self.up):
            wrong("up", "the direction is zero", "a direction such as [0, 0, 1]")
        return self


_PLACEMENT_KEYS: dict[str, tuple[str, ...]] = {
    "fixed": ("position_mm", "rotation_deg", "matrix"),
    "free": ("box_mm", "rotation_deg", "largest_turn_deg"),
    "table": ("table_z_mm", "table_x_mm", "table_y_mm", "up"),
    "fixture": ("poses_mm_deg",),
}
"""Of each mode: the keys that mean something in it."""


class FixtureTable(Table):
    """What else legs, spindle and tool must not touch: what holds the part, or what stands in the machine."""

    mesh: str | None = Field(
        default=None, min_length=1, description="mesh file of a vise, clamps, a table; relative to this job file"
    )
    unit: Literal["mm", "cm", "m", "inch"] | None = Field(
        default=None, description="unit of the numbers in its mesh file: compulsory with mesh"
    )
    scale: Positive = Field(default=1.0, description="factor applied to it after its unit")
    frame: Literal["part", "machine"] = Field(
        default="part", description='frame of its mesh: "part" (it moves with the part) or "machine" (it stays)'
    )

    @model_validator(mode="after")
    def _known_unit(self) -> FixtureTable:
        if self.mesh is not None and self.unit is None:
            wrong("unit", "the unit of the fixture's mesh is missing", "mm, cm, inch or m")
        return self


class OutputTable(Table):
    """The program's rows; the machine's own controller settings when left out."""

    period_ms: Positive | None = Field(default=None, ge=0.1, le=100.0, description="time between rows")
    interpolation: Literal["linear", "cubic"] | None = Field(
        default=None, description="how the controller moves between rows"
    )


class JobTables(Table):
    """All tables of a job file, in the order of the flow."""

    part: PartTable
    machine: MachineTable = Field(default=MachineTable(name="desk"))
    tool: ToolTable
    toolpath: ToolpathTable
    axis: AxisTable = Field(default=AxisTable())
    gouge: GougeTable = Field(default=GougeTable())
    feed: FeedTable
    tolerance: ToleranceTable = Field(default=ToleranceTable())
    placement: PlacementTable = Field(default=PlacementTable())
    fixture: FixtureTable = Field(default=FixtureTable())
    output: OutputTable = Field(default=OutputTable())

    @model_validator(mode="before")
    @classmethod
    def _raster_unless_said(cls, content: Any) -> Any:
        """Take a toolpath without a strategy for a raster."""
        if isinstance(content, dict) and isinstance(table := cast(dict[str, Any], content).get("toolpath"), dict):
            return {**content, "toolpath": {"strategy": "raster", **cast(dict[str, Any], table)}}
        return content

    @model_validator(mode="after")
    def _leaning(self) -> JobTables:
        if self.tool.type in ("bull", "flat") and self.axis.tilt_deg > 0.0:
            wrong("axis.tilt_deg", f'a tool of type "{self.tool.type}" cannot lean without digging in', "tilt_deg = 0")
        return self
