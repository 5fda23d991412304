"""Inputs by content: files that tasks read, kept once for each content, beside the folders of the tasks."""

from __future__ import annotations

import hashlib
import io
import os
import re
import secrets
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from pentapod.base.errors import InputError
from pentapod.base.files import BLOCK_BYTES, unwritable
from pentapod.base.values import Value

INPUTS = "inputs"
"""Folder of the inputs, beside the folders of the tasks."""

LONGEST_LABEL = 40
_UNUSUAL = re.compile(r"[^\w.+-]+")


def named(label: str, digest: str) -> str:
    """Return the name of a file or folder: a label for people, without unusual characters, and 16 digits."""
    return f"{_UNUSUAL.sub('-', label)[:LONGEST_LABEL]}-{digest[:16]}"


@dataclass(frozen=True)
class Input(Value):
    """A file by its content. name: within the folder of inputs; sha256: of its bytes."""

    name: str
    sha256: str

    @property
    def path(self) -> str:
        """Its path from a task's folder."""
        return f"../{INPUTS}/{self.name}"


class Store:
    """The inputs of a folder of tasks. They are copies: a file that is changed later changes no task."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder / INPUTS
        self._known: dict[tuple[str, int, int], Input] = {}

    def keep(self, path: Path) -> Input:
        """Copy a file, unless its content is there, and return it. Raises InputError: it cannot be read, or written."""
        try:
            state = path.stat()
            key = (str(path.resolve()), state.st_mtime_ns, state.st_size)
            if key not in self._known:
                with path.open("rb") as source:
                    self._known[key] = self._kept(path.stem, path.suffix, source)
        except OSError as error:
            raise InputError(f"cannot be read: {(error.strerror or str(error)).lower()}", file=path) from error
        return self._known[key]

    def keep_bytes(self, stem: str, suffix: str, data: bytes) -> Input:
        """Keep a content, unless it is there, and return it. Raises InputError: it cannot be written."""
        return self._kept(stem, suffix, io.BytesIO(data))

    def tidy(self) -> None:
        """Remove copies that were cut off; nobody else may be writing."""
        for path in self.folder.glob(".*"):
            path.unlink(missing_ok=True)

    def _kept(self, stem: str, suffix: str, source: IO[bytes]) -> Input:
        digest, copied = hashlib.sha256(), self.folder / f".{secrets.token_hex(6)}"
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            with copied.open("xb") as copy:
                while block := source.read(BLOCK_BYTES):
                    digest.update(block)
                    copy.write(block)
                copy.flush()
                os.fsync(copy.fileno())
            found = Input(named(stem, digest.hexdigest()) + suffix.lower(), digest.hexdigest())
            copied.replace(self.folder / found.name)
        except OSError as error:
            raise unwritable(self.folder, error) from error
        finally:
            copied.unlink(missing_ok=True)
        return found
