"""Smaller regions for a job: what to write into [part], and what share of the area it keeps."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import InputError
from pentapod.base.units import from_si
from pentapod.cutters.tool import Tool
from pentapod.geometry.directions import normalised
from pentapod.geometry.runs import distinct
from pentapod.job.advice.axes import Changes
from pentapod.job.advice.options import AdviceOptions
from pentapod.job.advice.sketch import Sketch
from pentapod.job.build.region import covers_region, job_region
from pentapod.job.schema.job import Job
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.patch import Patch
from pentapod.mesh.region_share import RegionShare
from pentapod.toolpath.toolpath import Toolpath


@dataclass(frozen=True, eq=False)
class Smaller:
    """A smaller region, sketched. share: of the area of the job's region."""

    words: str
    changes: Changes
    sketch: Sketch
    share: float


@dataclass(frozen=True, eq=False)
class Regions:
    """Smaller regions of one job. area: share of the surface in its own region, 0 to 1.

    cuts: places of its toolpath that cut, where it is known. A region may hold what no tool reaches: feet of walls,
    and what is hidden.
    """

    job: Job
    mesh: Mesh
    tool: Tool
    area: float
    cuts: Sketch | None
    options: AdviceOptions

    @classmethod
    def of(cls, job: Job, mesh: Mesh, tool: Tool, toolpath: Toolpath | None, options: AdviceOptions) -> Regions | None:
        """Return the regions of a job; None where its strategy covers none, or it holds nothing."""
        if not covers_region(job):
            return None
        area = RegionShare.of(mesh, job_region(job)).inside
        cuts = None if toolpath is None else Sketch.of_cuts(job, mesh, tool, toolpath, options.cuts)
        return cls(job, mesh, tool, area, cuts, options) if area > 0.0 else None

    def flatter(self, degrees: float) -> Smaller | None:
        """Return the part of the region within an angle of its direction; None where that is nothing, or all."""
        found = self._smaller({"region_angle_deg": degrees}, f"only where it is flatter than {degrees:g} deg")
        return found if found is not None and found.share < self.options.most else None

    @cached_property
    def _extents(self) -> Floats:
        """Lowest and highest coordinates (2, 3) of the region, metres."""
        patch = Patch.of(self.mesh, job_region(self.job))
        points = patch.vertices[distinct(patch.faces)]
        return np.stack([points.min(axis=0), points.max(axis=0)])

    @cached_property
    def _places(self) -> Floats:
        """Places (N, 3), each of which stands for as much of the region's area."""
        patch, (low, high) = Patch.of(self.mesh, job_region(self.job)), self._extents
        patch = patch.refined(float((high - low).max()) / self.options.points**0.5)
        area = np.cumsum(patch.areas)
        shares = (np.arange(self.options.places) + 0.5) / self.options.places
        rows = np.searchsorted(area, shares * float(area[-1]))
        return patch.vertices[patch.faces[rows]].mean(axis=1)

    def _middle(self, half: Floats) -> Floats:
        """Return where a box with half extents (3,) is: about the middle, or where it holds much more of the region."""
        low, high = self._extents
        middles = np.clip(self._places, low + half, high - half)
        middles = np.concatenate([[0.5 * (low + high)], middles[:: max(len(middles) // self.options.points, 1)]])
        across = np.delete(np.arange(3), self._along)
        inside = np.abs(self._places[None, :, across] - middles[:, None, across]) <= half[across]
        held = inside.all(axis=2).sum(axis=1)
        most = int(held.argmax())
        return middles[most] if held[most] > self.options.elsewhere * held[0] else middles[0]

    @property
    def _view(self) -> Floats:
        return normalised(self.job.part.si.region_direction)

    @property
    def _along(self) -> int:
        """The axis of the part that is nearest to the region's direction."""
        return int(np.abs(self._view).argmax())

    def boxed(self, share: float, *, deep: bool = False) -> Smaller | None:
        """Return the part of the region in a box about its middle, with a share of its largest extent.

        deep: whether the box is smaller along the region's direction, too, from the top downwards; None for a flat
        region.
        """
        low, high = self._extents
        half = 0.5 * np.minimum(high - low, share * float((high - low).max()))
        middle = self._middle(half)
        corners = np.stack([middle - half, middle + half])
        corners[:, self._along] = self._depths(share if deep else None)
        if deep and self._flat:
            return None
        return self._in_box(corners, {}, "only what lies in a box")

    def top(self, share: float) -> Smaller | None:
        """Return what is flat, and not deeper than a share of the region's depth; None for a flat region."""
        if self._flat:
            return None
        low, high = self._extents
        corners = np.stack([low, high]) + np.array([[-1.0], [1.0]]) * self._margin
        corners[:, self._along] = self._depths(share)
        degrees = min(self.options.top_deg, float(from_si(job_region(self.job).within, "deg")))
        return self._in_box(corners, {"region_angle_deg": degrees}, "only what is flat at the top")

    def above(self, height: float) -> Smaller | None:
        """Return what is higher along the region's direction than `height`, metres; None where that is all, or little.

        None, too, for a direction that is not along an axis of the part: a box has no sides across it.
        """
        low, high = self._extents
        corners = np.stack([low, high]) + np.array([[-1.0], [1.0]]) * self._margin
        along, upwards = self._along, self._view[self._along] > 0.0
        bottom = (low if upwards else -high)[along]
        corners[0 if upwards else 1, along] = height if upwards else -height
        if abs(self._view[along]) < 1.0 or not bottom < height < (high if upwards else -low)[along]:
            return None
        words = f"without the lowest {from_si(height - bottom, 'mm'):.3g} mm"
        found = self._in_box(corners, {}, words)
        return found if found is not None and found.share >= self.options.least else None

    @property
    def _margin(self) -> float:
        low, high = self._extents
        return 0.01 * float((high - low).max())

    @property
    def _flat(self) -> bool:
        low, high = self._extents
        return bool((high - low)[self._along] < self.options.flat * (high - low).max())

    def _depths(self, share: float | None) -> Floats:
        """Return the coordinates (2,) between which a box lies along the region's direction: all, or from the top."""
        low, high = self._extents[:, self._along]
        found = np.array([low - self._margin, high + self._margin])
        if share is not None:
            depth, upwards = share * (high - low), self._view[self._along] > 0.0
            found[0 if upwards else 1] = high - depth if upwards else low + depth
        return found

    def _in_box(self, corners: Floats, keys: dict[str, Any], words: str) -> Smaller | None:
        box = np.round(from_si(corners, "mm"), 1) + 0.0
        return self._smaller({**keys, "region_box_mm": box.tolist()}, words)

    def _smaller(self, keys: dict[str, Any], words: str) -> Smaller | None:
        try:
            job = self.job.with_(part=keys)
            share = RegionShare.of(self.mesh, job_region(job)).inside / self.area
            if self.cuts is None:
                sketch = Sketch.of_region(job, self.mesh, self.tool, self.options.points)
            else:
                sketch = self.cuts.in_region(job, self.mesh, self.options.points)
        except InputError:  # the box is flat
            return None
        return None if sketch is None else Smaller(words, {"part": keys}, sketch, min(float(share), 1.0))
