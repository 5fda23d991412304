"""Outcome: the results of a run, stage by stage with wall times, and the verdict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Self, TypeVar

from pentapod.base.refusal import Refusal
from pentapod.base.values import Result, Value
from pentapod.job.schema.job import Job
from pentapod.machine.machine import Machine
from pentapod.planning.placement.placed_path import PlacedPath
from pentapod.program.program import Program
from pentapod.toolpath.linking.partition import Piece
from pentapod.verify.claims.pieces import WHOLE
from pentapod.verify.verdict.sources import UNTOLD, Sources
from pentapod.verify.verdict.verdict import Certificate, Place, Verdict

T = TypeVar("T")


@dataclass(frozen=True)
class Stage(Value):
    """A stage that ran: its name, wall time in seconds, result, and a text about it.

    A value that is a tuple is several values of one stage.
    """

    name: str
    seconds: float
    value: Any
    said: str = ""


@dataclass(frozen=True)
class Outcome(Result):
    """The results of a run. stages: in the order of the flow; a refusal is the last one.

    machine: with the job's own tool length and controller settings.
    """

    summary = ("passed", "refusal")

    job: Job
    machine: Machine
    stages: tuple[Stage, ...]
    verdict: Verdict

    def find(self, kind: type[T]) -> T | None:
        """Return the value of this type, or None where no stage gave one."""
        for stage in self.stages:
            for value in stage.value if isinstance(stage.value, tuple) else (stage.value,):
                if isinstance(value, kind):
                    return value
        return None

    @property
    def refusal(self) -> Refusal | None:
        """The reason why the job cannot be done; None where a program was made."""
        return self.find(Refusal)

    @property
    def passed(self) -> bool:
        """True when there is a program and every claim about it holds."""
        return self.refusal is None and self.verdict.passed

    def unwrap(self) -> Self:
        """Return the outcome itself. Raises RefusalError where the job cannot be done."""
        if self.refusal is not None:
            self.refusal.unwrap()
        return self

    def to_dict(self) -> dict[str, Any]:
        """Return the content of verdict.json, with the refusal or the set-ups where there are any."""
        content = self.verdict.to_dict()
        if self.refusal is not None:
            content["refusal"] = refusal_dict(self.refusal)
        if (setups := self.find(SetUps)) is not None:
            content["setups"] = [part.to_dict() for part in setups.parts]
        return content


@dataclass(frozen=True)
class SetUp(Value):
    """One of several set-ups: its number from 1, its piece of the toolpath, and the outcome of its run."""

    number: int
    piece: Piece
    outcome: Outcome

    @staticmethod
    def folder_of(number: int) -> str:
        """Return the name of the folder of a set-up's files, within the job's."""
        return f"setup-{number}"

    @property
    def folder(self) -> str:
        """The folder of its files, within the job's."""
        return self.folder_of(self.number)

    @property
    def answer(self) -> str:
        """The verdict in a word."""
        return "passed" if self.outcome.passed else "refused" if self.outcome.refusal else "FAILED"

    @property
    def margin(self) -> float | None:
        """The smallest margin of its placement; None where it has none."""
        placed = self.outcome.find(PlacedPath)
        return None if placed is None else placed.smallest_margin

    @property
    def duration(self) -> float | None:
        """Seconds of its program; None where it has none."""
        program = self.outcome.find(Program)
        return None if program is None else program.duration

    @property
    def seconds(self) -> float:
        """Wall time of its own stages, from its toolpath on."""
        names = [stage.name for stage in self.outcome.stages]
        return sum(stage.seconds for stage in self.outcome.stages[names.index("toolpath") :])

    def to_dict(self) -> dict[str, Any]:
        """Return its entry in verdict.json."""
        return {
            "folder": self.folder,
            "piece": str(self.piece),
            "passed": self.outcome.passed,
            "smallest_margin": self.margin,
            "duration_s": self.duration,
        }


@dataclass(frozen=True)
class SetUps(Value):
    """The set-ups into which a job was split, in their order.

    cuts: how many intervals of the toolpath are cut; missed: how many of them in no set-up, or in more than one. most:
    set-ups that the job allows.
    """

    parts: tuple[SetUp, ...]
    cuts: int
    missed: int
    most: int

    def __str__(self) -> str:
        lines = [f"{len(self.parts)} set-ups, for one placement cannot reach all:"]
        lines += [f"  {part.folder}: {part.piece}, verdict {part.answer}" for part in self.parts]
        return "\n".join(lines)

    @property
    def verdict(self) -> Verdict:
        """All claims about all set-ups, and the claim that together they make every cut once."""
        return setups_verdict(
            [(part.number, part.outcome.verdict) for part in self.parts], self.cuts, self.missed, self.most
        )


def setups_verdict(verdicts: Sequence[tuple[int, Verdict]], cuts: int, missed: int, most: int) -> Verdict:
    """Return the verdict on all set-ups, and that together they make every cut once; most: set-ups that the job allows.

    Its sources name no program: each set-up's verdict names its own.
    """
    words = (
        f"{cuts} intervals between waypoints are cut; the set-ups' pieces were counted against them; {len(verdicts)} "
        f"set-ups, at most {most} are allowed"
    )
    whole = Certificate(WHOLE, missed == 0 and len(verdicts) <= most, missed, 0.0, "", Place(), words)
    parts = [(f"set-up {number}: ", verdict) for number, verdict in verdicts]
    certificates = (replace(c, claim=before + c.claim) for before, verdict in parts for c in verdict.certificates)
    unjudged = (replace(n, claim=before + n.claim) for before, verdict in parts for n in verdict.not_judged)
    sources = replace(verdicts[0][1].sources, program=None) if verdicts else UNTOLD
    return Verdict((whole, *certificates), tuple(unjudged), sources)


def refusal_verdict(refusal: Refusal, sources: Sources) -> Verdict:
    """Return the verdict on a job that was refused: each limit in the way is a claim that fails."""
    blames = [
        Certificate(
            claim=blame.constraint,
            passed=False,
            value=blame.shortfall,
            bound=0.0,
            unit=blame.unit,
            where=Place(),
            method=f"{refusal.stage}: shortfall of the best attempt",
        )
        for blame in refusal.diagnosis
    ]
    whole = Certificate("the job can be done", False, None, None, "", Place(), str(refusal))
    return Verdict((whole, *blames), sources=sources)


def refusal_dict(refusal: Refusal) -> dict[str, Any]:
    """Return a refusal as verdict.json tells it."""
    return {
        "stage": refusal.stage,
        "cause": refusal.cause,
        "remedy": refusal.remedy,
        "diagnosis": [
            {
                "constraint": blame.constraint,
                "shortfall": blame.shortfall,
                "unit": blame.unit,
                "waypoints": [list(pair) for pair in blame.waypoints],
            }
            for blame in refusal.diagnosis
        ],
    }
