"""The certificate's three answers on ten thousand intervals, against exact rational arithmetic: never a false one.

Polynomials are FLINT's over the rationals; whether one is positive on [0, 1] is decided by Sturm's theorem. w² and
4 w² S² come from the quartic of general pentapods (kinematics notes, section 5), not from the certificate's formulas.
"""

from fractions import Fraction
from itertools import pairwise
from math import comb

import flint
import numpy as np
import pytest
from leg_motions import Exact, grazing, segments

from pentapod.kinematics import LinearPentapod, certify_component
from pentapod.numerics.bernstein import elevate
from pentapods import MACHINES

Poly = flint.fmpq_poly


def rational(x: float | Fraction) -> flint.fmpq:
    fraction = Fraction(x)
    return flint.fmpq(fraction.numerator, fraction.denominator)


def power_form(coefficients: np.ndarray) -> Poly:
    """The exact polynomial with these Bernstein coefficients (k + 1,)."""
    k = len(coefficients) - 1
    t = Poly([0, 1])
    return sum(
        (comb(k, j) * rational(float(c)) * t**j * (1 - t) ** (k - j) for j, c in enumerate(coefficients)), Poly()
    )


class Oracle:
    """Exact w²(t) and 4 w² S²(t) of one machine."""

    def __init__(self, pentapod: LinearPentapod) -> None:
        exact = Exact(pentapod)
        self.delta = rational(exact.delta)
        self.inverse = [[rational(x) for x in row] for row in exact.inverse]
        self.k = [rational(x) for x in exact.k]

    def __call__(self, coefficients: np.ndarray) -> tuple[Poly, Poly]:
        squares = [power_form(c) ** 2 for c in coefficients]
        rhs = [(k + squares[2] - squares[leg]) / 2 for k, leg in zip(self.k, (0, 1, 3, 4), strict=True)]
        q, py, u, v = (sum((e * r for e, r in zip(row, rhs, strict=True)), Poly()) for row in self.inverse)
        # With px = q + δ τ and t = τ: (1 − u² − v²)(l3² − px² − py²) − (τ − px u − py v)² = a τ² + b τ + c
        d, d1, slope, offset = self.delta, 1 - u * u - v * v, 1 - self.delta * u, q * u + py * v
        a = -d * d * d1 - slope * slope
        b = -2 * d * d1 * q + 2 * slope * offset
        c = d1 * (squares[2] - q * q - py * py) - offset * offset
        return d1, b * b - 4 * a * c


def changes(chain: list, t: int) -> int:
    signs = [value > 0 for value in (p(t) for p in chain) if value != 0]
    return sum(x != y for x, y in pairwise(signs))


def positive(p: Poly) -> bool:
    """Whether p > 0 on all of [0, 1]."""
    if p(0) <= 0 or p(1) <= 0:
        return False
    chain = [p, p.derivative()]
    while chain[-1].degree() > 0:
        rest = -(chain[-2] % chain[-1])
        if rest.degree() < 0:
            break  # a multiple root; the chain still counts the distinct ones
        whole = rest.numer()
        chain.append(Poly(whole / whole.content()) if whole.content() > 1 else Poly(whole))
    return changes(chain, 0) == changes(chain, 1)


def check(pentapod: LinearPentapod, intervals: np.ndarray, depth: int = 16) -> dict[str, int]:
    """Compare every interval's answer with the exact one; return how often each was given."""
    proof, oracle = certify_component(pentapod, intervals, (1, 1), depth=depth), Oracle(pentapod)
    counts = {"proven": 0, "refuted": 0, "undecided": 0, "undecided though positive": 0}
    for n, interval in enumerate(intervals):
        w_squared, product = oracle(interval)
        if proof.proven[n]:
            counts["proven"] += 1
            assert positive(w_squared - rational(float(proof.w_lower[n])) ** 2)
            assert positive(product - 4 * rational(float(proof.s_lower[n])) ** 2 * w_squared)
            assert np.isnan(proof.doubt[n]).all()
            continue
        start, end = proof.doubt[n]
        assert 0.0 <= start < end <= 1.0
        truly = positive(w_squared) and positive(product)
        if proof.refuted[n]:
            counts["refuted"] += 1
            assert not truly
            continue
        counts["undecided"] += 1
        counts["undecided though positive"] += truly
        for t in np.linspace(0.0, 1.0, 9):
            if not start <= t <= end:
                assert w_squared(rational(t)) > 0
                assert product(rational(t)) > 0
    return counts


