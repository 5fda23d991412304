"""Claim: a named function that judges a replay."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pentapod.base.values import Value
from pentapod.verify.replay.replay import Replay
from pentapod.verify.verdict.verdict import Certificate, Place

ALLOWANCE = 1e-3
"""Relative tolerance on deviations, feeds, leg rates and accelerations: for rounding, and limits met exactly."""

MM = 1e3  # in a metre: verdicts are in millimetres
DEG = 180.0 / np.pi  # in a radian
TOLERATED = f"{ALLOWANCE:.1%} more is tolerated"


def with_allowance(bound: float) -> float:
    """Return the largest value that passes where `bound` should not be exceeded."""
    return bound * (1.0 + ALLOWANCE)


@dataclass(frozen=True)
class Finding:
    """The answer of a claim: a certificate without its name. at_least: whether the bound is a lower one."""

    passed: bool
    value: float | None
    bound: float | None
    unit: str
    where: Place
    method: str
    allowed: float | None = None
    at_least: bool = False

    @classmethod
    def without_value(cls, passed: bool, method: str, where: Place | None = None) -> Finding:
        """Return the finding of a claim that compares no numbers."""
        return cls(passed, None, None, "", where or Place(), method)

    @classmethod
    def at_most(
        cls,
        value: float,
        limit: float,
        scale: float,
        unit: str,
        where: Place,
        method: str,
        allowed: float | None = None,
    ) -> Finding:
        """Return whether a value is at most `allowed`, by default the limit with its allowance.

        All three are SI; scale: how many `unit` make one of SI.
        """
        most = with_allowance(limit) if allowed is None else allowed
        return cls(value <= most, scale * value, scale * limit, unit, where, method, scale * most)


@dataclass(frozen=True)
class Idle:
    """A claim was not judged, and why. unknown: it should have been; a verdict passes then only if that is waived.

    A claim that does not apply to the program (unknown is False) is listed in a strict verdict only.
    """

    why: str
    unknown: bool = False


@dataclass(frozen=True)
class Claim(Value):
    """name: as the verdict lists it. judge: from a replay to a finding, or to why there is none.

    needs_pose: the claim needs a pose at every sample; where the leg lengths have none it fails without being judged.
    needs_proof: its value is a bound for all times, which needs a proof of the motion between the samples; where there
    is none it is undecided, and fails.
    """

    name: str
    judge: Callable[[Replay], Finding | Idle]
    needs_pose: bool = True
    needs_proof: bool = False

    def __call__(self, replay: Replay) -> Certificate | Idle:
        """Return the certificate of this claim, or why there is none."""
        if self.needs_pose and len(samples := replay.unposed):
            why = f"not judged: the leg lengths have no pose at {len(samples)} of the samples"
            found = Finding.without_value(False, why, replay.place(int(samples[0])))
        elif self.needs_proof and len(chords := replay.interval_bounds.unproven):
            why = f"undecided: too near a singularity to prove the motion on {len(chords)} half periods"
            found = Finding.without_value(False, why, replay.place(int(chords[0])))
        else:
            found = self.judge(replay)
        if isinstance(found, Idle):
            return found
        value, bound, allowed = _plain(found.value), _plain(found.bound), _plain(found.allowed)
        numbers = value, bound, found.unit, found.where, found.method, allowed
        return Certificate(self.name, bool(found.passed), *numbers, at_least=found.at_least)

    def inapplicable(self, idle: Idle) -> Certificate:
        """Return the certificate of a strict verdict for a claim that does not apply."""
        return Certificate(self.name, True, None, None, "", Place(), f"does not apply: {idle.why}")


def _plain(number: float | None) -> float | None:
    """Return a plain float to 12 digits, so that 15 deg is not 14.999999999999998; None for NaN and infinities."""
    return None if number is None or not np.isfinite(number) else float(f"{number:.12g}")
