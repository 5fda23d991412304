"""The workpiece as mathematics: meshes, strategies, tools, links. No robot in it."""

from pentapod.toolpath.diagnosis import MeshDiagnosis
from pentapod.toolpath.heightfield import HeightField
from pentapod.toolpath.load import UNITS, load_mesh
from pentapod.toolpath.mesh import Mesh
from pentapod.toolpath.options import Pattern, RasterOptions
from pentapod.toolpath.raster import RasterReport, raster, raster_with_report, stepover_for
from pentapod.toolpath.region import Region
from pentapod.toolpath.stl import write_stl
from pentapod.toolpath.strategies import STRATEGIES, Strategy
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath
from pentapod.toolpath.tools import BallCutter, StandOff, Tool

__all__ = [
    "STRATEGIES",
    "UNITS",
    "BallCutter",
    "HeightField",
    "Mesh",
    "MeshDiagnosis",
    "Pattern",
    "RasterOptions",
    "RasterReport",
    "Region",
    "Segment",
    "SegmentKind",
    "StandOff",
    "Strategy",
    "Tool",
    "Toolpath",
    "load_mesh",
    "raster",
    "raster_with_report",
    "stepover_for",
    "write_stl",
]
