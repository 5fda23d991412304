"""Jerk-limited time law: sequential convex programming below the TOPP-RA profile, with S-curve starts and stops.

x(s) = ṡ² becomes a cubic spline. A leg's jerk is √x (q‴ x + 1.5 q″ x′ + 0.5 q′ x″); with 1/√x replaced by its
tangent at the last iterate the limit is linear, and stricter than the true one. So each subproblem is convex, its
answer keeps the true limits, and the next one starts from it and can only improve: the last iterate is the best.

At rest √x has no derivative. The law leaves rest with constant jerk, x = c s^(4/3), and joins the spline after a
small part of the ramp, with the ramp's speed and acceleration.

Long profiles are solved in blocks that overlap, on all cores; beyond their cuts they are free. About a cut both blocks
have a law, and the law passes from one to the other where they agree best, by a fraction with two vanishing
derivatives. Where they agree nowhere, or one has no law, the overlap is doubled.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.numerics.threads import in_threads
from pentapod.timing.jerk.interval import Interval
from pentapod.timing.jerk.options import DEFAULTS, JerkOptions
from pentapod.timing.jerk.passes import fastest_law
from pentapod.timing.jerk.rows import NO_ROWS, Excess, JerkRows, MeasureExcess, RowsAt
from pentapod.timing.jerk.subproblem import Subproblem
from pentapod.timing.jerk.tightening import tightened
from pentapod.timing.time_law.motion_law import SpeedNodes
from pentapod.timing.topp.stages import Failure

NO_LAW = Failure(-1, "no time law keeps the jerk limits")
NO_AGREEMENT = Failure(-1, "the blocks of a long path do not agree on a time law that keeps the jerk limits")


@dataclass(frozen=True)
class Block:
    """Gridpoints from `low` to `high`, both included, of which those from `begin` to `end` are this block's own."""

    low: int
    begin: int
    end: int
    high: int


@dataclass(frozen=True, eq=False)
class BlockLaw:
    """A block's subproblem, whose stations begin `shift` metres along the path, and the coefficients that solve it.

    longer: seconds that tightening has added; exceeds: whether setpoints still exceed limits.
    """

    problem: Subproblem
    y: Floats
    shift: float
    longer: float
    exceeds: bool

    def at(self, s: Floats) -> tuple[Floats, Floats]:
        """Return x and x′ (n,) at sorted stations s (n,) of the whole path."""
        knots = self.problem.knots
        v = self.problem.at(self.y, np.clip(s - self.shift, knots[0], knots[-1]))
        return v[:, 0], v[:, 1]

    def nodes(self, low: float, high: float) -> SpeedNodes:
        """Return the law from `low` to before `high`, stations of the whole path; rests included."""
        nodes = self.problem.nodes(self.y)
        s = nodes.s + self.shift
        own = (s >= low) & (s < high)
        return SpeedNodes(s[own], nodes.x[own], nodes.slope[own])


@dataclass(frozen=True, eq=False)
class JerkProfile:
    """Nodes of a jerk-limited profile; the jerk is about constant between them.

    longer: seconds that tightening has added; exceeds: whether setpoints still exceed limits; overlap: gridpoints by
    which its blocks reached beyond their cuts.
    """

    nodes: SpeedNodes
    longer: float
    exceeds: bool
    overlap: int


