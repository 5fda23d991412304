"""Timing: from a leg path to a trajectory that keeps the machine's limits (TOPP-RA)."""

from pentapod.timing.certificates import LimitUse, certify
from pentapod.timing.explain import Cause, CostlyPlace, Explanation, explain
from pentapod.timing.jerk.options import JerkOptions
from pentapod.timing.limits.limit import AccelerationRows, Limit
from pentapod.timing.limits.limits import LIMITS
from pentapod.timing.online.override import override
from pentapod.timing.path.path import LegPathLike, PathDerivatives, PieceLike
from pentapod.timing.process import Unheld, unheld
from pentapod.timing.retime import retime
from pentapod.timing.time_law.motion_law import MotionLaw
from pentapod.timing.time_law.slowed import Slowed
from pentapod.timing.time_law.trajectory import Profile, Trajectory
from pentapod.timing.waypoints import WaypointMotion, through_waypoints

__all__ = [
    "LIMITS",
    "AccelerationRows",
    "Cause",
    "CostlyPlace",
    "Explanation",
    "JerkOptions",
    "LegPathLike",
    "Limit",
    "LimitUse",
    "MotionLaw",
    "PathDerivatives",
    "PieceLike",
    "Profile",
    "Slowed",
    "Trajectory",
    "Unheld",
    "WaypointMotion",
    "certify",
    "explain",
    "override",
    "retime",
    "through_waypoints",
    "unheld",
]
