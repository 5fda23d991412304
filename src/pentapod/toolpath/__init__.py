"""Toolpaths: strategies, tool axes, links and gouge check in the workpiece frame; independent of the robot."""

from pentapod.cutters.ball import BallCutter
from pentapod.cutters.bull_nose import BullNose
from pentapod.cutters.flat_end import FlatEnd
from pentapod.cutters.lollipop import Lollipop
from pentapod.cutters.stand_off import StandOff
from pentapod.cutters.tool import Tool
from pentapod.geometry.solids import Cone
from pentapod.mesh.diagnosis import MeshDiagnosis
from pentapod.mesh.io.load import UNITS, load_mesh
from pentapod.mesh.io.stl import write_stl
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.query.heightfield import HeightField
from pentapod.mesh.region import Region
from pentapod.toolpath.axis.modes import AxisMode, Between, Fixed, Normal, Pointed
from pentapod.toolpath.axis.orientation import Orientation, oriented
from pentapod.toolpath.axis.steps import stepped
from pentapod.toolpath.gouge.gouge import without_gouges
from pentapod.toolpath.gouge.report import GougeOptions, GougeReport, Remedy
from pentapod.toolpath.inputs.drawings import read_lines
from pentapod.toolpath.inputs.lettering import lettering
from pentapod.toolpath.inputs.pictures import read_darkness
from pentapod.toolpath.inputs.points import read_points
from pentapod.toolpath.lines.scallop import stepover_for
from pentapod.toolpath.linking.links import LinkStyle
from pentapod.toolpath.options import CoverOptions, Entry, PathOptions
from pentapod.toolpath.path_report import PathReport
from pentapod.toolpath.strategies.cross_hatch import CrossHatchOptions
from pentapod.toolpath.strategies.curves import CurveOptions
from pentapod.toolpath.strategies.drawing import DrawingOptions
from pentapod.toolpath.strategies.edges import EdgeOptions
from pentapod.toolpath.strategies.image import ImageOptions
from pentapod.toolpath.strategies.offset import OffsetOptions
from pentapod.toolpath.strategies.pencil import PencilOptions
from pentapod.toolpath.strategies.polyline import PolylineOptions
from pentapod.toolpath.strategies.raster import Pattern, RasterOptions
from pentapod.toolpath.strategies.registry import STRATEGIES, make_toolpath, toolpath_with_report
from pentapod.toolpath.strategies.spiral import SpiralOptions
from pentapod.toolpath.strategies.text import TextOptions
from pentapod.toolpath.strategies.waterline import WaterlineOptions
from pentapod.toolpath.strategy import Strategy
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath

__all__ = [
    "STRATEGIES",
    "UNITS",
    "AxisMode",
    "BallCutter",
    "Between",
    "BullNose",
    "Cone",
    "CoverOptions",
    "CrossHatchOptions",
    "CurveOptions",
    "DrawingOptions",
    "EdgeOptions",
    "Entry",
    "Fixed",
    "FlatEnd",
    "GougeOptions",
    "GougeReport",
    "HeightField",
    "ImageOptions",
    "LinkStyle",
    "Lollipop",
    "Mesh",
    "MeshDiagnosis",
    "Normal",
    "OffsetOptions",
    "Orientation",
    "PathOptions",
    "PathReport",
    "Pattern",
    "PencilOptions",
    "Pointed",
    "PolylineOptions",
    "RasterOptions",
    "Region",
    "Remedy",
    "Segment",
    "SegmentKind",
    "SpiralOptions",
    "StandOff",
    "Strategy",
    "TextOptions",
    "Tool",
    "Toolpath",
    "WaterlineOptions",
    "lettering",
    "load_mesh",
    "make_toolpath",
    "oriented",
    "read_darkness",
    "read_lines",
    "read_points",
    "stepover_for",
    "stepped",
    "toolpath_with_report",
    "without_gouges",
    "write_stl",
]
