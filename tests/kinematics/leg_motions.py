"""Motions of the legs to put before a proof, and their exact w² and 4 w² S².

The latter come from the quartic of general pentapods (kinematics notes, section 5), not from the formulas of the
certificate: with t the parameter along the solutions of the linear equations, its discriminant is 4 w² S².
"""

from fractions import Fraction

import numpy as np
from rational_polynomials import add, power_form, times

from pentapod.kinematics import LinearPentapod


class Exact:
    """Exact w²(t) and 4 w² S²(t) of one machine."""

    def __init__(self, pentapod: LinearPentapod) -> None:
        base = [[Fraction(float(c)) for c in a] for a in pentapod.base]
        self.delta = Fraction(pentapod.delta)
        self.rows, self.k = [], []
        for leg in (0, 1, 3, 4):
            x, y = base[leg][0] - base[2][0], base[leg][1] - base[2][1]
            z = self.delta * x
            self.rows.append([x, y, x * z, y * z])
            self.k.append(x * x + y * y + z * z)
        self.inverse = self._invert(self.rows)

    @staticmethod
    def _invert(m: list) -> list:
        def minor(a: list, i: int, j: int) -> list:
            return [[*row[:j], *row[j + 1 :]] for r, row in enumerate(a) if r != i]

        def det(a: list) -> Fraction:
            if len(a) == 1:
                return a[0][0]
            return sum(((-1) ** j * a[0][j] * det(minor(a, 0, j)) for j in range(len(a))), Fraction(0))

        whole = det(m)
        return [[(-1) ** (i + j) * det(minor(m, j, i)) / whole for j in range(4)] for i in range(4)]

    def __call__(self, legs: list) -> tuple[list, list]:
        """(w², 4 w² S²) as polynomials, of five leg polynomials."""
        squares = [times(leg, leg) for leg in legs]
        rhs = []
        for k, leg in zip(self.k, (0, 1, 3, 4), strict=True):
            rhs.append([c / -2 for c in add(add(squares[leg], squares[2], -1), [k], -1)])
        forms = []
        for row in self.inverse:
            total: list = [Fraction(0)]
            for entry, r in zip(row, rhs, strict=True):
                total = add(total, [entry * c for c in r])
            forms.append(total)
        q, py, u, v = forms
        # t = τ, px = q + δ τ:  f(τ) = (1 − u² − v²)(l3² − px² − py²) − (τ − px u − py v)² = a τ² + b τ + c
        d, d1 = self.delta, add(add([Fraction(1)], times(u, u), -1), times(v, v), -1)
        slope = add([Fraction(1)], [d * x for x in u], -1)
        offset = add(times(q, u), times(py, v))
        a = add([-d * d * x for x in d1], times(slope, slope), -1)
        b = add([-2 * d * x for x in times(d1, q)], [2 * x for x in times(slope, offset)])
        c = add(times(d1, add(add(squares[2], times(q, q), -1), times(py, py), -1)), times(offset, offset), -1)
        return d1, add(times(b, b), [4 * x for x in times(a, c)], -1)

    def interval(self, coefficients: np.ndarray) -> tuple[list, list]:
        return self([power_form(c) for c in coefficients])


def segments(pentapod: LinearPentapod, n: int, k: int, seed: int, reach: float, height=2.0) -> np.ndarray:
    """Bernstein coefficients (n, 5, k + 1) of leg motions around random poses, `reach` times the machine's size."""
    rng = np.random.default_rng(seed)
    size = np.abs(pentapod.base - pentapod.base[2]).max()
    p = rng.uniform(-1.0, 1.0, size=(n, 1, 3)) * size + (0.0, 0.0, height * size)
    i = rng.normal(size=(n, 1, 3)) * 0.5 + (0.0, 0.0, 1.0)
    p = p + rng.normal(size=(n, k + 1, 3)) * reach * size
    i = i + rng.normal(size=(n, k + 1, 3)) * reach
    i /= np.linalg.norm(i, axis=-1, keepdims=True)
    return np.moveaxis(pentapod.leg_lengths(p, i), 1, 2)


def float_minima(pentapod: LinearPentapod, ends: np.ndarray, which: int) -> np.ndarray:
    """Minima (n,) of w² (which = 0) or S² (1) over linear intervals (n, 5, 2), by ever finer sampling."""
    centre, width = np.full((len(ends), 1), 0.5), 0.5
    for _ in range(5):
        t = np.clip(centre + width * np.linspace(-1.0, 1.0, 41), 0.0, 1.0)
        squared = ((1 - t)[:, None] * ends[..., :1] + t[:, None] * ends[..., 1:]) ** 2  # (n, 5, 41)
        q, py, u, v = pentapod.linear_part(np.moveaxis(squared, 1, 0).reshape(5, -1)).reshape(4, *t.shape)
        values = 1 - u * u - v * v
        if which == 1:
            c = q + pentapod.delta * v * py
            values = (squared[:, 2] - py * py) * ((1 - pentapod.delta * u) ** 2 + pentapod.delta**2 * values) - c * c
        centre, width = np.take_along_axis(t, values.argmin(axis=1)[:, None], axis=1), width / 20
    return values.min(axis=1)


def grazing(pentapod: LinearPentapod, which: int, n: int) -> np.ndarray:
    """Linear intervals (n, 5, 2) whose w² (which = 0) or S² (1) nearly touches 0 inside, from both sides."""
    rng = np.random.default_rng(11 + which)
    size = np.abs(pentapod.base - pentapod.base[2]).max()
    many = (800, 3500)[which]
    # S = 0 is met in low poses; a strong push there ends at w = 0 more often
    start = segments(pentapod, many, 1, 21 + which, 0.25, (2.0, 0.3)[which])
    push = rng.normal(size=(many, 5, 1)) * (0.3, 0.15)[which] * size
    low, high = np.zeros((many, 1, 1)), np.ones((many, 1, 1))
    use = (float_minima(pentapod, start, which) > 0.005) & (float_minima(pentapod, start + push, which) < 0)
    start, push, low, high = start[use], push[use], low[use], high[use]
    for _ in range(50):
        middle = 0.5 * (low + high)
        outside = (float_minima(pentapod, start + middle * push, which) <= 0)[:, None, None]
        low, high = np.where(outside, low, middle), np.where(outside, middle, high)
    ends = start + low * push
    w_squared, s_squared = (
        np.minimum(*(float_minima(pentapod, ends[..., [k, k]], form) for k in (0, 1))) for form in (0, 1)
    )
    other = float_minima(pentapod, ends, 1 - which)
    inside = ((w_squared, s_squared)[which] > 1e-3) & (other > 1e-3)
    shifts = np.array([1e-9, 1e-12, 1e-14, 1e-15, 0.0, -1e-15, -1e-13, -1e-11, -1e-9, -1e-8])
    chosen = start[inside], push[inside], low[inside]
    found = chosen[0] + chosen[2] * (1 + shifts[:, None, None, None]) * chosen[1]
    return np.swapaxes(found, 0, 1).reshape(-1, 5, 2)[:n]
