"""Key: the key of a dataclass field in files, declared once, beside the field.

    spacing: Annotated[float, Key("mm", "largest distance between waypoints", gt=0.0)] = 2e-3

declares the key `spacing_mm` of a job file: default 2.0, more than 0. The parser of the file, its error messages,
`pentapod new` and the reference are made from it (`pentapod.base.tables`). The field itself is SI.
"""

from __future__ import annotations

import dataclasses
import math
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from pathlib import Path
from typing import Any, Literal, get_args, get_origin, get_type_hints

import numpy as np

from pentapod.base.arrays import Floats, set_frozen
from pentapod.base.errors import InputError, nearest
from pentapod.base.units import from_si, to_si

VECTOR = tuple[float, float, float]
_BOUNDS = {
    "gt": ("more than", operator.gt),
    "ge": ("at least", operator.ge),
    "lt": ("less than", operator.lt),
    "le": ("at most", operator.le),
}
DEFAULT_DIGITS = 12
"""Significant digits of a default in the unit of files."""


@dataclass(frozen=True)
class Key:
    """The key of a field in a file. meaning: for the reference, `pentapod new` and messages; unit: "" for none.

    name: of the key without its unit, where it is not the field's. share: field = share · value (0.5 for a radius that
    the file gives as a diameter). kind: type of the value in the file, where it is not that of the field. read: reads
    the file that the key names and returns the field's value. needed: the file must have the key, though the field has
    a default. gt, ge, lt, le: bounds in the file's unit; min_length: of a text or a list. of_part: for lengths, the
    largest allowed multiple of the part's largest extent.
    """

    unit: str
    meaning: str
    name: str = ""
    share: float = 1.0
    kind: Any = None
    read: Callable[[Path], Any] | None = None
    needed: bool = False
    gt: float | None = None
    ge: float | None = None
    lt: float | None = None
    le: float | None = None
    min_length: int | None = None
    of_part: float = 10.0

    @property
    def bounds(self) -> dict[str, float]:
        """The bounds that are set, by gt, ge, lt, le."""
        values = {name: getattr(self, name) for name in _BOUNDS}
        return {name: value for name, value in values.items() if value is not None}

    def si(self, value: Any) -> Any:
        """Return the field's value for a value of the file."""
        value = to_si(value, self.unit)
        return value if value is None or self.share == 1.0 else self.share * value


@dataclass(frozen=True)
class Declared:
    """A field with a key. file_key: with its unit; hint: type of the field; default: SI, MISSING where it is needed."""

    field: str
    key: Key
    file_key: str
    hint: Any
    default: Any

    @property
    def file_default(self) -> Any:
        """The default in the unit of the file; MISSING where it is needed."""
        value = dataclasses.MISSING if self.key.needed else self.default
        if value is dataclasses.MISSING or value is None:
            return value
        if self.key.unit and isinstance(value, float | np.ndarray):
            value = np.asarray(from_si(np.asarray(value) / self.key.share, self.key.unit), dtype=np.float64)
            return np.vectorize(_shortest, otypes=[np.float64])(value).tolist() if math.inf not in value else None
        return value.value if isinstance(value, StrEnum) else value.tolist() if isinstance(value, np.ndarray) else value

    @property
    def is_needed(self) -> bool:
        """Whether the file must have the key."""
        return self.file_default is dataclasses.MISSING

    def enumeration(self) -> type[StrEnum] | None:
        """Return the enumeration that the field takes; None for others."""
        kinds = (self.hint, *get_args(self.hint))
        return next((kind for kind in kinds if isinstance(kind, type) and issubclass(kind, StrEnum)), None)


def _shortest(value: float) -> float:
    return float(f"{value:.{DEFAULT_DIGITS}g}")


@cache
def declared(cls: type) -> tuple[Declared, ...]:
    """Return the fields of a dataclass that have a key, in their order."""
    hints = get_type_hints(cls, include_extras=True)
    found: list[Declared] = []
    for field in dataclasses.fields(cls):
        key = next((item for item in getattr(hints[field.name], "__metadata__", ()) if isinstance(item, Key)), None)
        if key is not None and field.init:
            name = key.name or field.name
            made = field.default_factory is not dataclasses.MISSING
            default = field.default_factory() if made else field.default  # pyright: ignore[reportCallIssue]
            file_key = f"{name}_{key.unit}" if key.unit else name
            found.append(Declared(field.name, key, file_key, hints[field.name].__origin__, default))
    return tuple(found)


