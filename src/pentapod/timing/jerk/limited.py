"""Jerk-limited time law: sequential convex programming below the TOPP-RA profile, with S-curve starts and stops.

x(s) = ṡ² becomes a cubic spline. A leg's jerk is √x (q‴ x + 1.5 q″ x′ + 0.5 q′ x″); with 1/√x replaced by its
tangent at the last iterate the limit is linear, and stricter than the true one. So each pass is convex, its answer
keeps the true limits, and the next pass starts from it and can only improve: the last iterate is the best.

At rest √x has no derivative. The law leaves rest with constant jerk, x = c s^(4/3), and joins the spline after a
small part of the ramp, with the ramp's speed and acceleration; so it comes to rest.

Long profiles are solved in blocks that begin and end a lead beyond their cuts, where they may do as they like. About a
cut two blocks know the law, and it passes over from the one to the other where they agree best, by a fraction with two
vanishing derivatives; where they agree nowhere, or one has no law, all leads are doubled. Where the cuts are depends on
nothing but the number of gridpoints: so blocks from disk, or solved by several processes, are the same law, bit for
bit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.timing.jerk.eased import Eased, eased
from pentapod.timing.jerk.options import USUAL, JerkOptions
from pentapod.timing.jerk.part import Part
from pentapod.timing.jerk.passes import answer_of
from pentapod.timing.jerk.problem import Problem
from pentapod.timing.jerk.rows import NO_ROWS, JerkRows, Measure, Over, RowsAt, Run
from pentapod.timing.topp.stages import Failure

BLOCK = 65_536
"""Gridpoints of a block."""

LEAD = 1_024
"""Gridpoints by which a block reaches beyond its cuts, to begin with."""

_AGREED = 2e-3
"""Two blocks agree where their ṡ² differ by no more than this share."""

_PASSAGE = 128
"""Gridpoints over which the law passes from one block to the next."""

NOT_LIMITED = "no law below the fastest one keeps the jerk limits"
APART = "the blocks of a long path do not agree on a law that keeps the jerk limits"


@dataclass(frozen=True)
class Block:
    """Gridpoints from `low` to `high`, both included, of which those from `begin` to `end` are this block's own."""

    low: int
    begin: int
    end: int
    high: int

    def goes_on(self, count: int) -> tuple[bool, bool]:
        """Return whether a profile of `count` gridpoints goes on beyond the block's ends."""
        return self.low > 0, self.high < count - 1


@dataclass(frozen=True, eq=False)
class Solved:
    """A problem of stations from 0 on, which is `shift` metres along the path, and the coefficients that answer it.

    longer: seconds that lower limits cost where setpoints exceeded; exceeds: whether some still do.
    """

    problem: Problem
    y: Floats
    shift: float
    longer: float
    exceeds: bool

    def at(self, s: Floats) -> tuple[Floats, Floats]:
        """Return x and x′ (n,) at sorted stations s (n,) of the whole path."""
        knots = self.problem.knots
        v = self.problem.at(self.y, np.clip(s - self.shift, knots[0], knots[-1]))
        return v[:, 0], v[:, 1]

    def run(self, low: float, high: float) -> Run:
        """Return the law from `low` to before `high`, stations of the whole path; rests included."""
        s, x, slope = self.problem.run(self.y)
        s = s + self.shift
        own = (s >= low) & (s < high)
        return s[own], x[own], slope[own]


@dataclass(frozen=True, eq=False)
class SmoothProfile:
    """x = ṡ² (N,) and its slope x′ = 2 s̈ (N,) at stations (N,); jerk about constant between.

    longer: seconds that lower limits cost where setpoints exceeded; exceeds: whether some still do; lead: gridpoints by
    which the blocks reached beyond their cuts, from whose solutions it was joined.
    """

    s: Floats
    x: Floats
    slope: Floats
    longer: float
    exceeds: bool
    lead: int


def jerk_limited(
    s: Floats,
    x: Floats,
    rows_at: RowsAt,
    marks: Floats,
    *,
    options: JerkOptions = USUAL,
    least_step: float = 0.0,
    measure: Measure | None = None,
) -> SmoothProfile | Failure:
    """Return the fastest jerk-limited profile below x (N + 1,) at s (N + 1,).

    It rests at the ends where x is 0, and has the speed of x without acceleration where it is not. marks: where the
    path's third derivative has kinks. least_step: seconds below which the law needs no freedom. A Failure where the
    passes find nothing. measure: says where setpoints of a law exceed; there it is solved anew with lower limits.
    """
    return _joined(s, len(s), lambda block: solved(s, x, rows_at, marks, options, least_step, measure, block))


