"""The table [toolpath] of a job file: a model for each strategy, made from the keys of its options."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal, cast

from pydantic import BeforeValidator, Field, SerializeAsAny, create_model

from pentapod.base.errors import InputError, ToolpathError, nearest
from pentapod.base.keys import VECTOR, Key, declared
from pentapod.base.tables import TomlTable, table_of, wrong
from pentapod.toolpath.formats.rotary import RotaryAxes
from pentapod.toolpath.strategies.registry import STRATEGIES

FILE = "file"
"""The strategy that reads a toolpath instead of making one."""


class StrategyTable(TomlTable):
    """Toolpath strategy and its options."""

    strategy: str = "raster"

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the given values, from which the model follows."""
        return _of_strategy, ({"strategy": self.strategy, **self.model_dump(exclude_unset=True)},)


@dataclass(frozen=True, kw_only=True)
class FileOptions:
    """A toolpath read from a file."""

    file: Annotated[Path, Key("", "the toolpath (APT, G-code, CSV, npz), relative to this job file", kind=Path)]
    format: Annotated[str | None, Key("", "its format, where the suffix does not tell", min_length=1)] = None
    unit: Annotated[Literal["mm", "inch"] | None, Key("", "unit of a G-code file that does not name it (G20, G21)")] = (
        None
    )
    rotary_axes: Annotated[
        tuple[str, ...],
        Key("", 'G-code: rotary axes of the file\'s machine, from the part to the tool: ["table C", "head A"]'),
    ] = ()
    rotary_centre: Annotated[
        VECTOR | None, Key("mm", "where the axes of that machine's table meet, in the coordinates of the file")
    ] = None
    pivot: Annotated[
        float | None, Key("mm", "distance from the tip to where the axes of that machine's head meet", gt=0.0)
    ] = None
    tool: Annotated[str | None, Key("", "G-code: number or name of the tool whose moves are read", min_length=1)] = None

    @staticmethod
    def rules(table: Any) -> None:
        """Check that the rotary axes are those of a machine."""
        try:
            RotaryAxes.of(table.rotary_axes)
        except ToolpathError as error:
            wrong("rotary_axes", error.what, error.expected, value=error.value)
        for key in ("rotary_centre_mm", "pivot_mm"):
            if getattr(table, key) is not None and not table.rotary_axes:
                wrong(key, f"{key} without rotary_axes", 'rotary_axes = ["table C", "head A"], for example')


def job_strategies() -> tuple[str, ...]:
    """Return the strategies that a job file can name."""
    return (*(name for name, strategy in STRATEGIES.items() if strategy.in_jobs), FILE)


@cache
def strategy_table(name: str) -> type[StrategyTable]:
    """Return the table [toolpath] of a strategy. Raises InputError where there is no such strategy for job files."""
    field: Any = (Literal[name], Field(default=name, description="how the surface is machined"))
    base = table_of(_options_of(name), StrategyTable)
    made: Any = create_model(base.__name__, __base__=base, __doc__=base.__doc__, strategy=field)
    return made


def file_keys(strategy: str) -> tuple[str, ...]:
    """Return the keys of [toolpath] that name a file, for a strategy."""
    return tuple(item.file_key for item in declared(_options_of(strategy)) if item.key.kind is Path)


def _options_of(name: str) -> type:
    if name not in job_strategies():
        raise InputError("unknown strategy", value=name, remedy=nearest(name, job_strategies()))
    return FileOptions if name == FILE else STRATEGIES[name].options


def _of_strategy(value: Any) -> Any:
    """Validate [toolpath] by the keys of its strategy; without one it is a raster."""
    if not isinstance(value, Mapping):
        return value
    table = cast("Mapping[str, Any]", value)
    try:
        model = strategy_table(str(table.get("strategy", "raster")))
    except InputError as error:
        wrong("strategy", error.what, error.expected, value=table["strategy"], remedy=error.remedy)
    return model.model_validate(table)


ToolpathTable = Annotated[SerializeAsAny[StrategyTable], BeforeValidator(_of_strategy)]
