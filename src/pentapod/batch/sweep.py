"""Sweep files: which keys of a job, or of its machine, take which values; each combination is a task."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, NoReturn, cast

import numpy as np
from pydantic import Field, ValidationError

from pentapod.base.errors import InputError
from pentapod.base.tables import TomlTable, problem_of
from pentapod.base.toml import line_of, parsed, read_toml
from pentapod.base.values import Value
from pentapod.batch.changes import changed, unknown
from pentapod.batch.jobs import job_task
from pentapod.batch.tasks.engine import OPTIONS
from pentapod.batch.tasks.store import Store
from pentapod.batch.tasks.task import Task
from pentapod.job.schema.job import Job

RANGE = {"from", "to", "steps"}
DIGITS = 6
"""Significant digits of a value within a range."""


class SweepTables(TomlTable):
    """A sweep file."""

    job: str | None = Field(default=None, description="job file, relative to this file")
    jobs: tuple[str, ...] = Field(default=(), description="several job files; the sweep is made with each")
    combine: Literal["product", "zip", "sample"] = Field(
        default="product",
        description='"product": every combination; "zip": first values together, second ones, and so on; "sample": '
        "points of a Sobol sequence",
    )
    samples: Annotated[int, Field(ge=1)] | None = Field(
        default=None, description='how many points, with combine = "sample"; a power of 2 spreads them best'
    )
    seed: Annotated[int, Field(ge=0)] = Field(default=0, description="another number gives another sample")
    sweep: dict[str, Any] = Field(
        description="values by the path of a key of the job, or of its machine with `machine.` before it: a list, or "
        "{ from = 190, to = 206, steps = 5 }; in a sample without steps"
    )


@dataclass(frozen=True)
class Sweep(Value):
    """A sweep file. jobs: those that are changed; changes: of each task, by the path of the key.

    >>> sweep = Sweep.load("sweep.toml")
    >>> [dict(change) for change in sweep.changes]
    [{'axis.tilt_deg': 8}, {'axis.tilt_deg': 15}]
    """

    path: Path
    jobs: tuple[Job, ...]
    changes: tuple[Mapping[str, Any], ...]
    text: str

    @classmethod
    def load(cls, path: str | Path, most: int = OPTIONS.most) -> Sweep:
        """Return the sweep of a TOML file. most: largest number of tasks.

        Raises InputError: one line with file, key, value and remedy.
        """
        path = Path(path)
        text = read_toml(path, "sweep", InputError)
        content = parsed(text, path, InputError)
        try:
            tables: Any = SweepTables.model_validate({key: _tuples(value) for key, value in content.items()})
        except ValidationError as error:
            where, details = problem_of(error, SweepTables, lambda _: None)
            raise InputError(file=path, line=line_of(text, where), **details) from error
        names = tables.jobs if tables.job is None else (tables.job, *tables.jobs)
        if not names:
            raise InputError("the key is missing", file=path, key="job", expected="the job file that is changed")
        sweep = _Reader(path, text, tables)
        jobs = tuple(Job.load(path.parent / name) for name in names)
        changes = tuple(sweep.changes(jobs, most))
        return cls(path, jobs, changes, text)

    @property
    def keys(self) -> tuple[str, ...]:
        """Paths of the keys that are changed, in the order of the file."""
        return tuple(self.changes[0])

    def tasks(self, store: Store) -> list[Task]:
        """Return the tasks: each job with each of the changes. Raises InputError where one makes no job or machine."""
        found: list[Task] = []
        for job in self.jobs:
            for change in self.changes:
                try:
                    new, machine = changed(job, change)
                except InputError as error:
                    raise self._of_combination(error, change) from error
                found.append(job_task(new, store, change, machine))
        return found

    def _of_combination(self, error: InputError, change: Mapping[str, Any]) -> InputError:
        """Return the error about one combination of values."""
        line = _line(self.text, error.key) if error.key in change else None
        others = [f"{key} = {value!r}" for key, value in change.items() if key != error.key]
        remedy = "; ".join(part for part in (error.remedy, f"with {', '.join(others)}" if others else None) if part)
        return InputError(
            error.what, file=self.path, line=line, key=error.key, value=error.value, expected=error.expected,
            remedy=remedy or None,
        )  # fmt: skip


class _Reader:
    """Values of a sweep file, combined."""

    def __init__(self, path: Path, text: str, tables: Any) -> None:
        self._path, self._text, self._tables = path, text, tables

    def changes(self, jobs: tuple[Job, ...], most: int) -> Iterator[dict[str, Any]]:
        """Yield the changes of each task of one job."""
        given = dict(_flat(self._tables.sweep))
        if not given:
            self._wrong(None, "no key is swept", expected='"tool.length_mm" = [190, 198], for example')
        for key in given:
            for job in jobs:
                lists = {path: value if isinstance(value, tuple) else () for path, value in given.items()}
                if (remedy := unknown(key, job, lists)) is not None:
                    self._wrong(key, "no such key of the job or its machine", remedy=remedy)
        if self._tables.combine == "sample":
            rows = self._sampled(given, most // len(jobs))
        else:
            values = {key: self._values(key, value, most) for key, value in given.items()}
            rows = self._product(values, len(jobs), most) if self._tables.combine == "product" else self._zip(values)
        yield from (dict(zip(given, row, strict=True)) for row in rows)

    def _product(self, values: Mapping[str, tuple[Any, ...]], jobs: int, most: int) -> Iterator[tuple[Any, ...]]:
        count = jobs * math.prod(len(each) for each in values.values())
        if count > most:
            self._wrong(None, "too many tasks", value=count, expected=f"at most {most}", remedy='combine = "sample"')
        return itertools.product(*values.values())

    def _zip(self, values: Mapping[str, tuple[Any, ...]]) -> Iterator[tuple[Any, ...]]:
        counts = {key: len(each) for key, each in values.items()}
        first = next(iter(counts))
        for key, count in counts.items():
            if count != counts[first]:
                expected = f'{counts[first]} values, as many as "{first}" has'
                self._wrong(key, 'lists of combine = "zip" have one length', value=count, expected=expected)
        return zip(*values.values(), strict=True)

    def _sampled(self, given: Mapping[str, Any], most: int) -> Iterator[tuple[Any, ...]]:
        from scipy.stats import qmc  # noqa: PLC0415  slow, and only for samples

        count = self._tables.samples
        if count is None or count > most:
            self._wrong(None, "how many points the sample has", "samples", value=count, expected=f"1 to {most}")
        points = qmc.Sobol(len(given), scramble=False).random_base2(max(1, math.ceil(math.log2(count))))[:count]
        shift = np.random.default_rng(self._tables.seed).random(len(given))
        for point in ((points + shift) % 1.0).tolist():
            yield tuple(self._drawn(key, value, x) for (key, value), x in zip(given.items(), point, strict=True))

    def _drawn(self, key: str, value: Any, x: float) -> Any:
        """Return the value at x in [0, 1) of a list or a range."""
        if isinstance(value, tuple):
            self._values(key, value, len(cast("tuple[Any, ...]", value)))
            return value[int(x * len(cast("tuple[Any, ...]", value)))]
        low, high = self._ends(key, value, steps=False)
        return _rounded(low + x * (high - low))

    def _values(self, key: str, value: Any, most: int) -> tuple[Any, ...]:
        if isinstance(value, tuple):
            found = cast("tuple[Any, ...]", value)
            if not found:
                self._wrong(key, "the list is empty", expected="at least one value")
            return found
        low, high = self._ends(key, value, steps=True)
        steps = value["steps"]
        if not isinstance(steps, int) or not 2 <= steps <= most:
            self._wrong(key, "steps is out of range", value=steps, expected=f"a whole number, 2 to {most}")
        whole = isinstance(low, int) and isinstance(high, int) and (high - low) % (steps - 1) == 0
        if whole:
            return tuple(range(int(low), int(high) + (1 if high > low else -1), int(high - low) // (steps - 1) or 1))
        return tuple(_rounded(low + (high - low) * k / (steps - 1)) for k in range(steps))

    def _ends(self, key: str, value: Any, *, steps: bool) -> tuple[float, float]:
        wanted = RANGE if steps else RANGE - {"steps"}
        if not isinstance(value, Mapping) or set(cast("Mapping[str, Any]", value)) != wanted:
            shape = "{ from = 190, to = 206, steps = 5 }" if steps else "{ from = 190, to = 206 }"
            self._wrong(key, "no values to take", value=value, expected=f"a list, or {shape}")
        low, high = value["from"], value["to"]
        numbers = [isinstance(end, int | float) and not isinstance(end, bool) for end in (low, high)]
        if not all(numbers) or not math.isfinite(high - low) or high == low:
            self._wrong(key, "not a range", value=dict(value), expected="from and to: two numbers that differ")
        return low, high

    def _wrong(self, key: str | None, what: str, own: str = "", **details: Any) -> NoReturn:
        """Raise the error about the path of a key that is swept, or a key of the file's own."""
        line = line_of(self._text, (own,)) if own else _line(self._text, key)
        raise InputError(what, file=self._path, line=line, key=own or key or "sweep", **details)


def _line(text: str, key: str | None) -> int | None:
    """Return the line of the path of a key: for messages, so a plain search is enough."""
    quoted = rf'\s*["\']?{re.escape(key)}["\']?\s*=' if key else r"\s*\[sweep\]"
    return next((number for number, line in enumerate(text.splitlines(), 1) if re.match(quoted, line)), None)


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def _flat(tables: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Yield values by the path of their key, whether it is in quotes (one key) or not (tables in tables)."""
    for key, value in tables.items():
        if isinstance(value, Mapping) and not RANGE & set(cast("Mapping[str, Any]", value)):
            yield from _flat(cast("Mapping[str, Any]", value), f"{before}{key}.")
        else:
            yield f"{before}{key}", value


def _tuples(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _tuples(item) for key, item in cast("Mapping[str, Any]", value).items()}
    return tuple(_tuples(item) for item in cast("list[Any]", value)) if isinstance(value, list) else value
