"""Numerical continuation of poses while the legs change, proven step by step by tubes (lemma 10 of docs/proofs.md)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeAlias

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.kinematics.tubes.leg_equations import Legs, mids, newton
from pentapod.kinematics.tubes.tube import LegFamily, Tube, error_bound, prove_tube, sensitivity
from pentapod.numerics.balls import Ball

Pose: TypeAlias = tuple[Floats, Floats]
"""Positions and directions, (3, N) each."""


@dataclass(frozen=True)
class ContinuationOptions:
    """Step control.

    shortest: share of the whole way below which a step is given up. attempts: of all steps together, at most. easy: the
    contraction of a tube below which the next step is twice as long.
    """

    shortest: float
    attempts: int = 150
    easy: float = 0.4


class LegHomotopy(Protocol):
    """How the legs of each element of a batch change with s in [0, 1]; all s and h are short binary fractions."""

    def at(self, which: Ints, s: Floats) -> Legs[Ball]:
        """Return the legs of elements `which` (n,) at s (n,), their exact values enclosed."""
        ...

    def over(self, which: Ints, s: Floats, h: Floats) -> LegFamily:
        """Return the legs of elements `which` from s to s + h, (n,) each."""
        ...


@dataclass(frozen=True, eq=False)
class Continuation:
    """How far N poses were continued.

    position, direction (3, N): at s = 1 where proven, else what Newton's method alone found there; NaN for nothing.
    error (N,): how far at most the exact pose at s = 1 is, in the norm of `tube`; NaN where not proven.
    reached (N,): the s up to which the proof goes. step (N,): the length of the step that failed there, 0 for none.
    sensitivity (2, N): the largest of the tubes' `sensitivity` for positions and directions; 0 where there is none.
    """

    position: Floats
    direction: Floats
    error: Floats
    reached: Floats
    step: Floats
    sensitivity: Floats

    @property
    def proven(self) -> Bools:
        """Where the pose was continued to s = 1 (N,)."""
        return np.asarray(self.reached == 1.0)


def continue_poses(
    route: LegHomotopy,
    start: Pose,
    scale: float,
    *,
    end: Pose | None = None,
    admit: Callable[[Pose, Tube], Bools] | None = None,
    options: ContinuationOptions,
) -> Continuation:
    """Continue poses from s = 0 to s = 1 of their routes.

    start: approximate solutions; continued are the exact ones in the first tube around them. end: the approximate
    solutions at s = 1 to which the last tubes lead, by default those of Newton's method. admit: a further condition on
    the poses at the start and their tubes. A step that is not proven is halved, after an easy one the next is doubled.
    """
    n = start[0].shape[-1]
    out, sure = np.full((7, n), np.nan), np.zeros((4, n))
    left = np.flatnonzero(np.isfinite(start[0].sum(axis=0)))
    here, s, h = (start[0][:, left], start[1][:, left]), np.zeros(len(left)), np.ones(len(left))
    speed = (np.zeros_like(here[0]), np.zeros_like(here[1]))
    sure[1] = 1.0
    for attempt in range(options.attempts):
        if not left.size:
            break
        to, legs = s + h, route.at(left, s + h)
        there, settled = _next(here, speed, h, legs, scale)
        if end is not None:
            last = to == 1.0
            there = np.where(last, end[0][:, left], there[0]), np.where(last, end[1][:, left], there[1])
            settled |= last
        family = route.over(left, s, h)
        tube = prove_tube(here, there, family, scale)
        good = settled & tube.proven
        if admit is not None:
            first = s == 0.0
            good[first] &= admit(here, tube)[first]
        if attempt == 0:
            out[:6, left[settled]] = np.concatenate(there)[:, settled]
        done = good & (to == 1.0)
        if done.any():
            out[:6, left[done]] = np.concatenate(there)[:, done]
            out[6, left[done]] = error_bound(tube, there, legs)[done]
        speed = (
            np.where(good, (there[0] - here[0]) / h, speed[0]),
            np.where(good, (there[1] - here[1]) / h, speed[1]),
        )
        here = np.where(good, there[0], here[0]), np.where(good, there[1], here[1])
        s = np.where(good, to, s)
        sure[:2, left] = s, np.where(done, 0.0, h)
        worst = sure[2:, left]
        sure[2:, left] = np.where(good, np.maximum(worst, sensitivity(tube, family, scale)), worst)
        h = np.minimum(h * np.where(~good, 0.5, np.where(tube.contraction < options.easy, 2.0, 1.0)), 1.0 - s)
        keep = ~done & (h >= options.shortest)
        left, s, h = left[keep], s[keep], h[keep]
        here, speed = (here[0][:, keep], here[1][:, keep]), (speed[0][:, keep], speed[1][:, keep])
    return Continuation(out[:3], out[3:6], out[6], sure[0], sure[1], sure[2:])


def _next(here: Pose, speed: Pose, h: Floats, legs: Legs[Ball], scale: float) -> tuple[Pose, Bools]:
    p, i, settled = newton(here[0] + h * speed[0], here[1] + h * speed[1], mids(legs), scale)
    return (p, i), settled
