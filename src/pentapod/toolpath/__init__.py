"""The workpiece as mathematics: meshes, strategies, tools, links. No robot in it."""

from pentapod.toolpath.cross_hatch import CrossHatchOptions
from pentapod.toolpath.diagnosis import MeshDiagnosis
from pentapod.toolpath.heightfield import HeightField
from pentapod.toolpath.load import UNITS, load_mesh
from pentapod.toolpath.mesh import Mesh
from pentapod.toolpath.options import CoverOptions, Entry, PathOptions
from pentapod.toolpath.path_report import PathReport
from pentapod.toolpath.raster import Pattern, RasterOptions
from pentapod.toolpath.region import Region
from pentapod.toolpath.scallop import stepover_for
from pentapod.toolpath.stl import write_stl
from pentapod.toolpath.strategies import STRATEGIES, Strategy, make_toolpath, toolpath_with_report
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath
from pentapod.toolpath.tools import BallCutter, StandOff, Tool
from pentapod.toolpath.waterline import WaterlineOptions

__all__ = [
    "STRATEGIES",
    "UNITS",
    "BallCutter",
    "CoverOptions",
    "CrossHatchOptions",
    "Entry",
    "HeightField",
    "Mesh",
    "MeshDiagnosis",
    "PathOptions",
    "PathReport",
    "Pattern",
    "RasterOptions",
    "Region",
    "Segment",
    "SegmentKind",
    "StandOff",
    "Strategy",
    "Tool",
    "Toolpath",
    "WaterlineOptions",
    "load_mesh",
    "make_toolpath",
    "stepover_for",
    "toolpath_with_report",
    "write_stl",
]
