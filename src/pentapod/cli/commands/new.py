"""pentapod new: write a commented job file, made from the schema, and a small part."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pentapod.cli.output import echo_json, json_option, quiet_option

if TYPE_CHECKING:
    from pydantic.fields import FieldInfo

JOB, MESH = "job.toml", "part.stl"

_VALUES: dict[str, dict[str, Any]] = {
    "part": {"mesh": MESH, "unit": "mm"},
    "machine": {"name": "desk"},
    "tool": {"type": "ball", "diameter_mm": 10.0},
    "toolpath": {"direction_deg": 0.0, "pattern": "zigzag", "stepover_mm": 6.0},
    "axis": {"tilt_deg": 15.0},
    "feed": {"cut_mm_min": 1500.0},
}
COMMENT_COLUMN = 46


@click.command()
@click.argument("folder", type=click.Path(path_type=Path), metavar="DIR")
@json_option
@quiet_option
def new(folder: Path, as_json: bool, quiet: bool) -> int:
    """Write an example: DIR/job.toml with every key explained, and DIR/part.stl, a shallow dome of 60 mm."""
    from pentapod.base.errors import InputError
    from pentapod.base.files import atomic_write

    for name in (JOB, MESH):
        if (folder / name).exists():
            raise InputError("already exists", file=folder / name, remedy="choose another folder")
    folder.mkdir(parents=True, exist_ok=True)
    with atomic_write(folder / MESH) as temporary:
        temporary.write_bytes(dome_stl())
    with atomic_write(folder / JOB) as temporary:
        temporary.write_text(job_text(), encoding="utf-8")
    if as_json:
        echo_json({"files": [str(folder / JOB), str(folder / MESH)]})
    elif not quiet:
        click.echo(f"wrote {folder / JOB} and {folder / MESH}")
        click.echo(f"next: pentapod plan {folder / JOB} -o {folder / 'out'}")
    return 0


def job_text() -> str:
    """Return a job with every key of the schema; optional keys are commented out."""
    from pentapod.job.schema.tables import JobTables, table_model

    lines = ["# A pentapod job. Keys that are commented out show their defaults.", ""]
    for table in JobTables.model_fields:
        model = table_model(table)
        lines += [f"# {(model.__doc__ or '').splitlines()[0]}", f"[{table}]"]
        for key, info in model.model_fields.items():
            lines.append(_line(key, info, _VALUES.get(table, {}).get(key)))
        lines.append("")
    return "\n".join(lines)


def _line(key: str, info: FieldInfo, value: Any) -> str:
    """Return `key = value  # meaning`, commented out where the key is optional."""
    if value is not None:
        return f"{f'{key} = {json.dumps(value)}':<{COMMENT_COLUMN}} # {info.description}"
    default = info.default if not info.is_required() else None
    shown = json.dumps(default) if default is not None else "..."
    return f"{f'# {key} = {shown}':<{COMMENT_COLUMN}} # {info.description}"


def dome_stl(size_mm: float = 60.0, height_mm: float = 8.0, cells: int = 40) -> bytes:
    """Return a binary STL of a shallow dome over a square, in mm, facing +z."""
    import numpy as np

    grid = np.linspace(-0.5, 0.5, cells + 1)
    x, y = np.meshgrid(grid, grid, indexing="ij")
    z = height_mm * np.cos(np.pi * x) * np.cos(np.pi * y)
    points = np.stack([size_mm * x, size_mm * y, z], axis=-1)
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    triangles = np.concatenate([np.stack(t, axis=2).reshape(-1, 3, 3) for t in ((a, b, c), (a, c, d))])
    facets = np.zeros(len(triangles), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("spare", "<u2")])
    facets["corners"] = triangles
    return b"dome, written by pentapod new".ljust(80) + np.uint32(len(facets)).tobytes() + facets.tobytes()
