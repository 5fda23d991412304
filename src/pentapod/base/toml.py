"""TOML files: reading and parsing, with errors that name line, key and remedy; tables written as TOML."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, cast

from pentapod.base.errors import InputError
from pentapod.base.files import read_bytes

MOST_BYTES = 1_000_000
"""Largest file."""

DEEPEST = 16
"""Largest depth of nested arrays and tables."""

ERROR_PLACE = re.compile(r"\(at line (\d+), column (\d+)\)")
ONE_TABLE = "a table stands in a file once: put all its keys below the same [name]"
_TWICE = re.compile(r"Cannot declare .* twice")
_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rf"(?<![\w\"'-]){_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{4 * DEEPEST}}}")
_MANY_DIGITS = re.compile(r"\w{19,}")
TOO_LARGE = 2**63
_SHALLOW = f"at most {DEEPEST} levels"
_FEW_DIGITS = "a number that fits 64 bits"


def read_toml(path: Path, kind: str, wrong: type[InputError], *, start: str | None = None) -> str:
    """Return the text of a file. kind: "job" or "machine"; start: how to get a first file, for messages.

    Raises `wrong` where it is missing, a folder, not readable, not text, or empty.
    """
    try:
        # Some editors begin a file with a byte order mark.
        text = read_bytes(path, wrong, f"a {kind} file", MOST_BYTES, start).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise wrong("not a text file in UTF-8", file=path, expected=f"a {kind} file in TOML") from error
    if not text.strip():
        raise wrong(f"the {kind} file is empty", file=path, remedy=start)
    return text


def parsed(text: str, file: str | Path, wrong: type[InputError]) -> dict[str, Any]:
    """Return the tables of a text. Raises `wrong` with line and column where it is not TOML.

    Numbers beyond 4,300 digits and nesting deeper than `DEEPEST` are errors as well: Python's parser fails on them or
    takes hours.
    """
    if deep := _LONG_KEY.search(text):
        line = text.count("\n", 0, deep.start()) + 1
        raise wrong("a key of too many parts", file=file, line=line, value=deep[0][:40], expected=_SHALLOW)
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        place = ERROR_PLACE.search(str(error))
        # An error at the end of the file has no place.
        line, column = (int(place[1]), int(place[2])) if place else (len(text.splitlines()), None)
        told = str(error).split(" (at ")[0]
        remedy = _spelling(text.splitlines()[line - 1] if line else "") or (ONE_TABLE if _TWICE.match(told) else None)
        raise wrong(f"not TOML: {told}", file=file, line=line, column=column, remedy=remedy) from error
    except RecursionError as error:
        raise wrong("nested too deep", file=file, line=_deepest_line(text), expected=_SHALLOW) from error
    except (ValueError, ArithmeticError) as error:
        raise wrong("a number of too many digits", file=file, line=_digits_line(text), expected=_FEW_DIGITS) from error
    _check_values(content, text, file, wrong)
    return content


def _spelling(line: str) -> str | None:
    """Return how to write a number of a line that has a decimal comma, or a unit behind it."""
    if re.search(r"=\s*[-+]?\d+,\d+\s*(#.*)?$", line):
        return "write a number with a decimal point"
    if re.search(r"=\s*[-+]?\d+(\.\d+)?\s*[a-zµ°%][\w/]*\s*(#.*)?$", line):
        return "write the number alone: its unit is in the name of the key"
    return None


def _check_values(content: dict[str, Any], text: str, file: str | Path, wrong: type[InputError]) -> None:
    """Raise `wrong` where values are nested too deep, or an integer needs more than 64 bits."""
    level: list[Any] = [content]
    for _ in range(DEEPEST):
        inner: list[Any] = []
        for value in level:
            if isinstance(value, dict):
                inner += cast("dict[str, Any]", value).values()
            elif isinstance(value, list):
                inner += cast("list[Any]", value)
            elif isinstance(value, int) and abs(value) >= TOO_LARGE:
                raise wrong("a number of too many digits", file=file, line=_digits_line(text), expected=_FEW_DIGITS)
        level = inner
    if level:
        raise wrong("nested too deep", file=file, line=_deepest_line(text), expected=_SHALLOW)


def _digits_line(text: str) -> int | None:
    """Return the line of the first number that is too long."""
    found = _MANY_DIGITS.search(text)
    return text.count("\n", 0, found.start()) + 1 if found else None


def _deepest_line(text: str) -> int:
    """Return the line where the most brackets open: for messages, so a plain count is enough."""
    lines = text.splitlines()
    depth = [line.count("[") + line.count("{") - line.count("]") - line.count("}") for line in lines]
    opened = [line.count("[") + line.count("{") for line in lines]
    return 1 + max(range(len(lines)), key=lambda k: (depth[k], opened[k]))


def line_of(text: str, where: Sequence[str]) -> int | None:
    """Return the line of a key, or of its table's header: for messages, so a plain search is enough."""
    table, header = "", None
    for number, line in enumerate(text.splitlines(), start=1):
        if match := re.match(r"\s*\[\s*(\w+)\s*\]", line):
            table = match[1]
            if table == where[0]:
                header = number
            continue
        wanted = where[1:2] if table == where[0] else [] if table else where[:1]
        if wanted and re.match(rf"\s*{re.escape(wanted[0])}\s*=", line):
            return number
    return header


def toml_text(content: Mapping[str, Any]) -> str:
    """Return keys and tables of keys as the text of a TOML file, in their order, plain keys first; None is left out."""
    plain = {key: value for key, value in content.items() if not isinstance(value, Mapping)}
    lines = [*_lines(plain), ""] if plain else []
    for name, table in content.items():
        if name not in plain:
            lines += [f"[{name}]", *_lines(table), ""]
    return "\n".join(lines)


def _lines(table: Mapping[str, Any]) -> list[str]:
    return [f"{key} = {_value(value)}" for key, value in table.items() if value is not None]


def _value(value: Any) -> str:
    """Return a value in TOML: the spelling of texts, numbers, truth values and lists is that of JSON."""
    if isinstance(value, Mapping):
        inner = cast("Mapping[str, Any]", value)
        return "{ " + ", ".join(f"{key} = {_value(item)}" for key, item in inner.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_value(item) for item in cast("Sequence[Any]", value)) + "]"
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
