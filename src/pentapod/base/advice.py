"""Advice: changes of a job that were planned, with a verdict that passed, and what they keep of the task."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from pentapod.base.values import Value


@dataclass(frozen=True)
class Change(Value):
    """One key of a job and its new value, as in the file; None takes the key out."""

    table: str
    key: str
    value: Any


@dataclass(frozen=True)
class Advice(Value):
    """Changes of a job with which it was planned, and its verdict passed.

    words: what they do. kept: share of the area that the job asked for, 0 to 1. whole: False where the part itself
    becomes another, by its scale or unit.
    """

    changes: tuple[Change, ...]
    words: str
    kept: float
    whole: bool = True

    @property
    def tables(self) -> dict[str, dict[str, Any]]:
        """The changes by table and key, as `Job.with_` takes them."""
        found: dict[str, dict[str, Any]] = {}
        for change in self.changes:
            found.setdefault(change.table, {})[change.key] = change.value
        return found

    @property
    def toml(self) -> str:
        """The changes in TOML, to be put into the tables of the job file."""
        lines: list[str] = []
        for table, keys in self.tables.items():
            lines.append(f"[{table}]")
            lines += [f"{key} = {_toml(value)}" for key, value in keys.items() if value is not None]
            lines += [f"# take out {key}" for key, value in keys.items() if value is None]
        return "\n".join(lines)

    @property
    def keeps(self) -> str:
        """What is kept, in words."""
        share = "all" if self.kept > 0.9995 else f"{100.0 * self.kept:.2g} %"
        return f"{share} of the area" + ("" if self.whole else ", of another part")

    def __str__(self) -> str:
        return f"{self.words} (keeps {self.keeps})"

    def to_dict(self) -> dict[str, Any]:
        """Return its entry in verdict.json."""
        return {"words": self.words, "changes": self.tables, "kept": self.kept, "whole": self.whole, "toml": self.toml}


def _toml(value: Any) -> str:
    """Return a value in TOML: the spelling of texts, numbers, truth values and lists is that of JSON."""
    return json.dumps(value, ensure_ascii=False)
