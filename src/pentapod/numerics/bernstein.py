"""Polynomials in Bernstein form on [0, 1], in batches: coefficients (..., n + 1), degree n.

Source: R. T. Farouki, "The Bernstein polynomial basis: a centennial retrospective", CAGD 29 (2012).

Results are laid out in memory with the coefficients first and the batch last, so that the loops over
coefficients run over contiguous batches; this shows in strides only. The *scaled* form holds C(n, j) b_j in
place of b_j: there, a product of polynomials is a plain convolution, and no division rounds.
"""

from __future__ import annotations

from functools import cache
from math import comb

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_batch


def multiply(a: ArrayLike, b: ArrayLike) -> Floats:
    """Return the product (..., n + m + 1) of polynomials (..., n + 1) and (..., m + 1); batches broadcast."""
    return unscaled(convolve(scaled(a), scaled(b)))


def elevate(a: ArrayLike, by: int) -> Floats:
    """Return the same polynomials (..., n + 1) written with degree n + by."""
    return unscaled(convolve(scaled(a), binomials(by)))


def split(a: ArrayLike, at: float = 0.5) -> tuple[Floats, Floats]:
    """Return the coefficients (..., n + 1) of each polynomial on [0, at] and on [at, 1] (de Casteljau).

    Each coefficient passes through at most n convex combinations: at ½ these are n roundings.
    """
    work = np.array(np.moveaxis(_coefficients(a), -1, 0))
    left = np.empty_like(work)
    for j in range(len(work)):
        left[j] = work[0]
        if at == 0.5:
            work[: len(work) - 1 - j] = 0.5 * (work[: len(work) - 1 - j] + work[1 : len(work) - j])
        else:
            work[: len(work) - 1 - j] = (1.0 - at) * work[: len(work) - 1 - j] + at * work[1 : len(work) - j]
    return np.moveaxis(left, 0, -1), np.moveaxis(work, 0, -1)


def from_power(powers: ArrayLike) -> Floats:
    """Return Bernstein coefficients (..., n + 1) of Σ powers[..., j] t^j, t in [0, 1]."""
    c = _coefficients(powers)
    return c @ _power_to_bernstein(c.shape[-1] - 1).T


def scaled(a: ArrayLike) -> Floats:
    """Return C(n, j) b_j (..., n + 1): the scaled form, coefficients first in memory."""
    c = np.moveaxis(_coefficients(a), -1, 0)
    out = np.multiply(c, binomials(len(c) - 1).reshape((-1,) + (1,) * (c.ndim - 1)), order="C")
    return np.moveaxis(out, 0, -1)


def unscaled(a: ArrayLike) -> Floats:
    """Return the Bernstein coefficients (..., n + 1) of polynomials in scaled form."""
    c = np.moveaxis(_coefficients(a), -1, 0)
    out = np.divide(c, binomials(len(c) - 1).reshape((-1,) + (1,) * (c.ndim - 1)), order="C")
    return np.moveaxis(out, 0, -1)


def convolve(a: Floats, b: Floats) -> Floats:
    """Return the product (..., n + m + 1) of polynomials (..., n + 1) and (..., m + 1), all in scaled form.

    Each coefficient is a sum of at most min(n, m) + 1 products: 1 + min(n, m) roundings on any path.
    """
    if a.shape[-1] > b.shape[-1]:
        a, b = b, a
    n, m = a.shape[-1] - 1, b.shape[-1] - 1
    batch = np.broadcast_shapes(a.shape[:-1], b.shape[:-1])
    first, second = np.moveaxis(a, -1, 0), np.moveaxis(b, -1, 0)
    second = second.reshape(m + 1, *(1,) * (len(batch) + 1 - second.ndim), *second.shape[1:])
    out = np.empty((n + m + 1, *batch))
    out[: m + 1] = first[0] * second
    out[m + 1 :] = 0.0
    for j in range(1, n + 1):
        out[j : j + m + 1] += first[j] * second
    return np.moveaxis(out, 0, -1)


@cache
def binomials(n: int) -> Floats:
    """Return C(n, 0), ..., C(n, n) as floats (n + 1,), read-only: the constant 1 in scaled form."""
    row = np.array([float(comb(n, j)) for j in range(n + 1)])
    row.flags.writeable = False
    return row


@cache
def _power_to_bernstein(n: int) -> Floats:
    # t^j = Σ_i C(i, j) / C(n, j) B_i
    return np.array([[comb(i, j) / comb(n, j) for j in range(n + 1)] for i in range(n + 1)])


def _coefficients(value: ArrayLike) -> Floats:
    return as_batch(value, "coefficients", (None,))
