"""The table [toolpath] of a job file: one model for each strategy, with the keys that mean something to it.

Units are in the names; values are as in the file, not yet SI.
"""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import Field, model_validator

from pentapod.job.schema.table import Positive, Table, Vector, wrong

Degrees = Annotated[float, Field(ge=-360.0, le=360.0)]
NotNegative = Annotated[float, Field(ge=0.0)]


class StrategyTable(Table):
    """What every strategy takes."""

    clearance_mm: Positive = Field(default=10.0, description="height of rapids above the part")
    approach_mm: Positive = Field(default=3.0, description="height of the stretch on feed, to and from a cut")
    entry: Literal["axis", "straight", "arc"] = Field(
        default="axis", description='form of that stretch: along the "axis", a "straight" ramp ahead, or an "arc"'
    )
    stay_mm: NotNegative | None = Field(
        default=None, description="up to this far the tool stays on the surface between passes; 3 stepovers"
    )
    hop_mm: NotNegative = Field(default=20.0, description="up to this far it hops over the part, further it retracts")
    spacing_mm: Positive = Field(default=2.0, description="largest distance between waypoints on the surface")
    closest_mm: Positive = Field(default=0.01, description="waypoints nearer than this are one, if chordal_mm allows")
    shortest_mm: NotNegative = Field(default=0.5, description="shorter passes are left out, and reported")
    axis_step_deg: float = Field(default=3.0, gt=0.0, le=30.0, description="most that the axis turns between waypoints")


class CoverTable(StrategyTable):
    """What strategies take that cover a surface."""

    stepover_mm: Positive | None = Field(
        default=None, description="most between passes, along the surface; or scallop_mm"
    )
    scallop_mm: Positive | None = Field(default=None, description="height of the ridge left between passes")
    fill: bool = Field(default=True, description="lines of their own for what regular passes leave uncovered")

    @model_validator(mode="after")
    def _one_spacing(self) -> CoverTable:
        if self.stepover_mm is not None and self.scallop_mm is not None:
            wrong("scallop_mm", "stepover_mm and scallop_mm are both given", "one of the two")
        if self.stepover_mm is None and self.scallop_mm is None:
            wrong("stepover_mm", "the distance between passes is missing", "stepover_mm or scallop_mm")
        return self


class RasterTable(CoverTable):
    """Parallel plane slices."""

    strategy: Literal["raster"] = Field(default="raster", description="how the surface is machined")
    direction_deg: Degrees = Field(default=0.0, description="direction of the passes, from +x towards +y")
    pattern: Literal["zigzag", "one-way", "uphill", "downhill"] = Field(
        default="zigzag", description="cut both ways, one way, or only where passes rise or fall"
    )


class CrossHatchTable(RasterTable):
    """Parallel plane slices, and others across them."""

    strategy: Literal["cross-hatch"] = Field(description="how the surface is machined")  # pyright: ignore[reportIncompatibleVariableOverride]
    angle_deg: Degrees = Field(default=90.0, description="from the first passes to the second")


class WaterlineTable(CoverTable):
    """Lines of constant height."""

    strategy: Literal["waterline"] = Field(description="how the surface is machined")
    upright: Vector | None = Field(default=None, description="direction of the heights; the region's when left out")
    shallowest_deg: float = Field(default=10.0, gt=0.0, lt=90.0, description="flatter surface is left out")


class OffsetTable(CoverTable):
    """Lines a constant distance apart over the surface."""

    strategy: Literal["offset"] = Field(description="how the surface is machined")
    curve: str | None = Field(
        default=None, min_length=1, description="CSV file of a polyline to start from; the region's border if left out"
    )


class SpiralTable(CoverTable):
    """One line that winds over the surface."""

    strategy: Literal["spiral"] = Field(description="how the surface is machined")
    form: Literal["offset", "planar"] = Field(default="offset", description="along the border, or round from above")
    centre_mm: Vector | None = Field(default=None, description="about what it winds, mesh frame")


class EdgesTable(StrategyTable):
    """Borders and sharp edges, for deburring."""

    strategy: Literal["edges"] = Field(description="how the surface is machined")
    which: Literal["border", "sharp", "both"] = Field(default="both", description="which edges are followed")
    sharpest_deg: float = Field(default=40.0, gt=0.0, lt=180.0, description="angle of normals that makes an edge")


