"""Collision check of tool, shank and holder against the part over a whole motion."""

from __future__ import annotations

from functools import cached_property

from pentapod.base.arrays import Floats
from pentapod.cutters.tool import Tool
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.query.swept_depth import sweep
from pentapod.mesh.query.tree import FacetTree


class Clearing:
    """A mesh and a tool that is to stay clear of it. view (3,): unit, towards the tool."""

    def __init__(self, mesh: Mesh, tool: Tool, view: Floats) -> None:
        self.mesh, self.tool, self.view = mesh, tool, view
        self.top = float((mesh.vertices @ view).max())
        # Nothing of the tool is further from its tip than this.
        self.reach = max((s.top + s.low_radius + s.high_radius for s in tool.solids), default=0.0)

    @cached_property
    def _tree(self) -> FacetTree:
        return FacetTree.of(self.mesh)

    def clear(self, tips: Floats, axes: Floats, margin: float) -> bool:
        """Return whether no part of the tool comes within `margin` metres of the part along poses (N, 3), (N, 3)."""
        if not self.tool.solids or (tips @ self.view).min() > self.top + self.reach + margin:
            return True
        return not sweep(self._tree, self.tool, tips, axes, threshold=-margin).beyond(-margin).any()
