"""The two passes without a compiler, over all gridpoints at once: policy iteration.

Towards a rest, where x may be anything down to 0, each pass is x_i = min(cap_i, min_j α_ij + β_ij x_{i+1}): what the
row j allows at i, given x next to it. Which of these holds at each gridpoint is a policy, and the policy's x solves
chains of linear equations, each ending at a gridpoint that runs at its cap. Where a row then asks for less it becomes
the policy, and the chains it touches are solved again, until none does (R. A. Howard, *Dynamic Programming and Markov
Processes*, 1960). A pass takes some dozens of rounds, but most of these are short: a gridpoint is looked at one or two
times.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import get_lapack_funcs

from pentapod.arrays import Floats
from pentapod.timing.stage_rows import StageRows, right_root
from pentapod.timing.stages import Failure, admitted

_ROUNDS = 1000
_LESS = 1.0 - 1e-15
"""A row takes over where it asks for less than this share: rounding must not send two rows round in circles."""


def by_chains(rows: StageRows, x_start: float) -> Floats | Failure | None:
    """Return the largest x (N,) from x_start to a rest, why there is none, or None where chains do not do."""
    distinct = np.append(True, rows.twice[:-1] > 0.0)
    if not distinct.all():  # where a gridpoint comes twice x stays: both sides' rows and ceilings hold there
        stages = np.append(np.flatnonzero(distinct[1:]), len(distinct) - 1)
        ceiling = np.minimum.reduceat(rows.ceiling, np.flatnonzero(distinct))
        once = StageRows(rows.lows[stages], rows.highs[stages], rows.slopes[stages], rows.twice[stages], ceiling)
        x = by_chains(once, x_start)
        return x[np.cumsum(distinct) - 1] if isinstance(x, np.ndarray) else None
    caps = _caps(rows) if len(distinct) > 1 and np.isfinite(rows.ceiling).all() else None
    if caps is None:
        return None
    lows, highs, twice = rows.lows[:-1, :-1], rows.highs[:-1, :-1], rows.twice[:-1, None]
    gains = 1.0 - twice * rows.slopes[:-1, :-1]
    # Towards the start a row allows x ≤ (x_next − 2Δs low) / gain; a gain below 0 bounds x from the other side.
    high = _least(
        caps,
        np.where(gains > 0.0, -twice * lows / gains, np.inf),
        np.where(gains > 0.0, 1.0 / gains, 0.0),
        0.0,
    )
    if high is None:
        return None
    start = admitted(x_start, 0.0, float(high[0]))
    if isinstance(start, Failure):
        return start
    # Forwards it allows x_next ≤ gain x + 2Δs high: the same, seen from the other end.
    x = _least(high[:0:-1], (twice * highs)[::-1], gains[::-1], start)
    return None if x is None else np.maximum(x[::-1], 0.0)


def _caps(rows: StageRows) -> Floats | None:
    """Return the largest x (N − 1,) at which the rows leave an interval of u that does not end below x = 0."""
    lows, highs, slopes, caps = (y[:-1] for y in (rows.lows, rows.highs, rows.slopes, rows.ceiling))
    low = np.array(lows)
    low[:, -1] = 0.0  # u may brake to a rest at the next gridpoint, no further
    t = slopes * caps[:, None]
    tight = np.flatnonzero((low - t).max(axis=1) > (highs - t).min(axis=1))
    low, highs, slopes = (np.ascontiguousarray(y[tight].T) for y in (low, highs, slopes))
    x, lost = right_root(low, highs, slopes, caps[tight])
    caps = caps.copy()
    caps[tight] = x
    return None if lost.any() else caps


def _least(caps: Floats, offsets: Floats, gains: Floats, last: float) -> Floats | None:
    """Return x (N + 1,) with x_i = min(caps_i, min_j offsets_ij + gains_ij x_{i+1}), its end given; None if not found.

    caps (N,); offsets, gains (N, J).
    """
    (solve_triangular_band,) = get_lapack_funcs(("tbtrs",), (caps,))
    x = np.append(caps, last)
    policy = np.full(len(caps), -1)  # the row that holds, −1 for the cap
    offset, gain = caps.copy(), np.zeros(len(caps))
    at = np.arange(len(caps))
    for _ in range(_ROUNDS):
        asked = offsets[at] + gains[at] * x[at + 1, None]
        row = asked.argmin(axis=1)
        least, cap = asked[np.arange(len(at)), row], caps[at]
        less = np.flatnonzero(np.minimum(least, cap) < _LESS * x[at])
        if not len(less):
            return x
        changed, row, capped = at[less], row[less], cap[less] <= least[less]
        policy[changed] = np.where(capped, -1, row)
        offset[changed] = np.where(capped, cap[less], offsets[changed, row])
        gain[changed] = np.where(capped, 0.0, gains[changed, row])
        # All chains with a gridpoint that changed, from the one after a cap to the next cap.
        chain = np.cumsum(policy < 0) - (policy < 0)
        touched = np.zeros(chain[-1] + 1, dtype=bool)
        touched[chain[changed]] = True
        solve = np.flatnonzero(touched[chain])
        band = np.zeros((2, len(solve) + 1))
        band[0, 1:] = -gain[solve]
        right = np.append(offset[solve], x[solve[-1] + 1])
        found = solve_triangular_band(band, right, uplo="U", diag="U")[0][:-1]
        moved = found != x[solve]
        x[solve] = found
        at = solve[moved]
        at = at[at > 0] - 1
    return None
