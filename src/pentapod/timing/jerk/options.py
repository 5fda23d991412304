"""Options of the jerk-limited time law: one frozen value for each of its algorithms."""

from __future__ import annotations

from dataclasses import dataclass

from pentapod.base.values import Value


@dataclass(frozen=True)
class KnotOptions(Value):
    """Knot placement for the spline x(s); a ramp is the time in which jerk brings accelerations to what they reach."""

    per_ramp: float = 8.0  # knots per ramp
    least: int = 96  # smallest number of knots of an interval
    rough_share: float = 0.5  # knots of the first, rough law as a share of those of the final one
    spare: float = 1.1  # factor on the acceleration that a law reaches at gridpoints, for what is between them
    kink_share: float = 0.05  # share of a limit that the path's curvature takes at kinks that become knots
    kink_reach: int = 2  # gridpoints on either side of a kink at which this share is looked for
    min_gap: float = 0.2  # share of the usual distance of knots below which one is dropped
    rest_growth: float = 1.5  # ratio of successive distances of knots from a rest
    steady_share: float = 0.5  # share of the limits below which a stretch of constant speed counts as steady
    steady_margin: float = 3.0  # ramps inside a steady stretch after which knots become sparser
    steady_growth: float = 0.3  # growth of the knots' distance in time per second of steady motion
    steady_most: float = 12.0  # largest distance of knots in steady stretches, as a multiple of the usual one


@dataclass(frozen=True)
class RampOptions(Value):
    """Ramps of constant jerk out of rests."""

    jerk_share: float = 0.98  # share of the jerk limit that a ramp uses
    length_share: float = 0.125  # largest length of a ramp as a share of the interval's
    join_share: float = 0.01  # distance from the rest at which the spline begins, as a share of the ramp's length
    shortening: float = 0.125  # factor on that distance where no law is found
    retries: int = 4  # how often a law is looked for again, each time with shorter ramps


@dataclass(frozen=True)
class SolverOptions(Value):
    """Convex subproblems and their interior-point method."""

    gridpoints_per_knot: int = 4  # gridpoints in each interval between knots
    window: int = 256  # coefficients of a window; its arrays then fit into a core's own cache
    seam_overlap: int = 64  # coefficients on either side of a seam, beyond which the law no longer depends on it
    cold_levels: tuple[float, ...] = (1.0, 0.1)  # slacks and multipliers tried as a start in the first pass
    warm_levels: tuple[float, ...] = (0.01, 0.1, 1.0)  # likewise where the start is nearly optimal
    known_level: float = 1e-3  # likewise where multipliers of a solve before are known; they count above it
    iterations: int = 60  # largest number of Newton steps
    gap: float = 1e-5  # duality gap, as a share of the objective, at which the method stops
    accepted_gap: float = 1e-3  # gap that is accepted where it does not get there
    accepted_residual: float = 1e-6  # largest residual of a row that is accepted
    x_floor: float = 1e-9  # smallest x to linearise about, as a share of its upper bound
    dip: float = 0.1  # smallest x halfway between gridpoints, as a share of the smaller one at their ends


@dataclass(frozen=True)
class BlockOptions(Value):
    """Decomposition of long profiles into blocks."""

    size: int = 65_536  # gridpoints of a block
    overlap: int = 1_024  # gridpoints by which a block reaches beyond its cuts in the first attempt
    agreement: float = 2e-3  # largest relative difference of ṡ², or share of a limit that passing adds, to agree
    blend: int = 128  # gridpoints over which the law passes from one block to the next


@dataclass(frozen=True)
class TighteningOptions(Value):
    """Constraint tightening where setpoints exceed limits."""

    rounds: int = 10  # how often limits are lowered
    extra: float = 0.003  # share by which they are lowered more than by the excess; grows by itself with each round
    least_left: float = 0.75  # smallest share of an acceleration or jerk limit that is left
    jerk_share: float = 0.7  # share of a jerk limit at gridpoints near which setpoints may exceed it
    acceleration_share: float = 0.9  # likewise of an acceleration limit


@dataclass(frozen=True)
class JerkOptions(Value):
    """Sequential convex programming for jerk-limited laws, and the options of its parts.

    passes: largest number of convex subproblems on the final knots. rough_passes: of those for the rough law by which
    knots are placed. min_gain: relative decrease of the duration below which the passes stop. bound_share: share of the
    profile without jerk limits above which the law counts as equal to it. halvings: how often knots are halved where
    the spline exceeds, between gridpoints, the shares over_jerk, over_acceleration or over_speed of a limit, or falls
    below the share under_speed of x beside it. local_growth: factor on the length of a local re-solve that found
    nothing.
    """

    passes: int = 8
    rough_passes: int = 2
    min_gain: float = 2e-4
    bound_share: float = 0.995
    halvings: int = 3
    over_jerk: float = 1.03
    over_acceleration: float = 1.005
    over_speed: float = 1.005
    under_speed: float = 0.2
    local_growth: int = 4
    knots: KnotOptions = KnotOptions()
    ramps: RampOptions = RampOptions()
    solver: SolverOptions = SolverOptions()
    blocks: BlockOptions = BlockOptions()
    tightening: TighteningOptions = TighteningOptions()


DEFAULTS = JerkOptions()
"""The options of `retime` where none are given."""