@dataclass(frozen=True, eq=False)
class JerkProblem:
    """The fastest jerk-limited profile below x (N,) at s (N,).

    It rests at the ends where x is 0, and has the speed of x without acceleration where it is not. kinks: where the
    path's third derivative jumps. least_step: seconds below which knots are not closer. measure: where setpoints of a
    law exceed limits; there these are lowered and it is solved again.
    """

    s: Floats
    x: Floats
    rows_at: RowsAt
    kinks: Floats
    options: JerkOptions = DEFAULTS
    least_step: float = 0.0
    measure: MeasureExcess | None = None

    def blocks(self, overlap: int) -> list[Block]:
        """Return the blocks; a small rest is part of the last one."""
        last, size = len(self.s) - 1, self.options.blocks.size
        cuts = [0, *range(size, last + 1 - size // 2, size), last]
        return [Block(max(a - overlap, 0), a, b, min(b + overlap, last)) for a, b in pairwise(cuts)]

    def overlaps(self) -> list[int]:
        """Return the overlaps of blocks to try, one after the other."""
        size, first = self.options.blocks.size, self.options.blocks.overlap
        doubled = [first << k for k in range((size // first).bit_length() - 1)]
        return [first] if len(self.blocks(first)) == 1 else doubled

    def solved(self, block: Block) -> BlockLaw | Failure:
        """Return the law of one block, without its rows."""
        here, shift, last = slice(block.low, block.high + 1), float(self.s[block.low]), len(self.s) - 1
        interval = Interval.of(
            np.asarray(self.s[here]) - shift,
            np.asarray(self.x[here]),
            partial(_shifted, self.rows_at, shift),
            self.kinks - shift,
            (block.low > 0, block.high < last),
            self.least_step,
            self.options,
        )
        answer = fastest_law(interval)
        if answer is None:
            return NO_LAW
        longer, exceeds = 0.0, True
        if self.measure is not None:
            answer, longer, exceeds = tightened(*answer, partial(_measured, self.measure, shift))
        problem, y = answer
        return BlockLaw(replace(problem, rows=NO_ROWS, multipliers=NO_ROWS.jerks), y, shift, longer, exceeds)

    def joined(self, overlap: int, laws: list[BlockLaw]) -> SpeedNodes | None:
        """Return the law of the blocks' laws, None where two do not agree."""
        options, low = self.options.blocks, -np.inf
        parts: list[SpeedNodes] = []
        for block, (before, after) in zip(self.blocks(overlap)[1:], pairwise(laws), strict=True):
            marks = self.s[block.begin - overlap // 2 : block.begin + overlap // 2 + 1 : options.blend]
            differences = [_difference(before, after, float(a), float(b), options.blend) for a, b in pairwise(marks)]
            best = int(np.argmin(differences))
            if not differences[best] <= options.agreement:
                return None
            a, b = float(marks[best]), float(marks[best + 1])
            parts += [before.nodes(low, a), _blended(before, after, a, b)]
            low = b
        parts.append(laws[-1].nodes(low, np.inf))
        return SpeedNodes(*(np.concatenate([getattr(part, name) for part in parts]) for name in ("s", "x", "slope")))


def jerk_limited(problem: JerkProblem) -> JerkProfile | Failure:
    """Return the fastest jerk-limited profile, with the first overlap at which all blocks have a law and agree."""
    reason = NO_AGREEMENT
    for overlap in problem.overlaps():
        found = list(in_threads(problem.solved, problem.blocks(overlap)))
        laws = [law for law in found if isinstance(law, BlockLaw)]
        nodes = problem.joined(overlap, laws) if len(laws) == len(found) else None
        if nodes is not None:
            longer, exceeds = sum(law.longer for law in laws), any(law.exceeds for law in laws)
            return JerkProfile(nodes, longer, exceeds, overlap)
        reason = NO_LAW if len(laws) < len(found) else NO_AGREEMENT
    return reason


def _difference(left: BlockLaw, right: BlockLaw, low: float, high: float, count: int) -> float:
    """Return the largest relative difference of the ṡ² of two blocks at `count` stations from `low` to `high`."""
    s = np.linspace(low, high, count)
    x, other = left.at(s)[0], right.at(s)[0]
    return float((np.abs(other - x) / np.maximum(x, other)).max())


def _blended(left: BlockLaw, right: BlockLaw, low: float, high: float) -> SpeedNodes:
    """Return the law from `low` to before `high`, where it passes from one block to the next."""
    s = np.unique(np.concatenate([[low], left.nodes(low, high).s, right.nodes(low, high).s]))
    (x, slope), (other, other_slope) = left.at(s), right.at(s)
    u = (s - low) / (high - low)
    share, rise = u**3 * (10.0 - 15.0 * u + 6.0 * u**2), 30.0 * (u * (1.0 - u)) ** 2 / (high - low)
    return SpeedNodes(s, x + share * (other - x), slope + share * (other_slope - slope) + rise * (other - x))


def _shifted(rows_at: RowsAt, shift: float, s: Floats) -> JerkRows:
    """Return the rows at stations s (n,) from `shift` metres on."""
    return rows_at(s + shift)


def _measured(measure: MeasureExcess, shift: float, nodes: SpeedNodes, between: Floats) -> Excess:
    """Return where a law whose stations begin `shift` metres along the path exceeds limits."""
    over = measure(SpeedNodes(nodes.s + shift, nodes.x, nodes.slope), between + shift)
    return replace(over, s=over.s - shift)
