"""Time-optimal path parametrisation: one interface to the compiled engine and to toppra, the reference."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import InputError
from pentapod.timing.topp.stages import Failure, Stages

Engine = Literal["core", "toppra"]
"""core: our own passes, compiled; toppra: the reference, for comparison."""


def fastest(
    s: Floats,
    first: Floats,
    second: Floats,
    ceiling: Floats,
    *,
    offset: Floats | None = None,
    x_start: float = 0.0,
    x_end: float = 0.0,
    engine: Engine = "core",
) -> Floats | Failure:
    """Return the largest x = ṡ² (N + 1,) at gridpoints s (N + 1,), x_start and x_end at its ends (TOPP-RA).

    The arrays are those of `Stages`; x is linear in s in each stage. Raises InputError: an unknown engine, x
    below 0 at an end, what `Stages.of` raises.
    """
    if engine not in get_args(Engine):
        raise InputError("unknown engine", key="engine", value=engine, expected=", ".join(get_args(Engine)))
    for name, value in (("x_start", x_start), ("x_end", x_end)):
        if not 0.0 <= value < np.inf:
            raise InputError("squared speeds are finite and not negative", key=name, value=value)
    stages = Stages.of(s, first, second, ceiling, offset)
    fault = stages.fault()
    if fault is not None:
        return fault
    if engine == "toppra":
        from pentapod.timing.topp.reference import solve  # noqa: PLC0415  (heavy: imported when asked for)
    else:
        from pentapod.timing.topp.core import solve  # noqa: PLC0415  (compiled: loaded where it is used)
    x = solve(stages, x_start, x_end)
    if isinstance(x, Failure):
        return x
    still = ((x[:-1] + x[1:]) <= 0.0) & (np.diff(stages.s) > 0.0)
    if still.any():
        return Failure(int(np.argmax(still)), "the motion comes to a standstill")
    return x
