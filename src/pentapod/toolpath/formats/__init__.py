"""Toolpath files: for each format a reader and a writer, side by side in one module that registers itself."""

from pentapod.toolpath.formats import apt, csv, gcode, npz, robodk
from pentapod.toolpath.formats.registry import FORMATS, Format, format_of, read_toolpath, write_toolpath
from pentapod.toolpath.formats.rotary import RotaryAxes, RotaryAxis

__all__ = [
    "FORMATS",
    "Format",
    "RotaryAxes",
    "RotaryAxis",
    "apt",
    "csv",
    "format_of",
    "gcode",
    "npz",
    "read_toolpath",
    "robodk",
    "write_toolpath",
]
