"""Geometry without a robot in it: rigid transforms, directions, polylines, Bernstein polynomials."""

from pentapod.geometry.directions import angle_between, arc_weights, normalised, partway, tangent_frame
from pentapod.geometry.level_set import enclosed_volume, zero_surface
from pentapod.geometry.polyline import arc_length
from pentapod.geometry.rigid import RigidTransform
from pentapod.geometry.runs import equal_runs, marked_runs, run_starts
from pentapod.numerics.bernstein import (
    convolve,
    derivative,
    elevate,
    evaluate,
    from_power,
    hull,
    multiply,
    scaled,
    split,
    to_power,
    unscaled,
)
from pentapod.numerics.positivity import Positivity, positivity

__all__ = [
    "Positivity",
    "RigidTransform",
    "angle_between",
    "arc_length",
    "arc_weights",
    "convolve",
    "derivative",
    "elevate",
    "enclosed_volume",
    "equal_runs",
    "evaluate",
    "from_power",
    "hull",
    "marked_runs",
    "multiply",
    "normalised",
    "partway",
    "positivity",
    "run_starts",
    "scaled",
    "split",
    "tangent_frame",
    "to_power",
    "unscaled",
    "zero_surface",
]
