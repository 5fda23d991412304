"""Tables of TOML files as pydantic models: strict, and made from the keys of dataclasses (`pentapod.base.keys`)."""

from __future__ import annotations

import types
from collections.abc import Callable
from dataclasses import MISSING
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, NoReturn, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model, model_validator
from pydantic_core import ErrorDetails, PydanticCustomError

from pentapod.base.errors import nearest
from pentapod.base.keys import Declared, declared, file_key
from pentapod.base.units import split_key, to_si

Vector = tuple[float, float, float]
Positive = Annotated[float, Field(gt=0.0)]


class TomlTable(BaseModel):
    """A table of a file: unknown keys, wrong types, NaN and infinity are errors. Values are as in the file."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)
    declared_by: ClassVar[tuple[type, ...]] = ()
    """The dataclasses whose fields have these keys, where the table was made from some."""

    @property
    def si(self) -> Any:
        """The values in SI units, by keys without their unit: `feed.si.cut` in m/s is `feed.cut_mm_min`."""
        parts = {key: split_key(key) for key in type(self).model_fields}
        return SimpleNamespace(**{name: to_si(getattr(self, key), unit) for key, (name, unit) in parts.items()})

    if TYPE_CHECKING:  # most keys are declared by dataclasses

        def __getattr__(self, key: str) -> Any: ...


TableType = TypeVar("TableType", bound=TomlTable)


def wrong(key: str, what: str, expected: str | None = None, **details: Any) -> NoReturn:
    """Raise the error of a rule that spans several keys; `key` is the one to name. details: value, remedy."""
    raise PydanticCustomError("rule", "{what}", {"key": key, "what": what, "expected": expected, **details})


def table_fields(cls: type, *, optional: bool = False) -> dict[str, Any]:
    """Return the fields of a table by key, for `create_model`, from the keys of a dataclass.

    optional: all keys may be left out, and are None then.
    """
    return {item.file_key: (_kind(item, optional=optional), _field(item, optional=optional)) for item in declared(cls)}


@cache
def table_of(cls: type, base: type[TableType] = TomlTable, *more: type) -> type[TableType]:
    """Return the table whose keys a dataclass declares, and `more` of them; it pickles as a name of `cls`'s module.

    Its name is that of the dataclass with "Table" for "Options" or "Keys", its description the first sentence. Rules
    that span several keys are static methods `rules` of the dataclasses: called with a table, they raise by `wrong`.
    """
    about = " ".join((cls.__doc__ or "").split()).split(". ")[0].rstrip(".") + "."
    name = f"{cls.__name__.removesuffix('Options').removesuffix('Keys')}Table"
    every = (cls, *more)
    fields = {key: field for one in every for key, field in table_fields(one).items()}
    checks = [check for one in every if (check := getattr(one, "rules", None)) is not None]
    checks += [_one_of] if hasattr(cls, "one_of") else []
    rules: Any = {f"rules{k}": model_validator(mode="after")(_checked_by(check)) for k, check in enumerate(checks)}
    made = create_model(name, __base__=base, __module__=cls.__module__, __doc__=about, __validators__=rules, **fields)
    made.declared_by = every
    return made


def extended(name: str, base: type[TableType], cls: type) -> type[TableType]:
    """Return a table with the keys of another one, and those that a dataclass declares; it pickles as `name`."""
    made: Any = create_model(name, __base__=base, __module__=base.__module__, __doc__=base.__doc__, **table_fields(cls))
    return made


def _checked_by(check: Callable[[Any], object]) -> Callable[[Any], Any]:
    def checked(table: Any) -> Any:
        check(table)
        return table

    return checked


def _one_of(table: Any) -> None:
    """Raise unless exactly one of the keys in `one_of` is given."""
    cls = table.declared_by[0]
    keys = [key for field in cls.one_of if (key := file_key(cls, field)) is not None]
    given = [key for key in keys if getattr(table, key) is not None]
    if len(given) > 1:
        wrong(given[-1], f"{' and '.join(given)} are both given", "one of the two")
    if not given:
        wrong(keys[0], f"{' or '.join(keys)} is missing", "one of the two")


def _field(item: Declared, *, optional: bool) -> Any:
    default = None if optional else item.file_default
    default = ... if default is MISSING else default
    bounds: dict[str, Any] = item.key.bounds if item.key.kind is None else {}  # else the dataclass checks them
    least = 1 if item.key.kind is Path or (item.hint is str and not default) else item.key.min_length
    return Field(default=default, description=item.key.meaning, min_length=least, **bounds)


def _kind(item: Declared, *, optional: bool) -> Any:
    """Return the type of a key's value in the file, with None where that is the default."""
    kind: Any = item.key.kind or _plain(item.hint)
    if kind is Path:
        kind = str
    if (names := item.enumeration()) is not None:
        kind = Literal[tuple(str(name) for name in names)]
    return kind | None if optional or item.file_default is None else kind


