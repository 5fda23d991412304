"""Posts are written for programs with a passed verdict only, or marked as unverified in their first line."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import Any, cast

from pentapod.base.errors import InputError, ProgramError
from pentapod.program.header import UNVERIFIED

VerdictContent = Mapping[str, Any] | str | Path
"""The content of a verdict.json (`Verdict.to_dict`), or the path of that file."""

_REMEDY = "plan the job or verify the program (pentapod verify --json > verdict.json), or insist with --unverified"
_COMMENTS = {
    ".apt": "$$ {}", ".c": "/* {} */", ".h": "/* {} */",
    ".hal": "# {}", ".ini": "# {}", ".md": "**{}**", ".ngc": "({})", ".sdf": "<!-- {} -->",
    ".tbl": "; {}", ".var": "# {}", ".xml": "<!-- {} -->",
}  # fmt: skip
_ARCHIVES = (".npz", ".h5")
"""Their header begins with the mark."""


def check_passed(verdict: VerdictContent, sha256: str, program: str | Path | None = None, springs: str = "") -> None:
    """Raise ProgramError unless a verdict has passed for the program file with this SHA-256.

    program: the file's name, for the message. springs: digest of the stiffness and the masses by which it will be
    compensated; those that were judged must be the same.
    """
    content = verdict if isinstance(verdict, Mapping) else _content(Path(verdict), program)
    if content.get("passed") is not True:
        raise ProgramError(f"the verdict on this program {_failure(content)}", file=program, remedy=_REMEDY)
    sources = content.get("sha256")
    judged = cast("Mapping[str, Any]", sources).get("program") if isinstance(sources, Mapping) else None
    if judged is None:
        raise ProgramError("the verdict does not say which file it is about", file=program, remedy=_REMEDY)
    if judged != sha256:
        raise ProgramError(
            "the verdict is about another file: the program was changed, or replaced", file=program,
            value=f"SHA-256 {sha256[:12]}…", expected=f"{str(judged)[:12]}…", remedy=_REMEDY,
        )  # fmt: skip
    if springs and (before := content.get("springs", springs)) != springs:
        raise ProgramError(
            "the machine's stiffness or masses were changed after the verdict: drives would be told other lengths",
            file=program, key="springs", value=springs, expected=before, remedy=_REMEDY,
        )  # fmt: skip


def _failure(content: Mapping[str, Any]) -> str:
    """Return why a verdict has not passed, in words."""
    claims: Any = content.get("certificates")
    each = [c for c in claims if isinstance(c, dict)] if isinstance(claims, list) else []
    failed = [str(c.get("claim")) for c in each if c.get("passed") is not True]
    return f"failed: {', '.join(failed[:3])}{', …' if len(failed) > 3 else ''}" if failed else "has not passed"


def _content(file: Path, program: str | Path | None) -> Mapping[str, Any]:
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        what = "there is no verdict on this program"
        raise ProgramError(what, file=program, expected=f"its verdict in {file}", remedy=_REMEDY) from error
    except (OSError, ValueError, RecursionError) as error:
        raise ProgramError("not a verdict, or a broken one", file=file, remedy=_REMEDY) from error
    if not isinstance(content, dict):
        raise ProgramError("not a verdict", file=file, remedy=_REMEDY)
    return cast("dict[str, Any]", content)


def marked_unverified(name: str, content: bytes) -> bytes:
    """Return the content of a file with the mark in its first line, unless it has it there.

    In the second line where the first one is fixed: of scripts, and of G-code between two "%". Raises InputError where
    the format has no comments.
    """
    mark, suffix = UNVERIFIED.encode(), PurePosixPath(name).suffix
    first, _, rest = content.partition(b"\n")
    if mark in first or suffix in _ARCHIVES:
        return content
    if first.startswith(b"#!"):
        return first + b"\n# " + mark + b"\n" + rest
    if suffix == ".ngc" and first.strip() == b"%":
        return first + b"\n(" + mark + b")\n" + rest
    if suffix not in _COMMENTS:
        raise InputError(
            "this format has no comments to say that the program is unverified", key=name,
            remedy="choose a format with comments, or have the program verified",
        )  # fmt: skip
    return _COMMENTS[suffix].format(UNVERIFIED).encode() + b"\n" + content
