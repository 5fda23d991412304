"""Pruning by what is linear in the position: differences of the legs' equations, compiled (lemma 17 of docs/proofs.md).

For a given direction the difference of two legs' equations is linear in p, apart from the rings' terms −r ρ. Four
differences fix p, three unknowns, and leave one condition on the direction.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.kinematics.krawczyk.krawczyk_kernels import ROUND
from pentapod.kinematics.krawczyk.ring_kernels import norm
from pentapod.numerics.kernels import kernel

NEAR, SOUND = 1e-3, 1e-6
"""ρ / |d| below which a ring's leg counts as pointing anywhere; determinant of three unit rows from which they are
inverted. Neither changes what is proven."""


@kernel
def reduced(
    box: Floats,
    centre: Floats,
    half: Floats,
    lengths: Floats,
    geometry: Floats,
    rings: Floats,
    vectors: Floats,
    jacobian: Floats,
    g: Floats,
    slack: float,
) -> bool:
    """Cut the positions of a box (12,) to those that the legs allow; return False where no pose is in the box.

    centre, half (6,): of the box; vectors (5, 3), jacobian (6, 6), rings, g (6,): as `fill_line` and `equations` have
    filled them in the centre; slack: as for `search`.
    """
    dp, di = norm(half[:3]), norm(half[3:])
    unit = norm(centre[3:]) + di
    swing, lever = np.zeros(5), np.zeros(5)  # by how much ∂ρ/∂p and ∂ρ/∂i may differ from those in the centre
    rows, slopes = np.empty((5, 3)), np.empty((5, 3))
    for j in range(5):
        z, r = geometry[j, 3], rings[j, 8]
        moved, off = np.empty(3), 0.0
        for n in range(3):
            rows[j, n], slopes[j, n] = jacobian[j, n], jacobian[j, 3 + n]
            moved[n] = half[n] + abs(z) * half[3 + n]
        e, grown = norm(vectors[j]), norm(moved)
        least, most = max(0.0, e - grown) ** 2, (e + grown) ** 2
        if r > 0.0:
            far = rings[j, 3] + dp
            off = dp * unit + rings[j, 3] * di
            rho = rings[j, 2]
            if not rho > NEAR * rings[j, 3]:  # next to the line the leg may point anywhere
                rho = 0.0
                for n in range(3):
                    rows[j, n], slopes[j, n] = vectors[j, n], z * vectors[j, n]
                swing[j], lever[j] = r * unit, r * far
            else:
                turn = min(2.0, 2.0 * off / rho)
                swing[j], lever[j] = r * min(2.0 * unit, di + unit * turn), r * min(2.0 * far, turn * far + dp)
            least += r * r - 2.0 * r * (rings[j, 2] + off)
            most += r * r - 2.0 * r * max(0.0, rings[j, 2] - off)
        if lengths[j] ** 2 < least - 4.0 * slack or lengths[j] ** 2 > most + 4.0 * slack:
            return False
    a, b, value, loose = np.empty((4, 3)), np.empty((4, 3)), np.empty(4), np.empty(4)
    row = 0
    for j in range(5):
        if j == 2:
            continue
        dz, dzz = abs(geometry[j, 3] - geometry[2, 3]), abs(geometry[j, 3] ** 2 - geometry[2, 3] ** 2)
        value[row] = g[j] - g[2]
        loose[row] = 4.0 * slack + (swing[j] + swing[2]) * dp + (lever[j] + lever[2]) * di
        for n in range(3):
            a[row, n], b[row, n] = rows[j, n] - rows[2, n], slopes[j, n] - slopes[2, n]
            # (z - z_3) δp·δi + ½ (z² - z_3²) |δi|²: what the difference of squares adds to its slope.
            loose[row] += dz * half[n] * half[3 + n] + 0.5 * dzz * half[3 + n] ** 2
        row += 1
    across = _minors(a)
    if not _consistent(across, half, a, b, value, loose):
        return False
    return _cut(box, across, centre, half, a, b, value, loose)


@kernel
def _minors(a: Floats) -> Floats:
    """Return the vector (4,) that is square to the columns of A (4, 3)."""
    across, m = np.empty(4), np.empty((3, 3))
    for k in range(4):
        row = 0
        for n in range(4):
            if n != k:
                m[row] = a[n]
                row += 1
        minor = m[0, 0] * (m[1, 1] * m[2, 2] - m[1, 2] * m[2, 1])
        minor -= m[0, 1] * (m[1, 0] * m[2, 2] - m[1, 2] * m[2, 0])
        minor += m[0, 2] * (m[1, 0] * m[2, 1] - m[1, 1] * m[2, 0])
        across[k] = minor if k % 2 == 0 else -minor
    return across


@kernel
def _consistent(across: Floats, half: Floats, a: Floats, b: Floats, value: Floats, loose: Floats) -> bool:
    """Return whether value + A δp + B δi within ± loose, A, B (4, 3), can vanish along the vector square to A."""
    total, free = 0.0, 0.0
    for k in range(4):
        total += across[k] * value[k]
        free += abs(across[k]) * loose[k]
        free += ROUND * abs(across[k]) * (abs(value[k]) + norm(a[k]) * norm(half[:3]) + norm(b[k]) * norm(half[3:]))
    for n in range(3):
        along, error = 0.0, 0.0
        for k in range(4):
            along += across[k] * b[k, n]
            error += across[k] * a[k, n]
        free += abs(along) * half[3 + n] * (1.0 + ROUND) + 2.0 * abs(error) * half[n]
    return abs(total) <= free


@kernel
def _cut(
    box: Floats, across: Floats, centre: Floats, half: Floats, a: Floats, b: Floats, value: Floats, loose: Floats
) -> bool:
    """Cut a box's positions by the three rows of value + A δp + B δi = ± loose whose determinant is largest."""
    best = 0
    for k in range(1, 4):
        best = k if abs(across[k]) > abs(across[best]) else best
    m, kept = np.empty((3, 3)), np.empty(3, dtype=np.int64)
    row = 0
    for n in range(4):
        if n != best:
            m[row], kept[row] = a[n], n
            row += 1
    if not abs(across[best]) > SOUND * norm(m[0]) * norm(m[1]) * norm(m[2]):
        return True
    inverse = _inverse(m)
    for n in range(3):
        shift, free = 0.0, 0.0
        for row in range(3):
            k = kept[row]
            shift -= inverse[n, row] * value[k]
            free += abs(inverse[n, row]) * (loose[k] + ROUND * abs(value[k]))
        for c in range(3):
            along, error = 0.0, 1.0 if c == n else 0.0
            large = error
            for row in range(3):
                along += inverse[n, row] * b[kept[row], c]
                error -= inverse[n, row] * m[row, c]
                large += abs(inverse[n, row] * m[row, c])
            free += abs(along) * half[3 + c] * (1.0 + ROUND) + (abs(error) + ROUND * large) * half[c]
        free *= 1.0 + ROUND
        box[n], box[6 + n] = max(box[n], centre[n] + shift - free), min(box[6 + n], centre[n] + shift + free)
        if box[n] > box[6 + n]:
            return False
    return True


@kernel
def _inverse(m: Floats) -> Floats:
    """Return the inverse of a regular matrix (3, 3)."""
    inverse = np.empty((3, 3))
    for r in range(3):
        for c in range(3):
            one, two, left, right = (r + 1) % 3, (r + 2) % 3, (c + 1) % 3, (c + 2) % 3
            inverse[c, r] = m[one, left] * m[two, right] - m[one, right] * m[two, left]
    det = m[0, 0] * inverse[0, 0] + m[0, 1] * inverse[1, 0] + m[0, 2] * inverse[2, 0]
    for r in range(3):
        for c in range(3):
            inverse[r, c] /= det
    return inverse
