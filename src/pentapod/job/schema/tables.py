"""Schema of the job file: every key with its unit, meaning, default and range, stated once (`Key`).

Keys of strategies, cutters, regions, orientations, gouges and tool limits are declared beside the SI fields
that they set, all others in this folder. Parser, error messages, `pentapod new` and the reference are made from them.
Values of a table are as in the file (mm, degrees, mm/min), and in SI at `table.si`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal, cast

from pydantic import create_model, model_validator

from pentapod.base.keys import Key
from pentapod.base.tables import TomlTable, table_of, wrong
from pentapod.base.units import to_si
from pentapod.job.schema.axis import AxisTable, by_default, limited_lean
from pentapod.job.schema.placement import FixtureTable, PlacementTable
from pentapod.job.schema.process import ProcessTable
from pentapod.job.schema.strategies import ToolpathTable, strategy_table
from pentapod.job.schema.tool import AnyTool, tool_table
from pentapod.machine.parts import ToolLimits
from pentapod.mesh.region import Region
from pentapod.toolpath.gouge.report import GougeOptions


@dataclass(frozen=True, kw_only=True)
class PartKeys:
    """The workpiece: its mesh, and which side of it is machined."""

    mesh: Annotated[
        str,
        Key(
            "",
            "mesh file (.stl, .ply, .obj, .3mf, .glb, .step); relative to this job file, ${VARIABLE} is expanded",
            min_length=1,
        ),
    ]
    unit: Annotated[
        Literal["mm", "cm", "m", "inch"] | None,
        Key("", "unit of the numbers in the mesh file: needed for STL, PLY and OBJ, which do not state it"),
    ] = None
    scale: Annotated[float, Key("", "factor applied to the mesh after its unit", gt=0.0)] = 1.0
    repair: Annotated[
        bool, Key("", "wind all facets alike (double and degenerate ones are left out anyway, and reported)")
    ] = False
    flip: Annotated[
        bool, Key("", "turn the surface over: for an open sheet that shows its back to region_direction")
    ] = False
    least_body: Annotated[
        float | None,
        Key("mm", "leave out connected pieces of the mesh with a smaller extent, such as the debris of a scan", gt=0.0),
    ] = None
    stock: Annotated[
        tuple[float, float, float] | None,
        Key("mm", "size of the raw part along x, y and z of the mesh, for the set-up sheet; nothing is judged by it"),
    ] = None

    @staticmethod
    def rules(table: Any) -> None:
        """Check that the region has a size and a direction."""
        box = table.region_box_mm
        if box is not None and any(a == b for a, b in zip(*box, strict=True)):
            wrong("region_box_mm", "the box is flat", "corners that differ in x, y and z")
        if not any(table.region_direction):
            wrong("region_direction", "the direction is zero", "a direction such as [0, 0, 1]")


@dataclass(frozen=True, kw_only=True)
class MachineKeys:
    """The machine: one that ships, by name, or a machine file."""

    name: Annotated[str | None, Key("", 'a shipped machine, such as "desk"', min_length=1)] = None
    file: Annotated[str | None, Key("", "a machine file, relative to this one", min_length=1)] = None

    @staticmethod
    def rules(table: Any) -> None:
        """Check that there is one machine."""
        if (table.name is None) == (table.file is None):
            wrong("name", "name the machine once", 'either name = "desk" or file = "machine.toml"')


@dataclass(frozen=True, kw_only=True)
class GougeKeys:
    """Gouge check: what is done where cutter, shank or holder would cut into the part."""

    remedy: Annotated[
        tuple[Literal["tilt", "lift", "drop", "report"], ...] | None,
        Key(
            "",
            'tried in this order: "tilt", "lift", "drop"; or "report" alone, and the verdict fails where it gouges; '
            'when left out "drop", for a toolpath from a file "report"',
            min_length=1,
        ),
    ] = None


@dataclass(frozen=True, kw_only=True)
class FeedKeys:
    """Feed rates of the tool tip, exact stops, and limits of tip and tool axis in addition to the machine's."""

    cut: Annotated[float, Key("mm_min", "feed while cutting", gt=0.0, le=100_000.0)]
    link: Annotated[
        float | None,
        Key("mm_min", "feed of approaches and links; the cutting feed when left out", gt=0.0, le=100_000.0),
    ] = None
    cutting_force: Annotated[
        float,
        Key(
            "n",
            "force on the tip, in any direction, that drives with a peak force keep free for cutting; "
            "the tip deflects by it",
            ge=0.0,
        ),
    ] = 0.0
    lowest_share: Annotated[
        float | None,
        Key(
            "",
            "share of the feed that cuts and links must reach where no limit of machine or job is active; below it "
            "the verdict fails. 0.9 when left out, 0.95 for laser and spray; 0 requires none",
            ge=0.0,
            le=1.0,
        ),
    ] = None
    dwell: Annotated[
        float | None,
        Key("s", "dwell in an exact stop at the end of each cut; no stop when left out", ge=0.0, le=3600.0),
    ] = None
    stop_angle: Annotated[
        float,
        Key(
            "deg", "exact stop at corners where the toolpath turns by more; other corners are blended", gt=0.0, le=180.0
        ),
    ] = to_si(135.0, "deg")


