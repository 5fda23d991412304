"""Timing: time-optimal trajectories along a leg path within the machine's limits (TOPP-RA, jerk limits)."""

from pentapod.timing.certificates import LimitUse, certify
from pentapod.timing.explain import Cause, CostlyPlace, Explanation, explain
from pentapod.timing.jerk.options import JerkOptions
from pentapod.timing.limits.limit import AccelerationRows, Limit
from pentapod.timing.limits.limits import LIMITS
from pentapod.timing.online.override import override
from pentapod.timing.path.path import LegPathLike, PathDerivatives, PieceLike
from pentapod.timing.retime import retime
from pentapod.timing.slow_cuts import SlowCut, slow_cuts
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
    "SlowCut",
    "Slowed",
    "Trajectory",
    "WaypointMotion",
    "certify",
    "explain",
    "override",
    "retime",
    "slow_cuts",
    "through_waypoints",
]
