"""The paper's printed coefficients of (10), exactly: which are right, and which docs/kinematics.md corrects."""

import flint
import numpy as np
import pytest

Q, Poly = flint.fmpq, flint.fmpq_poly


def determinant(columns: list) -> flint.fmpq:
    rows = [list(row) for row in zip(*columns, strict=True)]
    return flint.fmpq_mat(len(rows), len(rows), [entry for row in rows for entry in row]).det()


class Design:
    """Random rational attachments and squared legs; the cofactors C, the E of (7) and (10) as (9) minus (8)."""

    def __init__(self, seed: int, kind: str) -> None:
        rng = np.random.default_rng(seed)
        x, y, z = ([Q(int(n), 7) for n in rng.integers(-9, 10, 5)] for _ in range(3))
        self.delta = Q(3, 5)
        if kind != "general":
            x[2] = y[2] = z[2] = Q(0)
        if kind == "quadratic":
            z = [self.delta * a for a in x]
        elif kind == "turned":
            z = [self.delta * a - Q(2, 3) * b for a, b in zip(x, y, strict=True)]
        elif kind == "four on a line":
            y = [Q(0) if k == 2 else Q(1) + Q(1, 2) * a for k, a in enumerate(x)]
        squared = [Q(int(n), 3) for n in rng.integers(20, 40, 5)]
        size = [a * a + b * b + c * c - s for a, b, c, s in zip(x, y, z, squared, strict=True)]
        n = [(s - size[2]) / 2 for s in size]  # (5)
        xz, yz = ([a * c for a, c in zip(p, z, strict=True)] for p in (x, y))
        columns = [z, x, y, xz, yz, [Q(1)] * 5]
        self.c = [None] + [(-1) ** k * determinant(columns[:k] + columns[k + 1 :]) for k in range(6)]
        c1 = columns[1:]
        self.e = [None, None] + [
            determinant([n if j == k else column for j, column in enumerate(c1)]) for k in range(4)
        ]
        self.x, self.y, self.z, self.l3 = x, y, z, squared[2]
        if self.c[1] != 0:
            px, py, u, v = (Poly([self.e[k], -self.c[k]]) / self.c[1] for k in (2, 3, 4, 5))
            t, (x3, y3, z3) = Poly([0, 1]), (x[2], y[2], z[2])
            pz2 = 2 * (-z3 * t + x3 * px + y3 * py + z3 * y3 * v + z3 * x3 * u) - px * px - py * py
            pz2 += self.l3 - x3 * x3 - y3 * y3 - z3 * z3
            self.quartic = (t - px * u - py * v) ** 2 - (1 - u * u - v * v) * pz2


def designs(kind: str) -> list[Design]:
    return [d for d in (Design(seed, kind) for seed in range(12)) if d.c[1] != 0]


def test_n4_and_n3_are_right() -> None:
    for d in designs("general"):
        _, c1, c2, c3, c4, c5, _ = d.c
        _, _, e2, e3, e4, e5 = d.e
        x3, y3, z3 = d.x[2], d.y[2], d.z[2]
        n3 = c1**2 * (c5 * c3 + c4 * c2)
        n3 += c1 * (c5**2 + c4**2) * (c2 * x3 + (c1 + c4 * x3 + c5 * y3) * z3 + y3 * c3)
        n3 += (c4 * c3 - c5 * c2) * (e5 * c2 + e2 * c5 - e4 * c3 - e3 * c4)
        assert d.quartic[4] == -((c4 * c3 - c2 * c5) ** 2) / c1**4
        assert d.quartic[3] == -2 * n3 / c1**4


def test_n2_n0_14_and_15_are_right_and_n1_wants_a_bracket() -> None:
    for d in designs("quadratic"):
        delta, (_, _, e2, e3, e4, e5), l3 = d.delta, d.e, d.l3
        legs = (0, 1, 3, 4)
        x, y = [d.x[k] for k in legs], [d.y[k] for k in legs]
        f = determinant([[a * a for a in x], [a * b for a, b in zip(x, y, strict=True)], x, y])
        assert d.c[1:] == [delta**2 * f, -(delta**3) * f, 0, 0, 0, 0]  # (12)
        n2 = ((delta**2 + 1) * delta**2 * f**2 - 2 * delta * f * e4 - e5**2) / (delta**2 * f**2)
        n0 = (e2**2 + e3**2 + l3 * (e4**2 + e5**2)) * f**2 * delta**4 - (e2 * e5 - e4 * e3) ** 2
        first, rest = e2 * delta**4 * f**2, -f * delta * (e4 * e2 + e5 * e3) - e5 * (e2 * e5 - e3 * e4)
        assert d.quartic.degree() == 2
        assert d.quartic[2] == n2
        assert d.quartic[0] == n0 / (delta**8 * f**4) - l3
        assert d.quartic[1] == 2 * (first + rest) / (delta**5 * f**3)
        assert d.quartic[1] != (2 * first + rest) / (delta**5 * f**3)
        below = delta**3 * f * (2 * delta * f * e4 + e5**2 - (delta**2 + 1) * delta**2 * f**2)
        second = 2 * delta**4 * f**2 * e4 * l3 + delta**3 * f * (e5**2 * l3 + e3**2) + delta * f * (e2**2 + e3**2)
        second += -(delta**2 + 1) * delta**5 * f**3 * l3 + 2 * e3 * (e2 * e5 - e3 * e4)
        root = delta * f * (e5**2 + e4**2 - delta**4 * f**2) * second  # (15)
        assert -d.quartic[1] / (2 * d.quartic[2]) == (first + rest) / below
        discriminant = d.quartic[1] ** 2 - 4 * d.quartic[2] * d.quartic[0]
        # (16) and (17): pz and w with equal signs have the opposite of the product that t = p · i asks for
        t, unit = Poly([0, 1]), delta**2 * f
        product = ((e4 - delta * f) * delta**3 * f * t + e4 * e2 + e5 * e3) / unit**2
        px, py, u, v = (delta**3 * f * t + e2) / unit, e3 / unit, e4 / unit, e5 / unit
        assert product == -(t - px * u - py * v)
        assert discriminant / (4 * d.quartic[2] ** 2) == root / below**2


@pytest.mark.parametrize(("kind", "zero"), [("turned", (4, 5)), ("four on a line", (2, 3))])
def test_other_designs_with_a_quadratic(kind: str, zero: tuple[int, int]) -> None:
    for d in designs(kind):
        assert [d.c[k] for k in zero] == [0, 0]
        assert d.quartic.degree() == 2
        assert any(d.c[k] != 0 for k in {2, 3, 4, 5} - set(zero))
