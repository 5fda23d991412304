"""The closed form near the singularities, where it loses digits: the same formulas with twice as many.

At w = 0 and at S = 0 the pose depends on the legs like a square root at zero. In ordinary doubles the radicands
w² and S² carry rounding errors which the legs themselves do not warrant; at the surface they come out negative as
often as not. Here they are exact for the legs as given, and where a radicand is negative, but would not be if
each leg were longer or shorter by `LEG_ULPS` units in its last place, the pose is that of such legs: on the surface,
but for what it takes to be on its own side of it, so that the named component never flips.

Where n = (1 − δu, −δw) vanishes, for |δ| ≥ 1, the legs do not hold the platform: a self-motion. Next to it the same
change of the legs keeps (px, pz) on its circle, so the pose has the lengths asked for, wherever on the circle it is.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.kinematics.forward.quadratic import LinearPart, Reduced
from pentapod.numerics.double_double import DoubleDouble

LEG_ULPS = 4.0
"""How far leg lengths may be from those of a pose, in units of 2⁻⁵³ of each, to count as its own: what computing
and rounding them costs."""

_SLACK = LEG_ULPS * 2.0**-53
_LEAST_W_SQUARED, _BY_ROUNDING = 2.0**-104, 2.0**-98  # what w² is put to where it vanishes; more than its own rounding
_HARMLESS = 2.0**-54  # a change of w² that no leg notices
_STEPS = 8  # one is enough where the radicand is nearly linear in the legs


class _Forms(NamedTuple):
    """What squared legs (5, N) say: py, u, v, n_1 = 1 − δu, c, R² = l_3² − py² and w²."""

    squared: DoubleDouble
    py: DoubleDouble
    u: DoubleDouble
    v: DoubleDouble
    n1: DoubleDouble
    c: DoubleDouble
    r_squared: DoubleDouble
    d1: DoubleDouble

    @classmethod
    def of(cls, squared: DoubleDouble, linear: LinearPart, delta: float) -> _Forms:
        q, py, u, v = linear.twofold(squared)
        r_squared = DoubleDouble(squared.high[2], squared.low[2]) - py * py
        return cls(squared, py, u, v, 1.0 - u * delta, q + v * py * delta, r_squared, 1.0 - u * u - v * v)

    def n_squared(self, delta: float, least: Floats) -> DoubleDouble:
        """|n|² = (1 − δu)² + δ²w², w² counting as `least` where it is smaller."""
        return self.n1 * self.n1 + _at_least(self.d1, least) * delta * delta


def self_motions(legs: Floats, linear: LinearPart, delta: float) -> Bools:
    """Return whether legs (5, N) are within rounding of those of a self-motion (N,). The caller silences NumPy."""
    return _self_motions(_Forms.of(_squares(legs), linear, delta), linear, delta)


def solve_near(legs: Floats, linear: LinearPart, delta: float, sign_w: Floats, sign_s: Floats, reach: float) -> Reduced:
    """Return `quadratic.solve` of legs (5, N) and signs (N,), to within the accuracy that the legs allow.

    reach: |x_3| + |z_3| in metres, the size of the shift from the reduced frame, whose rounding must not
    change the sign of S. NaN where no pose has these lengths, and where they are within rounding of those of a
    self-motion. The caller silences NumPy.
    """
    f = _Forms.of(_squares(legs), linear, delta)
    known = (legs.min(axis=0) >= 0.0) & ~_self_motions(f, linear, delta)
    least_w = _LEAST_W_SQUARED + _BY_ROUNDING * _change(f, _by_d1(f, linear))
    f = _raised(f, linear, delta, least_w, lambda g: (g.d1, _by_d1(g, linear)))
    least = 2.0**-49 * (1.0 + abs(delta)) * (legs[2] + reach)

    def s_squared(g: _Forms) -> tuple[DoubleDouble, Floats]:
        n_squared = g.n_squared(delta, least_w)
        return g.r_squared * n_squared - g.c * g.c, _by_d(g, linear, delta, n_squared.high)

    f = _raised(f, linear, delta, np.square(least), s_squared)
    d1, d = _at_least(f.d1, least_w), s_squared(f)[0].high
    # What is missing still is the rounding of w² itself: (px, pz) must be on its circle all the same.
    more = np.fmax(np.square(least) - d, 0.0) / (f.r_squared.high * delta * delta)
    d1 = d1 + np.where(more < _HARMLESS, more, 0.0)
    n_squared = f.n1 * f.n1 + d1 * delta * delta
    d = f.r_squared * n_squared - f.c * f.c
    w, root = np.sqrt(d1.high), np.sqrt(_at_least(d, np.square(least)).high)

    w, root = sign_w * w, sign_s * root
    n2, along = -delta * w, DoubleDouble(root, np.zeros_like(root))
    px, pz = ((f.c * f.n1 - along * n2).high, (f.c * n2 + along * f.n1).high) / n_squared.high
    nothing = np.where(known, 0.0 * (w + root), np.nan)  # NaN where one of these is, too
    return Reduced(px, f.py.high + nothing, pz, f.u.high + nothing, f.v.high + nothing, w + nothing)


def _squares(legs: Floats) -> DoubleDouble:
    return DoubleDouble(legs, np.zeros_like(legs)) * legs


def _at_least(radicand: DoubleDouble, least: Floats | float) -> DoubleDouble:
    """Return the radicand (N,), or `least` where it is smaller; NaN stays."""
    small = radicand.high < least
    return DoubleDouble(np.where(small, least, radicand.high), np.where(small, 0.0, radicand.low))


def _raised(
    f: _Forms,
    linear: LinearPart,
    delta: float,
    least: Floats,
    measure: Callable[[_Forms], tuple[DoubleDouble, Floats]],
) -> _Forms:
    """Return the forms of legs that are so little longer or shorter that a radicand is at least `least` (N,).

    measure: the radicand (N,) and its derivatives (5, N) by the squared legs. All legs change together and by at most
    `LEG_ULPS`, so the pose has the lengths to within that. NaN where that is not enough.
    """
    room = np.full_like(least, _SLACK)
    for _ in range(_STEPS):
        value, gradient = measure(f)
        short = value.high < least
        if not short.any():
            break
        change = (2.0 * least - value.high) / _change(f, gradient)  # relative, of every leg, to first order
        change = np.where(short, np.where(change <= room, change, np.nan), 0.0)
        room = room - change
        factor = DoubleDouble(np.ones_like(gradient), np.zeros_like(gradient)) + 2.0 * change * np.sign(gradient)
        f = _Forms.of(f.squared * factor, linear, delta)
    return f


def _change(f: _Forms, gradient: Floats) -> Floats:
    """Return how far (N,) something moves for every unit of relative change of all legs, each in its own direction."""
    return (2.0 * f.squared.high * np.abs(gradient)).sum(axis=0)


def _self_motions(f: _Forms, linear: LinearPart, delta: float) -> Bools:
    """Return whether legs within the slack have n = 0 and c = 0 (N,): n · (px, pz) = c then holds for a whole circle.

    The direction is (1/δ, ±√(1 − 1/δ²), 0), and leg 3's joint turns about an axis parallel to y.
    """
    one, zero = np.ones_like(f.u.high), np.zeros_like(f.u.high)
    by_n1 = _by_legs(linear, [zero, zero, zero - delta, zero])
    by_c = _by_legs(linear, [one, delta * f.v.high, zero, delta * f.py.high])
    both = ((f.n1, by_n1), (f.c, by_c), (f.d1, _by_d1(f, linear)))
    return np.all([np.abs(form.high) <= _SLACK * _change(f, gradient) for form, gradient in both], axis=0)


def _by_d1(f: _Forms, linear: LinearPart) -> Floats:
    zero = np.zeros_like(f.u.high)
    return _by_legs(linear, [zero, zero, -2.0 * f.u.high, -2.0 * f.v.high])


def _by_d(f: _Forms, linear: LinearPart, delta: float, n_squared: Floats) -> Floats:
    py, v, c, r_squared = f.py.high, f.v.high, f.c.high, f.r_squared.high
    by_v = -2.0 * delta * (delta * v * r_squared + c * py)
    gradient = _by_legs(linear, [-2.0 * c, -2.0 * (py * n_squared + c * delta * v), -2.0 * delta * r_squared, by_v])
    gradient[2] += n_squared
    return gradient


def _by_legs(linear: LinearPart, partial: list[Floats]) -> Floats:
    """Return the derivatives (5, N) by the squared legs of what has these by q, py, u, v (4, N)."""
    return np.einsum("fl,fn->ln", linear.linear_map, np.stack(partial))
