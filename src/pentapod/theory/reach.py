"""A workspace on a grid: its volume, its surface, the largest ball and the largest box in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats, Ints, set_frozen
from pentapod.base.errors import ArrayError
from pentapod.base.values import Value
from pentapod.numerics.blocks import blocks
from pentapod.theory.cuboid import largest_cuboid
from pentapod.theory.level_set import enclosed_volume, zero_surface
from pentapod.theory.workspace import Workspace


@dataclass(frozen=True, eq=False)
class ReachField(Value):
    """The slack of a workspace at the nodes origin + step · (i, j, k) of a grid; metres.

    slack (nx, ny, nz): see `Workspace.slack`; the voxel about a node is reachable where it is not negative.
    """

    workspace: Workspace
    origin: Floats
    step: float
    slack: Floats

    @classmethod
    def of(cls, workspace: Workspace, step: float, *, nodes: int = 20_000_000) -> ReachField:
        """Evaluate a workspace on a grid with this step, metres, over all it can hold. ArrayError above `nodes`."""
        low, high = workspace.bounds()
        if not step > 0.0:
            raise ArrayError("step must be positive", value=step, expected="metres")
        counts = np.maximum(np.ceil((high - low) / step).astype(np.intp) + 1, 1)
        if np.prod(counts, dtype=np.float64) > nodes:
            raise ArrayError(
                "the grid would be too fine", value=step, remedy=f"at most {nodes} nodes, or a larger step"
            )
        origin = 0.5 * (low + high) - 0.5 * step * (counts - 1)
        slack = np.empty(counts)
        flat = slack.reshape(-1)
        for block in blocks(flat.size, 65_536):
            node = np.stack(np.unravel_index(np.arange(block.start, block.stop), tuple(counts)), axis=-1)
            flat[block] = workspace.slack(origin + step * node)
        return cls(workspace, origin, step, slack)

    def __post_init__(self) -> None:
        for array in (self.origin, self.slack):
            array.flags.writeable = False
        set_frozen(self, step=float(self.step))

    def surface(self) -> tuple[Floats, Ints]:
        """Return the vertices (V, 3), metres, and triangles (T, 3) of the closed surface around what is reachable."""
        return zero_surface(np.maximum(self.slack, -4.0 * self.step), self.origin, self.step)

    def volume(self) -> float:
        """Return the volume that the surface encloses, cubic metres."""
        return enclosed_volume(*self.surface())

    def volume_bounds(self) -> tuple[float, float]:
        """Return proven bounds of the volume, m³: voxels wholly inside, and all but those wholly outside.

        A voxel is its node's cube, half its diagonal √3/2 steps; slack changes by at most a metre a metre.
        """
        half = 0.5 * np.sqrt(3.0) * self.step
        voxel = self.step**3
        return float((self.slack >= half).sum() * voxel), float((self.slack >= -half).sum() * voxel)

    def largest_ball(self) -> tuple[Floats, float, float]:
        """Return the centre (3,) and radius of the largest reachable ball found, and a radius that none exceeds.

        The best node is improved by a pattern search. The ball is proven by the slack at its centre; the bound is the
        best node's slack and half a voxel's diagonal, and holds where the legs and not S = 0 limit the ball. Radius 0
        where nothing is reachable.
        """
        best = np.unravel_index(int(np.argmax(self.slack)), self.slack.shape)
        centre, radius = self.origin + self.step * np.array(best), float(self.slack[best])
        upper = max(radius + 0.5 * np.sqrt(3.0) * self.step, 0.0)
        ways = np.array([(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1)], dtype=np.float64)
        reach = 0.5 * self.step
        while radius > 0.0 and reach > 1e-9 * self.step:
            tried = self.workspace.slack(centre + reach * ways)
            pick = int(np.argmax(tried))
            if tried[pick] > radius:
                centre, radius = centre + reach * ways[pick], float(tried[pick])
            else:
                reach *= 0.6
        return centre, max(radius, 0.0), upper

    def largest_box(self) -> tuple[Floats, Floats]:
        """Return the lowest and highest corner (3,) of the largest reachable box along the axes that was found.

        The largest one between nodes is searched exhaustively, then proven by `box_is_reachable` (shrunk a little
        where that fails), and its faces are pushed out as far as the proof goes. NaN where there is none.
        """
        found = largest_cuboid(self.slack >= 0.0)
        if found is None:
            return np.full(3, np.nan), np.full(3, np.nan)
        low, high = (self.origin + self.step * np.array(corner) for corner in found)
        while not self.box_is_reachable(low, high):
            low, high = low + 0.1 * self.step, high - 0.1 * self.step
            if (high <= low).any():
                return np.full(3, np.nan), np.full(3, np.nan)
        for push in self.step * 0.5 ** np.arange(1, 6):
            for axis in range(3):
                for corner, side in ((low, -1.0), (high, 1.0)):
                    moved = corner.copy()
                    moved[axis] += side * push
                    pair = (moved, high) if side < 0.0 else (low, moved)
                    if self.box_is_reachable(*pair):
                        low, high = pair
        return low, high

    def box_is_reachable(self, low: Floats, high: Floats, *, depth: int = 7) -> bool:
        """Return whether every tip of a box is proven to be reachable.

        A box is when the slack in its middle is at least half its diagonal; if not it is cut into eight, `depth` times
        at most. False also where that did not decide.
        """
        centres, half = 0.5 * (low + high)[None], 0.5 * (high - low)
        corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=np.float64)
        if (self.workspace.slack(centres + half * corners) < 0.0).any():
            return False
        for _ in range(depth):
            slack = self.workspace.slack(centres)
            if (slack < 0.0).any():
                return False
            open_ = slack < float(np.linalg.norm(half))
            if not open_.any():
                return True
            half = 0.5 * half
            centres = (centres[open_][:, None] + half * corners).reshape(-1, 3)
        return False
