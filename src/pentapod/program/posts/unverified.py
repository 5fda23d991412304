"""What is written without a passed verdict says so in its first line, in the comments of its language."""

from __future__ import annotations

from pathlib import PurePosixPath

from pentapod.base.errors import InputError
from pentapod.program.header import UNVERIFIED

_COMMENTS = {
    ".apt": "$$ {}", ".hal": "# {}", ".ini": "# {}", ".md": "**{}**", ".ngc": "({})", ".tbl": "; {}", ".var": "# {}",
}  # fmt: skip
_ARCHIVES = (".npz", ".h5")
"""They hold the header, which begins with it."""


def told_unverified(name: str, content: bytes) -> bytes:
    """Return a file's content with the line in front, unless it begins with it.

    What must begin otherwise has it as its second line: a script, and G-code between two "%".
    Raises InputError where the format has no place for it.
    """
    told, suffix = UNVERIFIED.encode(), PurePosixPath(name).suffix
    first, _, rest = content.partition(b"\n")
    if told in first or suffix in _ARCHIVES:
        return content
    if first.startswith(b"#!"):
        return first + b"\n# " + told + b"\n" + rest
    if suffix == ".ngc" and first.strip() == b"%":
        return first + b"\n(" + told + b")\n" + rest
    if suffix not in _COMMENTS:
        raise InputError(
            "this format has no place to say that the program is unverified", key=name,
            remedy="choose a format with comments, or have the program verified",
        )  # fmt: skip
    return _COMMENTS[suffix].format(UNVERIFIED).encode() + b"\n" + content
