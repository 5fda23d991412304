"""PathReport: lengths, counts and problems of a toolpath."""

from __future__ import annotations

from dataclasses import dataclass

from pentapod.base.values import Value
from pentapod.geometry.polyline import arc_length
from pentapod.toolpath.toolpath import SegmentKind, Toolpath


@dataclass(frozen=True)
class PathReport(Value):
    """Lengths, counts and problems of a toolpath. Lengths in metres.

    stepover: largest distance between passes along the surface; 0 for lines that do not cover it. stay_downs: links on
    the surface; hops: rapids just above the part; retracts: passes reached by a rapid at the clearance height, with the
    first. travel: total distance between the end of each pass and the start of the next; travel_bound: lower bound of
    it for any order. dropped: passes that are too short; dropped_length: their total length. hidden: waypoints left out
    because the part lies above them. tight: waypoints where the concave radius of the surface along the pass is below
    the ball's radius or the stand-off: a ball gouges there, a beam's tip moves backwards. notes: of the strategy.
    Whether links and rapids are clear of the part is told by the gouge check, which knows the final axes.
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
    notes: tuple[str, ...] = ()

    def __str__(self) -> str:
        stepover = f", up to {1e3 * self.stepover:.4g} mm apart" if self.stepover else ""
        text = (
            f"{self.strategy}: {self.passes:,} passes{stepover}, {self.cut_length:.4g} m along the surface; "
            f"passes reached: {self.stay_downs:,} on the surface, {self.hops:,} by hops, {self.retracts:,} at the "
            "clearance height"
        )
        for note in self.notes:
            text += f"\n  note: {note}"
        if self.dropped:
            text += f"\n  note: {self.dropped:,} short passes dropped, {1e3 * self.dropped_length:.3g} mm in all"
        if self.hidden:
            text += f"\n  note: {self.hidden:,} waypoints left out, the part lies above them"
        if self.tight:
            text += f"\n  problem: at {self.tight:,} waypoints the concave radius is below the ball's or the stand-off"
        return text


def totals(toolpath: Toolpath) -> str:
    """Return how many waypoints a toolpath has, and how far its tip moves on cuts, links and rapids."""
    parts = {kind: [s for s in toolpath.segments if s.kind is kind] for kind in SegmentKind}
    texts = [
        f"{len(own):,} {kind}{'s' if len(own) > 1 else ''} of {sum(float(arc_length(s.tips)[-1]) for s in own):.4g} m"
        for kind, own in parts.items()
        if own
    ]
    return f"toolpath: {len(toolpath):,} waypoints; the tip moves along {', '.join(texts)}"
