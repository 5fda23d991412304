"""Changes by the path of a key: of a job's file, `tool.length_mm`, or of its machine's, `machine.geometry.delta`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, cast

from pydantic import ValidationError

from pentapod.base.errors import InputError, MachineError, nearest
from pentapod.base.tables import problem_of
from pentapod.base.toml import parsed
from pentapod.job.schema.job import Job
from pentapod.job.schema.tables import JobTables, table_model
from pentapod.machine.families import FAMILIES, legs_of
from pentapod.machine.reader import machine_bytes
from pentapod.machine.tables import MachineTables

MACHINE = "machine"
"""Table of a job, and the beginning of paths into its machine's file."""


def machine_content(job: Job) -> dict[str, Any]:
    """Return the tables of a job's machine file, also of a shipped one. Raises MachineError."""
    name = job.machine_file or str(job.machine.name)
    return parsed(machine_bytes(name).decode("utf-8-sig"), name, MachineError)


def unknown(path: str, job: Job, swept: Mapping[str, Sequence[Any]]) -> str | None:
    """Return what to type instead of the path of a key that there is not; None where there is such a key.

    swept: values of all paths, which may name another strategy, or type of tool, with keys of its own.
    """
    known = _known(job, swept)
    return None if path in known else nearest(path, known)


def changed(job: Job, changes: Mapping[str, Any]) -> tuple[Job, dict[str, Any] | None]:
    """Return the job with other values, and the tables of its machine file; None where that stays.

    changes: by the paths of keys that there are. Raises JobError, or MachineError where the file cannot be read or a
    value is of the wrong kind.
    """
    own = {path: value for path, value in changes.items() if not _is_of_machine(path)}
    job = job.with_(**own) if own else job
    rest = {path: value for path, value in changes.items() if path not in own}
    if not rest:
        return job, None
    content = machine_content(job)
    for path, value in rest.items():
        _, table, key = path.split(".")
        content.setdefault(table, {})[key] = value
    try:
        MachineTables.model_validate(content, context={"legs": legs_of(content)})
    except ValidationError as error:
        _, details = problem_of(error, MachineTables, lambda _: None)
        details["key"] = f"{MACHINE}.{details['key']}"
        raise MachineError(**details) from error
    except InputError as error:
        raise MachineError(error.what, key=f"{MACHINE}.{error.key}", value=error.value) from error
    return job, content


def _is_of_machine(path: str) -> bool:
    return path.startswith(f"{MACHINE}.") and path.count(".") > 1


def _known(job: Job, swept: Mapping[str, Sequence[Any]]) -> set[str]:
    """Return the paths of all keys of a job and of its machine."""
    strategies = {str(name) for name in (job.toolpath.strategy, *swept.get("toolpath.strategy", ()))}
    tools = {str(name) for name in (job.tool.type, *swept.get("tool.type", ()))}
    found: set[str] = set()
    for table in JobTables.model_fields:
        for strategy in strategies:
            for tool in tools:
                try:
                    keys = table_model(table, strategy, tool).model_fields
                except (InputError, KeyError):  # told with the value
                    continue
                found |= {f"{table}.{key}" for key in keys}
    family = str(machine_content(job).get("geometry", {}).get("family", "quadratic"))
    for table, field in MachineTables.model_fields.items():
        model: Any = FAMILIES.find(family).table if table == "geometry" else field.annotation
        keys = cast("Mapping[str, Any]", getattr(model, "model_fields", {}))
        found |= {f"{MACHINE}.{table}.{key}" for key in keys}
    return found
