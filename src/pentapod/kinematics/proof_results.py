"""Results of proofs about the intervals of a motion: proven, refuted or undecided, with bounds."""

from __future__ import annotations

from dataclasses import dataclass

from pentapod.base.arrays import Bools, Floats
from pentapod.base.values import Value


class ProofResult:
    """Which intervals are proven (N,) to have a property, and which are refuted (N,): proven not to have it."""

    proven: Bools
    refuted: Bools

    @property
    def undecided(self) -> Bools:
        """Which intervals (N,) are neither proven nor refuted."""
        return ~(self.proven | self.refuted)

    @property
    def holds(self) -> bool:
        """Whether every interval is proven."""
        return bool(self.proven.all())


@dataclass(frozen=True, eq=False)
class BranchProof(Value, ProofResult):
    """Whether a motion stays in its branch, on N intervals.

    doubt (N, 2): first and last time in [0, 1] of the part that is not proven, NaN where all is. lower (N, B): proven
    lower bounds of the robot's `proven_measures`, not positive where nothing is proven.
    """

    proven: Bools
    refuted: Bools
    doubt: Floats
    lower: Floats


@dataclass(frozen=True)
class ProvenMeasure(Value):
    """A measure whose sign the branch keeps, bounded from below by a proof.

    name: of the claim, "" where it is the only one. unit: in which it is reported. scale: from the bound to that unit;
    for "deg" the bound is an angle's sine. meaning, method: texts for the user.
    """

    name: str
    unit: str
    scale: float
    meaning: str
    method: str


@dataclass(frozen=True, eq=False)
class Chords(Value):
    """Bounds for all times t in [0, 1] of H chords, and for A points p + offset · i of the line.

    The chord is the straight line between the poses at its ends. proven (H,): on all of it the legs give one continuous
    motion in the component.
    deviations (H, A): upper bounds of the point's distance from its own straight line at the same time, metres.
    angles (H,): upper bounds of the angle between the line's direction and that on the chord, radians.
    speeds (H, A): upper bounds of the point's speed, metres per duration of the chord.
    base_cosines (H, 5): lower bounds of the cosine between each leg (base → platform) and its base axis.
    platform_cosines (H, 5, 2): lower and upper bounds of the cosine between each leg and the line's direction i.
    beside (H,): upper bounds of how far platform joints beside the line get from where they are at the chord's start,
    metres; 0 where there are none.
    Infinite, or −1 and 1, where nothing is proven.
    """

    proven: Bools
    deviations: Floats
    angles: Floats
    speeds: Floats
    base_cosines: Floats
    platform_cosines: Floats
    beside: Floats | float = 0.0
