"""Claim: a named function that judges a replay."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pentapod.verify.replay import Replay
from pentapod.verify.verdict import Certificate, Place

ALLOWANCE = 1e-3
"""Relative allowance on deviations and feeds, for rounding and for the place where a feed changes."""
LIMIT_ALLOWANCE = 1e-2
"""Relative allowance on leg rates and accelerations: what a time law keeps between its gridpoints."""


@dataclass(frozen=True)
class Finding:
    """What a claim found: a certificate without its name."""

    passed: bool
    value: float | None
    bound: float | None
    unit: str
    where: Place
    method: str


@dataclass(frozen=True)
class Claim:
    """name as a user reads it; judge returns None where the claim does not apply.

    needs_pose: the claim means something only where the leg lengths have a pose at every sample; it fails
    without being judged where they have none.
    """

    name: str
    judge: Callable[[Replay], Finding | None]
    needs_pose: bool = True

    def __call__(self, replay: Replay) -> Certificate | None:
        """Return the certificate of this claim, or None where it does not apply."""
        if self.needs_pose and len(replay.unposed):
            first = int(replay.unposed[0])
            method = f"not judged: the leg lengths have no pose at {len(replay.unposed)} of the samples"
            return Certificate(self.name, False, None, None, "", replay.place(first), method)
        found = self.judge(replay)
        if found is None:
            return None
        # Plain numbers, as the verdict's file wants them; what is not a number has no value.
        value, bound = (None if x is None or not np.isfinite(x) else float(x) for x in (found.value, found.bound))
        return Certificate(self.name, bool(found.passed), value, bound, found.unit, found.where, found.method)
