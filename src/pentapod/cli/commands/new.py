"""pentapod new: write a commented job file, made from the schema, for a part or with a small part."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
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
    "placement": {"mode": "table", "table_z_mm": 471.0},
}
COMMENT_COLUMN = 46


@click.command()
@click.argument("target", type=click.Path(path_type=Path), metavar="DIR|PART")
@click.option(
    "-o", "--out", type=click.Path(path_type=Path), help="Job file to write for PART; beside it when left out."
)
@click.option("--machine", default="desk", show_default=True, help="Machine for PART: a shipped one, or a file.")
@json_option
@quiet_option
def new(target: Path, out: Path | None, machine: str, as_json: bool, quiet: bool) -> int:
    """Write a job: for PART, or an example in DIR.

    PART is a mesh (.stl .ply .obj .3mf .glb .step): its size and shape say which unit, side, cutter, strategy and
    placement to begin with. Each guess is printed, and commented in PART's job file.

    DIR gets job.toml, with every key explained, and part.stl, a shallow dome of 60 mm.
    """
    from pentapod.mesh.io.registry import MESH_FORMATS

    if not target.is_dir() and target.suffix.lower().removeprefix(".") in MESH_FORMATS:
        return _for_part(target, out or target.with_suffix(".toml"), machine, as_json=as_json, quiet=quiet)
    return _example(target, as_json=as_json, quiet=quiet)


def _for_part(part: Path, job: Path, machine: str, *, as_json: bool, quiet: bool) -> int:
    """Write a job for a part."""
    from pentapod.base.errors import InputError
    from pentapod.base.files import atomic_write
    from pentapod.job.proposal.proposal import propose
    from pentapod.machine.machine import Machine

    if job.exists():
        raise InputError("already exists", file=job, remedy="name another file with -o")
    beside = job.resolve().parent
    name = os.path.relpath(Path(machine).resolve(), beside) if machine.endswith(".toml") else machine
    proposal = propose(part, Machine.load(machine), name)
    mesh = {"mesh": Path(os.path.relpath(part.resolve(), beside)).as_posix()}
    tables = {**proposal.tables, "part": {**mesh, **proposal.tables["part"]}}
    with atomic_write(job) as temporary:
        temporary.write_text(job_text(tables, proposal.reasons), encoding="utf-8")
    if as_json:
        echo_json({"files": [str(job)], "job": tables, "remarks": list(proposal.remarks)})
    elif not quiet:
        click.echo("\n".join((*(f"{part.name}: {remark}" for remark in proposal.remarks), f"wrote {job}")))
        click.echo(f"next: pentapod plan {job} -o {job.with_suffix('')}-out")
        click.echo("if that refuses the job, it looks for changes of it and prints those whose plan passed")
    return 0


def _example(folder: Path, *, as_json: bool, quiet: bool) -> int:
    """Write an example."""
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


def job_text(
    values: Mapping[str, Mapping[str, Any]] = _VALUES, reasons: Mapping[tuple[str, str], str] | None = None
) -> str:
    """Return a job with every key of the schema; optional keys are commented out.

    values: by table and key; reasons: comments in place of the keys' meanings.
    """
    from pentapod.job.schema.tables import JobTables, table_model

    strategy = str(values["toolpath"].get("strategy", "raster"))
    lines = ["# A pentapod job. Keys that are commented out show their defaults.", ""]
    for table in JobTables.model_fields:
        model = table_model(table, strategy)
        lines += [f"# {(model.__doc__ or '').splitlines()[0]}", f"[{table}]"]
        for key, info in model.model_fields.items():
            reason = (reasons or {}).get((table, key)) or info.description
            lines.append(_line(key, info, values.get(table, {}).get(key), reason))
        lines.append("")
    return "\n".join(lines)


def _line(key: str, info: FieldInfo, value: Any, meaning: str | None) -> str:
    """Return `key = value  # meaning`, commented out where the key is optional."""
    if value is not None:
        return f"{f'{key} = {json.dumps(value, ensure_ascii=False)}':<{COMMENT_COLUMN}} # {meaning}"
    default = info.default if not info.is_required() else None
    shown = json.dumps(default) if default is not None else "..."
    return f"{f'# {key} = {shown}':<{COMMENT_COLUMN}} # {meaning}"


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
