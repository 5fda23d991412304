"""The workpiece as mathematics: meshes, strategies, tools, links. No robot in it."""

from pentapod.toolpath.axis_modes import AxisMode, Between, Fixed, Normal, Pointed
from pentapod.toolpath.axis_steps import stepped
from pentapod.toolpath.ball_cutter import BallCutter
from pentapod.toolpath.bull_nose import BullNose
from pentapod.toolpath.cross_hatch import CrossHatchOptions
from pentapod.toolpath.curves import CurveOptions
from pentapod.toolpath.diagnosis import MeshDiagnosis
from pentapod.toolpath.drawings_in import read_lines
from pentapod.toolpath.edges import EdgeOptions
from pentapod.toolpath.flat_end import FlatEnd
from pentapod.toolpath.gouge import without_gouges
from pentapod.toolpath.gouge_report import GougeOptions, GougeReport, Remedy
from pentapod.toolpath.heightfield import HeightField
from pentapod.toolpath.image import ImageOptions
from pentapod.toolpath.lettering import lettering
from pentapod.toolpath.load import UNITS, load_mesh
from pentapod.toolpath.lollipop import Lollipop
from pentapod.toolpath.mesh import Mesh
from pentapod.toolpath.offset import OffsetOptions
from pentapod.toolpath.options import CoverOptions, Entry, PathOptions
from pentapod.toolpath.orientation import Orientation
from pentapod.toolpath.orienting import oriented
from pentapod.toolpath.path_report import PathReport
from pentapod.toolpath.pictures_in import read_darkness
from pentapod.toolpath.points_in import read_points
from pentapod.toolpath.polyline import PolylineOptions
from pentapod.toolpath.raster import Pattern, RasterOptions
from pentapod.toolpath.region import Region
from pentapod.toolpath.scallop import stepover_for
from pentapod.toolpath.solids import Cone
from pentapod.toolpath.spiral import SpiralOptions
from pentapod.toolpath.stand_off import StandOff
from pentapod.toolpath.stl import write_stl
from pentapod.toolpath.strategies import STRATEGIES, Strategy, make_toolpath, toolpath_with_report
from pentapod.toolpath.tool import Tool
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath
from pentapod.toolpath.waterline import WaterlineOptions

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
    "EdgeOptions",
    "Entry",
    "Fixed",
    "FlatEnd",
    "GougeOptions",
    "GougeReport",
    "HeightField",
    "ImageOptions",
    "Lollipop",
    "Mesh",
    "MeshDiagnosis",
    "Normal",
    "OffsetOptions",
    "Orientation",
    "PathOptions",
    "PathReport",
    "Pattern",
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