def _plain(hint: Any) -> Any:
    """Return a type without None."""
    if get_origin(hint) in (Union, types.UnionType):
        rest = [kind for kind in get_args(hint) if kind is not type(None)]
        return rest[0] if len(rest) == 1 else Union[tuple(rest)]  # noqa: UP007
    return hint


TableOf = Callable[[str], type[BaseModel] | None]
"""From the name of a table to its model; None where it is not known."""


def problem_of(error: ValidationError, root: type[BaseModel], table: TableOf) -> tuple[tuple[str, ...], dict[str, Any]]:
    """Return the place of the error to show, and key, what, value, expected and remedy of its message.

    root: the model of the whole file; table: those of its tables. An unknown key comes first, since a misspelt key is
    also a missing one.
    """
    first = min(error.errors(include_url=False), key=lambda e: e["type"] != "extra_forbidden")
    where = tuple(str(part) for part in first["loc"])
    details = _details(first, where, root, table)
    where = (*where, *details.pop("key").split(".")) if "key" in details else where
    return where, {**details, "key": ".".join(where[:2]) + "".join(f"[{index}]" for index in where[2:])}


def _details(error: ErrorDetails, where: tuple[str, ...], root: type[BaseModel], table: TableOf) -> dict[str, Any]:
    context, owner = error.get("ctx", {}), root if len(where) < 2 else table(where[0])
    is_key = len(where) > 1 or table("".join(where)) is None
    if error["type"] == "extra_forbidden":
        known = [*owner.model_fields] if owner is not None else []
        if len(where) == 1 and not isinstance(error["input"], dict):
            keys = [f"{name}.{key}" for name in known for key in getattr(table(name), "model_fields", ())]
            return {"what": "unknown key", "remedy": nearest(where[0], [*known, *keys])}
        return {
            "what": f"unknown {'key' if len(where) > 1 else 'table'}",
            "remedy": nearest("".join(where[-1:]), known),
        }
    if error["type"] == "rule" and "key" in context:  # of several keys
        return {name: context[name] for name in context if name in ("key", "what", "value", "expected", "remedy")}
    meaning = _meaning(where, root, table)
    if error["type"] == "rule":
        return {
            "what": context["what"],
            "value": error["input"],
            "expected": f"{context['expected']} ({meaning})",
        }
    if error["type"] == "missing":
        few = f"the {'key' if is_key else 'table'} is missing" if len(where) < 3 else "too few numbers"
        return {"what": few, "expected": meaning}
    message = error["msg"].removeprefix("Input should be ").removeprefix("a ").removeprefix("valid ")
    what = "out of range" if set(context) & {"gt", "ge", "lt", "le"} else "wrong value"
    return {"what": what, "value": error["input"], "expected": f"{message} ({meaning})"}


def _meaning(where: tuple[str, ...], root: type[BaseModel], table: TableOf) -> str:
    """Return the meaning of a key, or the keys that a table must have."""
    model = table(where[0]) if where else None
    if model is None:
        field = root.model_fields.get(where[0]) if where else None
        return (field.description if field else None) or "see the reference"
    if len(where) == 1:
        needed = [name for name, field in model.model_fields.items() if field.is_required()]
        return f"[{where[0]}]" + (" with " + ", ".join(needed) if needed else "")
    field = model.model_fields.get(where[1])  # none: a key that one robot family has more than others
    return (field.description if field else None) or "see the reference"
