"""The component certificate against exact rational arithmetic: never a false proof.

The oracle uses the quartic of general pentapods (kinematics notes, section 5), not the formulas of the
certificate: with t the parameter along the solutions of the linear equations, its discriminant is 4 w² S².
"""

from fractions import Fraction
from itertools import pairwise
from math import comb, gcd, lcm

import numpy as np
import pytest

from pentapod.errors import ArrayError
from pentapod.geometry import elevate, split
from pentapod.kinematics import COMPONENTS, LinearPentapod, certify_component, singularity_values

# ---- exact polynomials in t: lists of Fractions, lowest power first


def add(a: list, b: list, factor: Fraction | int = 1) -> list:
    n = max(len(a), len(b))
    a, b = [*a, *[Fraction(0)] * (n - len(a))], [*b, *[Fraction(0)] * (n - len(b))]
    return [x + factor * y for x, y in zip(a, b, strict=True)]


def times(a: list, b: list) -> list:
    out = [Fraction(0)] * (len(a) + len(b) - 1)
    for i, x in enumerate(a):
        for j, y in enumerate(b):
            out[i + j] += x * y
    return out


def at(a: list, t: Fraction) -> Fraction:
    value = Fraction(0)
    for c in reversed(a):
        value = value * t + c
    return value


def power_form(coefficients: np.ndarray) -> list:
    """The exact powers of one Bernstein polynomial (k + 1,)."""
    c = [Fraction(float(x)) for x in coefficients]
    k = len(c) - 1
    return [
        sum((comb(k, i) * comb(i, j) * (-1) ** (i - j) * c[j] for j in range(i + 1)), Fraction(0)) for i in range(k + 1)
    ]


def divided(a: list, b: list) -> list:
    """a / b, which must leave no remainder."""
    rest, quotient = list(a), [Fraction(0)] * (len(a) - len(b) + 1)
    for j in reversed(range(len(quotient))):
        quotient[j] = rest[j + len(b) - 1] / b[-1]
        for m, c in enumerate(b):
            rest[j + m] -= quotient[j] * c
    assert not any(rest)
    return quotient


