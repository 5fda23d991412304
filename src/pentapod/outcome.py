"""Outcome: what a run reached: the value of each stage with its time, and the verdict."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeVar

from pentapod.job import Job
from pentapod.machine.machine import Machine
from pentapod.refusal import Refusal
from pentapod.verify.verdict import Certificate, Place, Verdict

Value = TypeVar("Value")


@dataclass(frozen=True)
class Stage:
    """One stage that ran: its name, its wall time in seconds, the value that it gave, and what it says of it.

    A value that is a tuple is several values of one stage.
    """

    name: str
    seconds: float
    value: Any
    said: str = ""


@dataclass(frozen=True)
class Outcome:
    """What a run reached. stages: in the order of the flow, as far as it came; a refusal ends it.

    machine: with the job's own tool length and controller settings.
    """

    job: Job
    machine: Machine
    stages: tuple[Stage, ...]
    verdict: Verdict

    def find(self, kind: type[Value]) -> Value | None:
        """Return the value of this type, or None where no stage gave one."""
        for stage in self.stages:
            for value in stage.value if isinstance(stage.value, tuple) else (stage.value,):
                if isinstance(value, kind):
                    return value
        return None

    @property
    def refusal(self) -> Refusal | None:
        """Why the job cannot be done; None where a program was made."""
        return self.find(Refusal)

    @property
    def passed(self) -> bool:
        """True when there is a program and every claim about it holds."""
        return self.refusal is None and self.verdict.passed

    def to_dict(self) -> dict[str, Any]:
        """Return the content of verdict.json; a refused job's has the key "refusal" besides."""
        content = self.verdict.to_dict()
        if self.refusal is not None:
            content["refusal"] = refusal_dict(self.refusal)
        return content


def refusal_verdict(refusal: Refusal) -> Verdict:
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
        for blame in refusal.blames
    ]
    whole = Certificate("the job can be done", False, None, None, "", Place(), str(refusal))
    return Verdict((whole, *blames))


def refusal_dict(refusal: Refusal) -> dict[str, Any]:
    """Return a refusal as verdict.json tells it."""
    return {
        "stage": refusal.stage,
        "cause": refusal.cause,
        "remedy": refusal.remedy,
        "blames": [
            {
                "constraint": blame.constraint,
                "shortfall": blame.shortfall,
                "unit": blame.unit,
                "waypoints": [list(pair) for pair in blame.waypoints],
            }
            for blame in refusal.blames
        ],
    }
