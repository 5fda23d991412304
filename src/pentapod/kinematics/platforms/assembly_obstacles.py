"""Why leg lengths have no pose: the inequality that they violate, and by how much."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pentapod.base.arrays import Bools, Floats, as_batch
from pentapod.base.values import Value
from pentapod.kinematics.families.general import GeneralPentapod
from pentapod.kinematics.families.quadratic import LinearPentapod
from pentapod.kinematics.forward.line_equations import LineEquations
from pentapod.kinematics.forward.line_roots import interior
from pentapod.kinematics.forward.quadratic_near import self_motions
from pentapod.kinematics.forward.solution_line import SolutionLine
from pentapod.kinematics.platforms.six_leg import SixLegPlatform
from pentapod.numerics.blocks import blocks

_EPS = float(np.finfo(np.float64).eps)


class AssemblyObstacle(IntEnum):
    """The first inequality, in this order, that no point of the solution line fulfils (kinematics notes, section 5)."""

    NONE = 0
    NOT_A_LENGTH = 1
    DIRECTION = 2
    POSITION = 3
    APART = 4
    ANGLE = 5
    SIXTH_LEG = 6
    SELF_MOTION = 7

    @property
    def inequality(self) -> str:
        """The inequality that is violated, in the formulas' symbols (p is leg 3's platform joint)."""
        return _INEQUALITIES[self]


_INEQUALITIES = {
    AssemblyObstacle.NONE: "none: a pose exists",
    AssemblyObstacle.NOT_A_LENGTH: "0 ≤ l_i < ∞ for every leg",
    AssemblyObstacle.DIRECTION: "u² + v² ≤ 1: the direction's horizontal part is too long",
    AssemblyObstacle.POSITION: "px² + py² ≤ l_3²: leg 3 is too short for the horizontal position",
    AssemblyObstacle.APART: "u² + v² ≤ 1 and px² + py² ≤ l_3² at once: each can hold, but not both together",
    AssemblyObstacle.ANGLE: "|t − px u − py v| ≤ |pz w|: leg 3 and the line cannot include the angle",
    AssemblyObstacle.SIXTH_LEG: "|M − r| ≤ √(l_6² − h²) ≤ M + r: the sixth leg never reaches the platform",
    AssemblyObstacle.SELF_MOTION: "w = 0 and u = 1/δ: a self-motion, a whole circle of poses has these lengths",
}


@dataclass(frozen=True, eq=False)
class AssemblyObstacles(Value):
    """What keeps legs (..., 5) from being assembled: an `AssemblyObstacle` (...) for each, and the shortfall (...).

    The shortfall is by how much the inequality fails where it fails least, relative to its right-hand side; for
    ANGLE relative to l_3, for SIXTH_LEG by how much l_6 must change, relative to itself. 0 where a pose exists, NaN
    for NOT_A_LENGTH and SELF_MOTION. For APART it is taken in the middle of the gap. SELF_MOTION means that to within
    rounding the legs leave a motion free (quadratic family, |δ| ≥ 1): none of its poses is the one of a mode.
    """

    obstacle: NDArray[np.int8]
    shortfall: Floats

    @property
    def exists(self) -> Bools:
        """Whether a pose exists (...)."""
        return self.obstacle == AssemblyObstacle.NONE

    def explain(self, *index: int) -> str:
        """Return a sentence on the element at this index."""
        obstacle, shortfall = AssemblyObstacle(int(self.obstacle[index])), float(self.shortfall[index])
        if obstacle is AssemblyObstacle.NONE:
            return "a pose exists"
        if obstacle is AssemblyObstacle.SELF_MOTION:
            return f"no isolated pose: {obstacle.inequality}"
        amount = "" if np.isnan(shortfall) else f" (missed by a relative {shortfall:.3g})"
        return f"no assembly: violates {obstacle.inequality}{amount}"


def assembly_obstacles(pentapod: LinearPentapod | GeneralPentapod, legs: ArrayLike) -> AssemblyObstacles:
    """Return for leg lengths (..., 5), metres, whether a pose exists, and if none the inequality that fails.

    A pose exists exactly where the pentapod's `assembly_modes` has one. Raises ArrayError for a wrong shape;
    LinAlgError cannot occur for a pentapod that was built.
    """
    lengths = as_batch(legs, "legs", (5,))
    flat = lengths.reshape(-1, 5)
    obstacle = np.full(len(flat), AssemblyObstacle.NOT_A_LENGTH, dtype=np.int8)
    shortfall = np.full(len(flat), np.nan)
    equations = LineEquations.of(pentapod.base, pentapod.offsets)
    for block in blocks(len(flat)):
        some, missed, part = obstacle[block], shortfall[block], flat[block]
        exists = np.isfinite(pentapod.assembly_modes(part)[0]).all(axis=(1, 2))
        some[exists], missed[exists] = AssemblyObstacle.NONE, 0.0
        lost = np.flatnonzero(np.isfinite(part).all(axis=-1) & (part >= 0.0).all(axis=-1) & ~exists)
        some[lost], missed[lost] = _judge(SolutionLine.of(equations, np.square(part[lost].T)))
        if isinstance(pentapod, LinearPentapod):
            with np.errstate(invalid="ignore", over="ignore", under="ignore"):
                free = lost[self_motions(part[lost].T.copy(), pentapod.linear_part, pentapod.delta)]
            some[free], missed[free] = AssemblyObstacle.SELF_MOTION, np.nan
    return AssemblyObstacles(obstacle.reshape(lengths.shape[:-1]), shortfall.reshape(lengths.shape[:-1]))


def platform_obstacles(platform: SixLegPlatform, legs: ArrayLike) -> AssemblyObstacles:
    """Return the same for the leg lengths (..., 6), metres, of a platform with a sixth leg."""
    lengths = as_batch(legs, "legs", (6,))
    sixth = lengths[..., 5, None]
    line = assembly_obstacles(platform.pentapod, lengths[..., :5])
    shortest, longest = platform.sixth_leg_range(*platform.pentapod.assembly_modes(lengths[..., :5]))
    missed = np.maximum(np.maximum(shortest - sixth, sixth - longest), 0.0)
    shortfall = np.where(line.exists, np.where(line.exists[..., None], missed, 0.0).min(axis=-1), np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        shortfall = shortfall / lengths[..., 5]
    bad = ~(np.isfinite(sixth[..., 0]) & (sixth[..., 0] >= 0.0))
    assembled = np.isfinite(platform.assembly_modes(lengths)[0]).all(axis=-1).any(axis=-1)
    obstacle = np.where(line.exists & ~assembled, AssemblyObstacle.SIXTH_LEG, line.obstacle)
    obstacle = np.where(bad, AssemblyObstacle.NOT_A_LENGTH, obstacle).astype(np.int8)
    shortfall = np.where(obstacle == AssemblyObstacle.SIXTH_LEG, shortfall, line.shortfall)
    return AssemblyObstacles(obstacle, np.where(bad, np.nan, shortfall))


def _judge(line: SolutionLine) -> tuple[NDArray[np.int8], Floats]:
    """Return obstacle and shortfall (N,) of solution lines without a pose."""
    best = interior(line, thorough=True)
    (low1, high1), (low2, high2) = line.directions(), line.positions()
    reach = line.reach_squared
    safe = np.where(reach > 0.0, reach, 1.0)

    def excess(low: Floats, high: Floats) -> tuple[Floats, Floats]:
        bounded = np.isfinite(low)  # else it is the same everywhere
        values = line.factors(0.5 * (np.where(bounded, low, 0.0) + np.where(bounded, high, 0.0)))
        return -values.d1, -values.e / safe

    in_direction, in_position = excess(low1, high1)[0], excess(low2, high2)[1]
    apart = np.maximum(*excess(best.tau, best.tau))
    angle = -line.factors(best.tau).margin()[0] / np.sqrt(safe)
    missed = np.stack([in_direction, in_position, apart, angle])
    failed = np.stack([~(low1 < high1) | np.isinf(low1), ~(low2 < high2) | np.isinf(low2)])
    failed &= np.stack([in_direction, in_position]) > 0.0
    failed = np.concatenate([failed, [np.maximum(low1, low2) > np.minimum(high1, high2)], [np.ones_like(best.exists)]])
    first = np.argmax(failed, axis=0)
    shortfall = np.take_along_axis(missed, first[None], axis=0)[0]
    return (first + AssemblyObstacle.DIRECTION).astype(np.int8), np.maximum(shortfall, _EPS)
