"""Certificate: one judged claim about a program. Verdict: all certificates of a program, and the answer."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

from pentapod.base.display import html_table, load_extra
from pentapod.base.values import Result, Value
from pentapod.base.version import __version__, library_versions, processor_kind
from pentapod.verify.verdict.material_left import MaterialLeft

_COLUMNS = ["claim", "answer", "value", "bound", "unit", "time_s", "row", "segment", "method"]
_SHOWN = 12


@dataclass(frozen=True)
class Sources(Value):
    """SHA-256 of each file that a verdict is about, as hex digits; None where there is none, or it is not known.

    machine: of the machine's file, also of one that is shipped. calibration: of the file that it names. fixture: of
    its mesh. toolpath_file and toolpath_curve: what the job's [toolpath] names (a drawing, points, a picture, a
    toolpath; a guide curve). way_in, way_out: of the ways from the machine's park pose and back, where it has one.
    """

    program: str | None = None
    job: str | None = None
    machine: str | None = None
    calibration: str | None = None
    mesh: str | None = None
    fixture: str | None = None
    stock: str | None = None
    toolpath_file: str | None = None
    toolpath_curve: str | None = None
    way_in: str | None = None
    way_out: str | None = None

    def to_dict(self) -> dict[str, str | None]:
        """Return its entry in verdict.json; the ways are named where they were judged."""
        return {key: value for key, value in asdict(self).items() if value is not None or not key.startswith("way_")}


NO_SOURCES = Sources()
"""Where no file is known."""


@dataclass(frozen=True)
class Place(Value):
    """Where in the program a claim is closest to its bound: seconds, row (0-based), toolpath segment."""

    time_s: float | None = None
    row: int | None = None
    segment: int | None = None


@dataclass(frozen=True)
class Certificate(Value):
    """One claim: what was measured, what it must not exceed (or fall below), where, and by which method.

    unit: as in files, mm, deg, mm/s, …. method: how the value was computed, and what it covers (at the rows or between
    them, proven or sampled). allowed: largest value that passes although it is beyond its bound, for the reason in
    `method`; None where there is no such tolerance. at_least: whether the bound is a lower one.

    >>> claim = verdict.certificates[0]
    >>> claim.claim, claim.passed
    ('machine', True)
    """

    summary = ("claim", "passed")

    claim: str
    passed: bool
    value: float | None
    bound: float | None
    unit: str
    where: Place
    method: str
    allowed: float | None = None
    at_least: bool = False

    @property
    def sense(self) -> str:
        """On which side of the bound the value may be: "at most" or "at least"."""
        return "at least" if self.at_least else "at most"

    @property
    def is_lenient(self) -> bool:
        """Whether the value is beyond its bound, but within what is allowed."""
        if self.value is None or self.bound is None or self.allowed is None or not self.passed:
            return False
        return self.bound < self.value <= self.allowed


@dataclass(frozen=True)
class NotJudged(Value):
    """A claim that the job needs but that could not be judged, and why. waived: the job does not ask for it.

    >>> verdict.not_judged[0].waived
    False
    """

    summary = ("claim", "waived")

    claim: str
    why: str
    waived: bool = False


@dataclass(frozen=True)
class Verdict(Result):
    """All certificates of a program, the claims that were not judged, and the files that it is about.

    springs: digest of the stiffness and the masses by which the program is compensated; "" where it is not. left: what
    the cutter leaves on the surface; None for beams, and where no surface is given.

    >>> [claim.claim for claim in verdict.certificates if not claim.passed]
    []
    """

    summary = ("answer",)

    certificates: tuple[Certificate, ...]
    not_judged: tuple[NotJudged, ...] = ()
    sources: Sources = NO_SOURCES
    springs: str = ""
    left: MaterialLeft | None = field(default=None, compare=False, repr=False)

    @property
    def passed(self) -> bool:
        """Whether there is a claim, all claims hold, and those that were not judged are waived."""
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

    def to_frame(self) -> Any:
        """Return a pandas DataFrame, a row for each claim. Raises InputError where pandas is not installed.

        Columns: claim, answer ("holds", "fails", "not judged" or "waived"), value, bound, unit, time_s, row, segment,
        method.
        """
        pandas = load_extra("pandas", "pandas", "frames need pandas", key="to_frame")
        entries = [
            {"claim": c.claim, "answer": "holds" if c.passed else "fails", "value": c.value, "bound": c.bound}
            | {"unit": c.unit, **asdict(c.where), "method": c.method}
            for c in self.certificates
        ]
        entries += [
            {"claim": n.claim, "answer": "waived" if n.waived else "not judged", "method": n.why}
            for n in self.not_judged
        ]
        return pandas.DataFrame(entries, columns=_COLUMNS)

    def _repr_html_(self) -> str:
        """Return the HTML for notebooks: the answer, what failed or was not judged, and how many claims hold."""
        failed = [(c.claim, "fails", _measured(c), c.method) for c in self.certificates if not c.passed]
        open_ = [(n.claim, "waived" if n.waived else "not judged", "", n.why) for n in self.not_judged]
        rows = failed + open_
        head = ("claim", "answer", "value, bound", "how, why") if rows else ()
        hold = f"{len(self.certificates) - len(failed)} of {len(self.certificates)} claims hold"
        more = f"; {len(rows) - _SHOWN} rows are left out" if len(rows) > _SHOWN else ""
        return html_table(f"Verdict: {self.answer}; {hold}{more}", rows[:_SHOWN], head)

    def to_dict(self) -> dict[str, Any]:
        """Return the content of verdict.json."""
        return {
            "passed": self.passed,
            "certificates": [asdict(c) for c in self.certificates],
            "not_judged": [asdict(entry) for entry in self.not_judged],
            "sha256": self.sources.to_dict(),
            **({"springs": self.springs} if self.springs else {}),
            "judged_by": {
                "pentapod": __version__,
                "libraries": library_versions(),
                "processor": processor_kind(),
            },
        }


def _measured(claim: Certificate) -> str:
    numbers = [f"{number:.4g} {claim.unit}".strip() for number in (claim.value, claim.bound) if number is not None]
    return ", ".join(numbers)
