"""Numbers for each leg: their types in machine files, and the checks that the parts of a machine share."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, Any, cast

import numpy as np
from pydantic import BeforeValidator, Field
from pydantic_core import PydanticCustomError

from pentapod.base.arrays import Floats, frozen, set_frozen
from pentapod.base.errors import MachineError
from pentapod.kinematics.five_legs import FiveLegs

LEGS = FiveLegs.n_legs
"""Of the machines that files describe."""


def each_leg(value: float | list[float]) -> Callable[[], Floats]:
    """Return a factory of defaults: the same value, or row of values, for each leg."""
    return lambda: np.array([value] * LEGS)


def per_leg(owner: object, *names: str, **widths: int) -> None:
    """Replace fields by read-only arrays with an entry for each leg: (n,), or (n, width) for those with a width.

    One entry counts for all legs; where every field has only one, n is that of a linear pentapod. Raises MachineError
    naming the field.
    """
    tails: dict[str, tuple[int, ...]] = dict.fromkeys(names, ())
    tails |= {name: (width,) for name, width in widths.items()}
    values = {name: np.asarray(getattr(owner, name), dtype=np.float64) for name in tails}
    counts = [v.shape[0] for name, v in values.items() if v.shape[1:] == tails[name] and v.ndim]
    count = next((c for c in counts if c > 1), FiveLegs.n_legs)
    for name, value in values.items():
        if value.shape not in {tails[name], (1, *tails[name]), (count, *tails[name])}:
            raise MachineError(
                "wrong count", key=name, value=value.shape, expected=f"one for all legs, or one for each of {count}"
            )
        if not np.isfinite(value).all():
            raise MachineError("not finite", key=name, value=value.tolist())
        set_frozen(owner, **{name: frozen(np.broadcast_to(value, (count, *tails[name])), name)})


def positive(owner: object, *names: str) -> None:
    """Raise MachineError where a field is not finite and positive."""
    for name in names:
        value = getattr(owner, name)
        if not (np.isfinite(value).all() and np.min(value) > 0.0):
            raise MachineError("must be positive", key=name, value=np.asarray(value).tolist())


def _numbers(value: object) -> bool:
    items = cast(list[Any], value) if isinstance(value, list) else [value]
    return all(isinstance(x, int | float) and not isinstance(x, bool) and math.isfinite(x) for x in items)


def _require(ok: bool, what: str, expected: str) -> None:
    if not ok:
        raise PydanticCustomError("rule", "{what}", {"what": what, "expected": expected})


def _one_or_five(value: object) -> list[float]:
    expected = "one finite number, or five (one for each leg)"
    _require(_numbers(value), "not finite numbers", expected)
    if not isinstance(value, list):
        return [float(cast(float, value))] * LEGS
    items = cast(list[float], value)
    _require(len(items) == LEGS, f"{len(items)} numbers where there are five legs", expected)
    return [float(x) for x in items]


def _five(value: object) -> list[float]:
    _require(isinstance(value, list), "not a list", "five numbers, one for each leg")
    return _one_or_five(value)


def _rows(value: object, width: int, words: str) -> list[list[float]]:
    _require(isinstance(value, list), "not a list", words)
    rows = cast(list[Any], value)
    _require(len(rows) == LEGS, f"{len(rows)} entries where there are five legs", words)
    for k, row in enumerate(rows, start=1):
        ok = isinstance(row, list) and len(cast(list[Any], row)) == width and _numbers(cast(object, row))
        _require(ok, f"entry {k} is not {width} finite numbers", words)
    return [[float(x) for x in row] for row in rows]


def _pairs(value: object) -> list[list[float]]:
    return _rows(value, 2, "five pairs [x, y], one for each leg")


def _axes(value: object) -> list[list[float]]:
    words = "one unit vector [x, y, z], or five (one for each leg)"
    single = isinstance(value, list) and len(cast(list[Any], value)) == 3 and _numbers(cast(object, value))
    return _rows([value] * LEGS if single else value, 3, words)


PER_LEG = Annotated[list[float], BeforeValidator(_one_or_five)]
FIVE_NUMBERS = Annotated[list[float], BeforeValidator(_five)]
FIVE_PAIRS = Annotated[list[list[float]], BeforeValidator(_pairs)]
FIVE_AXES = Annotated[list[list[float]], BeforeValidator(_axes)]
LIST_OF_3 = Annotated[list[float], Field(min_length=3, max_length=3)]
