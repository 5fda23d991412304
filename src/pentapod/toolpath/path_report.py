"""PathReport: lengths, counts and problems of a toolpath."""

from __future__ import annotations

from dataclasses import dataclass

from pentapod.base.values import Value


@dataclass(frozen=True)
class PathReport(Value):
    """What a toolpath came to. Lengths in metres.

    stepover: between passes along the surface, at most; 0 for lines that do not cover it. stay_downs: links on
    the surface; hops: rapids close above the part; retracts: passes reached over the clearance level, the
    first too. travel: distance between the end of each pass and the start of the next, in all; no order has
    less than travel_bound. dropped: passes shorter than asked for, dropped_length their sum. hidden:
    waypoints left out because the part itself lies above them. tight: waypoints where the surface is hollow
    along the pass with a radius below the ball's or the stand-off: a ball gouges there, a beam's tip turns back.
    unproven: rapids for which no way was found that keeps clear with a margin: whether they are clear is for the
    verdict to judge. notes: of the strategy.
    """

    strategy: str
    passes: int
    waypoints: int
    stepover: float
    cut_length: float
    stay_downs: int
    hops: int
    retracts: int
    travel: float
    travel_bound: float
    dropped: int
    dropped_length: float
    hidden: int
    tight: int
    unproven: int
    notes: tuple[str, ...] = ()

    def __str__(self) -> str:
        apart = f", up to {1e3 * self.stepover:.4g} mm apart" if self.stepover else ""
        text = (
            f"{self.strategy}: {self.passes:,} passes{apart}, {self.cut_length:.4g} m of cut, "
            f"{self.waypoints:,} waypoints; {self.stay_downs:,} links on the surface, {self.hops:,} hops, "
            f"{self.retracts:,} by way of the clearance level"
        )
        for note in self.notes:
            text += f"\n  note: {note}"
        if self.dropped:
            text += f"\n  note: {self.dropped:,} short passes dropped, {1e3 * self.dropped_length:.3g} mm in all"
        if self.hidden:
            text += f"\n  note: {self.hidden:,} waypoints left out, the part lies above them"
        if self.tight:
            text += f"\n  problem: at {self.tight:,} waypoints the surface is hollower than the ball or the stand-off"
        if self.unproven:
            text += (
                f"\n  note: {self.unproven:,} rapids pass the part closely; the verdict judges whether they are clear"
            )
        return text
