"""Inverse dynamics of five legs that end on the platform line or on rings around it, compiled.

By virtual work. The platform is a mass on the line, each leg two: the cylinder turns about its base joint, the rod also
slides. Of each body (m, m c, m c² + I) are given: mass, first and second moment about its origin, across its axis. What
a leg's bodies need across the leg acts at its platform joint; all that acts on the platform goes to the legs by the
equations of statics: Σ f e = force, Σ f (z e − (e·i) w) = moment over the line, across it. w is the radius of the leg's
ring, towards its base joint. A ring turns freely and has no mass; what a leg asks across the plane of line and ring
acts as if the ring stood where the base joint has it.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.machine.dynamics.ring_kernels import at_ring, bend, ring
from pentapod.numerics.kernels import kernel

LEGS = 5
"""As many as the freedoms of a line: three of a point on it, two of its direction."""


@kernel
def _tangents(i: Floats, t: Floats) -> None:
    """Fill t (2, 3) with unit vectors across the unit vector i (3,) and each other."""
    least = 0
    for c in range(1, 3):
        least = c if abs(i[c]) < abs(i[least]) else least
    a, b = (least + 1) % 3, (least + 2) % 3
    size = np.sqrt(i[a] * i[a] + i[b] * i[b])
    t[0, least], t[0, a], t[0, b] = 0.0, i[b] / size, -i[a] / size
    for c in range(3):
        d, f = (c + 1) % 3, (c + 2) % 3
        t[1, c] = i[d] * t[0, f] - i[f] * t[0, d]


@kernel
def _solve(m: Floats, r: Floats) -> None:
    """Replace r (5, c) by the solution of m x = r, m (5, 5) by its factors; not finite where m is singular."""
    n, columns = LEGS, r.shape[1]
    for k in range(n):
        pivot = k
        for j in range(k + 1, n):
            pivot = j if abs(m[j, k]) > abs(m[pivot, k]) else pivot
        if pivot != k:
            for j in range(k, n):
                m[k, j], m[pivot, j] = m[pivot, j], m[k, j]
            for j in range(columns):
                r[k, j], r[pivot, j] = r[pivot, j], r[k, j]
        for j in range(k + 1, n):
            share = m[j, k] / m[k, k]
            for c in range(k + 1, n):
                m[j, c] -= share * m[k, c]
            for c in range(columns):
                r[j, c] -= share * r[k, c]
    for k in range(n - 1, -1, -1):
        for c in range(columns):
            rest = r[k, c]
            for j in range(k + 1, n):
                rest -= m[k, j] * r[j, c]
            r[k, c] = rest / m[k, k]


@kernel
def _of_leg(
    d: Floats, cylinder: Floats, rod: Floats, moving: float, gravity: Floats, u: Floats, own: Floats, side: Floats
) -> None:
    """Fill own (3,), what a leg's bodies ask of its own drive, and side (3, 3), what they ask across it at its end.

    Rows: A, B and G. d (3, 3): the leg's vector and its derivatives; u (3, 3): filled with its direction and theirs.
    """
    square, along, curl, fast, weight = 0.0, 0.0, 0.0, 0.0, 0.0
    for c in range(3):
        square += d[0, c] * d[0, c]
    length = np.sqrt(square)
    for c in range(3):
        u[0, c] = d[0, c] / length
        along += u[0, c] * d[1, c]
    for c in range(3):
        u[1, c] = (d[1, c] - along * u[0, c]) / length
        curl += u[1, c] * d[1, c] + u[0, c] * d[2, c]
        fast += u[1, c] * u[1, c]
        weight += gravity[c] * u[0, c]
    for c in range(3):  # the part of u″ across the leg: along it, it is −|u′|²
        u[2, c] = (d[2, c] - curl * u[0, c] - 2.0 * along * u[1, c]) / length + fast * u[0, c]
    once = rod[1] + rod[0] * length
    twice = cylinder[2] + rod[2] + (2.0 * rod[1] + rod[0] * length) * length
    own[0] = (moving + rod[0]) * along
    own[1] = (moving + rod[0]) * curl - once * fast
    own[2] = -rod[0] * weight
    for c in range(3):
        side[0, c] = twice / length * u[1, c]
        side[1, c] = (2.0 * once * along * u[1, c] + twice * u[2, c]) / length
        side[2, c] = -(cylinder[1] + once) / length * (gravity[c] - weight * u[0, c])


@kernel
def _at_end(side: Floats, z: float, at_p: Floats, at_i: Floats) -> None:
    """Add to at_p and at_i (3, 3) what forces (3, 3) at z on the line do."""
    for n in range(3):
        for c in range(3):
            at_p[n, c] += side[n, c]
            at_i[n, c] += z * side[n, c]


@kernel
def _levers(e: Floats, z: Floats, w: Floats, i: Floats, t: Floats, out: Floats) -> None:
    """Fill out (5, 2) with what a newton along each leg does to i along t (2, 3), in N·m/N; w (5, 3): their rings."""
    for leg in range(LEGS):
        over = e[leg, 0] * i[0] + e[leg, 1] * i[1] + e[leg, 2] * i[2]
        for j in range(2):
            out[leg, j] = 0.0
            for c in range(3):
                out[leg, j] += (z[leg] * e[leg, c] - over * w[leg, c]) * t[j, c]


@kernel
def _spread(
    e: Floats, levers: Floats, t: Floats, tool: float, at_p: Floats, at_i: Floats, m: Floats, r: Floats
) -> None:
    """Fill r (5, 6) with the legs' forces for what acts on p and i (3, 3), and for 1 N along x, y, z on the tip.

    With three columns, the last three are left out.
    """
    for_tip = r.shape[1] > 3
    for c in range(3):
        for leg in range(LEGS):
            m[c, leg] = e[leg, c]
        for n in range(3):
            r[c, n] = at_p[n, c]
            if for_tip:
                r[c, 3 + n] = 1.0 if n == c else 0.0
    for j in range(2):
        for leg in range(LEGS):
            m[3 + j, leg] = levers[leg, j]
        for n in range(3):
            r[3 + j, n] = at_i[n, 0] * t[j, 0] + at_i[n, 1] * t[j, 1] + at_i[n, 2] * t[j, 2]
            if for_tip:
                r[3 + j, 3 + n] = tool * t[j, n]
    _solve(m, r)


@kernel
def _largest(r: Floats, reach: Floats) -> None:
    """Fill reach (5,) with the largest force of each leg for 1 N on the tip, from the last columns of r (5, 6)."""
    for leg in range(LEGS):
        square = 0.0
        for c in range(3):
            square += r[leg, 3 + c] * r[leg, 3 + c]
        reach[leg] = np.sqrt(square)


@kernel
def force_terms(
    tips: Floats,
    axes: Floats,
    base: Floats,
    offsets: Floats,
    radii: Floats,
    tool: float,
    platform: Floats,
    cylinders: Floats,
    rods: Floats,
    moving: Floats,
    gravity: Floats,
    terms: Floats,
    reach: Floats,
) -> None:
    """Fill terms (3, n, 5) with A, B and G of the drives' forces A s̈ + B ṡ² + G, in newtons; reach (n, 5).

    tips, axes (3, n, 3): tip and tool axis (tip → spindle), and their first two derivatives by s. tool: metres from p
    to the tip. platform (3,), cylinders, rods (5, 3): moments of the masses, of the platform about p along the line,
    of a cylinder about the base joint, of a rod about the platform joint, towards the platform. moving (5,): kg that
    only move with a drive. reach: largest force of a leg for 1 N on the tip; (0, 5) where it is not asked for.
    """
    p, i, d, u, e = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((LEGS, 3))
    t, m, own = np.empty((2, 3)), np.empty((LEGS, LEGS)), np.empty(3)
    r = np.empty((LEGS, 6 if len(reach) else 3))
    at_p, at_i, side, w = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.zeros((3, 3))
    rings, levers = np.zeros((LEGS, 3)), np.empty((LEGS, 2))
    for k in range(tips.shape[1]):
        for c in range(3):
            for n in range(3):
                i[n, c] = -axes[n, k, c]
                p[n, c] = tips[n, k, c] - tool * i[n, c]
            for n in range(1, 3):
                at_p[n - 1, c] = platform[0] * p[n, c] + platform[1] * i[n, c]
                at_i[n - 1, c] = platform[1] * p[n, c] + platform[2] * i[n, c]
            at_p[2, c], at_i[2, c] = -platform[0] * gravity[c], -platform[1] * gravity[c]
        for leg in range(LEGS):
            z = offsets[leg]
            for c in range(3):
                d[0, c] = p[0, c] + z * i[0, c] - base[leg, c]
                d[1, c], d[2, c] = p[1, c] + z * i[1, c], p[2, c] + z * i[2, c]
            if radii[leg] > 0.0:
                ring(p, i, base[leg], radii[leg], w)
                d += w
                rings[leg] = w[0]
            _of_leg(d, cylinders[leg], rods[leg], moving[leg], gravity, u, own, side)
            _at_end(side, z, at_p, at_i)
            if radii[leg] > 0.0:
                at_ring(side, base[leg], p[0], i[0], w[0], at_p, at_i)
            for n in range(3):
                e[leg, n] = u[0, n]
                terms[n, k, leg] = own[n]
        _tangents(i[0], t)
        _levers(e, offsets, rings, i[0], t, levers)
        _spread(e, levers, t, tool, at_p, at_i, m, r)
        for leg in range(LEGS):
            for n in range(3):
                terms[n, k, leg] += r[leg, n]
        if len(reach):
            _largest(r, reach[k])


@kernel
def motion_of_rows(
    rates: Floats,
    accelerations: Floats,
    base: Floats,
    offsets: Floats,
    radii: Floats,
    tool: float,
    tips: Floats,
    axes: Floats,
) -> None:
    """Fill tips and axes (3, n, 3) at [1] and [2] with derivatives by time, from those of the legs (n, 5).

    At [0] they are given. From |d|² = l² with d = p + z i + w − b: e · ḋ = l̇, e · d̈ = l̈ + (l̇² − |ḋ|²) / l, |i| = 1.
    w, across i, stays in the plane of i and e: e · ẇ = −(e·i) (w · i̇), and so on.
    """
    p, i, e, length, right = np.zeros((3, 3)), np.zeros((3, 3)), np.empty((LEGS, 3)), np.empty(LEGS), np.empty(LEGS)
    t, m, r, levers = np.empty((2, 3)), np.empty((LEGS, LEGS)), np.empty((LEGS, 1)), np.empty((LEGS, 2))
    rings, w = np.zeros((LEGS, 3)), np.zeros((3, 3))
    for k in range(tips.shape[1]):
        for c in range(3):
            i[0, c] = -axes[0, k, c]
            p[0, c] = tips[0, k, c] - tool * i[0, c]
        _tangents(i[0], t)
        for leg in range(LEGS):
            if radii[leg] > 0.0:
                ring(p, i, base[leg], radii[leg], w)
                rings[leg] = w[0]
            for c in range(3):
                e[leg, c] = p[0, c] + offsets[leg] * i[0, c] + rings[leg, c] - base[leg, c]
            length[leg] = np.sqrt(e[leg, 0] ** 2 + e[leg, 1] ** 2 + e[leg, 2] ** 2)
            e[leg] /= length[leg]
            right[leg] = rates[k, leg]
        _levers(e, offsets, rings, i[0], t, levers)
        turning = 0.0
        for n in range(1, 3):
            # For accelerations i also moves by −|i̇|² i.
            for leg in range(LEGS):
                over = e[leg, 0] * i[0, 0] + e[leg, 1] * i[0, 1] + e[leg, 2] * i[0, 2]
                for c in range(3):
                    m[leg, c] = e[leg, c]
                m[leg, 3], m[leg, 4] = levers[leg, 0], levers[leg, 1]
                r[leg, 0] = right[leg] + offsets[leg] * turning * over
            _solve(m, r)
            for c in range(3):
                p[n, c] = r[c, 0]
                i[n, c] = r[3, 0] * t[0, c] + r[4, 0] * t[1, c] - turning * i[0, c]
                axes[n, k, c] = -i[n, c]
                tips[n, k, c] = p[n, c] + tool * i[n, c]
            turning = i[1, 0] ** 2 + i[1, 1] ** 2 + i[1, 2] ** 2
            for leg in range(LEGS):
                z, moved, bent = offsets[leg], 0.0, 0.0
                w[1] = 0.0
                if radii[leg] > 0.0:
                    ring(p, i, base[leg], radii[leg], w)
                    bent = bend(e[leg], i, w, radii[leg])
                for c in range(3):
                    moved += (p[1, c] + z * i[1, c] + w[1, c]) ** 2
                right[leg] = accelerations[k, leg] + (rates[k, leg] ** 2 - moved) / length[leg] + bent
