"""manifest.json: the files of a run with their SHA-256; it shows mixed files of different runs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, cast

from pentapod.base.errors import InputError
from pentapod.base.files import sha256_of
from pentapod.job.artefacts import MANIFEST, NAMES, SETUPS, write_json


def run_files(folder: Path) -> list[Path]:
    """Return the files of a run that are in a folder, relative to it, those of set-ups first, manifests last."""
    parts = [*sorted(path for path in folder.glob(SETUPS) if path.is_dir()), folder]
    return [(part / name).relative_to(folder) for part in parts for name in NAMES if (part / name).is_file()]


def write_manifest(folder: Path) -> None:
    """Write manifest.json of a run's folder, and first that of each of its set-ups."""
    for part in sorted(path for path in folder.glob(SETUPS) if path.is_dir()):
        write_manifest(part)
    files = [relative for relative in run_files(folder) if relative != Path(MANIFEST)]
    entries = {
        relative.as_posix(): {"sha256": sha256_of(folder / relative), "bytes": (folder / relative).stat().st_size}
        for relative in sorted(files)
    }
    write_json({"files": entries}, folder / MANIFEST)


def read_manifest(folder: Path) -> dict[str, tuple[str, int]]:
    """Return SHA-256 and size of each file by name; {} where there is no manifest. Raises InputError: broken."""
    file = folder / MANIFEST
    try:
        entries = cast("dict[str, dict[str, Any]]", json.loads(file.read_text(encoding="utf-8"))["files"])
        return {name: (str(entry["sha256"]), int(entry["bytes"])) for name, entry in entries.items()}
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise InputError(
            "not the manifest of a run, or a broken one", file=file, remedy="plan the job again"
        ) from error


def changed_files(folder: Path) -> list[str]:
    """Return the names of files that are not as manifest.json says, or not there. Raises InputError: broken."""
    return [name for name, told in read_manifest(folder).items() if not _is(folder / name, *told)]


def _is(path: Path, sha256: str, size: int) -> bool:
    """Whether a file is there with these bytes; its size is compared first."""
    try:
        return path.stat().st_size == size and sha256_of(path) == sha256
    except OSError:
        return False
