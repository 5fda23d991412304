"""Cutting: the solids of the tool, the finished part, and the allowed depth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.errors import ArrayError
from pentapod.base.values import Value
from pentapod.cutters.tool import Tool
from pentapod.geometry.solids import Solid
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.query.distance import MeshDistance
from pentapod.verify.verdict.coverage import Coverage


@dataclass(frozen=True, eq=False)
class Cutting(Value):
    """What cuts into which part, and how deep it may.

    surface: of the finished part, workpiece frame. solids: of the tool; those of kind "cutter" cut. depth: metres by
    which cuts and links may go into the part: the gouge tolerance and the engraving depth. coverage: what must be
    machined; None where it is not given. Raises ArrayError where depth is negative.

    >>> cutting = Cutting.of(part, tool)
    """

    surface: MeshDistance
    solids: tuple[Solid, ...]
    depth: float
    coverage: Coverage | None = None

    def __post_init__(self) -> None:
        if not (np.isfinite(self.depth) and self.depth >= 0.0):
            raise ArrayError("must not be negative", key="depth", value=self.depth)

    @classmethod
    def of(cls, part: Mesh, tool: Tool, depth: float = 50e-6, *, coverage: Coverage | None = None) -> Cutting:
        """Return what a tool cuts into a part, whose mesh is in the workpiece frame."""
        return cls(MeshDistance.of(part), tool.solids, depth, coverage)

    @property
    def cutter(self) -> tuple[Solid, ...]:
        """The solids that cut; none of a laser."""
        return tuple(solid for solid in self.solids if solid.kind == "cutter")
