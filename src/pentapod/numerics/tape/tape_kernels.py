"""The instructions of a casadi function carried out on many points, compiled."""

from __future__ import annotations

import math

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.numerics.kernels import kernel

OPERATIONS = (
    "MUL", "ADD", "SUB", "DIV", "INPUT", "OUTPUT", "CONST", "NEG", "TWICE", "SQ", "IF_ELSE_ZERO", "LE", "LT",
    "FMAX", "FMIN", "SQRT", "NOT", "INV", "FABS", "SIGN", "EQ", "NE", "AND", "OR", "ASSIGN", "SIN", "COS", "EXP",
    "LOG",
)  # fmt: skip
"""casadi's names of the operations that are known; the place of a name is the operation's code in a tape."""

(
    MUL, ADD, SUB, DIV, INPUT, OUTPUT, CONST, NEG, TWICE, SQ, IF_ELSE_ZERO, LE, LT, FMAX, FMIN, SQRT, NOT, INV,
    FABS, SIGN, EQ, NE, AND, OR, ASSIGN, SIN, COS, EXP, LOG,
) = range(len(OPERATIONS))  # fmt: skip

WIDTH = 64
"""Points at a time: each instruction then costs little more than its arithmetic, and values stay in the cache."""


@kernel
def run_tape(  # noqa: PLR0912  a branch for each operation
    given: Floats, codes: Ints, into: Ints, first: Ints, second: Ints, constants: Floats, size: int, found: Floats
) -> None:
    """Fill outputs found (N, outputs) of inputs given (N, inputs), by instructions codes (n,) on `size` work numbers.

    into, first, second (n,): work numbers; of an input, `first` is its column, of an output `into` is. constants (n,).
    Results go to t first: loops whose result may be one of their arguments are not vectorised.
    """
    work, t = np.empty((size, WIDTH)), np.empty(WIDTH)
    for begin in range(0, len(given), WIDTH):
        count = min(WIDTH, len(given) - begin)
        for i in range(len(codes)):
            code, c, a, b = codes[i], into[i], first[i], second[i]
            if code == MUL:
                for j in range(count):
                    t[j] = work[a, j] * work[b, j]
            elif code == ADD:
                for j in range(count):
                    t[j] = work[a, j] + work[b, j]
            elif code == SUB:
                for j in range(count):
                    t[j] = work[a, j] - work[b, j]
            elif code == DIV:
                for j in range(count):
                    t[j] = work[a, j] / work[b, j]
            elif code == INPUT:
                for j in range(count):
                    t[j] = given[begin + j, a]
            elif code == OUTPUT:
                for j in range(count):
                    found[begin + j, c] = work[a, j]
                continue
            elif code == CONST:
                for j in range(count):
                    t[j] = constants[i]
            elif code == NEG:
                for j in range(count):
                    t[j] = -work[a, j]
            elif code == TWICE:
                for j in range(count):
                    t[j] = 2.0 * work[a, j]
            elif code == SQ:
                for j in range(count):
                    t[j] = work[a, j] * work[a, j]
            elif code == IF_ELSE_ZERO:
                for j in range(count):
                    t[j] = work[b, j] if work[a, j] != 0.0 else 0.0
            elif code == LE:
                for j in range(count):
                    t[j] = 1.0 if work[a, j] <= work[b, j] else 0.0
            elif code == LT:
                for j in range(count):
                    t[j] = 1.0 if work[a, j] < work[b, j] else 0.0
            elif code == FMAX:
                for j in range(count):
                    t[j] = work[b, j] if work[b, j] > work[a, j] or work[a, j] != work[a, j] else work[a, j]
            elif code == FMIN:
                for j in range(count):
                    t[j] = work[b, j] if work[b, j] < work[a, j] or work[a, j] != work[a, j] else work[a, j]
            else:
                for j in range(count):
                    t[j] = _seldom(code, work[a, j], work[b, j])
            for j in range(count):
                work[c, j] = t[j]


@kernel
def _seldom(code: int, x: float, y: float) -> float:  # noqa: PLR0911, PLR0912  likewise
    """Return what an operation that is seldom gives: one of `OPERATIONS` from SQRT on."""
    if code == SQRT:
        return np.sqrt(x)
    if code == NOT:
        return 1.0 if x == 0.0 else 0.0
    if code == INV:
        return 1.0 / x
    if code == FABS:
        return abs(x)
    if code == SIGN:
        return -1.0 if x < 0.0 else 1.0 if x > 0.0 else x
    if code == EQ:
        return 1.0 if x == y else 0.0
    if code == NE:
        return 1.0 if x != y else 0.0
    if code == AND:
        return 1.0 if x != 0.0 and y != 0.0 else 0.0
    if code == OR:
        return 1.0 if x != 0.0 or y != 0.0 else 0.0
    if code == ASSIGN:
        return x
    if code == SIN:
        return math.sin(x)
    if code == COS:
        return math.cos(x)
    if code == EXP:
        return np.exp(x)
    return np.log(x)
