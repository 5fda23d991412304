"""Batch evaluation of a casadi function: its instructions carried out on many points, compiled.

casadi's own `map` calls its virtual machine once for each point; here each instruction runs over a block of points, on
all cores, which takes a fifth of the time. The instructions are the same, in the same order, so the numbers are
casadi's to the last bit.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.numerics.threads import for_rows


class Vectorised:
    """A casadi function of SX expressions whose outputs are dense, callable with the numbers of many points.

    Called with the numbers of each input in casadi's column-major order: (N, numbers), or (numbers,) for all points.
    Returns one array (N, numbers) for each output. Raises NotImplementedError for an operation not known here.
    """

    def __init__(self, function: Any) -> None:
        import casadi as ca  # noqa: PLC0415  heavy: only when planning

        # Only where kernels are used.
        from pentapod.numerics.tape.tape_kernels import OPERATIONS  # noqa: PLC0415

        known = {getattr(ca, f"OP_{name}"): code for code, name in enumerate(OPERATIONS)}
        inputs = _offsets([function.numel_in(k) for k in range(function.n_in())])
        self._ends = _offsets([function.numel_out(k) for k in range(function.n_out())])
        count = function.n_instructions()
        codes, places, constants = np.empty(count, np.int64), np.zeros((3, count), np.int64), np.zeros(count)
        for k in range(count):
            operation = function.instruction_id(k)
            if operation not in known:
                raise NotImplementedError(f"casadi's operation {operation} has no counterpart here")
            codes[k] = known[operation]
            into, of = function.instruction_output(k), function.instruction_input(k)
            if operation == ca.OP_INPUT:
                places[:2, k] = into[0], inputs[of[0]] + of[1]
            elif operation == ca.OP_OUTPUT:
                places[:2, k] = self._ends[into[0]] + into[1], of[0]
            elif operation == ca.OP_CONST:
                places[0, k], constants[k] = into[0], function.instruction_constant(k)
            else:
                places[:, k] = into[0], of[0], of[-1]
        self._tape = (codes, *places, constants, int(function.sz_w()))

    def __call__(self, *inputs: Floats) -> list[Floats]:
        """Return the outputs at all points."""
        # Only where kernels are used.
        from pentapod.numerics.tape.tape_kernels import run_tape  # noqa: PLC0415

        count = _count(inputs)
        given, column = np.empty((count, sum(x.shape[-1] for x in inputs))), 0
        for x in inputs:
            given[:, column : column + x.shape[-1]] = x
            column += x.shape[-1]
        found = np.empty((count, self._ends[-1]))
        for_rows(run_tape, (given,), self._tape, (found,))
        return np.split(found, self._ends[1:-1], axis=1)


class PointByPoint:
    """The last output of a casadi function, dense; as `Vectorised`, without what that takes to make for few points.

    casadi's virtual machine evaluates it in place until that has taken as long. Returns an array (N, numbers). Not to
    be called by two threads at a time.
    """

    def __init__(self, function: Any) -> None:
        self._function, self._left, self._made = function, POINTS, None
        self._given = [np.zeros(int(function.numel_in(k))) for k in range(function.n_in())]
        last = int(function.n_out()) - 1
        self._found = np.zeros(int(function.numel_out(last)))
        self._buffer, self._evaluate = function.buffer()
        for k, numbers in enumerate(self._given):
            self._buffer.set_arg(k, numbers.data)
        self._buffer.set_res(last, self._found.data)

    def __call__(self, *inputs: Floats) -> Floats:
        """Return the output at all points."""
        count = _count(inputs)
        self._left -= count
        if self._left < 0:
            self._made = self._made or Vectorised(self._function)
            return self._made(*inputs)[-1]
        each, out = [np.atleast_2d(x) for x in inputs], np.empty((count, len(self._found)))
        for k in range(count):
            for numbers, x in zip(self._given, each, strict=True):
                numbers[:] = x[k if len(x) > 1 else 0]
            self._evaluate()
            out[k] = self._found
        return out


POINTS = 500
"""Points after which instructions are worth reading: that takes as long as casadi takes for some 1,400 points."""


def _count(inputs: Sequence[Floats]) -> int:
    """Return the number of points."""
    counts = {len(x) for x in inputs if x.ndim == 2}
    return counts.pop() if counts else 1


def _offsets(sizes: Sequence[int]) -> list[int]:
    """Return where each of several arrays begins in one, and where the last ends."""
    return [0, *np.cumsum(sizes).tolist()]
