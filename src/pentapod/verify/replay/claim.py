"""Claim: a named function that judges a replay."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pentapod.base.values import Value
from pentapod.verify.replay.replay import Replay
from pentapod.verify.verdict.verdict import Certificate, Place

ALLOWANCE = 1e-3
"""Relative allowance on deviations, feeds, leg rates and accelerations: rounding, and limits met exactly."""

MM = 1e3  # in a metre: verdicts are told in millimetres


def with_allowance(bound: float) -> float:
    """Return up to where a value passes that should not exceed a bound."""
    return bound * (1.0 + ALLOWANCE)


@dataclass(frozen=True)
class Finding:
    """What a claim found: a certificate without its name."""

    passed: bool
    value: float | None
    bound: float | None
    unit: str
    where: Place
    method: str
    allowed: float | None = None


@dataclass(frozen=True)
class Idle:
    """A claim was not judged, and why. unknown: it should have been; a verdict passes then only if that is waived.

    A claim that does not apply to the program (unknown is False) is not listed, but for a strict verdict.
    """

    why: str
    unknown: bool = False


@dataclass(frozen=True)
class Claim(Value):
    """name as a user reads it; judge returns what it found, or that there is nothing to judge.

    needs_pose: the claim means something only where the leg lengths have a pose at every sample; it fails
    without being judged where they have none. needs_proof: its value is a bound for all times, which exists only where
    the motion between the samples is proven; else it is undecided, and fails.
    """

    name: str
    judge: Callable[[Replay], Finding | Idle]
    needs_pose: bool = True
    needs_proof: bool = False

    def __call__(self, replay: Replay) -> Certificate | Idle:
        """Return the certificate of this claim, or why there is none."""
        if self.needs_pose and len(replay.unposed):
            first = int(replay.unposed[0])
            method = f"not judged: the leg lengths have no pose at {len(replay.unposed)} of the samples"
            return Certificate(self.name, False, None, None, "", replay.place(first), method)
        if self.needs_proof and len(unproven := replay.interval_bounds.unproven):
            first, count = int(unproven[0]), len(unproven)
            method = f"undecided: too near a singularity to prove where the motion goes on {count} half periods"
            return Certificate(self.name, False, None, None, "", replay.place(first), method)
        found = self.judge(replay)
        if isinstance(found, Idle):
            return found
        value, bound, allowed = _plain(found.value), _plain(found.bound), _plain(found.allowed)
        return Certificate(self.name, bool(found.passed), value, bound, found.unit, found.where, found.method, allowed)

    def inapplicable(self, idle: Idle) -> Certificate:
        """Return the certificate that stands in a strict verdict where the claim does not apply."""
        return Certificate(self.name, True, None, None, "", Place(), f"does not apply: {idle.why}")


def _plain(number: float | None) -> float | None:
    """Return a plain float to 12 digits: 15 deg is not 14.999999999999998. What is no number has no value."""
    return None if number is None or not np.isfinite(number) else float(f"{number:.12g}")
