"""Job: what a job file says, checked, with its paths resolved and its digest."""

from __future__ import annotations

import hashlib
import json
import os
import re
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, cast

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from pentapod.base.errors import JobError, nearest
from pentapod.base.toml import first_of, line_of, parsed, read_toml, wrong_value
from pentapod.base.values import Value
from pentapod.job.schema.placement import FixtureTable, PlacementTable
from pentapod.job.schema.strategies import FILE_KEYS, TABLES, ToolpathTable
from pentapod.job.schema.tables import (
    AxisTable,
    FeedTable,
    GougeTable,
    JobTables,
    MachineTable,
    OutputTable,
    PartTable,
    ToleranceTable,
    ToolTable,
    VerifyTable,
)

_VARIABLE = re.compile(r"\$\{(\w+)\}")


@dataclass(frozen=True)
class Job(Value):
    """What a job file says. Units are as in the file; `pentapod.job.build.values` and its neighbours turn them into SI.

    path: the job file. mesh_path, fixture_mesh, machine_file and files, by their keys in [toolpath]: resolved against
    the job file's folder.
    """

    path: Path
    tables: JobTables
    mesh_path: Path
    machine_file: Path | None
    files: dict[str, Path] = field(default_factory=dict[str, Path])
    fixture_mesh: Path | None = None

    @classmethod
    def load(cls, path: str | Path) -> Job:
        """Return the job of a TOML file. Raises JobError: one line with file, key, value and remedy."""
        path = Path(path)
        text = read_toml(path, "job", JobError, start='"pentapod new DIR" writes one to start from')
        content = parsed(text, path, JobError)
        try:
            tables = JobTables.model_validate(_tuples(content))
        except ValidationError as error:
            raise _job_error(path, text, error) from error
        mesh = _resolve(path, text, ("part", "mesh"), tables.part.mesh)
        named = tables.machine.file
        machine = None if named is None else _resolve(path, text, ("machine", "file"), named)
        names = {key: getattr(tables.toolpath, key, None) for key in FILE_KEYS}
        files = {key: _resolve(path, text, ("toolpath", key), name) for key, name in names.items() if name is not None}
        held = tables.fixture.mesh
        fixture = None if held is None else _resolve(path, text, ("fixture", "mesh"), held)
        job = cls(path, tables, mesh, machine, files, fixture)
        job._check_waived()
        return job

    def _check_waived(self) -> None:
        """Raise JobError where [verify] waives a claim that does not exist."""
        if not self.verify.waive:
            return
        from pentapod.verify.judge import CLAIM_NAMES  # noqa: PLC0415  most jobs waive nothing, and it is heavy

        for name in self.verify.waive:
            if name not in CLAIM_NAMES:
                raise self.error("verify", "waive", "no such claim", remedy=nearest(name, CLAIM_NAMES))

    @property
    def part(self) -> PartTable:
        """The table [part]."""
        return self.tables.part

    @property
    def machine(self) -> MachineTable:
        """The table [machine]."""
        return self.tables.machine

    @property
    def tool(self) -> ToolTable:
        """The table [tool]."""
        return self.tables.tool

    @property
    def toolpath(self) -> ToolpathTable:
        """The table [toolpath]."""
        return self.tables.toolpath

    def file(self, key: str) -> Path:
        """Return the file that a key of [toolpath] names."""
        return self.files[key]

    @property
    def axis(self) -> AxisTable:
        """The table [axis]."""
        return self.tables.axis

    @property
    def gouge(self) -> GougeTable:
        """The table [gouge]."""
        return self.tables.gouge

    @property
    def feed(self) -> FeedTable:
        """The table [feed]."""
        return self.tables.feed

    @property
    def tolerance(self) -> ToleranceTable:
        """The table [tolerance]."""
        return self.tables.tolerance

    @property
    def placement(self) -> PlacementTable:
        """The table [placement]."""
        return self.tables.placement

    @property
    def fixture(self) -> FixtureTable:
        """The table [fixture]."""
        return self.tables.fixture

    @property
    def output(self) -> OutputTable:
        """The table [output]."""
        return self.tables.output

    @property
    def verify(self) -> VerifyTable:
        """The table [verify]."""
        return self.tables.verify

    @cached_property
    def digest(self) -> str:
        """16 hexadecimal digits over the meaning of the job: defaults filled in, files by their bytes.

        Comments, the order of keys and the folders where files lie do not change it; nor does [verify], which says
        nothing of the program.
        """
        content = self.tables.model_dump(mode="json", exclude={"verify"})
        content["part"]["mesh"] = [self.mesh_path.suffix.lower(), _sha(self.mesh_path)]
        if self.machine_file is not None:
            content["machine"]["file"] = _sha(self.machine_file)
        if self.fixture_mesh is None:
            del content["fixture"]
        else:
            content["fixture"]["mesh"] = [self.fixture_mesh.suffix.lower(), _sha(self.fixture_mesh)]
        for key, file in self.files.items():
            content["toolpath"][key] = [file.suffix.lower(), _sha(file)]
        canonical = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
        return hashlib.sha256(canonical.encode()).hexdigest()[:16]

    def error(self, table: str, key: str, what: str, **details: Any) -> JobError:
        """Return the JobError about a key of this job that only shows once the mesh or machine is known."""
        value, line = getattr(getattr(self.tables, table), key), None
        with suppress(OSError, UnicodeDecodeError):  # the file may have changed since: then its line is left out
            line = line_of(self.path.read_text(encoding="utf-8-sig"), (table, key))
        return JobError(what, file=self.path, line=line, key=f"{table}.{key}", value=value, **details)


