"""What cannot be done, as a value: the cause, where on the path, and by how much."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Blame:
    """One constraint that cannot be met, the waypoints where, and the shortfall.

    constraint: a name a user knows, "leg 2 too long". waypoints: inclusive index ranges into the
    toolpath's waypoints. shortfall: how far beyond the limit the best attempt is, in `unit` (mm, deg, ...); 0 where
    no attempt can be measured.
    """

    constraint: str
    waypoints: tuple[tuple[int, int], ...]
    shortfall: float
    unit: str

    def __str__(self) -> str:
        ranges = ", ".join(f"{a}-{b}" if b > a else f"{a}" for a, b in self.waypoints[:4])
        more = ", ..." if len(self.waypoints) > 4 else ""
        amount = f" by {self.shortfall:.3g} {self.unit}" if self.shortfall else ""
        return f"{self.constraint}{amount} at waypoints {ranges}{more}"


@dataclass(frozen=True)
class Refusal:
    """A stage's answer when it cannot be done. stage: "placement", "timing", ...; cause: one sentence."""

    stage: str
    cause: str
    blames: tuple[Blame, ...] = ()
    remedy: str = ""

    def __str__(self) -> str:
        text = f"{self.stage}: {self.cause}"
        if self.blames:
            text += ": " + "; ".join(str(blame) for blame in self.blames[:3])
            text += f"; and {len(self.blames) - 3} more limits" if len(self.blames) > 3 else ""
        return text + (f". {self.remedy}" if self.remedy else "")