def blocks(count: int, lead: int) -> list[Block]:
    """Return the blocks of a profile of `count` gridpoints; what is left is a block, or part of one if it is small."""
    cuts = [0, *range(BLOCK, count - BLOCK // 2, BLOCK), count - 1]
    return [Block(max(a - lead, 0), a, b, min(b + lead, count - 1)) for a, b in pairwise(cuts)]


def leads(count: int) -> list[int]:
    """Return the leads to try, one after the other."""
    return [LEAD] if len(blocks(count, LEAD)) == 1 else [LEAD << k for k in range((BLOCK // LEAD).bit_length() - 1)]


def solved(
    s: Floats,
    x: Floats,
    rows_at: RowsAt,
    marks: Floats,
    options: JerkOptions,
    least_step: float,
    measure: Measure | None,
    block: Block,
) -> Solved | Failure:
    """Return the answer of one block, without its rows; arguments as for `jerk_limited`."""
    here, shift = slice(block.low, block.high + 1), float(s[block.low])
    local, rows = np.asarray(s[here]) - shift, partial(_shifted, rows_at, shift)
    part = Part.of(local, np.asarray(x[here]), rows, marks - shift, block.goes_on(len(s)), least_step, options)
    answer = answer_of(part)
    if answer is None:
        return Failure(-1, NOT_LIMITED)
    softer = Eased(answer, 0.0, exceeds=True)
    if measure is not None:
        softer = eased(*answer, partial(_measured, measure, shift))
    problem, y = softer.answer
    return Solved(replace(problem, rows=NO_ROWS), y, shift, softer.longer, softer.exceeds)


def runs_of(s: Floats, count: int, lead: int, parts: Iterable[Solved]) -> Iterator[Run | None]:
    """Yield the law in runs that follow each other, from the blocks' answers; None where two do not agree."""
    before: Solved | None = None
    low = -np.inf
    for block, part in zip(blocks(count, lead), parts, strict=True):
        if before is not None:
            marks = s[block.begin - lead // 2 : block.begin + lead // 2 + 1 : _PASSAGE]
            places = [_differing(before, part, float(a), float(b)) for a, b in pairwise(marks)]
            best = int(np.argmin(places))
            a, b = float(marks[best]), float(marks[best + 1])
            yield before.run(low, a)
            yield _passage(before, part, a, b) if places[best] <= _AGREED else None
            low = b
        before = part
    if before is not None:
        yield before.run(low, np.inf)


def _joined(s: Floats, count: int, solve: Callable[[Block], Solved | Failure]) -> SmoothProfile | Failure:
    """Return the law of the blocks' answers, with the first leads with which all have one and they agree."""
    reason = Failure(-1, APART)
    for lead in leads(count):
        parts = [solve(block) for block in blocks(count, lead)]
        found = [part for part in parts if isinstance(part, Solved)]
        if len(found) < len(parts):
            reason = Failure(-1, NOT_LIMITED)
            continue
        runs = list(runs_of(s, count, lead, found))
        if None not in runs:
            return _profile(runs, found, lead)
        reason = Failure(-1, APART)
    return reason


def _profile(runs: Sequence[Run | None], parts: Sequence[Solved], lead: int) -> SmoothProfile:
    columns = (np.concatenate([run[k] for run in runs if run is not None]) for k in range(3))
    longer, exceeds = sum(part.longer for part in parts), any(part.exceeds for part in parts)
    return SmoothProfile(*columns, longer=longer, exceeds=exceeds, lead=lead)


def _differing(left: Solved, right: Solved, low: float, high: float) -> float:
    """Return by which share the ṡ² of two blocks differ from `low` to `high` at most."""
    s = np.linspace(low, high, _PASSAGE)
    x, other = left.at(s)[0], right.at(s)[0]
    return float((np.abs(other - x) / np.maximum(x, other)).max())


def _passage(left: Solved, right: Solved, low: float, high: float) -> Run:
    """Return the law from `low` to before `high`, where it passes over from one block to the next."""
    s = np.unique(np.concatenate([[low], left.run(low, high)[0], right.run(low, high)[0]]))
    (x, slope), (other, other_slope) = left.at(s), right.at(s)
    u = (s - low) / (high - low)
    share, rise = u**3 * (10.0 - 15.0 * u + 6.0 * u**2), 30.0 * (u * (1.0 - u)) ** 2 / (high - low)
    return s, x + share * (other - x), slope + share * (other_slope - slope) + rise * (other - x)


def _shifted(rows_at: RowsAt, shift: float, s: Floats) -> JerkRows:
    """Return the rows at stations s (n,) from `shift` metres on."""
    return rows_at(s + shift)


def _measured(measure: Measure, shift: float, run: Run, between: Floats) -> Over:
    """Return where the law of a run exceeds whose stations begin `shift` metres on."""
    s, x, slope = run
    over = measure((s + shift, x, slope), between + shift)
    return replace(over, s=over.s - shift)
