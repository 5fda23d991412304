"""Files of a post, written into a folder."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from pentapod.base.errors import InputError
from pentapod.base.files import atomic_write


def write_files(contents: Mapping[str, bytes], folder: str | Path) -> list[Path]:
    """Write contents by file name into a folder, created if missing; scripts become executable. Raises InputError."""
    made: list[Path] = []
    for relative, content in contents.items():
        path = Path(folder) / relative
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            what = f"the folder cannot be created: {(error.strerror or str(error)).lower()}"
            raise InputError(what, file=path.parent, remedy="choose another") from error
        with atomic_write(path) as temporary:
            temporary.write_bytes(content)
            if content.startswith(b"#!"):
                temporary.chmod(temporary.stat().st_mode | 0o111)
        made.append(path)
    return made
