"""Jerk-limited time law: sequential convex programming below the TOPP-RA profile, with S-curve starts and stops.

x(s) = ṡ² becomes a cubic spline. A leg's jerk is √x (q‴ x + 1.5 q″ x′ + 0.5 q′ x″); with 1/√x replaced by its
tangent at the last iterate the limit is linear, and stricter than the true one. So each subproblem is convex, its
answer keeps the true limits, and the next one starts from it and can only improve: the last iterate is the best.

At rest √x has no derivative. The law leaves rest with constant jerk, x = c s^(4/3), and joins the spline after a
small part of the ramp, with the ramp's speed and acceleration.

Long profiles are solved in blocks that overlap, on all cores; beyond their cuts they are free. About a cut both blocks
have a law, and the law passes from one to the other where they agree best, by a fraction with two vanishing
derivatives. Where they agree nowhere, or one has no law, the overlap at that cut is doubled.
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

    def at(self, s: Floats) -> Floats:
        """Return x, x′, x″ (n, 3) at sorted stations s (n,) of the whole path."""
        knots = self.problem.knots
        return self.problem.at(self.y, np.clip(s - self.shift, knots[0], knots[-1]))

    def nodes(self, low: float, high: float) -> SpeedNodes:
        """Return the law from `low` to before `high`, stations of the whole path; rests included."""
        nodes = self.problem.nodes(self.y)
        s = nodes.s + self.shift
        own = (s >= low) & (s < high)
        return SpeedNodes(s[own], nodes.x[own], nodes.slope[own])


@dataclass(frozen=True, eq=False)
class JerkProfile:
    """Nodes of a jerk-limited profile; the jerk is about constant between them.

    longer: seconds that tightening has added; exceeds: whether setpoints still exceed limits; overlap: most
    gridpoints by which its blocks reached beyond a cut.
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

    @property
    def cuts(self) -> list[int]:
        """The gridpoints between blocks; a small rest is part of the last block."""
        size = self.options.blocks.size
        return list(range(size, len(self.s) - size // 2, size))

    def blocks(self, overlaps: list[int]) -> list[Block]:
        """Return the blocks. overlaps: gridpoints by which they reach beyond each cut."""
        last = len(self.s) - 1
        ends, beyond = pairwise([0, *self.cuts, last]), pairwise([0, *overlaps, 0])
        return [Block(max(a - p, 0), a, b, min(b + q, last)) for (a, b), (p, q) in zip(ends, beyond, strict=True)]

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

    def seam(self, cut: int, overlap: int, before: BlockLaw, after: BlockLaw) -> tuple[float, float] | None:
        """Return the stations about a cut between which one law passes to the next; None where they do not agree."""
        options = self.options.blocks
        marks = self.s[cut - overlap // 2 : cut + overlap // 2 + 1 : options.blend]
        places = [(float(a), float(b)) for a, b in pairwise(marks)]
        for measure in (partial(_difference, count=options.blend), self._excess):
            found = [measure(before, after, *place) for place in places]
            best = int(np.argmin(found))
            if found[best] <= options.agreement:
                return places[best]
        return None

    def _excess(self, left: BlockLaw, right: BlockLaw, low: float, high: float) -> float:
        """Return the share of a limit by which passing from one law to the other exceeds the limit and both laws."""
        s = np.linspace(low, high, 4 * self.options.blocks.blend)
        rows, laws = self.rows_at(s), (left.at(s), right.at(s))
        passing = _passed(*laws, low, high, s)
        return max(
            float((shares(passing) - np.maximum(shares(laws[0]), shares(laws[1])).clip(1.0)).max())
            for shares in (rows.acceleration_shares, rows.jerk_shares)
        )


def jerk_limited(problem: JerkProblem) -> JerkProfile | Failure:
    """Return the fastest jerk-limited profile, with the first overlaps at which all blocks have a law and agree.

    Only the blocks beside a cut whose overlap is doubled are solved again.
    """
    options, cuts, laws = problem.options.blocks, problem.cuts, dict[Block, BlockLaw | Failure]()
    overlaps = [options.overlap] * len(cuts)
    while True:
        blocks = problem.blocks(overlaps)
        asked = [block for block in blocks if block not in laws]
        answers = dict(zip(asked, in_threads(problem.solved, asked), strict=True))
        laws = {block: answers[block] if block in answers else laws[block] for block in blocks}
        found = list(laws.values())
        seams = [
            None if isinstance(left, Failure) or isinstance(right, Failure) else problem.seam(cut, overlap, left, right)
            for cut, overlap, left, right in zip(cuts, overlaps, found[:-1], found[1:], strict=True)
        ]
        solved, agreed = [law for law in found if isinstance(law, BlockLaw)], [seam for seam in seams if seam]
        if len(solved) == len(found) and len(agreed) == len(seams):
            longer, exceeds = sum(law.longer for law in solved), any(law.exceeds for law in solved)
            return JerkProfile(_joined(solved, agreed), longer, exceeds, max(overlaps, default=options.overlap))
        short = [k for k, seam in enumerate(seams) if seam is None]
        if not short or 4 * max(overlaps[k] for k in short) > options.size:
            return NO_LAW if len(solved) < len(found) else NO_AGREEMENT
        for k in short:
            overlaps[k] *= 2


def _joined(laws: list[BlockLaw], seams: list[tuple[float, float]]) -> SpeedNodes:
    """Return the law of the blocks' laws. seams: the stations between which each passes to the next."""
    low, parts = -np.inf, list[SpeedNodes]()
    for (before, after), (a, b) in zip(pairwise(laws), seams, strict=True):
        parts += [before.nodes(low, a), _blended(before, after, a, b)]
        low = b
    parts.append(laws[-1].nodes(low, np.inf))
    return SpeedNodes(*(np.concatenate([getattr(part, name) for part in parts]) for name in ("s", "x", "slope")))


def _difference(left: BlockLaw, right: BlockLaw, low: float, high: float, count: int) -> float:
    """Return the largest relative difference of the ṡ² of two blocks at `count` stations from `low` to `high`."""
    s = np.linspace(low, high, count)
    x, other = left.at(s)[:, 0], right.at(s)[:, 0]
    return float((np.abs(other - x) / np.maximum(x, other)).max())


def _blended(left: BlockLaw, right: BlockLaw, low: float, high: float) -> SpeedNodes:
    """Return the law from `low` to before `high`, where it passes from one block to the next."""
    s = np.unique(np.concatenate([[low], left.nodes(low, high).s, right.nodes(low, high).s]))
    v = _passed(left.at(s), right.at(s), low, high, s)
    return SpeedNodes(s, v[:, 0], v[:, 1])


def _passed(one: Floats, other: Floats, low: float, high: float, s: Floats) -> Floats:
    """Return x, x′, x″ (n, 3) at stations s (n,) of the law that passes from one to the other, both (n, 3)."""
    width, away = high - low, other - one
    u = (s - low) / width
    share, rise = u**3 * (10.0 - 15.0 * u + 6.0 * u**2), 30.0 * (u * (1.0 - u)) ** 2 / width
    bend = 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / width**2
    v = one + share[:, None] * away
    v[:, 1] += rise * away[:, 0]
    v[:, 2] += 2.0 * rise * away[:, 1] + bend * away[:, 0]
    return np.asarray(v, dtype=np.float64)


def _shifted(rows_at: RowsAt, shift: float, s: Floats) -> JerkRows:
    """Return the rows at stations s (n,) from `shift` metres on."""
    return rows_at(s + shift)


def _measured(measure: MeasureExcess, shift: float, nodes: SpeedNodes, between: Floats) -> Excess:
    """Return where a law whose stations begin `shift` metres along the path exceeds limits."""
    over = measure(SpeedNodes(nodes.s + shift, nodes.x, nodes.slope), between + shift)
    return replace(over, s=over.s - shift)
