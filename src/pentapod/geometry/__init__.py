"""Geometry: rigid transforms, directions, polylines, interpolants, solids of revolution."""

from pentapod.geometry.directions import angle_between, arc_weights, normalised, partway, tangent_frame
from pentapod.geometry.polyline import arc_length
from pentapod.geometry.rigid import RigidTransform
from pentapod.geometry.runs import equal_runs, marked_runs, run_starts

__all__ = [
    "RigidTransform",
    "angle_between",
    "arc_length",
    "arc_weights",
    "equal_runs",
    "marked_runs",
    "normalised",
    "partway",
    "run_starts",
    "tangent_frame",
]
