"""Certificate: one claim about a program, judged. Verdict: all of them, and the answer."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class Place:
    """Where in the program a claim is closest to its bound: seconds, row (0-based), toolpath segment."""

    time_s: float | None = None
    row: int | None = None
    segment: int | None = None


@dataclass(frozen=True)
class Certificate:
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
class Verdict:
    """All certificates of a program; passed when each of them is."""

    certificates: tuple[Certificate, ...]

    @property
    def passed(self) -> bool:
        """True when there is at least one claim and every claim holds."""
        return bool(self.certificates) and all(c.passed for c in self.certificates)

    def to_dict(self) -> dict[str, Any]:
        """Return the content of verdict.json."""
        return {"passed": self.passed, "certificates": [asdict(c) for c in self.certificates]}
