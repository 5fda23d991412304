"""Leg strokes: no leg shorter or longer than its drive allows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pentapod.planning.limits.limit import LengthLimit, Scene
from pentapod.planning.limits.tool_pose import ToolPose


@dataclass(frozen=True, kw_only=True)
class LegStroke(LengthLimit):
    """One end of the stroke of one leg. length: metres at that end; half a stroke counts as margin 1."""

    leg: int
    length: float
    longest: bool

    @classmethod
    def of(cls, scene: Scene) -> list[LegStroke]:
        """Return the lower ends of all legs, then the upper ones."""
        legs = scene.machine.legs
        half = (0.5 * (legs.max_length - legs.min_length)).tolist()
        return [
            cls(
                name=f"leg {k + 1} too {'long' if longest else 'short'}", group="strokes",
                leg=k, length=length, longest=longest, comfort=half[k],
            )
            for longest, lengths in ((False, legs.min_length), (True, legs.max_length))
            for k, length in enumerate(lengths.tolist())
        ]  # fmt: skip

    def margin(self, pose: ToolPose) -> Any:
        """Return the share of half a stroke that is left."""
        length = pose.readings[self.leg]
        return (self.length - length if self.longest else length - self.length) / self.comfort