def primitive(a: list) -> list[int]:
    """A positive multiple with integer coefficients without a common factor, leading zeros removed."""
    common = lcm(*[c.denominator for c in a])
    whole = [int(c * common) for c in a]
    factor = gcd(*whole) or 1
    while whole and whole[-1] == 0:
        whole.pop()
    return [c // factor for c in whole]


def positive_on_unit_interval(polynomial: list) -> bool:
    """Whether a polynomial is > 0 on all of [0, 1], by Sturm's theorem in integers."""
    chain = [primitive(polynomial)]
    if chain[0][0] <= 0 or sum(chain[0]) <= 0:
        return False
    chain.append(primitive([Fraction(j * c) for j, c in enumerate(chain[0])][1:]))
    while len(chain[-1]) > 1:
        rest, divisor = list(chain[-2]), chain[-1]
        while len(rest) >= len(divisor):
            shift, lead = len(rest) - len(divisor), rest[-1]
            rest = [abs(divisor[-1]) * c for c in rest]
            for m, c in enumerate(divisor):
                rest[shift + m] -= (lead if divisor[-1] > 0 else -lead) * c
            rest.pop()
        rest = primitive([Fraction(-c) for c in rest])
        if not rest:
            break  # a multiple root; the chain still counts distinct roots
        chain.append(rest)

    def changes(values: list[int]) -> int:
        signs = [value > 0 for value in values if value]
        return sum(x != y for x, y in pairwise(signs))

    return changes([p[0] for p in chain if p]) == changes([sum(p) for p in chain if p])


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


@pytest.mark.parametrize("k", [1, 3])
def test_bounds_hold_in_exact_arithmetic_on_random_intervals(pentapod: LinearPentapod, k: int) -> None:
    n = 30 if k == 1 else 8
    coefficients = np.concatenate([segments(pentapod, n, k, seed, reach) for seed, reach in ((0, 1e-3), (1, 0.2))])
    noise = np.random.default_rng(0).normal(size=(n // 2, 5, k + 1))
    coefficients[-(n // 2) :] += 0.3 * np.abs(pentapod.base).max() * noise
    proof = certify_component(pentapod, coefficients, COMPONENTS[0])
    exact = Exact(pentapod)
    for index, interval in enumerate(coefficients):
        d1, product = exact.interval(interval)
        s_squared = divided(product, [4 * c for c in d1])
        for polynomial, bound in ((d1, proof.w_lower[index]), (s_squared, proof.s_lower[index])):
            least = min(at(polynomial, Fraction(j, 16)) for j in range(17))
            assert bound == 0.0 or least >= Fraction(float(bound)) ** 2
            # and it is a bound of all values, not of samples only
            assert bound == 0.0 or positive_on_unit_interval(add(polynomial, [-(Fraction(float(bound)) ** 2)]))
            assert bound > 0.0 or least < 1e-6
    assert 0.4 < proof.proven.mean() < 1.0  # small motions are proven, and not everything is


def test_small_intervals_have_tight_bounds(pentapod: LinearPentapod) -> None:
    rng = np.random.default_rng(0)
    size = np.abs(pentapod.base - pentapod.base[2]).max()
    p = rng.uniform(-1.0, 1.0, size=(500, 3)) * size + (0.0, 0.0, 2.0 * size)
    i = rng.normal(size=(500, 3)) * 0.3 + (0.0, 0.0, 1.0)
    i /= np.linalg.norm(i, axis=1)[:, None]
    legs = pentapod.leg_lengths(p, i)
    w, s = singularity_values(pentapod, p, i)
    clear = (abs(s) > 0.1 * size) & (w > 0.1)
    proof = certify_component(pentapod, np.stack([legs, legs], axis=-1)[clear], (1, 1))
    assert proof.holds
    assert (proof.w_lower <= w[clear]).all()
    assert (proof.s_lower <= abs(s[clear])).all()
    np.testing.assert_allclose(proof.w_lower, w[clear], rtol=1e-6)
    np.testing.assert_allclose(proof.s_lower, abs(s[clear]), rtol=1e-6)


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


@pytest.mark.parametrize("which", [0, 1], ids=["w", "S"])
def test_grazing_intervals_are_never_proven_falsely(paper: LinearPentapod, which: int) -> None:
    intervals = grazing(paper, which, 150)
    assert len(intervals) >= 100
    proof = certify_component(paper, intervals, (1, 1), depth=40)
    exact = Exact(paper)
    counts = {(a, b): 0 for a in (True, False) for b in (True, False)}
    for index, interval in enumerate(intervals):
        d1, product = exact.interval(interval)
        polynomial = d1 if which == 0 else divided(product, [4 * c for c in d1])
        truth = positive_on_unit_interval(polynomial)
        counts[truth, bool(proof.proven[index])] += 1
    assert counts[False, True] == 0
    # both cases occur, many of those that are true are proven, and some are nearer to 0 than rounding can tell
    assert counts[False, False] > 20
    assert counts[True, True] > 20
    assert counts[True, False] > 0


def test_a_false_bound_would_be_seen(paper: LinearPentapod) -> None:
    """The oracle itself: w² and 4 w² S² at one pose, known from the pose."""
    p, i = np.array([0.5, 0.25, 3.0]), np.array([0.36, 0.48, 0.8])
    legs = paper.leg_lengths(p, i)
    d1, product = Exact(paper)([[Fraction(float(leg))] for leg in legs])
    w, s = singularity_values(paper, p, i)
    assert float(d1[0]) == pytest.approx(w**2, rel=1e-13)
    assert float(product[0]) == pytest.approx(4 * w**2 * s**2, rel=1e-13)
    one = [Fraction(1)]
    touching = times([Fraction(-1, 3), *one], [Fraction(-1, 3), *one])
    assert not positive_on_unit_interval(touching)
    assert positive_on_unit_interval(add(touching, [Fraction(1, 10**30)]))
    assert not positive_on_unit_interval(add(touching, [Fraction(-1, 10**30)]))


def test_motions_through_a_singularity_are_not_proven(pentapod: LinearPentapod) -> None:
    size = np.abs(pentapod.base - pentapod.base[2]).max()
    steps = np.linspace(-1.0, 1.0, 201)
    # S = 0 at the middle of the first motion, which moves square to the plane; w = 0 at that of the second
    i = np.array([0.2, 0.1, 1.0]) / np.linalg.norm([0.2, 0.1, 1.0])
    p = np.array([0.1, 0.3, 0.0]) * size
    normal = np.array([pentapod.delta * i[2], 0.0, 1.0 - pentapod.delta * i[0]])
    normal /= np.linalg.norm(normal)
    _, s = singularity_values(pentapod, [p, p + normal], i)
    p = p - s[0] / (s[1] - s[0]) * normal
    falling = p + size * steps[:, None] * normal
    turning = np.c_[0.6 * np.cos(steps / 2), 0.8 * np.cos(steps / 2), np.sin(steps / 2)]
    above = np.array([0.2, 0.1, 1.5]) * size
    for positions, directions in ((falling, i[None]), (above[None], turning)):
        w, s = singularity_values(pentapod, positions, directions)
        component = pentapod.component(positions, directions)
        legs = pentapod.leg_lengths(positions, directions)
        proof = certify_component(pentapod, np.stack([legs[:-1], legs[1:]], axis=-1), component[0])
        assert (component[0] * component[-1] == (1, -1)).all() or (component[0] * component[-1] == (-1, 1)).all()
        assert not proof.proven[99:101].any()
        far = (np.abs(s) > 0.2 * size) & (np.abs(w) > 0.1)
        assert proof.proven[far[:-1] & far[1:]].all()
        assert (proof.w_lower <= np.minimum(np.abs(w[:-1]), np.abs(w[1:]))).all()
        assert (proof.s_lower <= np.minimum(np.abs(s[:-1]), np.abs(s[1:]))).all()


def test_the_same_motion_in_any_degree_and_in_halves(pentapod: LinearPentapod) -> None:
    linear = segments(pentapod, 300, 1, 5, 0.05)
    proof = certify_component(pentapod, linear, (1, 1))
    assert proof.proven.mean() > 0.2
    whole = certify_component(pentapod, linear, (1, 1), depth=0)
    for by in (1, 2, 4):
        assert (certify_component(pentapod, elevate(linear, by), (1, 1)).proven == proof.proven).all()
        # a higher degree holds the curve tighter, but for the larger rounding error
        raised = certify_component(pentapod, elevate(linear, by), (1, 1), depth=0)
        assert (raised.w_lower**2 >= whole.w_lower**2 - 1e-9).all()
        assert (raised.s_lower**2 >= whole.s_lower**2 - 1e-9).all()
    halves = [certify_component(pentapod, half, (1, 1)) for half in split(linear)]
    assert ((halves[0].proven & halves[1].proven) == proof.proven).all()
    both = np.minimum(halves[0].s_lower, halves[1].s_lower)
    assert (both[proof.proven] >= proof.s_lower[proof.proven] * (1 - 1e-9)).all()


def test_legs_at_rest_are_a_motion_of_degree_zero(paper: LinearPentapod) -> None:
    legs = paper.leg_lengths([0.5, 0.25, 3.0], [0.36, 0.48, 0.8])
    proof = certify_component(paper, legs[None, :, None], (1, 1))
    assert proof.w_lower[0] == pytest.approx(0.8, rel=1e-12)
    assert proof.w_lower[0] < 0.8


@pytest.mark.parametrize("k", [1, 3])
def test_a_leg_error_covers_every_motion_within_it(paper: LinearPentapod, k: int) -> None:
    coefficients = segments(paper, 12, k, 9, 0.02)
    error = 2e-3
    sharp, covered = (certify_component(paper, coefficients, (1, 1), leg_error=e) for e in (0.0, error))
    assert covered.proven.any()
    assert (covered.w_lower <= sharp.w_lower).all()
    assert (covered.s_lower <= sharp.s_lower).all()
    exact, rng = Exact(paper), np.random.default_rng(0)
    worst = np.inf
    for index in np.flatnonzero(covered.proven):
        for _ in range(20):
            t, signs = Fraction(int(rng.integers(0, 65)), 64), rng.choice([-1.0, 1.0], 5)
            legs = [
                [at(power_form(c), t) + Fraction(float(e))]
                for c, e in zip(coefficients[index], signs * error, strict=True)
            ]
            d1, product = exact(legs)
            assert d1[0] >= Fraction(float(covered.w_lower[index])) ** 2
            assert product[0] >= 4 * d1[0] * Fraction(float(covered.s_lower[index])) ** 2
            worst = min(worst, float(d1[0]) - sharp.w_lower[index] ** 2)
    assert worst < 0.0  # the sharp bound would not have covered them


def test_intervals_are_judged_one_by_one(pentapod: LinearPentapod) -> None:
    coefficients = segments(pentapod, 5000, 1, 3, 0.2)
    coefficients[17, 3, 1] = np.nan
    coefficients[18, 0, 0] = np.inf
    coefficients[19] = 1e200
    coefficients[20] = 0.0
    proof = certify_component(pentapod, coefficients, (-1, 1))
    assert not proof.proven[17:21].any()
    for k in (0, 16, 21, 2047, 2048, 4999):
        alone = certify_component(pentapod, coefficients[k : k + 1], (-1, 1))
        np.testing.assert_allclose(alone.w_lower[0], proof.w_lower[k], rtol=1e-9, atol=1e-12)
        assert alone.proven[0] == proof.proven[k]
    assert (proof.proven == ((proof.w_lower > 0) & (proof.s_lower > 0))).all()
    assert certify_component(pentapod, coefficients[:0], (1, 1)).holds
    assert str(proof.component) == "-+"
    with pytest.raises(ValueError, match="read-only"):
        proof.proven[0] = True


def test_wrong_arguments(paper: LinearPentapod) -> None:
    good = np.ones((3, 5, 2))
    for bad in (np.ones((5, 2)), np.ones((3, 4, 2)), np.ones((3, 5, 0))):
        with pytest.raises(ArrayError, match="leg_coefficients"):
            certify_component(paper, bad, (1, 1))
    for component in ((0, 1), (1, 1, 1), np.ones((3, 2))):
        with pytest.raises(ArrayError, match="component"):
            certify_component(paper, good, component)
    with pytest.raises(ArrayError, match="negative"):
        certify_component(paper, good, (1, 1), leg_error=-1.0)
