"""Outcome: results of a run, stage by stage with wall times, and the verdict; set-ups and refusals as verdicts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Self, TypeVar

from pentapod.base.refusal import Refusal
from pentapod.base.values import Result, Value
from pentapod.job.schema.job import Job
from pentapod.job.stage_runner import Stage
from pentapod.machine.machine import Machine
from pentapod.planning.placement.placed_path import PlacedPath
from pentapod.program.program import Program
from pentapod.toolpath.linking.partition import Piece
from pentapod.verify.claims.set_up import WHOLE
from pentapod.verify.verdict.verdict import NO_SOURCES, Certificate, Place, Sources, Verdict

T = TypeVar("T")


@dataclass(frozen=True)
class Outcome(Result):
    """Results of a run. stages: in the order of the flow; only the search for advice comes after a refusal.

    machine: with the job's tool length and controller settings.

    >>> outcome.find(Program).duration == outcome.find(Trajectory).duration
    True
    """

    summary = ("passed", "refusal")

    job: Job
    machine: Machine
    stages: tuple[Stage, ...]
    verdict: Verdict

    def find(self, kind: type[T]) -> T | None:
        """Return the first value of this type; None where there is none."""
        for stage in self.stages:
            for value in stage.value if isinstance(stage.value, tuple) else (stage.value,):
                if isinstance(value, kind):
                    return value
        return None

    @property
    def refusal(self) -> Refusal | None:
        """The refusal of a job that cannot be done; None where there is a program."""
        return self.find(Refusal)

    @property
    def passed(self) -> bool:
        """Whether there is a program and every claim about it holds."""
        return self.refusal is None and self.verdict.passed

    @property
    def margin(self) -> float | None:
        """The smallest margin of its placement, or of its set-ups; None where it has none."""
        placed, split = self.find(PlacedPath), self.find(SetUps)
        if split is not None:
            return min((part.margin for part in split.parts if part.margin is not None), default=None)
        return None if placed is None else placed.smallest_margin

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
        """Return the name of a set-up's folder."""
        return f"setup-{number}"

    @property
    def folder(self) -> str:
        """Name of its folder."""
        return self.folder_of(self.number)

    @property
    def answer(self) -> str:
        """The verdict in a word."""
        return "passed" if self.outcome.passed else "refused" if self.outcome.refusal else "FAILED"

    @property
    def margin(self) -> float | None:
        """The smallest margin of its placement; None where it has none."""
        return self.outcome.margin

    @property
    def duration(self) -> float | None:
        """Seconds of its program; None where it has none."""
        program = self.outcome.find(Program)
        return None if program is None else program.duration

    @property
    def seconds(self) -> float:
        """Wall time of its stages from the toolpath on."""
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
    """The set-ups of a job, in their order.

    cuts: number of cut intervals of the toolpath; missed: number of those in no set-up, or in more than one. most:
    number of set-ups that the job allows.
    """

    parts: tuple[SetUp, ...]
    cuts: int
    missed: int
    most: int

    def __str__(self) -> str:
        lines = [f"{len(self.parts)} set-ups, because one placement cannot reach the whole path:"]
        lines += [f"  {part.folder}: {part.piece}, verdict {part.answer}" for part in self.parts]
        return "\n".join(lines)

    @property
    def verdict(self) -> Verdict:
        """All claims about all set-ups, and that together they make every cut once."""
        return setups_verdict(
            [(part.number, part.outcome.verdict) for part in self.parts], self.cuts, self.missed, self.most
        )


def setups_verdict(verdicts: Sequence[tuple[int, Verdict]], cuts: int, missed: int, most: int) -> Verdict:
    """Return the verdict on all set-ups, and that together they make every cut once; arguments as in `SetUps`.

    Its sources name no program; the verdict of each set-up does.
    """
    words = (
        f"{cuts} cut intervals between waypoints, counted in the set-ups' pieces; {len(verdicts)} set-ups, at most "
        f"{most} are allowed"
    )
    whole = Certificate(WHOLE, missed == 0 and len(verdicts) <= most, missed, 0.0, "", Place(), words)
    parts = [(f"set-up {number}: ", verdict) for number, verdict in verdicts]
    certificates = (replace(c, claim=before + c.claim) for before, verdict in parts for c in verdict.certificates)
    unjudged = (replace(n, claim=before + n.claim) for before, verdict in parts for n in verdict.not_judged)
    sources = replace(verdicts[0][1].sources, program=None, way_in=None, way_out=None) if verdicts else NO_SOURCES
    return Verdict((whole, *certificates), tuple(unjudged), sources)


def refusal_verdict(refusal: Refusal, sources: Sources) -> Verdict:
    """Return the verdict on a refused job: each exceeded limit is a claim that fails."""
    limits = [
        Certificate(
            claim=shortfall.constraint,
            passed=False,
            value=shortfall.shortfall,
            bound=0.0,
            unit=shortfall.unit,
            where=Place(),
            method=f"{refusal.stage}: shortfall of the best attempt",
        )
        for shortfall in refusal.diagnosis
    ]
    whole = Certificate("the job can be done", False, None, None, "", Place(), str(refusal))
    return Verdict((whole, *limits), sources=sources)


def refusal_dict(refusal: Refusal) -> dict[str, Any]:
    """Return a refusal as in verdict.json."""
    return {
        "stage": refusal.stage,
        "cause": refusal.cause,
        "remedy": refusal.remedy,
        "advice": [each.to_dict() for each in refusal.advice],
        "diagnosis": [
            {
                "constraint": shortfall.constraint,
                "shortfall": shortfall.shortfall,
                "unit": shortfall.unit,
                "waypoints": [list(pair) for pair in shortfall.waypoints],
            }
            for shortfall in refusal.diagnosis
        ],
    }
