"""What proofs about intervals of a motion have in common: three answers for each interval."""

from __future__ import annotations

from pentapod.base.arrays import Bools


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
