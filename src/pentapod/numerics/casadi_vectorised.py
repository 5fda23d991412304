"""Batch evaluation of a casadi function: its instructions carried out on NumPy arrays.

casadi's own `map` calls its virtual machine once for each point; here each instruction runs over a block of points. The
instructions are the same, in the same order, so the numbers are casadi's, to the last bit where NumPy's elementary
functions are the C library's.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats

_BLOCK = 2048
"""Points at a time: few enough that the values on their way stay in the cache."""


class Vectorised:
    """A casadi function of SX expressions, callable with one array (rows, N) or column (rows, 1) for each input.

    Returns one array (rows, N) for each output, which must be dense. Raises NotImplementedError for an operation not
    known here.
    """

    def __init__(self, function: Any) -> None:
        import casadi as ca  # noqa: PLC0415  heavy: only when planning

        unary, binary = _operations(ca)
        self._sizes = [function.numel_out(k) for k in range(function.n_out())]
        self._work = int(function.sz_w())
        self._steps: list[tuple[Any, int, int, int]] = []
        for k in range(function.n_instructions()):
            code, into, of = function.instruction_id(k), function.instruction_output(k), function.instruction_input(k)
            if code == ca.OP_CONST:
                self._steps.append((float(function.instruction_constant(k)), into[0], _CONSTANT, 0))
            elif code == ca.OP_INPUT:
                self._steps.append((of[0], into[0], _INPUT, of[1]))
            elif code == ca.OP_OUTPUT:
                self._steps.append((into[0], into[1], _OUTPUT, of[0]))
            elif code in unary:
                self._steps.append((unary[code], into[0], of[0], _UNARY))
            elif code in binary:
                self._steps.append((binary[code], into[0], of[0], of[1]))
            else:
                raise NotImplementedError(f"casadi's operation {code} has no counterpart here")

    def __call__(self, *inputs: Floats) -> list[Floats]:
        """Return the outputs at all points."""
        (count,) = np.broadcast_shapes(*(x.shape[1:] for x in inputs))  # 0 where one of them has no point
        out = [np.empty((size, count)) for size in self._sizes]
        for first in range(0, count, _BLOCK):
            part = slice(first, min(first + _BLOCK, count))
            self._run([x if x.shape[1] == 1 else x[:, part] for x in inputs], out, part)
        return out

    def _run(self, inputs: list[Floats], out: list[Floats], part: slice) -> None:
        work: list[Any] = [0.0] * self._work
        with np.errstate(all="ignore"):  # branches that are not taken may divide by zero, as they do in casadi
            for what, into, a, b in self._steps:
                if a >= 0:
                    work[into] = what(work[a]) if b == _UNARY else what(work[a], work[b])
                elif a == _CONSTANT:
                    work[into] = what
                elif a == _INPUT:
                    work[into] = inputs[what][b]
                else:
                    out[what][into, part] = work[b]


class PointByPoint:
    """The last output of a casadi function, dense, at a few points; evaluated in place, without copies.

    Called with the numbers of each input in casadi's column-major order: (N, numbers), or (numbers,) for all points.
    Returns an array (N, numbers). Not to be called by two threads at a time.
    """

    def __init__(self, function: Any) -> None:
        self._given = [np.zeros(int(function.numel_in(k))) for k in range(function.n_in())]
        last = int(function.n_out()) - 1
        self._found = np.zeros(int(function.numel_out(last)))
        self._buffer, self._evaluate = function.buffer()
        for k, numbers in enumerate(self._given):
            self._buffer.set_arg(k, numbers.data)
        self._buffer.set_res(last, self._found.data)

    def __call__(self, *inputs: Floats) -> Floats:
        """Return the output at all points."""
        each = [np.atleast_2d(x) for x in inputs]
        count = max(len(x) for x in each)
        out = np.empty((count, len(self._found)))
        for k in range(count):
            for numbers, x in zip(self._given, each, strict=True):
                numbers[:] = x[k if len(x) > 1 else 0]
            self._evaluate()
            out[k] = self._found
        return out


_CONSTANT, _INPUT, _OUTPUT, _UNARY = -1, -2, -3, -4


def _operations(ca: Any) -> tuple[dict[int, Callable[..., Any]], dict[int, Callable[..., Any]]]:
    """Return casadi's operation codes with what does the same on arrays: those of one argument, and of two."""
    unary = {
        ca.OP_ASSIGN: lambda a: a,
        ca.OP_NEG: np.negative,
        ca.OP_SQ: np.square,
        ca.OP_TWICE: lambda a: 2.0 * a,
        ca.OP_INV: lambda a: 1.0 / a,
        ca.OP_SQRT: np.sqrt,
        ca.OP_FABS: np.abs,
        ca.OP_SIGN: np.sign,
        ca.OP_NOT: lambda a: 1.0 * (a == 0.0),
        ca.OP_SIN: np.sin,
        ca.OP_COS: np.cos,
        ca.OP_EXP: np.exp,
        ca.OP_LOG: np.log,
    }
    binary = {
        ca.OP_ADD: np.add,
        ca.OP_SUB: np.subtract,
        ca.OP_MUL: np.multiply,
        ca.OP_DIV: np.divide,
        ca.OP_FMIN: np.fmin,
        ca.OP_FMAX: np.fmax,
        ca.OP_LT: lambda a, b: 1.0 * (a < b),
        ca.OP_LE: lambda a, b: 1.0 * (a <= b),
        ca.OP_EQ: lambda a, b: 1.0 * (a == b),
        ca.OP_NE: lambda a, b: 1.0 * (a != b),
        ca.OP_AND: lambda a, b: 1.0 * ((a != 0.0) & (b != 0.0)),
        ca.OP_OR: lambda a, b: 1.0 * ((a != 0.0) | (b != 0.0)),
        ca.OP_IF_ELSE_ZERO: lambda a, b: np.where(np.not_equal(a, 0.0), b, 0.0),
    }
    return unary, binary
