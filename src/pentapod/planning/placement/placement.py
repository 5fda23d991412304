"""Placement: where the workpiece stands in the machine."""

from __future__ import annotations

from dataclasses import dataclass

from pentapod.base.values import Value
from pentapod.geometry.rigid import RigidTransform


@dataclass(frozen=True)
class Placement(Value):
    """Rigid transform workpiece → machine, and what it was chosen by ("job", "largest smallest margin", ...).

    slides (n,): rail positions of a reconfigurable machine, metres; None for other machines.
    """

    summary = ("chosen_by",)

    transform: RigidTransform
    chosen_by: str
    rail_positions: tuple[float, ...] | None = None

    @property
    def guides(self) -> str:
        """Where the guides are to stand, in words; nothing for a machine that has none."""
        return (
            ""
            if self.rail_positions is None
            else ", ".join(f"{1e3 * slide:.3f}" for slide in self.rail_positions) + " mm"
        )
