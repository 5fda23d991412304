"""Numbers for each leg: their types in machine files, and the checks that the parts of a machine share."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Annotated, Any, TypeVar, cast

import numpy as np
from pydantic import BeforeValidator, Field, ValidationInfo
from pydantic_core import PydanticCustomError

from pentapod.base.arrays import Floats, read_only, set_frozen
from pentapod.base.errors import MachineError
from pentapod.kinematics.five_legs import FiveLegs

LEGS = FiveLegs.n_legs
"""Of a linear pentapod, and of machine files without another family."""

WORDS = {4: "four", 5: "five", 6: "six", 7: "seven", 8: "eight"}
"""Counts of legs in words."""


def each_leg(value: float | list[float]) -> Callable[[], Floats]:
    """Return a factory of defaults: one value, or row of values, that counts for every leg."""
    return lambda: np.array([value])


def per_leg(owner: object, *names: str, finite: bool = True, **widths: int) -> None:
    """Replace fields by read-only arrays with an entry for each leg: (n,), or (n, width) for those with a width.

    finite: whether infinite entries are errors. One entry counts for all legs; where every field has only one, n is
    that of a linear pentapod. Raises MachineError naming the field.
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
        if not (np.isfinite(value) if finite else ~np.isnan(value)).all():
            raise MachineError("not finite", key=name, value=value.tolist())
        set_frozen(owner, **{name: read_only(np.array(np.broadcast_to(value, (count, *tails[name]))))})


Part = TypeVar("Part")


def for_legs(part: Part, count: int) -> Part:
    """Return a part for so many legs: a value that is the same for all legs of it is that of each."""
    fields = {item.name: getattr(part, item.name) for item in dataclasses.fields(cast(Any, part)) if item.init}
    wider = {
        name: np.broadcast_to(value[:1], (count, *value.shape[1:]))
        for name, value in fields.items()
        if isinstance(value, np.ndarray) and len(value) == LEGS != count and not (value != value[:1]).any()
    }
    return cast(Part, dataclasses.replace(cast(Any, part), **wider)) if wider else part


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


def _legs(info: ValidationInfo) -> tuple[int, str]:
    """Return how many legs the file's machine has, and the number in words."""
    count = int((info.context or {}).get("legs", LEGS))
    return count, WORDS.get(count, str(count))


def _one_or_each(value: object, info: ValidationInfo) -> list[float]:
    count, word = _legs(info)
    expected = f"one finite number, or {word} (one for each leg)"
    _require(_numbers(value), "not finite numbers", expected)
    if not isinstance(value, list):
        return [float(cast(float, value))] * count
    items = cast(list[float], value)
    _require(len(items) == count, f"{len(items)} numbers where there are {word} legs", expected)
    return [float(x) for x in items]


def _each(value: object, info: ValidationInfo) -> list[float]:
    _require(isinstance(value, list), "not a list", f"{_legs(info)[1]} numbers, one for each leg")
    return _one_or_each(value, info)


def _rows(value: object, width: int, count: int, word: str, words: str) -> list[list[float]]:
    _require(isinstance(value, list), "not a list", words)
    rows = cast(list[Any], value)
    _require(len(rows) == count, f"{len(rows)} entries where there are {word} legs", words)
    for k, row in enumerate(rows, start=1):
        ok = isinstance(row, list) and len(cast(list[Any], row)) == width and _numbers(cast(object, row))
        _require(ok, f"entry {k} is not {width} finite numbers", words)
    return [[float(x) for x in row] for row in rows]


def _pairs(value: object, info: ValidationInfo) -> list[list[float]]:
    count, word = _legs(info)
    return _rows(value, 2, count, word, f"{word} pairs [x, y], one for each leg")


def _points(value: object, info: ValidationInfo) -> list[list[float]]:
    count, word = _legs(info)
    return _rows(value, 3, count, word, f"{word} points [x, y, z], one for each leg")


def _axes(value: object, info: ValidationInfo) -> list[list[float]]:
    count, word = _legs(info)
    words = f"one unit vector [x, y, z], or {word} (one for each leg)"
    single = isinstance(value, list) and len(cast(list[Any], value)) == 3 and _numbers(cast(object, value))
    return _rows([value] * count if single else value, 3, count, word, words)


PER_LEG = Annotated[list[float], BeforeValidator(_one_or_each)]
LEG_NUMBERS = Annotated[list[float], BeforeValidator(_each)]
LEG_PAIRS = Annotated[list[list[float]], BeforeValidator(_pairs)]
LEG_POINTS = Annotated[list[list[float]], BeforeValidator(_points)]
LEG_AXES = Annotated[list[list[float]], BeforeValidator(_axes)]
LIST_OF_2 = Annotated[list[float], Field(min_length=2, max_length=2)]
LIST_OF_3 = Annotated[list[float], Field(min_length=3, max_length=3)]
