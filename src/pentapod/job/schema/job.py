"""Job: what a job file says, checked, with its paths resolved and its digest."""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Container, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from typing import Any, cast

from pydantic import BaseModel, ValidationError

from pentapod.base.errors import JobError, nearest
from pentapod.base.tables import TomlTable, problem_of
from pentapod.base.toml import line_of, parsed, read_toml
from pentapod.base.units import from_si
from pentapod.base.values import Value
from pentapod.cutters.registry import CUTTERS
from pentapod.job.schema.strategies import file_keys, job_strategies, strategy_table
from pentapod.job.schema.tables import JobTables, table_model
from pentapod.mesh.io.registry import MESH_FORMATS
from pentapod.toolpath.options import SHORTEST_M, SHORTEST_STEPOVERS

_VARIABLE = re.compile(r"\$\{(\w+)\}")
Content = Mapping[str, Any]

LATER_KEYS = (
    ("output", "compensation"), ("tolerance", "deflection_mm"), ("placement", "weight_stiffness"),
    ("placement", "table_turn_deg"), ("part", "least_body_mm"),
)  # fmt: skip
"""Keys that a job of an earlier version does not have; left out, they are not in its digest."""


class _TableOf:
    """Attribute of a job: its table of that name."""

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def __get__(self, job: Job | None, owner: type) -> TomlTable:
        return cast(TomlTable, self if job is None else getattr(job.tables, self.name))


@dataclass(frozen=True)
class Job(Value):
    """Content of a job file. Values are as in the file; each table has them in SI units as well: `job.feed.si.cut`.

    path: the job file; for a job from values, a name in its folder. mesh_path, fixture_mesh, machine_file and files (by
    their keys in [toolpath]): resolved against its folder. from_file: whether the job is that of its file. asked: the
    job as its file says it, where this one is another way to do it; its digest counts.

    >>> job = Job.load("job.toml")
    >>> slower = job.with_(**{"feed.cut_mm_min": 1200})
    >>> job.feed.cut_mm_min, slower.feed.si.cut
    (1500.0, 0.02)
    """

    summary = ("path",)

    path: Path
    tables: TomlTable
    mesh_path: Path
    machine_file: Path | None
    files: dict[str, Path] = field(default_factory=dict[str, Path])
    fixture_mesh: Path | None = None
    from_file: bool = field(default=True, compare=False)
    asked: Job | None = field(default=None, compare=False)

    part = _TableOf()
    machine = _TableOf()
    tool = _TableOf()
    toolpath = _TableOf()
    axis = _TableOf()
    gouge = _TableOf()
    feed = _TableOf()
    tolerance = _TableOf()
    placement = _TableOf()
    fixture = _TableOf()
    process = _TableOf()
    output = _TableOf()
    limits = _TableOf()
    verify = _TableOf()

    @classmethod
    def load(cls, path: str | Path) -> Job:
        """Return the job of a TOML file. Raises JobError: one line with file, key, value and remedy."""
        path = Path(path)
        if path.suffix.lower().removeprefix(".") in MESH_FORMATS:
            remedy = f"`pentapod new {path.name}` writes a job for it"
            raise JobError("this is a mesh, not a job", file=path, expected="a job file in TOML", remedy=remedy)
        text = read_toml(path, "job", JobError, start='"pentapod new DIR" writes one to start from')
        return cls._of(parsed(text, path, JobError), path, text)

    @classmethod
    def from_dict(cls, content: Content, folder: str | Path = ".") -> Job:
        """Return the job of nested values: tables of keys, as in a job file, `{"feed": {"cut_mm_min": 1500}, ...}`.

        folder: of relative paths. Lists, tuples and arrays may be used for lists, paths for texts. The job and its
        digest are those of a file with the same values. Raises JobError as `load`, without a line.
        """
        return cls._of(content, Path(folder) / "job.toml", None)

    def with_(self, **changes: Any) -> Job:
        """Return the job with other values; all else stays.

        Tables of keys, `job.with_(feed={"cut_mm_min": 1200}, tolerance={"path_mm": 0.05})`, or keys with their table,
        `job.with_(**{"feed.cut_mm_min": 1200})`. None removes the key, so that its default holds. Raises JobError as
        `from_dict`.
        """
        content = self.tables.model_dump(exclude_unset=True)
        for name, value in changes.items():
            table, _, key = name.partition(".")
            old = content.get(table, {})
            if key or isinstance(value, Mapping):
                new = {**old, **({key: value} if key else cast(Content, value))}
                content[table] = {key: value for key, value in new.items() if value is not None}
            else:
                content[table] = value
        return self._of({name: table for name, table in content.items() if table is not None}, self.path, None)

    @classmethod
    def _of(cls, content: Content, path: Path, text: str | None) -> Job:
        """Return the job of parsed content. text: of the file, for the lines in messages; None: there is no file."""
        try:
            tables = JobTables.model_validate(_plain(content))
        except ValidationError as error:
            where, details = _problem(error, content)
            raise _error(path, text, where, **details) from error
        resolve = partial(_resolve, path, text)
        fixture, machine = tables.fixture.mesh, tables.machine.file
        names = {key: getattr(tables.toolpath, key) for key in file_keys(tables.toolpath.strategy)}
        job = cls(
            path,
            tables,
            resolve(("part", "mesh"), tables.part.mesh),
            None if machine is None else resolve(("machine", "file"), machine),
            {key: resolve(("toolpath", key), name) for key, name in names.items() if name is not None},
            None if fixture is None else resolve(("fixture", "mesh"), fixture),
            from_file=text is not None,
        )
        job._check_names()
        return job

    def _check_names(self) -> None:
        """Raise JobError where [verify] waives a claim, or [limits] uses a limit, that does not exist."""
        if self.verify.waive:  # most jobs waive nothing, and the import is slow
            from pentapod.verify.judge import CLAIM_NAMES  # noqa: PLC0415

            for name in self.verify.waive:
                if name not in CLAIM_NAMES:
                    raise self.error("verify", "waive", "no such claim", value=name, remedy=nearest(name, CLAIM_NAMES))
        if self.limits.use:
            from pentapod.planning.limits.margins import LIMITS  # noqa: PLC0415
            from pentapod.timing.limits.limits import PLUGGED  # noqa: PLC0415

            known = sorted({*LIMITS.added, *PLUGGED.added})
            for name in self.limits.use:
                if name not in known:
                    listed = ", ".join(known) or "none"
                    raise self.error("limits", "use", "no such limit", value=name, remedy=f"installed: {listed}")

    @cached_property
    def digest(self) -> str:
        """16 hexadecimal digits over the meaning of the job: defaults filled in, files by their bytes.

        Comments, order of keys and folders of files do not change it; nor do [verify] and the stock, which do not
        affect the program.
        """
        if self.asked is not None:
            return self.asked.digest
        content = self.tables.model_dump(mode="json", exclude={"verify"})
        if not self.limits.use:
            del content["limits"]
        if not self.feed.cutting_force_n:
            del content["feed"]["cutting_force_n"]
        if all(value is None for value in content["process"].values()):
            del content["process"]
        for table, key in LATER_KEYS:
            if content[table][key] is None:
                del content[table][key]
        lines, usual = content["toolpath"], from_si(SHORTEST_M, "mm")
        stepover = lines.get("stepover_mm")
        usually = stepover is None or SHORTEST_STEPOVERS * stepover >= usual
        if usually and lines.get("shortest_mm", usual) is None:
            lines["shortest_mm"] = usual  # as in the digests of earlier versions, of whatever stepover
        del content["part"]["stock_mm"]
        if not self.part.flip:
            del content["part"]["flip"]
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

    @property
    def named_files(self) -> tuple[tuple[str, str, Path], ...]:
        """Table, key and path of each file that the job names."""
        found = [("part", "mesh", self.mesh_path), *(("toolpath", key, path) for key, path in self.files.items())]
        found += [] if self.machine_file is None else [("machine", "file", self.machine_file)]
        found += [] if self.fixture_mesh is None else [("fixture", "mesh", self.fixture_mesh)]
        return tuple(found)

    def error(self, table: str, key: str, what: str, **details: Any) -> JobError:
        """Return the JobError about a key of this job that is found with the mesh or the machine."""
        text = None
        if self.from_file:
            with suppress(OSError, UnicodeDecodeError):  # the file may have changed: then the line is left out
                text = self.path.read_text(encoding="utf-8-sig")
        details = {"value": getattr(getattr(self.tables, table), key), **details}
        file = self.path if self.from_file else None
        line = line_of(text, (table, key)) if text is not None else None
        return JobError(what, file=file, line=line, key=f"{table}.{key}", **details)