def _sha(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _tuples(value: Any) -> Any:
    """Return TOML content with its arrays as tuples, which is what the strict tables take."""
    if isinstance(value, dict):
        return {key: _tuples(item) for key, item in cast(dict[str, Any], value).items()}
    if isinstance(value, list):
        return tuple(_tuples(item) for item in cast(list[Any], value))
    return value


def _resolve(job: Path, text: str, where: tuple[str, str], name: str) -> Path:
    """Return the file that a key names. Raises JobError where a variable is not set or no file can be read there."""
    table, key = where

    def wrong(what: str, **details: Any) -> JobError:
        line = line_of(text, (table, key))
        return JobError(what, file=job, line=line, key=f"{table}.{key}", value=name, **details)

    for variable in _VARIABLE.findall(name):
        if variable not in os.environ:
            raise wrong(f"the environment variable {variable} is not set", remedy=f"set {variable} to a folder")
    path = job.parent / _VARIABLE.sub(lambda match: os.environ[match[1]], name)
    try:
        if not path.is_file():
            what = "is not a file" if path.exists() else "no such file"
            raise wrong(what, expected="a path relative to the job file's folder")
    except OSError as error:  # a name too long, or a folder that may not be searched
        raise wrong(f"cannot be read: {(error.strerror or str(error)).lower()}") from error
    return path


def _job_error(path: Path, text: str, error: ValidationError) -> JobError:
    first = first_of(error)
    place = tuple(str(part) for part in first["loc"])
    # A place within [toolpath] is told with the strategy whose table it is; the file does not nest so.
    strategy = place[1] if len(place) > 1 and place[0] == "toolpath" and place[1] in TABLES else "raster"
    where = (place[0], *place[2:]) if len(place) > 1 and place[:2] == ("toolpath", strategy) else place
    details = _details(first, where, strategy)
    where = (*where, *details.pop("key").split(".")) if "key" in details else where
    key = ".".join(where[:2]) + "".join(f"[{index}]" for index in where[2:])
    return JobError(file=path, line=line_of(text, where), key=key, **details)


def _details(error: ErrorDetails, where: tuple[str, ...], strategy: str) -> dict[str, Any]:
    """Return what, value, expected and remedy of one error of pydantic."""
    context = error.get("ctx", {})
    if error["type"] == "extra_forbidden":
        return _unknown(where, strategy, is_table=isinstance(error["input"], dict))
    if error["type"] == "rule":
        return {"what": context["what"], "expected": context["expected"], "key": context["key"]}
    if error["type"] == "union_tag_invalid":
        tag = str(context["tag"])
        return {"what": "unknown strategy", "value": tag, "remedy": nearest(tag, TABLES), "key": "strategy"}
    if error["type"] == "missing" and len(where) > 2:
        return {"what": "too few numbers", "expected": _description(where, strategy)}
    if error["type"] == "missing":
        kind = "table" if len(where) == 1 else "key"
        return {
            "what": f"the {kind} is missing",
            "expected": _description(where, strategy),
        }
    return wrong_value(error, _description(where, strategy))


def _unknown(where: tuple[str, ...], strategy: str, *, is_table: bool) -> dict[str, Any]:
    """Return what and remedy of a table or key that is not known, or not with this strategy."""
    owner = _model(where[:-1], strategy)
    known = list(owner.model_fields) if owner is not None else []
    if len(where) == 2 and where[0] == "toolpath" and any(where[1] in table.model_fields for table in TABLES.values()):
        rest = ", ".join(sorted(known))
        return {"what": f'the strategy "{strategy}" has no such key', "remedy": f"take it out; known: {rest}"}
    if len(where) == 1 and not is_table:
        keys = [f"{table}.{key}" for table in known for key in getattr(_model((table,), strategy), "model_fields", ())]
        return {"what": "a key outside the tables", "remedy": nearest(where[0], [*known, *keys])}
    return {"what": f"unknown {'table' if len(where) == 1 else 'key'}", "remedy": nearest(where[-1], known)}


def _model(where: tuple[str, ...], strategy: str) -> type[BaseModel] | None:
    """Return the table that a place in the file belongs to."""
    if not where:
        return JobTables
    if where[0] == "toolpath":
        return TABLES[strategy]
    field = JobTables.model_fields.get(where[0])
    return cast("type[BaseModel] | None", field.annotation if field else None)


def _description(where: tuple[str, ...], strategy: str) -> str:
    """Return what the schema says of a key, or of a table what keys it must have."""
    model = _model(where[:1], strategy)
    if model is None:
        return "see the README"
    if len(where) == 1:
        needed = [name for name, field in model.model_fields.items() if field.is_required()]
        return f"[{where[0]}]" + (" with " + ", ".join(needed) if needed else "")
    return model.model_fields[where[1]].description or ""
