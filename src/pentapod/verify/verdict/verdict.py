"""Certificate: one claim about a program, judged. Verdict: all of them, and the answer."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from pentapod.base.values import Result, Value
from pentapod.base.version import __version__, library_versions, processor_kind
from pentapod.verify.verdict.sources import UNTOLD, Sources


@dataclass(frozen=True)
class Place(Value):
    """Where in the program a claim is closest to its bound: seconds, row (0-based), toolpath segment."""

    time_s: float | None = None
    row: int | None = None
    segment: int | None = None


@dataclass(frozen=True)
class Certificate(Value):
    """One claim: what was measured, what it must not exceed (or fall below), where, and by which method.

    unit is as in files: mm, deg, mm/s, ...; method says in words how value was computed, and what it
    covers (at the rows, between the rows, proven or sampled). allowed: up to where a value beyond its bound passes all
    the same, for the reason that method gives; None where it does not.
    """

    claim: str
    passed: bool
    value: float | None
    bound: float | None
    unit: str
    where: Place
    method: str
    allowed: float | None = None

    @property
    def is_lenient(self) -> bool:
        """Whether the value is beyond its bound, and passed by what is allowed."""
        if self.value is None or self.bound is None or self.allowed is None or not self.passed:
            return False
        return self.bound < self.value <= self.allowed


@dataclass(frozen=True)
class NotJudged(Value):
    """A claim that the job implies and that could not be judged, and why. waived: the job lets it go unjudged."""

    claim: str
    why: str
    waived: bool = False


@dataclass(frozen=True)
class Verdict(Result):
    """All certificates of a program, what was not judged, and the files that it is about.

    passed: there is at least one claim, every claim holds, and what was not judged is waived.
    """

    certificates: tuple[Certificate, ...]
    not_judged: tuple[NotJudged, ...] = ()
    sources: Sources = UNTOLD

    @property
    def passed(self) -> bool:
        """Whether the program is as the job asks, as far as nobody waived it."""
        judged = bool(self.certificates) and all(c.passed for c in self.certificates)
        return judged and all(entry.waived for entry in self.not_judged)

    @property
    def answer(self) -> str:
        """The verdict in words: passed or not, and how many claims failed, were not judged, or were waived."""
        failed = sum(not c.passed for c in self.certificates)
        waived = sum(entry.waived for entry in self.not_judged)
        counts = [f"{failed} of {len(self.certificates)} claims"] if failed else []
        counts += [f"{len(self.not_judged) - waived} not judged"] if waived < len(self.not_judged) else []
        counts += [f"{waived} waived"] if waived else []
        if not self.passed:
            return f"FAILED: {', '.join(counts) or 'there is no claim'}"
        return f"passed ({', '.join(counts)})" if counts else "passed"

    def to_dict(self) -> dict[str, Any]:
        """Return the content of verdict.json."""
        return {
            "passed": self.passed,
            "certificates": [asdict(c) for c in self.certificates],
            "not_judged": [asdict(entry) for entry in self.not_judged],
            "sha256": asdict(self.sources),
            "judged_by": {
                "pentapod": __version__,
                "libraries": library_versions(),
                "processor": processor_kind(),
            },
        }
