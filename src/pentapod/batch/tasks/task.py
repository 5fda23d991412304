"""Task: a function to be run in a folder of its own, named by the SHA-256 of what its result depends on."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from pentapod.base.errors import InputError
from pentapod.base.values import Value
from pentapod.base.version import __version__, library_versions
from pentapod.batch.tasks.store import Input, named

Row = dict[str, Any]
"""Columns of a table by name: texts, numbers, None, and lists or dicts of them, as JSON has them."""


@dataclass(frozen=True)
class Task(Value):
    """A function, the files that it reads, and what is known beforehand.

    name: of its folder, a label and the beginning of a SHA-256. function: "module:name" of a function that gets its
    folder and `arguments`, writes files into the folder, and returns a `Row` with the column "status". files: contents
    of small files in the folder before it begins. inputs: large files, in `../inputs` of the folder. known: columns of
    the table that are known beforehand; they do not count for the name.
    """

    name: str
    function: str
    arguments: Mapping[str, Any] = field(default_factory=dict[str, Any])
    files: Mapping[str, str] = field(default_factory=dict[str, str])
    inputs: tuple[Input, ...] = ()
    known: Row = field(default_factory=dict[str, Any])

    @classmethod
    def of(
        cls,
        label: str,
        function: Callable[..., Row],
        arguments: Mapping[str, Any] | None = None,
        *,
        files: Mapping[str, str] | None = None,
        inputs: tuple[Input, ...] = (),
        known: Row | None = None,
    ) -> Task:
        """Return the task of a function that can be imported; arguments as JSON has them, for keywords.

        Raises InputError where the function cannot be imported elsewhere.
        """
        place = f"{function.__module__}:{function.__qualname__}"
        if function.__module__ == "__main__" or "<" in function.__qualname__:
            raise InputError(
                "the function of a task cannot be imported", value=place, expected="a function of a module",
                remedy="put it into a file of its own",
            )  # fmt: skip
        content = [
            versions(), place, dict(arguments or {}), dict(files or {}), sorted({each.sha256 for each in inputs}),
        ]  # fmt: skip
        text = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
        name = named(label, hashlib.sha256(text.encode()).hexdigest())
        return cls(name, place, dict(arguments or {}), dict(files or {}), inputs, dict(known or {}))


def function_of(place: str) -> Callable[..., Row]:
    """Return the function of a task by its "module:name"."""
    module, _, name = place.partition(":")
    found: Any = import_module(module)
    for part in name.split("."):
        found = getattr(found, part)
    return found


@cache
def versions() -> dict[str, str]:
    """Return the versions on which a result depends: of pentapod, of its sources, of Python and libraries."""
    return {"pentapod": __version__, "sources": _sources(), "libraries": library_versions()}


def _sources() -> str:
    """Return a digest of pentapod's own files: between two releases its version stays the same."""
    folder, digest = Path(__file__).parents[2], hashlib.sha256()
    for file in sorted(path for path in folder.rglob("*") if path.suffix in (".py", ".toml", ".j2", ".css", ".js")):
        digest.update(f"{file.relative_to(folder).as_posix()}\0".encode() + file.read_bytes() + b"\0")
    return digest.hexdigest()[:16]