@dataclass(frozen=True, kw_only=True)
class ToleranceKeys:
    """Tolerances of the path, of the tool axis and of the material left."""

    chordal: Annotated[float, Key("mm", "between the waypoints' chords and the mesh", gt=0.0)] = 10e-6
    path: Annotated[
        float,
        Key(
            "mm",
            "between the motion of the tool's tilt centre (a ball's centre, a beam's spot) and the toolpath",
            gt=0.0,
        ),
    ] = 20e-6
    axis: Annotated[
        float, Key("deg", "largest angle by which the axis may leave the tilt cone between waypoints", gt=0.0, le=10.0)
    ] = to_si(0.5, "deg")
    deflection: Annotated[
        float | None,
        Key(
            "mm",
            "largest deflection of the tip by weight, acceleration and cutting force, of machines that give the "
            "stiffness of their legs; told without a bound when left out",
            gt=0.0,
        ),
    ] = None
    left: Annotated[
        float | None,
        Key(
            "mm",
            "material above the surface that counts as none; for a stand-off tool, distance from its lines; when left "
            "out, 1.25 times the ridge between passes (or half a stepover), plus chordal_mm and path_mm",
            gt=0.0,
        ),
    ] = None
    left_share: Annotated[
        float,
        Key(
            "",
            "share of the region's area, 0 to 1, on which more may be left where the cutter can reach",
            ge=0.0,
            le=1.0,
        ),
    ] = 0.001


@dataclass(frozen=True, kw_only=True)
class OutputKeys:
    """Sampling of the program; the machine's controller settings when left out."""

    period: Annotated[float | None, Key("ms", "time between rows", ge=0.1, le=100.0)] = None
    interpolation: Annotated[Literal["linear", "cubic"] | None, Key("", "how the controller moves between rows")] = None
    compensation: Annotated[
        Literal["none", "gravity", "process"] | None,
        Key(
            "",
            "loads that drives compensate for, because legs yield to them: gravity, or gravity and "
            "feed.cutting_force_n against the motion on cuts (process); gravity when left out, on machines that give "
            "the stiffness of their legs and have no calibration",
        ),
    ] = None


@dataclass(frozen=True, kw_only=True)
class LimitsKeys:
    """Limits of installed packages that the plan must keep as well."""

    use: Annotated[
        tuple[str, ...], Key("", "names of entry points in the groups pentapod.limits and pentapod.timing_limits")
    ] = ()


@dataclass(frozen=True, kw_only=True)
class VerifyKeys:
    """Claims that the verdict may waive."""

    waive: Annotated[tuple[str, ...], Key("", "claims that may stay unjudged without failing the verdict")] = ()


PartTable = table_of(PartKeys, TomlTable, Region)
MachineTable = table_of(MachineKeys)
GougeTable = table_of(GougeKeys, TomlTable, GougeOptions)
FeedTable = table_of(FeedKeys, TomlTable, ToolLimits)
ToleranceTable = table_of(ToleranceKeys)
OutputTable = table_of(OutputKeys)
LimitsTable = table_of(LimitsKeys)
VerifyTable = table_of(VerifyKeys)


class _JobRules(TomlTable):
    """All tables of a job file, in the order of the flow."""

    @model_validator(mode="after")
    def _leaning(self) -> _JobRules:
        ends = self.tool.type in ("bull", "flat")
        if self.axis.mode == "auto":
            vars(self).update(axis=limited_lean(self.axis, self.tool.type, self.toolpath.strategy))
        elif ends and "tilt_deg" not in self.axis.model_fields_set:
            vars(self).update(axis=by_default(self.axis, 0.0))
        if ends and self.axis.tilt_deg > 0.0:
            wrong("axis.tilt_deg", f'a tool of type "{self.tool.type}" cannot tilt without gouging', "tilt_deg = 0")
        return self


_TABLES: dict[str, Any] = {
    "part": (PartTable, ...),
    "machine": (MachineTable, MachineTable(name="desk")),
    "tool": (AnyTool, ...),
    "toolpath": (ToolpathTable, ...),
    "axis": (AxisTable, AxisTable()),
    "gouge": (GougeTable, GougeTable()),
    "feed": (FeedTable, ...),
    "tolerance": (ToleranceTable, ToleranceTable()),
    "placement": (PlacementTable, PlacementTable()),
    "fixture": (FixtureTable, FixtureTable()),
    "process": (ProcessTable, ProcessTable()),
    "output": (OutputTable, OutputTable()),
    "limits": (LimitsTable, LimitsTable()),
    "verify": (VerifyTable, VerifyTable()),
}
JobTables = create_model("JobTables", __base__=_JobRules, __module__=__name__, __doc__=_JobRules.__doc__, **_TABLES)
"""A whole job file."""


def table_model(name: str, strategy: str = "raster", tool: str = "ball") -> type[TomlTable]:
    """Return the model of a table of job files. strategy: whose keys [toolpath] has; tool: type whose keys [tool] has.

    Raises KeyError: no such table.
    """
    if name == "toolpath":
        return strategy_table(strategy)
    return tool_table(tool) if name == "tool" else cast("type[TomlTable]", JobTables.model_fields[name].annotation)
