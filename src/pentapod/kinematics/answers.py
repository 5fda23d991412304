"""What proofs about intervals of a motion answer: proven, refuted or undecided, and bounds."""

from __future__ import annotations

from dataclasses import dataclass

from pentapod.base.arrays import Bools, Floats
from pentapod.base.values import Value


class Answers:
    """proven (N,) and refuted (N,): which intervals are proven to have a property, and which proven not to have it."""

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
class BranchProof(Value, Answers):
    """Whether a motion stays in its branch, on N intervals.

    doubt (N, 2): first and last time in [0, 1] of the part that is not proven, NaN where all is. lower (N, B): proven
    lower bounds of the measures that the robot's `proven_measures` name, not positive where nothing is proven.
    """

    proven: Bools
    refuted: Bools
    doubt: Floats
    lower: Floats


@dataclass(frozen=True)
class ProvenMeasure(Value):
    """A measure whose sign the branch keeps, bounded from below by a proof.

    name: of the claim, "" where it is the only one. unit: of what is told. scale: from the bound to that unit; for
    "deg" the bound is an angle's sine. meaning, method: as a user reads them.
    """

    name: str
    unit: str
    scale: float
    meaning: str
    method: str


@dataclass(frozen=True, eq=False)
class Chords(Value):
    """What is proven of H chords, for all times t in [0, 1] of each, and for A points p + arm · i of the line.

    proven (H,): on the whole chord the legs give one continuous motion in the component.
    away (H, A): the point is nowhere farther than this from its own straight line at the same time, metres.
    turned (H,): the angle in radians between the line's direction and x̃'s is nowhere larger.
    speeds (H, A): the point is nowhere faster, metres per duration of the chord.
    base_cosines (H, 5): the cosine of the angle between each leg (base → platform) and a given direction is nowhere
    less. platform_cosines (H, 5, 2): that of each leg and the line's direction i is nowhere less, nor more.
    Infinite, or −1 and 1, where nothing is proven.
    """

    proven: Bools
    away: Floats
    turned: Floats
    speeds: Floats
    base_cosines: Floats
    platform_cosines: Floats
