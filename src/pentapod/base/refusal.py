"""Refusal: a task that cannot be done, with cause, waypoints, shortfalls and advice. RefusalError raises it."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import wraps
from typing import Any, Concatenate, Never, ParamSpec, Protocol, TypeVar, cast, overload

from pentapod.base.errors import PentapodError
from pentapod.base.values import Value

Given_contra = TypeVar("Given_contra", contravariant=True)
Answer_co = TypeVar("Answer_co", covariant=True)
Options = ParamSpec("Options")


@dataclass(frozen=True)
class Shortfall(Value):
    """One constraint that cannot be met, the waypoints where, and the shortfall.

    constraint: a name a user knows, "leg 2 too long". waypoints: inclusive index ranges into the
    toolpath's waypoints. shortfall: of the best attempt, in `unit` (mm, deg, ...); 0 where it is unknown.
    """

    constraint: str
    waypoints: tuple[tuple[int, int], ...]
    shortfall: float
    unit: str

    def __str__(self) -> str:
        ranges = ", ".join(f"{a}-{b}" if b > a else f"{a}" for a, b in self.waypoints[:4])
        more = ", ..." if len(self.waypoints) > 4 else ""
        amount = f" by {self.shortfall:.3g} {self.unit}" if self.shortfall else ""
        return f"{self.constraint}{amount} at waypoints {ranges}{more}"


@dataclass(frozen=True)
class Change(Value):
    """One key of a job and its new value, as in the file; None takes the key out."""

    table: str
    key: str
    value: Any


LITTLE_MARGIN = 0.05
"""Smallest margin of a plan below which advice says that there is little to spare."""


@dataclass(frozen=True)
class Advice(Value):
    """Changes of a job with which it was planned, and its verdict passed.

    words: what they do. kept: share of the area that the job asked for, 0 to 1. whole: False where the part itself
    becomes another, by its scale or unit. margin: the smallest of the plan, 0 at a limit; None where it is unknown.
    """

    changes: tuple[Change, ...]
    words: str
    kept: float
    whole: bool = True
    margin: float | None = None

    @property
    def tables(self) -> dict[str, dict[str, Any]]:
        """The changes by table and key, as `Job.with_` takes them."""
        found: dict[str, dict[str, Any]] = {}
        for change in self.changes:
            found.setdefault(change.table, {})[change.key] = change.value
        return found

    @property
    def toml(self) -> str:
        """The changes in TOML, to be put into the tables of the job file."""
        lines: list[str] = []
        for table, keys in self.tables.items():
            lines.append(f"[{table}]")
            lines += [f"{key} = {_toml(value)}" for key, value in keys.items() if value is not None]
            lines += [f"# take out {key}" for key, value in keys.items() if value is None]
        return "\n".join(lines)

    @property
    def keeps(self) -> str:
        """What is kept, in words."""
        share = "all" if self.kept > 0.9995 else f"{100.0 * self.kept:.{3 if self.kept > 0.99 else 2}g} %"
        return f"{share} of the area" + ("" if self.whole else ", of another part")

    def __str__(self) -> str:
        scant = self.margin is not None and self.margin < LITTLE_MARGIN
        told = f"; little to spare: its smallest margin is {self.margin:.2g}, 0 is a limit" if scant else ""
        return f"{self.words} (keeps {self.keeps}{told})"

    def to_dict(self) -> dict[str, Any]:
        """Return its entry in verdict.json."""
        return {
            "words": self.words,
            "changes": self.tables,
            "kept": self.kept,
            "whole": self.whole,
            "margin": self.margin,
            "toml": self.toml,
        }


def _toml(value: Any) -> str:
    """Return a value in TOML: the spelling of texts, numbers, truth values and lists is that of JSON."""
    return json.dumps(value, ensure_ascii=False)


@dataclass(frozen=True)
class Refusal(Value):
    """Result of a stage that cannot do its task. stage: "placement", "timing", ...; cause: one sentence.

    advice: changes of the job that were planned, and passed, the best first (`job.run`). Later stages return
    a refusal unchanged, so a chain of stages needs one `unwrap` at its end.

    >>> answer = Refusal("timing", "the motion comes to a standstill", remedy="Look at segment 4")
    >>> print(answer)
    timing: the motion comes to a standstill. Look at segment 4
    """

    stage: str
    cause: str
    diagnosis: tuple[Shortfall, ...] = ()
    remedy: str = ""
    advice: tuple[Advice, ...] = ()

    def __str__(self) -> str:
        text = f"{self.stage}: {self.cause}"
        if self.diagnosis:
            text += ": " + "; ".join(str(item) for item in self.diagnosis[:3])
            text += f"; and {len(self.diagnosis) - 3} more limits" if len(self.diagnosis) > 3 else ""
        return text + (f". {self.remedy}" if self.remedy else "")

    def with_advice(self, advice: tuple[Advice, ...], sentence: str) -> Refusal:
        """Return the refusal with advice, and a sentence about it, without its point, after its own remedy."""
        return replace(self, advice=advice, remedy=". ".join(text for text in (self.remedy, sentence) if text))

    def unwrap(self) -> Never:
        """Raise RefusalError with this refusal; a result of a stage returns itself instead."""
        raise RefusalError(self)


class RefusalError(PentapodError):
    """A stage refused, and `unwrap` was called on its answer; `refusal` is that answer.

    >>> try:
    ...     Refusal("timing", "the motion comes to a standstill").unwrap()
    ... except RefusalError as error:
    ...     print(error.refusal.stage)
    timing
    """

    def __init__(self, refusal: Refusal) -> None:
        super().__init__(str(refusal))
        self.refusal = refusal

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.refusal,)


class StageFunction(Protocol[Given_contra, Options, Answer_co]):
    """A stage that returns a refusal of the stage before it unchanged."""

    @overload
    def __call__(self, given: Given_contra, /, *args: Options.args, **options: Options.kwargs) -> Answer_co: ...
    @overload
    def __call__(self, given: Refusal, /, *args: Options.args, **options: Options.kwargs) -> Refusal: ...


def stage(
    function: Callable[Concatenate[Given_contra, Options], Answer_co],
) -> StageFunction[Given_contra, Options, Answer_co]:
    """Decorate a stage: if its first argument is a `Refusal`, it is returned and the stage does not run."""

    @wraps(function)
    def passed(*args: Any, **options: Any) -> Any:
        return args[0] if args and isinstance(args[0], Refusal) else function(*args, **options)

    return cast("StageFunction[Given_contra, Options, Answer_co]", passed)
