"""Bounds of a design's figures over boxes of poses: first derivatives with bounded remainders.

A box is a sector of tips, r ± dr, φ ± dφ, z ± dz about the volume's centre, and a sector of directions i, at angles
θ ± dθ to the vertical with azimuths ψ ± dψ. Each sector lies within its `bulge` of the hull of its corners. So a linear
function of tip t and direction i is greatest in corners, up to its gradient times the bulges. The vector of leg k is
d = t + λ i − a, linear in both, and the rest follows from (v: the change of d, e = d/|d|)

- |d| + e·v ≤ |d + v| ≤ |d| + e·v + |v|²/(2(|d| − |v|));
- e(d + v) is e + (v − e e·v)/|d| up to |v|²/(√3 (|d| − |v|)²): the second derivative of e is at most 2/√3 of 1/|d|²;
- leg forces are M = Λ (1 + X)⁻¹ M₀, with the columns of the wrench matrix scaled by the legs' lengths, of which Λ are
  the ratios 1 + ε: then X is linear up to a product δi × δt, and with |X| ≤ χ < 1 and |X M₀| ≤ s the map M is
  M₀ − X M₀ + ε M₀ up to (χ + |ε|) s/(1 − χ) and second-order terms of ε. A norm of a linear function is convex: it is
  greatest in a corner.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, product

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.design.figures import shaft_distance, wrenches
from pentapod.design.geometry import Geometry

BEND = 1.0 / np.sqrt(3.0)
SIDES = np.array([(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)])
TINY = 1e-12


@dataclass(frozen=True, eq=False)
class Boxes:
    """Boxes of poses of a design. axes (n, 3): of the base joints. centre, half (N, 5): of r, φ, z, θ, ψ; SI."""

    design: Geometry
    axes: Floats
    centre: Floats
    half: Floats

    @cached_property
    def tips(self) -> Floats:
        """Tips in the middle (N, 3)."""
        r, turn, z = self.centre.T[:3]
        return self.design.centre + np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=-1)

    @cached_property
    def directions(self) -> Floats:
        """Directions of the platform in the middle (N, 3)."""
        return _direction(self.centre[:, 3], self.centre[:, 4])

    @cached_property
    def tip_corners(self) -> tuple[Floats, Floats, Floats]:
        """Corners (N, 4, 3) from the middle, in the plane; the bulge, and the largest change of the tip (N,)."""
        (r, turn), (dr, dturn, dz) = self.centre.T[:2], self.half.T[:3]
        far, angle = (x[:, None] + s * dx[:, None] for x, s, dx in ((r, SIDES[:, 0], dr), (turn, SIDES[:, 1], dturn)))
        plane = np.stack([far * np.cos(angle), far * np.sin(angle), 0.0 * far], axis=-1)
        corners = plane - np.stack([r * np.cos(turn), r * np.sin(turn), 0.0 * r], axis=-1)[:, None]
        bulge = (r + dr) * (1.0 - np.cos(dturn))
        return corners, bulge, np.hypot(_norm(corners).max(axis=1) + bulge, dz)

    @cached_property
    def direction_corners(self) -> tuple[Floats, Floats, Floats]:
        """As `tip_corners`, of the directions."""
        (lean, azimuth), (dlean, dturn) = self.centre.T[3:], self.half.T[3:]
        theta, psi = (
            x[:, None] + s * dx[:, None] for x, s, dx in ((lean, SIDES[:, 0], dlean), (azimuth, SIDES[:, 1], dturn))
        )
        corners = _direction(theta, psi) - self.directions[:, None]
        bulge = 1.0 - np.cos(dlean) + np.sin(lean + dlean) * (1.0 - np.cos(dturn))
        return corners, bulge, _norm(corners).max(axis=1) + bulge

    def _range(self, by_tip: Floats, by_direction: Floats) -> tuple[Floats, Floats]:
        """Return how far (N, m) linear functions fall and rise over the boxes, from their gradients (N, m, 3)."""
        (at, bulge_t, _), (along, bulge_i, _) = self.tip_corners, self.direction_corners
        plane, turned = by_tip @ np.swapaxes(at, 1, 2), by_direction @ np.swapaxes(along, 1, 2)
        more = np.abs(by_tip[..., 2]) * self.half[:, 2:3] + bulge_t[:, None] * np.hypot(by_tip[..., 0], by_tip[..., 1])
        more = more + bulge_i[:, None] * _norm(by_direction)
        return more - plane.min(axis=-1) - turned.min(axis=-1), more + plane.max(axis=-1) + turned.max(axis=-1)

    @cached_property
    def legs(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Vectors (N, n, 3) of the legs, their lengths (N, n), unit vectors, and bounds (N, n) of their changes."""
        levers = self.design.levers
        vectors = self.tips[:, None] + levers[:, None] * self.directions[:, None] - self.design.feet
        length = _norm(vectors)
        change = self.tip_corners[2][:, None] + np.abs(levers) * self.direction_corners[2][:, None]
        return vectors, length, vectors / length[..., None], change

    @cached_property
    def turned(self) -> tuple[Floats, Floats]:
        """Bounds (N, n) of the changes of the legs' unit vectors, and of what is not linear in them."""
        _, length, _, change = self.legs
        share = change / np.maximum(length - change, TINY)
        return share, BEND * share * share

    def _along(self, vectors: Floats, legs: slice | Ints = slice(None)) -> tuple[Floats, Floats, Floats]:
        """Return values and ranges (N, m): products of vectors (N or 1, m, 3) with unit vectors of legs."""
        _, length, unit, _ = (x[:, legs] for x in self.legs)
        value = np.einsum("nki,nki->nk", unit, np.broadcast_to(vectors, unit.shape))
        by = (vectors - unit * value[..., None]) / length[..., None]
        low, high = self._range(by, self.design.levers[legs][:, None] * by)
        rest = self.turned[1][:, legs] * _norm(vectors)
        return value, low + rest, high + rest

    @cached_property
    def lengths(self) -> tuple[Floats, Floats]:
        """Least and greatest lengths (N, n)."""
        _, length, unit, change = self.legs
        low, high = self._range(unit, self.design.levers[:, None] * unit)
        return length - low, length + high + 0.5 * change * change / np.maximum(length - change, TINY)

    @cached_property
    def base_cosine(self) -> Floats:
        """Least cosine (N, n) of the legs with their base joints' axes."""
        value, low, _ = self._along(self.axes[None])
        return value - low

    @cached_property
    def platform_cosine(self) -> tuple[Floats, Floats]:
        """Least and greatest cosine (N, n) of legs and platform direction."""
        _, length, unit, _ = self.legs
        i, far = self.directions[:, None], self.direction_corners[2][:, None]
        value = np.einsum("nki,nki->nk", unit, np.broadcast_to(i, unit.shape))
        by = (i - unit * value[..., None]) / length[..., None]
        low, high = self._range(by, self.design.levers[:, None] * by + unit)
        rest = self.turned[1] + self.turned[0] * far
        return value - low - rest, value + high + rest

    @cached_property
    def shaft(self) -> Floats:
        """Least distances (N, n) of legs from the shaft's axis."""
        low, high = (np.clip(c, -1.0, 1.0) for c in self.platform_cosine)
        return np.minimum(shaft_distance(self.design, low), shaft_distance(self.design, high))

    @cached_property
    def singular(self) -> Floats:
        """Least distance (N,) from S = 0, where S > 0; of the quadratic family."""
        delta, i, far_i = self.design.delta or 0.0, self.directions, self.direction_corners[2]
        d, far, lever = self.legs[0][:, 2], self.legs[3][:, 2], self.design.levers[2]
        across, along = delta * i[:, 2], 1.0 - delta * i[:, 0]
        steep, zero = np.hypot(across, along), np.zeros(len(i))
        by = np.stack([across, zero, along], axis=-1)
        by_i = lever * by + delta * np.stack([-d[:, 2], zero, d[:, 0]], axis=-1)
        low, _ = self._range(by[:, None], by_i[:, None])
        least = across * d[:, 0] + along * d[:, 2] - low[:, 0] - abs(delta) * far * far_i
        return np.where(least > 0.0, least / (steep + abs(delta) * far_i), least / np.maximum(steep, TINY))

    @cached_property
    def apart(self) -> Floats:
        """Least distances (N, pairs) of the axes of legs, as segments.

        Segments are as far apart as their lines, or, where the lines' nearest points are not both on them, as an end of
        one is from the other.
        """
        k, other = np.array(list(combinations(range(len(self.design.levers)), 2))).T
        feet, levers = self.design.feet, self.design.levers
        c = (feet[other] - feet[k])[None]
        size = _norm(c)
        p, q = self._along(c, k), self._along(c, other)
        low, high = self.platform_cosine
        ends: list[Floats] = []
        for one, two in ((k, other), (other, k)):
            up = levers[one] - levers[two]
            beyond = np.where(up >= 0.0, low[:, two] >= 0.0, high[:, two] <= 0.0)  # nearest to the other leg's end
            sine = np.sqrt(np.maximum(1.0 - np.square(np.maximum(np.abs(low), np.abs(high))), 0.0))[:, two]
            ends.append(np.abs(up) * np.where(beyond, 1.0, sine))
        for ahead in (p[0] + p[2], q[1] - q[0]):  # of the foot of one from that of the other, along its leg
            share = np.clip(ahead, 0.0, size)
            ends.append(np.sqrt(size * size - share * share))
        both = ~(self._off(k, other, c) | self._off(other, k, -c))
        return np.minimum(np.minimum.reduce(ends), np.where(both, self._lines_apart(k, other), np.inf))

    def _lines_apart(self, k: Ints, other: Ints) -> Floats:
        """Return least distances (N, pairs) of the lines of legs: (z_l − z_k) c·((t − a_k) × i)/|d_k × d_l|."""
        feet, levers, i = self.design.feet, self.design.levers, self.directions[:, None]
        vectors, length, _, change = self.legs
        (_, _, far_t), (_, _, far_i) = self.tip_corners, self.direction_corners
        c, rise = feet[other] - feet[k], levers[other] - levers[k]
        by_tip, by_i = np.cross(i, c), np.cross(c, self.tips[:, None] - feet[k])
        value = np.einsum("nki,nki->nk", by_i, np.broadcast_to(i, by_i.shape))
        sign = np.where(value < 0.0, -1.0, 1.0)
        low, _ = self._range(sign[..., None] * by_tip, sign[..., None] * by_i)
        least = np.abs(rise) * (np.abs(value) - low - _norm(c) * (far_t * far_i)[:, None])
        d, d2, moves, moves2 = vectors[:, k], vectors[:, other], change[:, k], change[:, other]
        normal = np.cross(d, d2)
        wide = np.maximum(_norm(normal), TINY)
        normal = normal / wide[..., None]
        to_d, to_d2 = np.cross(d2, normal), np.cross(normal, d)
        _, more = self._range(to_d + to_d2, levers[k][:, None] * to_d + levers[other][:, None] * to_d2)
        moved = moves * length[:, other] + moves2 * length[:, k] + moves * moves2
        return np.maximum(least, 0.0) / (wide + more + moves * moves2 + 0.5 * moved * moved / wide)

    def _off(self, k: Ints, other: Ints, c: Floats) -> Bools:
        """Return whether the points of legs k nearest to the lines of others are beyond their ends (N, pairs).

        c (1, pairs, 3): from the foot of k to that of the other. With p, q the products of c with both unit vectors
        e, e' and w = e·e', that point is at (p − q w)/(1 − w²) along the leg.
        """
        _, length, unit, change = self.legs
        (turn, bend), levers = self.turned, self.design.levers
        e, e2, size = unit[:, k], unit[:, other], _norm(c)
        p, q, w = np.einsum("nki,nki->nk", e, c + 0.0 * e), np.einsum("nki,nki->nk", e2, c + 0.0 * e), _dot(e, e2)
        turns, bends = turn[:, k] + turn[:, other], bend[:, k] + bend[:, other] + turn[:, k] * turn[:, other]
        off = np.zeros(w.shape, dtype=np.bool_)
        for sign, far, moves in ((-1.0, 0.0 * length[:, k], 0.0 * change[:, k]), (1.0, length[:, k], change[:, k])):
            value, by_w = p - q * w - far * (1.0 - w * w), 2.0 * far * w - q
            by = (c - e * p[..., None] + by_w[..., None] * (e2 - e * w[..., None])) / length[:, k, None]
            by -= (1.0 - w * w)[..., None] * e * (far > 0.0)[..., None]
            by2 = by_w[..., None] * (e - e2 * w[..., None]) - w[..., None] * (c - e2 * q[..., None])
            by2 /= length[:, other, None]
            low, _ = self._range(sign * (by + by2), sign * (levers[k][:, None] * by + levers[other][:, None] * by2))
            rest = size * (bend[:, k] + np.abs(w) * bend[:, other] + turn[:, other] * turns) + np.abs(by_w) * bends
            rest += (far + moves) * turns * turns + 2.0 * moves * turns
            rest += 0.5 * moves * moves / np.maximum(length[:, k] - change[:, k], TINY)
            off |= sign * value - low - rest > 0.0
        return off

    def force_bounds(self) -> tuple[Floats, Floats]:
        """Return bounds (N,) of the spectral norm, and of the largest row, of the map from tip force to leg forces."""
        m0, gradient, first, ratio, bilinear = self._linear_forces()
        (at, bulge_t, far_t), (along, bulge_i, far_i) = self.tip_corners, self.direction_corners
        _, length, _, change = self.legs
        size, epsilon = _spectral(m0), (change / length).max(axis=1)
        bulges, half_z = np.stack([bulge_t, bulge_i], axis=1), self.half[:, 2]
        chi, small, most, row = (np.zeros(len(m0)) for _ in range(4))
        flat = [x.reshape(len(m0), 6, -1) for x in (gradient, first, ratio)]
        for corner, turn, side in product(range(len(SIDES)), range(len(SIDES)), (-1.0, 1.0)):
            tip = at[:, corner] + np.stack([0.0 * half_z, 0.0 * half_z, side * half_z], axis=-1)
            x = np.concatenate([tip, along[:, turn]], axis=1)[:, None, :]
            turned, moved, stretched = ((x @ derivative)[:, 0] for derivative in flat)
            chi, small = np.maximum(chi, _norm(turned)), np.maximum(small, _norm(moved))
            m = m0 + (stretched - moved).reshape(m0.shape)
            most, row = np.maximum(most, _spectral(m)), np.maximum(row, _norm(m).max(axis=1))
        left = bilinear * far_t * far_i
        chi = chi + _bulged(gradient, bulges) + left
        small = small + _bulged(first, bulges) + left * size
        room, share = np.maximum(1.0 - chi, TINY), np.maximum(1.0 - epsilon, TINY)
        rest = _bulged(ratio - first, bulges) + left * size + (chi + epsilon) * small / room
        rest = rest + 0.5 * size * epsilon * epsilon / share
        rest = np.where((chi < 1.0) & (epsilon < 1.0), rest, np.inf)
        return most + rest, row + rest

    def _linear_forces(self) -> tuple[Floats, Floats, Floats, Floats, Floats]:
        """Return M₀ (N, n, 3), derivatives by tip and direction (N, 6, ...) of X, X M₀ and ε M₀, and a bound (N,).

        The bound: of what is not linear in X, by |δi| |δt|.
        """
        _, length, unit, _ = self.legs
        levers, n = self.design.levers, len(self.design.levers)
        matrices, tangents = wrenches(unit, levers, self.directions)
        inverse = np.asarray(np.linalg.inv(matrices + 1e-15 * np.eye(n)), dtype=np.float64)
        m0, shares = inverse[..., :3], levers / length
        # Moments of leg k: λ tangent·(i × (t − a)), by t: tangent × i, and by i: (t − a) × tangent; forces: 1 and λ.
        by_t = np.broadcast_to(np.cross(tangents, self.directions[:, None])[:, :, None], (len(m0), 2, n, 3))
        by_i = np.cross((self.tips[:, None] - self.design.feet)[:, None], tangents[:, :, None])
        moments = np.concatenate([by_t, by_i], axis=-1) * shares[:, None, :, None]
        forces = np.zeros((len(m0), 3, n, 6))
        for axis in range(3):
            forces[:, axis, :, axis], forces[:, axis, :, 3 + axis] = 1.0 / length, shares
        gradient = np.einsum("nab,nbkj->njak", inverse, np.concatenate([forces, moments], axis=1))
        along = np.concatenate([unit, levers[:, None] * unit], axis=-1) / length[..., None]
        bound = _norm(inverse[..., 3:].reshape(len(m0), -1)) * _norm(shares)
        return m0, gradient, gradient @ m0[:, None], np.einsum("nkj,nki->njki", along, m0), bound