def _sha(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _plain(value: Any) -> Any:
    """Return content with lists and arrays as tuples, for the strict tables, and paths as texts."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in cast(Content, value).items()}
    if isinstance(value, list | tuple):
        return tuple(_plain(item) for item in cast(list[Any], value))
    return os.fspath(cast(Any, value)) if isinstance(value, os.PathLike) else value


def _error(path: Path, text: str | None, where: tuple[str, ...], what: str, **details: Any) -> JobError:
    """Return an error about a place in a job; text: of its file, None where it comes from values."""
    if text is None:
        return JobError(what, **details)
    return JobError(what, file=path, line=line_of(text, where), **details)


def _resolve(job: Path, text: str | None, where: tuple[str, str], name: str) -> Path:
    """Return the file that a key names. Raises JobError: a variable is not set, or there is no readable file."""

    def wrong(what: str, **details: Any) -> JobError:
        return _error(job, text, where, what, key=".".join(where), value=name, **details)

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


def _problem(error: ValidationError, content: Content) -> tuple[tuple[str, ...], dict[str, Any]]:
    """Return the place of the first error, and its message."""

    def named(table: str, key: str, known: Container[str], usual: str) -> str:
        given = content.get(table)
        name = cast(Content, given).get(key) if isinstance(given, Mapping) else None
        return name if isinstance(name, str) and name in known else usual

    strategy, tool = named("toolpath", "strategy", job_strategies(), "raster"), named("tool", "type", CUTTERS, "ball")

    def model(name: str) -> type[BaseModel] | None:
        return table_model(name, strategy, tool) if name in JobTables.model_fields else None

    where, details = problem_of(error, JobTables, model)
    if details["what"] == "unknown key" and len(where) == 2 and where[0] == "toolpath":
        every = {key for name in job_strategies() for key in strategy_table(name).model_fields}
        if where[1] in every:
            known = ", ".join(sorted(strategy_table(strategy).model_fields))
            details["what"], details["remedy"] = (
                f'the strategy "{strategy}" has no such key', f"take it out; known: {known}",
            )  # fmt: skip
    return where, details
