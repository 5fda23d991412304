"""Designs of the shipped machines, for tests."""

from pentapod.design.geometry import Geometry
from pentapod.design.unknowns import Unknowns
from pentapod.machine import Machine


def geometry_of(name: str) -> Geometry:
    return Unknowns.of(Machine.load(name), {}).start
