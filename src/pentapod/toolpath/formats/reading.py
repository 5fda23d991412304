"""Shared parts of the readers of toolpath text: numbered lines, numbers with their words, guards against non-text."""

from __future__ import annotations

from pathlib import Path

from pentapod.base.errors import ToolpathError
from pentapod.base.files import number_in, read_bytes

MOST_BYTES = 500_000_000
"""A toolpath of ten million waypoints is smaller."""

_HEAD = 4096


def read_lines(file: Path) -> list[str]:
    """Return the lines of a UTF-8 text file. Raises ToolpathError: missing, empty, too large, not text, cut short.

    The size and the first bytes are looked at before anything else is read. A last line without its end is taken
    for the sign of a truncated file.
    """
    check_head(file)
    data = read_bytes(file, ToolpathError, "a toolpath", MOST_BYTES)
    if not data.strip():
        raise ToolpathError("the file is empty", file=file, expected="a toolpath")
    if b"\0" in data:
        line = data.count(b"\n", 0, data.index(b"\0")) + 1
        raise ToolpathError("not a text file: it holds zero bytes", file=file, line=line, remedy="save it as UTF-8")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        value = data[error.start : error.start + 1]
        raise ToolpathError("not UTF-8 text", file=file, line=line, value=value, remedy="save it as UTF-8") from error
    if not text.endswith("\n"):
        raise ToolpathError(
            "the last line has no end: the file was cut off", file=file, line=text.count("\n") + 1,
            remedy="export it again, or end the last line",
        )  # fmt: skip
    lines = text.replace("\r\n", "\n").split("\n")[:-1]
    if "\r" in text and (odd := next((k for k, line in enumerate(lines, start=1) if "\r" in line), None)):
        raise ToolpathError("a carriage return within a line", file=file, line=odd, remedy="end lines with a line feed")
    return lines


def check_head(file: Path) -> bytes:
    """Return the first bytes of a file. Raises ToolpathError: not there, a folder, empty, too large, binary."""
    try:
        size = file.stat().st_size
        with file.open("rb") as stream:
            head = stream.read(_HEAD)
    except FileNotFoundError as error:
        raise ToolpathError("no such file", file=file, expected="a toolpath file") from error
    except OSError as error:
        raise ToolpathError(f"cannot be read: {(error.strerror or str(error)).lower()}", file=file) from error
    if not head.strip():
        raise ToolpathError("the file is empty", file=file, expected="a toolpath")
    if size > MOST_BYTES:
        raise ToolpathError(
            "the file is too large",
            file=file,
            value=f"{size / 1e6:.0f} MB",
            expected=f"at most {MOST_BYTES / 1e6:.0f} MB",
        )
    if b"\0" in head and not head.startswith(b"PK"):
        wide = head.startswith((b"\xff\xfe", b"\xfe\xff"))
        what = "not UTF-8 text but UTF-16" if wide else "not a text file: it holds zero bytes"
        raise ToolpathError(what, file=file, line=1, remedy="save it as UTF-8")
    return head


def seconds(text: str, file: Path, line: int, word: str) -> float:
    """Return a time, 0 or more. Raises ToolpathError naming the word."""
    value = number(text, file, line, word)
    if value < 0.0:
        raise ToolpathError("a time below 0", file=file, line=line, key=word, value=text.strip()[:40])
    return value


def number(text: str, file: Path, line: int, word: str) -> float:
    """Return a finite number. Raises ToolpathError naming the word."""
    value = number_in(text)
    if value is None:
        raise ToolpathError("not a finite number", file=file, line=line, key=word, value=text.strip()[:40])
    return value
