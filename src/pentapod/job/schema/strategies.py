"""The table [toolpath] of a job file: for each strategy a model, made from the options that the strategy declares."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal, cast

from pydantic import BeforeValidator, Field, SerializeAsAny, create_model

from pentapod.base.errors import InputError, nearest
from pentapod.base.keys import declared
from pentapod.base.tables import Table, table_of, wrong
from pentapod.toolpath.strategies.registry import STRATEGIES


class StrategyTable(Table):
    """Toolpath strategy and its options."""

    strategy: str = Field(default="raster", description="how the surface is machined")

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the given values; the model is made again from the strategy's options."""
        return _of_strategy, ({"strategy": self.strategy, **self.model_dump(exclude_unset=True)},)


class FileTable(StrategyTable):
    """A toolpath read from a file."""

    strategy: str = Field(default="file", description="how the surface is machined")
    file: str = Field(min_length=1, description="the toolpath (APT, G-code, CSV, npz), relative to this job file")
    format: str | None = Field(default=None, min_length=1, description="its format, where the suffix does not tell")


def job_strategies() -> tuple[str, ...]:
    """Return the strategies that a job file can name."""
    return (*(name for name, strategy in STRATEGIES.items() if strategy.in_jobs), "file")


@cache
def strategy_table(name: str) -> type[StrategyTable]:
    """Return the table [toolpath] of a strategy. Raises InputError where there is no such strategy for job files."""
    if name == "file":
        return FileTable
    if name in STRATEGIES and (strategy := STRATEGIES[name]).in_jobs:
        base = table_of(strategy.options, StrategyTable)
        field: Any = (Literal[name], Field(default=name, description="how the surface is machined"))
        made: Any = create_model(base.__name__, __base__=base, __doc__=base.__doc__, strategy=field)
        return made
    raise InputError("unknown strategy", value=name, remedy=nearest(name, job_strategies()))


def file_keys(strategy: str) -> tuple[str, ...]:
    """Return the keys of [toolpath] that name a file, for a strategy."""
    if strategy == "file":
        return ("file",)
    return tuple(item.file_key for item in declared(STRATEGIES[strategy].options) if item.key.kind is Path)


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
