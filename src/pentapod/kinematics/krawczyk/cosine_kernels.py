"""Bounds of the cosines at the joints of the legs, many lines of poses side by side, compiled; see `lane_kernels`."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.kinematics.krawczyk.krawczyk_kernels import ROUND, ring_region
from pentapod.kinematics.krawczyk.lane_kernels import LANES
from pentapod.kinematics.krawczyk.ring_kernels import ring_swing
from pentapod.numerics.kernels import kernel


@kernel
def base_cosines_on_lines(
    first: Floats,
    second: Floats,
    axis: Floats,
    legs: Floats,
    lines_up: Floats,
    j: int,
    rings: Floats | None,
    out: Floats,
) -> None:
    """Fill the least (v · axis − off) / l (LANES,), v on the lines from first to second, l of coefficients (k + 1,).

    A quotient of polynomials lies between the quotients of their coefficients. off: along the axis, of the leg's end
    from the centre of its ring.
    """
    off, x, y, z = np.zeros(LANES), axis[0], axis[1], axis[2]
    if rings is not None:
        for t in range(LANES):
            if rings[t, j, 8] > 0.0:
                ring = rings[t, j]
                off[t] = ring[8] * (ring[5] * x + ring[6] * y + ring[7] * z)
    for t in range(LANES):
        out[t] = np.inf
    for m in range(len(legs)):
        s0, s1 = lines_up[0, m], lines_up[1, m]
        for t in range(LANES):
            b0 = first[0, t] * x + first[1, t] * y + first[2, t] * z - off[t]
            b1 = second[0, t] * x + second[1, t] * y + second[2, t] * z - off[t]
            out[t] = min(out[t], (s0 * b0 + s1 * b1) / legs[m, t])


@kernel
def platform_cosines_on_lines(
    first: Floats,
    second: Floats,
    start_i: Floats,
    end_i: Floats,
    legs: Floats,
    cosines_up: Floats,
    least: Floats,
    most: Floats,
) -> None:
    """Fill the least and the largest v · i / l (LANES,), v and i on their lines; as `base_cosines_on_lines`."""
    value = np.empty(LANES)
    for t in range(LANES):
        least[t], most[t] = np.inf, -np.inf
    for m in range(cosines_up.shape[1]):
        s0, s1, s2 = cosines_up[0, m], cosines_up[1, m], cosines_up[2, m]
        for t in range(LANES):
            value[t] = cosines_up[3, m] * legs[0, t]
        for n in range(1, len(legs)):
            factor = cosines_up[3 + n, m]
            if factor != 0.0:
                for t in range(LANES):
                    value[t] += factor * legs[n, t]
        for t in range(LANES):
            b0 = first[0, t] * start_i[0, t] + first[1, t] * start_i[1, t] + first[2, t] * start_i[2, t]
            b2 = second[0, t] * end_i[0, t] + second[1, t] * end_i[1, t] + second[2, t] * end_i[2, t]
            b1 = first[0, t] * end_i[0, t] + first[1, t] * end_i[1, t] + first[2, t] * end_i[2, t]
            b1 = 0.5 * (
                b1 + (second[0, t] * start_i[0, t] + second[1, t] * start_i[1, t] + second[2, t] * start_i[2, t])
            )
            value[t] = (s0 * b0 + s1 * b1 + s2 * b2) / value[t]
        for t in range(LANES):
            least[t] = min(least[t], value[t])
        for t in range(LANES):
            most[t] = max(most[t], value[t])


@kernel
def fill_loose(
    bound: Floats,
    spread: Floats,
    spread_i: Floats,
    legs: Floats,
    geometry: Floats,
    j: int,
    rings: Floats | None,
    loose: Floats,
) -> None:
    """Fill by how much the cosines at both joints of leg j may differ from those on the lines (2, LANES)."""
    shortest, longest, offset = np.empty(LANES), np.empty(LANES), abs(geometry[j, 3])
    for t in range(LANES):
        shortest[t] = legs[0, t]
    for t in range(LANES):
        longest[t] = legs[0, t]
    for m in range(1, len(legs)):
        for t in range(LANES):
            shortest[t] = min(shortest[t], legs[m, t])
        for t in range(LANES):
            longest[t] = max(longest[t], legs[m, t])
    for t in range(LANES):
        rounding = 4.0 * ROUND * geometry[5, 2] / shortest[t]
        loose[0, t] = joined(bound, t, offset) / shortest[t] + rounding
    # The vector to a ring has the same component along the line as that to its centre, and is no longer than the leg,
    # its shift and the ring's radius together.
    wide = 0.0 if rings is None else rings[0, j, 8]
    for t in range(LANES):
        swing = np.sqrt(bound[3, t] * bound[3, t] + bound[4, t] * bound[4, t] + bound[5, t] * bound[5, t])
        shift, rounding = joined(bound, t, offset), 4.0 * ROUND * geometry[5, 2] / shortest[t]
        loose[1, t] = ((longest[t] + shift + wide) * swing + shift) / shortest[t] + rounding
    if rings is not None and wide > 0.0:
        for t in range(LANES):
            aside = wide * ring_swing(rings[t, j], ring_region(spread[j, :, t], spread_i[:, t], offset))
            loose[0, t] += aside / shortest[t]


@kernel
def joined(bound: Floats, t: int, offset: float) -> float:
    """Return the largest |p + offset · i| of p and i that `bound` (6, LANES) bounds in a lane."""
    x, y, z = bound[0, t] + offset * bound[3, t], bound[1, t] + offset * bound[4, t], bound[2, t] + offset * bound[5, t]
    return np.sqrt(x * x + y * y + z * z) * (1.0 + ROUND)
