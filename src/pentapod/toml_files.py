"""TOML files that people write: read and parsed, and what is wrong with them told by line, key and remedy."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pentapod.errors import InputError

if TYPE_CHECKING:
    from pydantic import ValidationError
    from pydantic_core import ErrorDetails

_PLACE = re.compile(r"\(at line (\d+), column (\d+)\)")


def read_toml(path: Path, kind: str, wrong: type[InputError], *, start: str | None = None) -> str:
    """Return the text of a file. kind: "job" or "machine"; start: how one gets a file to start from, for messages.

    Raises `wrong` where it is missing, a folder, not readable, not text, or empty.
    """
    try:
        # Some editors begin a file with a byte order mark.
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError as error:
        raise wrong(f"no such {kind} file", file=path, remedy=start) from error
    except UnicodeDecodeError as error:
        raise wrong("not a text file in UTF-8", file=path, expected=f"a {kind} file in TOML") from error
    except IsADirectoryError as error:
        raise wrong("this is a folder", file=path, expected=f"a {kind} file", remedy="name the one in it") from error
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise wrong(f"cannot be read: {reason}", file=path, expected=f"a {kind} file") from error
    if not text.strip():
        raise wrong(f"the {kind} file is empty", file=path, remedy=start)
    return text


def parsed(text: str, file: str | Path, wrong: type[InputError]) -> dict[str, Any]:
    """Return the tables of a text. Raises `wrong` with line and column where it is not TOML."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        place = _PLACE.search(str(error))
        # Only the end of the file comes without a place.
        line, column = (int(place[1]), int(place[2])) if place else (len(text.splitlines()), None)
        raise wrong(f"not TOML: {str(error).split(' (at ')[0]}", file=file, line=line, column=column) from error


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


def first_of(error: ValidationError) -> ErrorDetails:
    """Return the one error to show: an unknown key first, since a misspelling is also a missing key."""
    return min(error.errors(include_url=False), key=lambda e: e["type"] != "extra_forbidden")


def wrong_value(error: ErrorDetails, meaning: str) -> dict[str, Any]:
    """Return what, value and expected of a value that its schema refuses. meaning: what the schema says of the key."""
    message = error["msg"].removeprefix("Input should be ").removeprefix("a ").removeprefix("valid ")
    what = "out of range" if set(error.get("ctx", {})) & {"gt", "ge", "lt", "le"} else "wrong value"
    return {"what": what, "value": error["input"], "expected": f"{message} ({meaning})"}
