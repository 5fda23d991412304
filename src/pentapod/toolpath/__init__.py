"""Toolpaths: strategies, tool axes, links and gouge check in the workpiece frame; independent of the robot.

The names below are imported when they are first used, so that a part of the package loads alone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pentapod.base.registry import imported_when_used

if TYPE_CHECKING:
    from pentapod.cutters.ball import BallCutter as BallCutter
    from pentapod.cutters.bull_nose import BullNose as BullNose
    from pentapod.cutters.flat_end import FlatEnd as FlatEnd
    from pentapod.cutters.lollipop import Lollipop as Lollipop
    from pentapod.cutters.stand_off import StandOff as StandOff
    from pentapod.cutters.tool import Tool as Tool
    from pentapod.geometry.solids import Cone as Cone
    from pentapod.mesh.diagnosis import MeshDiagnosis as MeshDiagnosis
    from pentapod.mesh.io.load import UNITS as UNITS
    from pentapod.mesh.io.load import load_mesh as load_mesh
    from pentapod.mesh.io.stl import write_stl as write_stl
    from pentapod.mesh.mesh import Mesh as Mesh
    from pentapod.mesh.query.heightfield import HeightField as HeightField
    from pentapod.mesh.region import Region as Region
    from pentapod.toolpath.axis.modes import AxisMode as AxisMode
    from pentapod.toolpath.axis.modes import Between as Between
    from pentapod.toolpath.axis.modes import Fixed as Fixed
    from pentapod.toolpath.axis.modes import Normal as Normal
    from pentapod.toolpath.axis.modes import Pointed as Pointed
    from pentapod.toolpath.axis.orientation import Orientation as Orientation
    from pentapod.toolpath.axis.orientation import oriented as oriented
    from pentapod.toolpath.axis.steps import stepped as stepped
    from pentapod.toolpath.gouge.gouge import without_gouges as without_gouges
    from pentapod.toolpath.gouge.report import GougeOptions as GougeOptions
    from pentapod.toolpath.gouge.report import GougeReport as GougeReport
    from pentapod.toolpath.gouge.report import Remedy as Remedy
    from pentapod.toolpath.inputs.drawings import read_lines as read_lines
    from pentapod.toolpath.inputs.lettering import lettering as lettering
    from pentapod.toolpath.inputs.pictures import read_darkness as read_darkness
    from pentapod.toolpath.inputs.points import read_points as read_points
    from pentapod.toolpath.lines.scallop import stepover_for as stepover_for
    from pentapod.toolpath.linking.links import LinkStyle as LinkStyle
    from pentapod.toolpath.options import CoverOptions as CoverOptions
    from pentapod.toolpath.options import Entry as Entry
    from pentapod.toolpath.options import PathOptions as PathOptions
    from pentapod.toolpath.path_report import PathReport as PathReport
    from pentapod.toolpath.strategies.cross_hatch import CrossHatchOptions as CrossHatchOptions
    from pentapod.toolpath.strategies.curves import CurveOptions as CurveOptions
    from pentapod.toolpath.strategies.drawing import DrawingOptions as DrawingOptions
    from pentapod.toolpath.strategies.edges import EdgeOptions as EdgeOptions
    from pentapod.toolpath.strategies.image import ImageOptions as ImageOptions
    from pentapod.toolpath.strategies.offset import OffsetOptions as OffsetOptions
    from pentapod.toolpath.strategies.pencil import PencilOptions as PencilOptions
    from pentapod.toolpath.strategies.polyline import PolylineOptions as PolylineOptions
    from pentapod.toolpath.strategies.raster import Pattern as Pattern
    from pentapod.toolpath.strategies.raster import RasterOptions as RasterOptions
    from pentapod.toolpath.strategies.registry import STRATEGIES as STRATEGIES
    from pentapod.toolpath.strategies.registry import make_toolpath as make_toolpath
    from pentapod.toolpath.strategies.registry import toolpath_with_report as toolpath_with_report
    from pentapod.toolpath.strategies.spiral import SpiralOptions as SpiralOptions
    from pentapod.toolpath.strategies.text import TextOptions as TextOptions
    from pentapod.toolpath.strategies.waterline import WaterlineOptions as WaterlineOptions
    from pentapod.toolpath.strategy import Strategy as Strategy
    from pentapod.toolpath.toolpath import Segment as Segment
    from pentapod.toolpath.toolpath import SegmentKind as SegmentKind
    from pentapod.toolpath.toolpath import Toolpath as Toolpath

_HOMES = {
    "cutters.ball": "BallCutter",
    "cutters.bull_nose": "BullNose",
    "cutters.flat_end": "FlatEnd",
    "cutters.lollipop": "Lollipop",
    "cutters.stand_off": "StandOff",
    "cutters.tool": "Tool",
    "geometry.solids": "Cone",
    "mesh.diagnosis": "MeshDiagnosis",
    "mesh.io.load": "UNITS load_mesh",
    "mesh.io.stl": "write_stl",
    "mesh.mesh": "Mesh",
    "mesh.query.heightfield": "HeightField",
    "mesh.region": "Region",
    "toolpath.axis.modes": "AxisMode Between Fixed Normal Pointed",
    "toolpath.axis.orientation": "Orientation oriented",
    "toolpath.axis.steps": "stepped",
    "toolpath.gouge.gouge": "without_gouges",
    "toolpath.gouge.report": "GougeOptions GougeReport Remedy",
    "toolpath.inputs.drawings": "read_lines",
    "toolpath.inputs.lettering": "lettering",
    "toolpath.inputs.pictures": "read_darkness",
    "toolpath.inputs.points": "read_points",
    "toolpath.lines.scallop": "stepover_for",
    "toolpath.linking.links": "LinkStyle",
    "toolpath.options": "CoverOptions Entry PathOptions",
    "toolpath.path_report": "PathReport",
    "toolpath.strategies.cross_hatch": "CrossHatchOptions",
    "toolpath.strategies.curves": "CurveOptions",
    "toolpath.strategies.drawing": "DrawingOptions",
    "toolpath.strategies.edges": "EdgeOptions",
    "toolpath.strategies.image": "ImageOptions",
    "toolpath.strategies.offset": "OffsetOptions",
    "toolpath.strategies.pencil": "PencilOptions",
    "toolpath.strategies.polyline": "PolylineOptions",
    "toolpath.strategies.raster": "Pattern RasterOptions",
    "toolpath.strategies.registry": "STRATEGIES make_toolpath toolpath_with_report",
    "toolpath.strategies.spiral": "SpiralOptions",
    "toolpath.strategies.text": "TextOptions",
    "toolpath.strategies.waterline": "WaterlineOptions",
    "toolpath.strategy": "Strategy",
    "toolpath.toolpath": "Segment SegmentKind Toolpath",
}

if not TYPE_CHECKING:  # type checkers read the imports above
    __getattr__, __dir__, __all__ = imported_when_used(__name__, _HOMES)
