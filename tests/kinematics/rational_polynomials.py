"""Exact polynomials in t, the oracle of proofs: lists of Fractions, lowest power first."""

from fractions import Fraction
from itertools import pairwise
from math import comb, gcd, lcm

import numpy as np


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
