"""The discriminants of the quadratic family in scaled Bernstein form, compiled.

Polynomials are (n + 1, lanes): the loops over the coefficients are short, those over the intervals become vector
instructions.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.numerics.kernels import kernel

_LANES = 32


@kernel
def _convolve(a: Floats, b: Floats, out: Floats) -> None:
    """Fill out with the product of a and b in scaled form; a has at most the degree of b."""
    n, m, lanes = len(a), len(b), out.shape[1]
    for j in range(m):
        for t in range(lanes):
            out[j, t] = a[0, t] * b[j, t]
    out[m:] = 0.0
    for i in range(1, n):
        for j in range(m):
            for t in range(lanes):
                out[i + j, t] += a[i, t] * b[j, t]


@kernel
def _elevate(a: Floats, unit: Floats, out: Floats) -> None:
    """Fill out with the product of a and the constant 1 of a's degree, `unit`."""
    n, lanes = len(a), out.shape[1]
    for j in range(n):
        for t in range(lanes):
            out[j, t] = a[0, t] * unit[j]
    out[n:] = 0.0
    for i in range(1, n):
        for j in range(n):
            for t in range(lanes):
                out[i + j, t] += a[i, t] * unit[j]


@kernel
def _top(a: Floats, unit: Floats, start: int, count: int, out: Floats) -> None:
    """Fill out[start : start + count] with the largest |coefficient| of a polynomial in scaled form."""
    for t in range(count):
        top = 0.0
        for j in range(len(a)):
            top = max(top, abs(a[j, t] / unit[j]))
        out[start + t] = top


@kernel
def _unscaled(a: Floats, unit: Floats, start: int, count: int, out: Floats) -> None:
    """Fill out[:, start : start + count] with plain Bernstein coefficients."""
    for j in range(len(a)):
        for t in range(count):
            out[j, start + t] = a[j, t] / unit[j]


@kernel
def _scaled_leg(legs: Floats, i: int, start: int, count: int, unit: Floats, out: Floats, largest: Floats) -> None:
    """Fill out with leg i of the intervals from `start` on, in scaled form, and largest[i]."""
    for t in range(count):
        top = 0.0
        for j in range(len(unit)):
            value = legs[start + t, i, j]
            out[j, t] = value * unit[j]
            top = max(top, abs(value))
        largest[i, start + t] = top


@kernel
def _linear_forms(squares: Floats, linear_map: Floats, constant: Floats, unit: Floats, forms: Floats) -> None:
    """Fill q, py, u, v (4, 2k + 1, lanes) of the squared legs (5, 2k + 1, lanes)."""
    for f in range(4):
        for j in range(len(unit)):
            for t in range(forms.shape[2]):
                value = linear_map[f, 0] * squares[0, j, t]
                value += linear_map[f, 1] * squares[1, j, t]
                value += linear_map[f, 2] * squares[2, j, t]
                value += linear_map[f, 3] * squares[3, j, t]
                value += linear_map[f, 4] * squares[4, j, t]
                forms[f, j, t] = value + constant[f] * unit[j]


@kernel
def discriminants(
    legs: Floats,
    linear_map: Floats,
    constant: Floats,
    delta: float,
    units: tuple[Floats, Floats, Floats, Floats],
    tops: bool,
    w_squared: Floats,
    s_squared: Floats,
    largest: Floats,
    maxima: Floats,
) -> None:
    """Fill w² (4k + 1, N), S² (8k + 1, N), largest (5, N) and maxima (6, N) of legs (N, 5, k + 1).

    units: the constant 1 in scaled form, of degrees k, 2k, 4k, 8k.
    """
    unit1, unit2, unit4, unit8 = units
    count, k = len(legs), legs.shape[2] - 1
    n2, n4, n8 = 2 * k + 1, 4 * k + 1, 8 * k + 1
    leg, squares = np.zeros((k + 1, _LANES)), np.empty((5, n2, _LANES))
    forms = np.empty((4, n2, _LANES))
    d1, v2, r = np.empty((n4, _LANES)), np.empty((n4, _LANES)), np.empty((n4, _LANES))
    n, c, other = np.empty((n4, _LANES)), np.empty((n4, _LANES)), np.empty((n4, _LANES))
    slope = np.empty((n2, _LANES))
    d, c2 = np.empty((n8, _LANES)), np.empty((n8, _LANES))
    for start in range(0, count, _LANES):
        lanes = min(_LANES, count - start)
        for i in range(5):
            _scaled_leg(legs, i, start, lanes, unit1, leg, largest)
            _convolve(leg, leg, squares[i])
        _linear_forms(squares, linear_map, constant, unit2, forms)
        q, py, u, v = forms[0], forms[1], forms[2], forms[3]
        _convolve(u, u, d1)
        _convolve(v, v, v2)
        _elevate(squares[2], unit2, r)
        _convolve(py, py, other)
        for j in range(n2):
            for t in range(_LANES):
                slope[j, t] = unit2[j] - (2.0 * delta) * u[j, t]
        _elevate(slope, unit2, n)
        for j in range(n4):
            for t in range(_LANES):
                d1[j, t] = (unit4[j] - d1[j, t]) - v2[j, t]
                r[j, t] -= other[j, t]
                n[j, t] += (delta * delta) * (unit4[j] - v2[j, t])
        _elevate(q, unit2, c)
        _convolve(v, py, other)
        for j in range(n4):
            for t in range(_LANES):
                c[j, t] += delta * other[j, t]
        _convolve(r, n, d)
        _convolve(c, c, c2)
        for j in range(n8):
            for t in range(_LANES):
                d[j, t] -= c2[j, t]
        _unscaled(d1, unit4, start, lanes, w_squared)
        _unscaled(d, unit8, start, lanes, s_squared)
        if tops:
            for f in range(3):
                _top(forms[1 + f], unit2, start, lanes, maxima[f])
            _top(r, unit4, start, lanes, maxima[3])
            _top(n, unit4, start, lanes, maxima[4])
            _top(c, unit4, start, lanes, maxima[5])
