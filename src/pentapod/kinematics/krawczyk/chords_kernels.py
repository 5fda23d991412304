"""The proof of `pentapod.kinematics.proofs.chords`, many chords side by side, compiled.

Its bounds are computed in ordinary floating point; an allowance that exceeds the rounding (`ROUND`) is added to each.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.kinematics.krawczyk.cosine_kernels import (
    base_cosines_on_lines,
    fill_loose,
    joined,
    platform_cosines_on_lines,
)
from pentapod.kinematics.krawczyk.krawczyk_kernels import (
    RING_SLOPE,
    RING_VALUE,
    ROUND,
    angle_within,
    ring_region,
    sane,
    sided,
)
from pentapod.kinematics.krawczyk.lane_kernels import (
    LANES,
    contract,
    corrections,
    fill_defects,
    fill_lines,
    fill_spreads,
    inflate,
    invert,
    residuals,
)
from pentapod.kinematics.krawczyk.ring_kernels import norm, ring_bend
from pentapod.numerics.kernels import kernel


@kernel
def chords(  # noqa: PLR0912, PLR0915 - short loops
    legs: Floats,
    start: Floats,
    end: Floats,
    geometry: Floats,
    rings: Floats | None,
    signs: Floats,
    offsets: Floats,
    base_axes: Floats,
    bases: tuple[Floats, Floats, Floats, Floats],
    found: tuple[Bools, Floats, Floats, Floats, Floats, Floats],
) -> None:
    """Fill what `Chords` holds, in its order, for legs (H, 5, k + 1) and poses `start`, `end` (H, 6).

    geometry (6, 4): as in `krawczyk_kernels`; rings (LANES, 5, 9): theirs for each lane. bases: products (k + 1,
    k + 1), what l_a l_b contributes to coefficient a + b of l²; matrices that elevate from degree 2 to 2k, from 1 to k,
    and from 2 to max(k, 2), the last with further rows for k to max(k, 2).
    """
    products, squares_up, lines_up, cosines_up = bases
    proven, deviations, angles, speeds, base_cosines, platform_cosines = found
    k, size = legs.shape[2] - 1, geometry[5, 2]
    own, one, two, step = np.empty((5, k + 1, LANES)), np.empty((6, LANES)), np.empty((6, LANES)), np.empty((6, LANES))
    first, second, change = np.empty((5, 3, LANES)), np.empty((5, 3, LANES)), np.empty((5, 3, LANES))
    jacobian, inverse = np.zeros((6, 6, LANES)), np.empty((6, 6, LANES))
    defect, spread, spread_i = np.empty((6, 6, LANES)), np.empty((5, 3, LANES)), np.empty((3, LANES))
    residual, e, de = np.empty((6, 2 * k + 1, LANES)), np.empty((6, 2 * k + 1, LANES)), np.empty((6, 2 * k, LANES))
    slack, y, z, bound = np.empty((6, LANES)), np.empty((6, LANES)), np.empty((6, LANES)), np.empty((6, LANES))
    radius, q, off, room = np.empty((6, LANES)), np.empty((6, LANES)), np.empty((6, LANES)), np.empty((6, LANES))
    a, b, c, loose = np.empty(LANES), np.empty(LANES), np.empty(LANES), np.empty((2, LANES))
    good, bounded = np.empty(LANES, dtype=np.bool_), np.empty(LANES, dtype=np.bool_)
    for h in range(0, len(legs), LANES):
        count = min(LANES, len(legs) - h)
        for t in range(LANES):
            chord = h + min(t, count - 1)
            for r in range(6):
                one[r, t], two[r, t] = start[chord, r], end[chord, r]
            for j in range(5):
                for m in range(k + 1):
                    own[j, m, t] = legs[chord, j, m]
        fill_lines(one, two, geometry, first, second, change, step, jacobian, rings)
        invert(jacobian, defect, inverse)
        fill_defects(inverse, jacobian, defect)
        residuals(own, one, two, first, second, rings, squares_up, products, room[:3], residual)
        corrections(inverse, residual, size, rings, e, slack, y)
        # Whether Krawczyk's operator maps a box around the line into itself: as `enclosed`.
        inflate(y, size, radius)
        fill_spreads(geometry, change, step, radius, spread, spread_i)
        contract(inverse, defect, geometry, rings, spread, spread_i, radius, room, z)
        for r in range(6):
            for t in range(LANES):
                bound[r, t] = y[r, t] + z[r, t]
        for t in range(count):
            good[t] = sane(legs[h + t], start[h + t], end[h + t])
            for r in range(6):
                good[t] = good[t] and bound[r, t] < radius[r, t]
            good[t] = good[t] and sided(start[h + t], end[h + t], bound[:, t], signs, geometry)
            proven[h + t] = good[t]
        # The solution is known to be this near: with the smaller box the bounds become closer.
        fill_spreads(geometry, change, step, bound, spread, spread_i)
        contract(inverse, defect, geometry, rings, spread, spread_i, bound, room, z)
        for r in range(6):
            for t in range(LANES):
                z[r, t] += slack[r, t]
        _derivatives(e, slack, bound, inverse, geometry, rings, change, step, spread, spread_i, room, de, q, y)
        inflate(y, size, radius)
        contract(inverse, defect, geometry, rings, spread, spread_i, radius, room, off)
        for t in range(count):
            bounded[t] = good[t]
            for r in range(6):
                bounded[t] = bounded[t] and y[r, t] + off[r, t] < radius[r, t]
        for r in range(6):
            for t in range(LANES):
                off[r, t] += q[r, t]
        for p in range(len(offsets)):
            _farthest(e, step, 0.0, offsets[p], z, a)
            _farthest(de, step, 1.0, offsets[p], off, b)
            for t in range(count):
                deviations[h + t, p] = a[t] if good[t] else np.inf
                speeds[h + t, p] = b[t] if bounded[t] else np.inf
        _turned(e, a)
        for t in range(count):
            turn = np.sqrt(a[t]) + np.sqrt(z[3, t] ** 2 + z[4, t] ** 2 + z[5, t] ** 2)
            angles[h + t] = angle_within(turn) if good[t] else np.inf
        for j in range(5):
            base_cosines_on_lines(first[j], second[j], base_axes[j], own[j], lines_up, j, rings, a)
            platform_cosines_on_lines(first[j], second[j], one[3:], two[3:], own[j], cosines_up, b, c)
            fill_loose(bound, spread, spread_i, own[j], geometry, j, rings, loose)
            for t in range(count):
                if good[t]:
                    base_cosines[h + t, j] = a[t] - loose[0, t]
                    platform_cosines[h + t, j, 0], platform_cosines[h + t, j, 1] = (
                        b[t] - loose[1, t],
                        c[t] + loose[1, t],
                    )
                else:
                    base_cosines[h + t, j], platform_cosines[h + t, j, 0], platform_cosines[h + t, j, 1] = (
                        -1.0,
                        -1.0,
                        1.0,
                    )


@kernel
def _derivatives(  # noqa: PLR0912 - short loops
    e: Floats,
    slack: Floats,
    bound: Floats,
    inverse: Floats,
    geometry: Floats,
    rings: Floats | None,
    change: Floats,
    step: Floats,
    spread: Floats,
    spread_i: Floats,
    moved: Floats,
    de: Floats,
    q: Floats,
    least: Floats,
) -> None:
    """Fill e' (6, 2k, LANES), bounds q (6, LANES), and least (6, LANES): e' and q together. moved (6, LANES): room.

    J x' = (l l', 0) and C (J(x̃) x̃' − (l l', 0)) = e'. So f = x' − x̃' solves C J f = −e' − q with
    q = C (J(x) − J(x̃)) x̃', and |f + e'| ≤ |q| + |1 − C J| |f|.
    """
    size, degree = geometry[5, 2], de.shape[1]
    widened = 4.0 * degree  # what the rounding in slack adds to e'
    if rings is not None:
        widened = max(widened, RING_SLOPE / RING_VALUE)
    for r in range(6):
        for t in range(LANES):
            moved[r, t] = 0.0
    for n in range(3):
        for t in range(LANES):
            moved[5, t] += bound[3 + n, t] * (abs(step[3 + n, t]) + ROUND)
        for j in range(5):
            offset = abs(geometry[j, 3])
            for t in range(LANES):
                reach = bound[n, t] + offset * bound[3 + n, t]
                moved[j, t] += reach * (abs(change[j, n, t]) + ROUND * size)
    if rings is not None:
        for t in range(LANES):
            for j in range(5):
                ring = rings[t, j]
                if ring[8] > 0.0:
                    region = ring_region(spread[j, :, t], spread_i[:, t], abs(geometry[j, 3]))
                    length = norm(step[:3, t]), norm(step[3:, t])
                    moved[j, t] += ring[8] * ring_bend(ring, region, (norm(bound[:3, t]), norm(bound[3:, t])), length)
    for r in range(6):
        for t in range(LANES):
            total = widened * slack[r, t]
            for j in range(6):
                total += abs(inverse[r, j, t]) * moved[j, t]
            q[r, t] = total
        for t in range(LANES):
            least[r, t] = 0.0
        for m in range(degree):
            for t in range(LANES):
                de[r, m, t] = degree * (e[r, m + 1, t] - e[r, m, t])
            for t in range(LANES):
                least[r, t] = max(least[r, t], abs(de[r, m, t]))
        for t in range(LANES):
            least[r, t] += q[r, t]


@kernel
def _turned(e: Floats, out: Floats) -> None:
    """Fill the largest |e|² (LANES,) of the direction."""
    for t in range(LANES):
        out[t] = 0.0
    for m in range(e.shape[1]):
        for t in range(LANES):
            out[t] = max(out[t], e[3, m, t] ** 2 + e[4, m, t] ** 2 + e[5, m, t] ** 2)


@kernel
def _farthest(e: Floats, step: Floats, moving: float, offset: float, more: Floats, out: Floats) -> None:
    """Fill the largest |moving · step − e| (LANES,) of the point p + offset · i over e (6, n, LANES).

    With what p and i that `more` (6, LANES) bounds add to it.
    """
    for t in range(LANES):
        out[t] = 0.0
    for m in range(e.shape[1]):
        for t in range(LANES):
            x = moving * (step[0, t] + offset * step[3, t]) - e[0, m, t] - offset * e[3, m, t]
            y = moving * (step[1, t] + offset * step[4, t]) - e[1, m, t] - offset * e[4, m, t]
            z = moving * (step[2, t] + offset * step[5, t]) - e[2, m, t] - offset * e[5, m, t]
            out[t] = max(out[t], x * x + y * y + z * z)
    for t in range(LANES):
        out[t] = np.sqrt(out[t]) * (1.0 + ROUND)
    for t in range(LANES):
        out[t] += joined(more, t, abs(offset))
