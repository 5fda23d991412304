"""Numbers for each leg: their types in machine files, and the checks that the parts of a machine share."""

from __future__ import annotations

import math
from typing import Annotated, Any, cast

import numpy as np
from pydantic import BeforeValidator, Field
from pydantic_core import PydanticCustomError

from pentapod.base.arrays import frozen, set_frozen
from pentapod.base.errors import MachineError


def per_leg(owner: object, *names: str) -> None:
    """Replace scalars or five numbers by read-only arrays (5,). Raises MachineError naming the field."""
    for name in names:
        value = np.asarray(getattr(owner, name), dtype=np.float64)
        if value.shape not in {(), (1,), (5,)}:
            raise MachineError(
                "wrong count", key=name, value=value.shape, expected="one number, or one for each of 5 legs"
            )
        if not np.isfinite(value).all():
            raise MachineError("not finite", key=name, value=value.tolist())
        set_frozen(owner, **{name: frozen(np.broadcast_to(value, (5,)), name, (5,))})


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
        return [float(cast(float, value))] * 5
    items = cast(list[float], value)
    _require(len(items) == 5, f"{len(items)} numbers where there are five legs", expected)
    return [float(x) for x in items]


def _five(value: object) -> list[float]:
    _require(isinstance(value, list), "not a list", "five numbers, one for each leg")
    return _one_or_five(value)


def _rows(value: object, width: int, words: str) -> list[list[float]]:
    _require(isinstance(value, list), "not a list", words)
    rows = cast(list[Any], value)
    _require(len(rows) == 5, f"{len(rows)} entries where there are five legs", words)
    for k, row in enumerate(rows, start=1):
        ok = isinstance(row, list) and len(cast(list[Any], row)) == width and _numbers(cast(object, row))
        _require(ok, f"entry {k} is not {width} finite numbers", words)
    return [[float(x) for x in row] for row in rows]


def _pairs(value: object) -> list[list[float]]:
    return _rows(value, 2, "five pairs [x, y], one for each leg")


def _axes(value: object) -> list[list[float]]:
    words = "one unit vector [x, y, z], or five (one for each leg)"
    single = isinstance(value, list) and len(cast(list[Any], value)) == 3 and _numbers(cast(object, value))
    return _rows([value] * 5 if single else value, 3, words)


PER_LEG = Annotated[list[float], BeforeValidator(_one_or_five)]
FIVE_NUMBERS = Annotated[list[float], BeforeValidator(_five)]
FIVE_PAIRS = Annotated[list[list[float]], BeforeValidator(_pairs)]
FIVE_AXES = Annotated[list[list[float]], BeforeValidator(_axes)]
LIST_OF_3 = Annotated[list[float], Field(min_length=3, max_length=3)]
