"""JerkOptions: how long the jerk passes search for a faster law, and how closely they check it."""

from __future__ import annotations

from dataclasses import dataclass

from pentapod.base.values import Value


@dataclass(frozen=True)
class JerkOptions(Value):
    """Options of the jerk passes.

    passes: at most so many convex problems once the knots are where they stay. settled: a pass that shortens the law by
    a smaller share is the last one. rough_passes: passes of the rough law that the knots are laid by; rough_knots: how
    many knots that one has, as a share. knots_per_ramp: knots in the time in which jerk brings the accelerations to
    what they reach; least_knots: knots of a part at least. ramps: how often ramps out of rests are tried again, shorter
    than the one before. halvings: how often knots are halved where the spline exceeds, between gridpoints, the share
    over_jerk, over_push or over_speed of a limit, or falls below the share under_speed of ṡ² beside it. tightenings:
    how often limits are lowered where setpoints exceed them, each time by the share `tighter` more than would have to
    be; least_left: share of a limit that is left at least.
    """

    passes: int = 8
    settled: float = 2e-4
    rough_passes: int = 2
    rough_knots: float = 0.5
    knots_per_ramp: float = 8.0
    least_knots: int = 96
    ramps: int = 4
    halvings: int = 3
    over_jerk: float = 1.03
    over_push: float = 1.005
    over_speed: float = 1.005
    under_speed: float = 0.2
    tightenings: int = 10
    tighter: float = 0.003
    least_left: float = 0.75


USUAL = JerkOptions()
"""The options of `retime` where it is given none."""
