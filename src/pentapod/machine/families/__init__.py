"""The robot families of machine files: a file each, with its keys of [geometry]."""

from pentapod.machine.families.registry import FAMILIES, Family, GeometryTable

__all__ = ["FAMILIES", "Family", "GeometryTable"]
