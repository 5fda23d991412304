"""The tables of a job file: every key with its unit, meaning, default and range.

Documentation and `pentapod new` are generated from the descriptions here, so that there is one source of
defaults. Units are in the names; values are as in the file (mm, degrees, mm/min), not yet SI.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, NoReturn

from pydantic import BaseModel, ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

Vector = tuple[float, float, float]
Row = tuple[float, float, float, float]
Positive = Annotated[float, Field(gt=0.0)]


def _wrong(key: str, what: str, expected: str) -> NoReturn:
    """Raise the error of a rule that spans several keys; `key` is the one to name."""
    raise PydanticCustomError("rule", "{what}", {"key": key, "what": what, "expected": expected})


class Table(BaseModel):
    """A table of the job file: unknown keys, wrong types, NaN and infinity are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


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
                _wrong("region_box_mm", "the box is flat", "corners that differ in x, y and z")
        if not any(self.region_direction):
            _wrong("region_direction", "the direction is zero", "a direction such as [0, 0, 1]")
        return self


class MachineTable(Table):
    """The machine: one that ships, by name, or a machine file."""

    name: str | None = Field(default=None, min_length=1, description='a shipped machine, such as "desk"')
    file: str | None = Field(default=None, min_length=1, description="a machine file, relative to this one")

    @model_validator(mode="after")
    def _one(self) -> MachineTable:
        if (self.name is None) == (self.file is None):
            _wrong("name", "name the machine once", 'either name = "desk" or file = "machine.toml"')
        return self


class ToolTable(Table):
    """The tool: a ball cutter that touches the surface, or a beam or spray that keeps its distance."""

    type: Literal["ball", "standoff"] = Field(description='"ball" cutter, or "standoff" (laser, spray)')
    diameter_mm: Positive | None = Field(default=None, le=100.0, description="diameter of the ball")
    standoff_mm: Positive | None = Field(default=None, le=200.0, description="from the tip to the surface")
    length_mm: Positive | None = Field(
        default=None,
        le=1000.0,
        description="from the platform's origin to the tip; the machine's if left out",
    )

    @model_validator(mode="after")
    def _own_size(self) -> ToolTable:
        needed, other = ("diameter_mm", "standoff_mm") if self.type == "ball" else ("standoff_mm", "diameter_mm")
        if getattr(self, needed) is None:
            _wrong(needed, f'missing for a tool of type "{self.type}"', "a length in mm")
        if getattr(self, other) is not None:
            _wrong(other, f'means nothing for a tool of type "{self.type}"', f"{needed} alone")
        return self


class ToolpathTable(Table):
    """How the surface is covered."""

    strategy: Literal["raster"] = Field(default="raster", description="parallel plane slices")
    direction_deg: float = Field(
        default=0.0, ge=-360.0, le=360.0, description="direction of the passes, from +x towards +y"
    )
    pattern: Literal["zigzag", "one-way"] = Field(default="zigzag", description="cut both ways or one way")
    stepover_mm: Positive | None = Field(default=None, description="between passes; or scallop_mm")
    scallop_mm: Positive | None = Field(default=None, description="height of the ridge left between passes")
    clearance_mm: Positive = Field(default=10.0, description="height of rapids above the part")
    approach_mm: Positive = Field(default=3.0, description="stretch along the axis, on feed, to and from a cut")
    spacing_mm: Positive = Field(default=2.0, description="largest distance between waypoints on the surface")

    @model_validator(mode="after")
    def _one_spacing(self) -> ToolpathTable:
        if self.stepover_mm is not None and self.scallop_mm is not None:
            _wrong("scallop_mm", "stepover_mm and scallop_mm are both given", "one of the two")
        if self.stepover_mm is None and self.scallop_mm is None:
            _wrong("stepover_mm", "the distance between passes is missing", "stepover_mm or scallop_mm")
        return self


class AxisTable(Table):
    """How freely the tool axis may lean."""

    tilt_deg: float = Field(
        default=15.0,
        ge=0.0,
        le=60.0,
        description="largest angle of the tool axis to the surface normal",
    )


class FeedTable(Table):
    """Speeds of the tool tip."""

    cut_mm_min: Positive = Field(le=100_000.0, description="feed while cutting")
    link_mm_min: Positive | None = Field(
        default=None, le=100_000.0, description="feed of approaches and links; the cutting feed when left out"
    )


class ToleranceTable(Table):
    """How far the motion may stray from the surface and from the chosen axis."""

    chordal_mm: Positive = Field(default=0.01, description="between the waypoints' chords and the mesh")
    path_mm: Positive = Field(default=0.02, description="between the tool tip's motion and the toolpath")
    axis_deg: float = Field(
        default=0.5, gt=0.0, le=10.0, description="by which the axis may leave the tilt cone on the way"
    )


class PlacementTable(Table):
    """Where the part stands in the machine: left to the planner, or fixed by you."""

    mode: Literal["free", "fixed"] = Field(default="free", description='"free" (the planner chooses) or "fixed"')
    position_mm: Vector | None = Field(
        default=None, description="fixed: where the mesh's origin goes, machine frame (base plane: z = 0)"
    )
    rotation_deg: Vector | None = Field(
        default=None, description="fixed: turns about the machine's fixed x, then y, then z axis"
    )
    matrix: tuple[Row, Row, Row, Row] | None = Field(
        default=None,
        description="fixed: both as a 4x4 matrix, translation in mm",
    )
    component: Literal["++", "+-", "-+", "--"] | None = Field(
        default=None, description="signs of w and S of the assembly mode; the best one when left out"
    )
    solver: Literal["sequential", "ipopt"] = Field(
        default="sequential", description='"sequential" (quick), or "ipopt" (the slow reference)'
    )

    @model_validator(mode="after")
    def _numbers(self) -> PlacementTable:
        numbers: dict[str, Any] = {k: getattr(self, k) for k in ("position_mm", "rotation_deg", "matrix")}
        given = [key for key, value in numbers.items() if value is not None]
        if self.mode == "free" and given:
            _wrong(given[0], 'means nothing when mode = "free"', 'mode = "fixed", or no numbers')
        if self.mode == "fixed" and not given:
            _wrong(
                "position_mm",
                "a fixed placement needs its numbers",
                "position_mm and rotation_deg, or matrix",
            )
        if self.matrix is not None and len(given) > 1:
            _wrong("matrix", "the placement is given twice", "matrix, or position_mm and rotation_deg")
        if self.mode == "fixed" and self.matrix is None and self.position_mm is None:
            _wrong("position_mm", "a fixed placement needs a position", "[x, y, z] in mm")
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
    feed: FeedTable
    tolerance: ToleranceTable = Field(default=ToleranceTable())
    placement: PlacementTable = Field(default=PlacementTable())
    output: OutputTable = Field(default=OutputTable())