def cases(pentapod: LinearPentapod, share: float) -> dict[str, tuple[np.ndarray, int]]:
    """Intervals (n, 5, k + 1) and the depth of subdivision; share 1 makes ten thousand."""

    def many(n: int) -> int:
        return round(share * n)

    found: dict[str, tuple[np.ndarray, int]] = {}
    rng = np.random.default_rng(3)
    for k, n in ((1, 2500), (3, 120), (5, 15)):
        for seed, reach in enumerate((1e-3, 0.05, 0.3)):
            found[f"random, degree {k}, reach {reach}"] = (segments(pentapod, many(n), k, seed, reach), 16)
        wild = segments(pentapod, many(n // 2), k, 9, 0.2)
        wild += 0.3 * np.abs(pentapod.base).max() * rng.normal(size=wild.shape)
        found[f"not from poses, degree {k}"] = (wild, 16)
    return found


def touching(pentapod: LinearPentapod, n: int) -> np.ndarray:
    """Linear intervals (n, 5, 2) that end on a singularity, but for up to 1e-12 of its size to either side."""
    rng = np.random.default_rng(17)
    size = np.abs(pentapod.base - pentapod.base[2]).max()
    start = segments(pentapod, n, 1, 31, 0.1, 0.5)
    p = rng.uniform(-1.0, 1.0, (n, 3)) * size + np.append(pentapod.base[2], 0.0)
    i = rng.normal(size=(n, 3)) * (1.0, 1.0, 0.5)
    off = rng.choice([0.0, 1e-17, 1e-15, 1e-13, 1e-12], n) * rng.choice([-1.0, 1.0], n)
    flat = np.arange(n) % 2 == 0
    i[flat, 2] = off[flat]
    i /= np.linalg.norm(i, axis=1)[:, None]
    normal = np.c_[pentapod.delta * i[:, 2], np.zeros(n), 1.0 - pentapod.delta * i[:, 0]]
    s = (normal * p).sum(axis=1) + pentapod.lever * i[:, 2]
    p[~flat] -= ((s - off * size) / (normal**2).sum(axis=1))[~flat, None] * normal[~flat]
    start[..., 1] = pentapod.leg_lengths(p, i)
    return start


def run(pentapod: LinearPentapod, share: float) -> dict[str, int]:
    totals = {"proven": 0, "refuted": 0, "undecided": 0, "undecided though positive": 0}
    jobs = cases(pentapod, share)
    jobs["ending on a singularity"] = (touching(pentapod, max(4, round(1000 * share))), 16)
    for name, (intervals, depth) in jobs.items():
        counts = check(pentapod, intervals, depth)
        if "reach 0.001" in name:
            assert counts["proven"] >= 0.9 * len(intervals)
        totals = {key: totals[key] + counts[key] for key in totals}
    return totals


@pytest.mark.parametrize(
    "pentapod",
    [pytest.param(m, id=name, marks=() if name == "paper" else pytest.mark.slow) for name, m in MACHINES.items()],
)
def test_random_and_touching_intervals(pentapod: LinearPentapod) -> None:
    totals = run(pentapod, 0.008)
    assert min(totals["proven"], totals["refuted"]) > 3
    assert totals["undecided"] > 0


@pytest.mark.slow
def test_ten_thousand_random_and_touching_intervals(pentapod: LinearPentapod) -> None:
    totals = run(pentapod, 1.0)
    assert sum(totals[answer] for answer in ("proven", "refuted", "undecided")) >= 10_000
    assert min(totals["proven"], totals["refuted"], totals["undecided"]) > 100


@pytest.mark.slow
@pytest.mark.parametrize(("degree", "most"), [(1, 1000), (3, 60), (5, 30)])
@pytest.mark.parametrize("which", [0, 1], ids=["w", "S"])
def test_intervals_that_graze_a_singularity_to_a_relative_1e_15(
    pentapod: LinearPentapod, which: int, degree: int, most: int
) -> None:
    intervals = elevate(grazing(pentapod, which, most), degree - 1)
    assert len(intervals) >= 30
    totals = check(pentapod, np.ascontiguousarray(intervals), depth=40)
    assert min(totals["proven"], totals["refuted"], totals["undecided"]) > 0
