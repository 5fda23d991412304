"""Value objects: frozen dataclasses that compare by content, print in one short line and can be pickled."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cached_property
from pathlib import PurePath
from types import FunctionType
from typing import Any, ClassVar, Self, cast

LONGEST, LONGEST_FIELD, LONGEST_TEXT = 300, 120, 80
"""Characters of a value's `repr`, of one field and of one text in it."""

MOST_ITEMS = 6
"""Items of a tuple that a `repr` shows one by one."""

_UNITS = {
    "m": "tips legs tilt_centres points vertices stations knots tilt_centre length radius stepover scallop spacing"
    " chordal clearance approach hop closest shortest flute stem reserve corner neck_radius height path_tolerance"
    " translation tool_length offsets depth min_length max_length",
    "s": "times period duration seconds dwells dwell wait",
    "m/s": "speeds feed link_feed max_velocity rapid",
    "m/s²": "max_acceleration",
    "m/s³": "max_jerk",
    "rad": "tilt axis_tolerance angle lead axis_step cone",
}
_UNIT_OF = {name: f" {unit}" for unit, names in _UNITS.items() for name in names.split()}


class Value:
    """Base of the frozen dataclasses that users hold.

    `repr` has at most `LONGEST` characters: the properties that `summary` names, then the fields; arrays as shape and
    range, with the SI unit where the name of the field implies one. Values are equal if class and fields are, arrays
    element by element, NaN equal to NaN. Pickles have no cached properties; unpickled arrays are read-only.
    """

    summary: ClassVar[tuple[str, ...]] = ()
    """Names of quick properties that come first in `repr`."""

    def __init_subclass__(cls, **options: Any) -> None:
        """Keep these methods; the dataclass decorator would write its own."""
        super().__init_subclass__(**options)
        for name in ("__repr__", "__eq__", "__hash__"):
            if name not in cls.__dict__:
                setattr(cls, name, getattr(cls, name))

    def __repr__(self) -> str:
        names = dict.fromkeys((*self.summary, *(f.name for f in fields(cast(Any, self)) if f.repr)))
        parts = [f"{name}={_text(getattr(self, name), _UNIT_OF.get(name, ''))}" for name in names]
        shown = [part if len(part) <= LONGEST_FIELD else part[: LONGEST_FIELD - 1] + "…" for part in parts]
        while len(text := f"{type(self).__name__}({', '.join(shown)})") > LONGEST:
            shown[-2:] = ["…"]
        return text

    def __eq__(self, other: object) -> bool:
        return self is other or (type(self) is type(other) and same(_content(self), _content(cast(Value, other))))

    def __hash__(self) -> int:
        return hash((type(self), *(v for v in _content(self) if isinstance(v, str | int | Enum))))

    def __getstate__(self) -> dict[str, Any]:
        return {k: v for k, v in vars(self).items() if not isinstance(getattr(type(self), k, None), cached_property)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        for value in state.values():
            for array in filter(_is_array, value if isinstance(value, tuple) else (value,)):
                array.flags.writeable = False
        vars(self).update(state)


class Result(Value):
    """Base of the results of stages that may also return a `Refusal`, whose `unwrap` raises."""

    def unwrap(self) -> Self:
        """Return the value itself."""
        return self


def same(a: Any, b: Any) -> bool:
    """Return whether two values are equal, arrays within them element by element, NaN equal to NaN."""
    if a is b:
        return True
    if _is_array(a) and _is_array(b):
        return a.shape == b.shape and bool(((a == b) | ((a != a) & (b != b))).all())  # noqa: PLR0124 - NaN
    if isinstance(a, tuple | list) and type(a) is type(b):
        both = cast("tuple[tuple[Any, ...], tuple[Any, ...]]", (a, b))
        return len(both[0]) == len(both[1]) and all(map(same, *both))
    if isinstance(a, dict) and isinstance(b, dict):
        keys, others = cast("dict[Any, Any]", a), cast("dict[Any, Any]", b)
        return keys.keys() == others.keys() and all(same(value, others[key]) for key, value in keys.items())
    if type(a) is type(b) and not isinstance(a, type | FunctionType) and type(a).__eq__ is object.__eq__:
        return same(a.__getstate__(), b.__getstate__())
    return not _is_array(a) and not _is_array(b) and bool(a == b or (a != a and b != b))  # noqa: PLR0124 - NaN


def _content(value: Value) -> list[Any]:
    return [getattr(value, f.name) for f in fields(cast(Any, value)) if f.compare]


def _is_array(value: Any) -> bool:
    return hasattr(value, "flags") and getattr(value, "ndim", 0) > 0


def _text(value: Any, unit: str = "") -> str:  # noqa: PLR0911 - a kind of value each
    """Return a field as `repr` shows it."""
    if _is_array(value):
        return _array(value, unit)
    if isinstance(value, float):
        return f"{value:.6g}{unit}"
    if isinstance(value, str | PurePath) and not isinstance(value, Enum):
        text = str(value)
        return repr(text if len(text) <= LONGEST_TEXT else text[: LONGEST_TEXT - 1] + "…")
    if isinstance(value, Mapping):
        return f"{{{', '.join(map(str, cast('Mapping[Any, Any]', value)))}}}"
    if isinstance(value, tuple | list) and type(value).__repr__ in (tuple.__repr__, list.__repr__):
        return _items(cast("tuple[Any, ...]", tuple(value)), unit)
    if isinstance(value, Value):
        return f"{type(value).__name__}({', '.join(f'{k}={_text(getattr(value, k))}' for k in value.summary) or '…'})"
    if is_dataclass(value):
        return f"{type(value).__name__}(…)"
    return str(getattr(value, "__name__", value))


def _items(items: tuple[Any, ...], unit: str) -> str:
    if len(items) > MOST_ITEMS:
        kinds = {type(item).__name__ for item in items}
        return f"{len(items)} × {' | '.join(sorted(kinds))}"
    return f"({', '.join(_text(item, unit) for item in items)})"


def _array(array: Any, unit: str) -> str:
    shape = f"[{'×'.join(map(str, array.shape))}]"
    if array.dtype.kind == "b":
        return f"{shape} {int(array.sum())} true"
    if array.dtype.kind not in "iuf" or not array.size:
        return f"{shape} {array.dtype}"
    low, high = float(array.min()), float(array.max())
    return f"{shape} {low:.4g}{'' if low == high else f'…{high:.4g}'}{unit}"
