"""Placement: where the workpiece stands in the machine."""

from __future__ import annotations

from dataclasses import dataclass

from pentapod.geometry.rigid import RigidTransform


@dataclass(frozen=True)
class Placement:
    """Rigid transform workpiece → machine, and what it was chosen by ("job", "largest smallest margin", ...)."""

    transform: RigidTransform
    chosen_by: str
