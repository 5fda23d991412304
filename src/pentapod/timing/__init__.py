"""Timing: from a leg path to a trajectory that keeps the machine's limits (TOPP-RA)."""

from pentapod.timing.certificates import LimitUse, certify
from pentapod.timing.constraints import CONSTRAINTS
from pentapod.timing.explain import Cause, CostlyPlace, Explanation, explain
from pentapod.timing.law import MotionLaw
from pentapod.timing.override import override
from pentapod.timing.paths import LegPathLike, PieceLike
from pentapod.timing.process import Unheld, unheld
from pentapod.timing.retime import retime
from pentapod.timing.slowed import Slowed
from pentapod.timing.trajectory import Profile, Trajectory
from pentapod.timing.waypoints import WaypointMotion, through_waypoints

__all__ = [
    "CONSTRAINTS",
    "Cause",
    "CostlyPlace",
    "Explanation",
    "LegPathLike",
    "LimitUse",
    "MotionLaw",
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