def _direction(lean: Floats, azimuth: Floats) -> Floats:
    s = np.sin(lean)
    return np.stack([s * np.cos(azimuth), s * np.sin(azimuth), np.cos(lean)], axis=-1)


def _norm(vectors: Floats) -> Floats:
    return np.sqrt(np.einsum("...i,...i->...", vectors, vectors))


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray(np.einsum("nki,nki->nk", a, b), dtype=np.float64)


def _bulged(derivatives: Floats, bulges: Floats) -> Floats:
    """Return bounds (N,) of what derivatives (N, 6, ...) make of the bulges (N, 2) of tips and directions."""
    squared = np.square(derivatives).reshape(len(derivatives), 2, -1).sum(axis=-1)
    return np.einsum("nd,nd->n", np.sqrt(squared), bulges)


def _spectral(maps: Floats) -> Floats:
    """Return the spectral norms (N,) of maps (N, n, 3): the largest eigenvalue of a matrix (3, 3) in closed form."""
    gram = np.swapaxes(maps, 1, 2) @ maps
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = np.moveaxis(gram, 0, -1)
    mean = (xx + yy + zz) / 3.0
    a, b, c = xx - mean, yy - mean, zz - mean
    mixed = xy * xy + xz * xz + yz * yz
    size = np.sqrt((a * a + b * b + c * c + 2.0 * mixed) / 6.0)
    determinant = a * (b * c - yz * yz) - xy * (xy * c - yz * xz) + xz * (xy * yz - b * xz)
    turn = np.arccos(np.clip(0.5 * determinant / np.maximum(size, 1e-100) ** 3, -1.0, 1.0))
    return np.sqrt(mean + 2.0 * size * np.cos(turn / 3.0))
