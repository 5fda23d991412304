"""Jobs whose part stands where it was found: placement files (found.toml), and the job file of a run with one."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

from pydantic import ValidationError

from pentapod.base.errors import InputError
from pentapod.base.tables import problem_of
from pentapod.base.toml import line_of, parsed, read_toml
from pentapod.geometry.rigid import RigidTransform
from pentapod.job.build.placement import fixed_placement, job_at
from pentapod.job.schema.job import Job
from pentapod.job.schema.placement import PlacementTable
from pentapod.job.schema.written_job import write_job

PLACED_JOB = "placed-job.toml"
"""Name of the job file of a run with a placement of its own, in the run's folder."""


def read_placement(path: str | Path) -> RigidTransform:
    """Return the placement in a file with a table [placement], as `pentapod register` writes it.

    Raises InputError with file, line and key, also where its mode is not "fixed".
    """
    file = Path(path)
    return placement_in(read_toml(file, "placement", InputError, start='"pentapod register" writes one'), file)


def placement_in(text: str, file: Path) -> RigidTransform:
    """Return the placement in the text of such a file. Raises InputError, as `read_placement` does."""
    content = parsed(text, file, InputError)
    table = content.get("placement")
    if not isinstance(table, Mapping):
        raise InputError("the table is missing", file=file, key="placement", expected='[placement] with mode = "fixed"')
    values = cast("Mapping[str, Any]", _tuples(table))
    try:
        found = PlacementTable.model_validate(values)
    except ValidationError as error:
        where, details = problem_of(error, PlacementTable, lambda _: None)
        where = ("placement", *where)
        details["key"] = ".".join(where)
        raise InputError(details.pop("what"), file=file, line=line_of(text, where), **details) from error
    if found.mode != "fixed":
        line = line_of(text, ("placement", "mode"))
        raise InputError(
            "not a placement, but a choice of them", file=file, line=line, key="placement.mode", value=found.mode,
            expected='"fixed"',
        )  # fmt: skip
    return fixed_placement(found, lambda key, what, **details: InputError(what, file=file, key=key, **details))


def placed_job(job: Job, placement: RigidTransform, folder: Path) -> Job:
    """Return the job with its part fixed at a placement, from a job file that is written into the run's folder.

    It names the same mesh, machine and files. Raises InputError where it cannot be written.
    """
    fixed = job_at(job, placement)
    content = fixed.tables.model_dump(mode="json", exclude_unset=True)
    content["placement"] = fixed.placement.model_dump(mode="json", exclude_defaults=True)
    return write_job(job, content, folder / PLACED_JOB, "with the part where it was found")


def _tuples(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _tuples(item) for key, item in cast("Mapping[str, Any]", value).items()}
    return tuple(_tuples(item) for item in cast("list[Any]", value)) if isinstance(value, list) else value