class LaidTable(StrategyTable):
    """Where and how flat lines are laid on the surface."""

    laying: Literal["project", "wrap"] = Field(
        default="project", description='"project" along the region\'s direction, or "wrap" along the surface'
    )
    position_mm: Vector | None = Field(
        default=None, description="where the origin of the lines goes, mesh frame; the middle of the region if left out"
    )
    rotation_deg: Degrees = Field(default=0.0, description="of the lines, anticlockwise")
    depth_mm: NotNegative = Field(default=0.0, description="below the surface, along the normal")


class DrawingTable(LaidTable):
    """The lines of a drawing."""

    strategy: Literal["drawing"] = Field(description="how the surface is machined")
    file: str = Field(min_length=1, description="drawing (.svg, .dxf), relative to this job file")
    scale: Positive = Field(default=1.0, description="factor on the drawing's own size")
    centred: bool = Field(default=True, description="the drawing's middle is its origin, not the file's own")


class TextTable(LaidTable):
    """Text, in single strokes."""

    strategy: Literal["text"] = Field(description="how the surface is machined")
    text: str = Field(min_length=1, description="what is written; \\n begins a new line")
    height_mm: Positive = Field(default=5.0, description="height of capitals")
    letter_spacing: Positive = Field(default=1.0, description="factor on the distance of letters")
    align: Literal["left", "centre", "right"] = Field(default="centre", description="of several lines")


class PolylineTable(StrategyTable):
    """Lines given point by point."""

    strategy: Literal["polyline"] = Field(description="how the surface is machined")
    file: str = Field(min_length=1, description="CSV file with columns x_mm, y_mm, z_mm, relative to this job file")
    towards: Literal["view", "nearest"] = Field(
        default="view", description="taken to the surface along the region's direction, or to its nearest point"
    )
    depth_mm: NotNegative = Field(default=0.0, description="below the surface, along the normal")


class ImageTable(StrategyTable):
    """Grey levels as depth or as laser power."""

    strategy: Literal["image"] = Field(description="how the surface is machined")
    file: str = Field(min_length=1, description="picture (.png, .jpg, ...), relative to this job file")
    width_mm: Positive = Field(description="of the picture on the surface")
    stepover_mm: Positive = Field(default=0.5, description="between lines")
    effect: Literal["depth", "power"] = Field(default="depth", description="what dark means: deep, or full power")
    depth_mm: NotNegative = Field(default=0.3, description="depth of black")
    levels: int = Field(default=8, ge=1, le=256, description="steps of power")
    threshold: float = Field(default=0.05, ge=0.0, lt=1.0, description="darkness from 0 to 1 up to which is left out")
    laying: Literal["project", "wrap"] = Field(default="project", description="as for drawings")
    position_mm: Vector | None = Field(default=None, description="where the picture's middle goes, mesh frame")
    rotation_deg: Degrees = Field(default=0.0, description="of the picture, anticlockwise")


class FileTable(Table):
    """A toolpath that is there already."""

    strategy: Literal["file"] = Field(description="how the surface is machined")
    file: str = Field(min_length=1, description="the toolpath (APT, G-code, CSV, npz), relative to this job file")
    format: str | None = Field(default=None, min_length=1, description="its format, where the suffix does not tell")


ToolpathTable: TypeAlias = Annotated[
    RasterTable
    | CrossHatchTable
    | WaterlineTable
    | OffsetTable
    | SpiralTable
    | EdgesTable
    | DrawingTable
    | TextTable
    | PolylineTable
    | ImageTable
    | FileTable,
    Field(discriminator="strategy"),
]

TABLES: dict[str, type[Table]] = {
    "raster": RasterTable,
    "cross-hatch": CrossHatchTable,
    "waterline": WaterlineTable,
    "offset": OffsetTable,
    "spiral": SpiralTable,
    "edges": EdgesTable,
    "drawing": DrawingTable,
    "text": TextTable,
    "polyline": PolylineTable,
    "image": ImageTable,
    "file": FileTable,
}
"""The model of each strategy."""


def sunk_mm(table: ToolpathTable) -> float:
    """Return by how much a strategy goes below the surface on purpose."""
    if isinstance(table, ImageTable) and table.effect == "power":
        return 0.0
    return table.depth_mm if isinstance(table, (LaidTable, PolylineTable, ImageTable)) else 0.0


FILE_KEYS = ("file", "curve")
"""Keys that name a file."""