def file_key(classes: tuple[type, ...] | type, field: str) -> str | None:
    """Return the key of a file by which a field of dataclasses is set; None where it has none."""
    every = classes if isinstance(classes, tuple) else (classes,)
    return next((item.file_key for cls in every for item in declared(cls) if item.field == field), None)


def fields_from(cls: type, table: object, files: Mapping[str, Path] | None = None) -> dict[str, Any]:
    """Return the fields of a dataclass, SI, from a table of a file.

    files: paths by the keys that name them; without `files` these fields are left out, as are keys that are None: the
    default of the dataclass holds. Raises what `Key.read` raises.
    """
    values: dict[str, Any] = {}
    for item in declared(cls):
        value = getattr(table, item.file_key)
        if value is None:
            continue
        if item.key.kind is not Path:
            values[item.field] = item.key.si(value)
        elif files is not None:
            path = files[item.file_key]
            values[item.field] = path if item.key.read is None else item.key.read(path)
    return values


def check_fields(instance: object, wrong: type[InputError]) -> None:
    """Check the numbers and names of a dataclass by its keys; names become members of their enumeration.

    For `__post_init__`. Raises `wrong` with field, value and what is expected, SI.
    """
    for item in declared(type(instance)):
        value = getattr(instance, item.field)
        if (names := item.enumeration()) is not None:
            set_frozen(instance, **{item.field: names(chosen(item.field, value, tuple(names), wrong))})
        elif get_origin(item.hint) is Literal:
            chosen(item.field, value, get_args(item.hint), wrong)
        elif isinstance(value, int | float | np.ndarray) and not isinstance(value, bool):
            _check_number(item, value, wrong)


def _check_number(item: Declared, numbers: float | Floats, wrong: type[InputError]) -> None:
    bounds = {name: item.key.si(bound) for name, bound in item.key.bounds.items()}
    value = numbers.tolist() if isinstance(numbers, np.ndarray) else numbers
    if not np.isfinite(numbers).all():
        raise wrong("must be finite", key=item.field, value=value)
    kept = {name: bool(np.all(_BOUNDS[name][1](numbers, bound))) for name, bound in bounds.items()}
    if all(kept.values()):
        return
    if not kept.get("gt", True) and bounds["gt"] == 0.0:
        raise wrong("must be positive", key=item.field, value=value)
    if not kept.get("ge", True) and bounds["ge"] == 0.0:
        raise wrong("must not be negative", key=item.field, value=value)
    expected = " and ".join(f"{_BOUNDS[name][0]} {bound:.6g}" for name, bound in bounds.items())
    raise wrong("out of range", key=item.field, value=value, expected=expected)


def chosen(name: str, value: str, choices: Sequence[str], wrong: type[InputError]) -> str:
    """Return a name that is one of the choices. Raises `wrong` with the known ones."""
    known = [str(choice) for choice in choices]
    if value not in known:
        raise wrong(
            f"unknown {name}", key=name, value=value, expected=" or ".join(known), remedy=nearest(str(value), known)
        )
    return value


def oversized(cls: type, values: Mapping[str, Any], extent: float) -> Declared | None:
    """Return the first length (SI, no default) of a dataclass that is too large for a part of this extent."""
    for item in declared(cls):
        value = values.get(item.field)
        if item.key.unit != "mm" or not isinstance(value, int | float) or value == item.default:
            continue
        if value > item.key.of_part * extent:
            return item
    return None


def check_size(instance: object, extent: float, wrong: type[InputError]) -> None:
    """Raise `wrong` for a length of a dataclass that is too large for a part of this largest extent, metres."""
    if (item := oversized(type(instance), vars(instance), extent)) is not None:
        value, times = getattr(instance, item.field), item.key.of_part
        than = "larger than" if times == 1.0 else f"more than {times:g} times as large as"
        what = f"{value:.4g} m is {than} the part ({extent:.4g} m)"
        raise wrong(what, key=item.field, remedy="lengths are in metres")
