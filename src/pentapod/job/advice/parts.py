"""Smaller regions for a job: what to write into [part], and what share of the area it keeps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pentapod.base.errors import InputError
from pentapod.base.units import from_si
from pentapod.cutters.tool import Tool
from pentapod.geometry.directions import normalised
from pentapod.job.advice.axes import Changes
from pentapod.job.advice.options import AdviceOptions
from pentapod.job.advice.sketch import Sketch
from pentapod.job.build.region import covers_region, job_region
from pentapod.job.schema.job import Job
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.patch import Patch
from pentapod.mesh.region_share import RegionShare


@dataclass(frozen=True, eq=False)
class Smaller:
    """A smaller region, sketched. share: of the area of the job's region."""

    words: str
    changes: Changes
    sketch: Sketch
    share: float


@dataclass(frozen=True, eq=False)
class Regions:
    """Smaller regions of one job. area: share of the surface in its own region, 0 to 1."""

    job: Job
    mesh: Mesh
    tool: Tool
    area: float
    options: AdviceOptions

    @classmethod
    def of(cls, job: Job, mesh: Mesh, tool: Tool, options: AdviceOptions) -> Regions | None:
        """Return the regions of a job; None where its strategy covers none, or it holds nothing."""
        if not covers_region(job):
            return None
        area = RegionShare.of(mesh, job_region(job)).inside
        return cls(job, mesh, tool, area, options) if area > 0.0 else None

    def flatter(self, degrees: float) -> Smaller | None:
        """Return the part of the region within an angle of its direction; None where that is nothing, or all."""
        found = self._smaller({"region_angle_deg": degrees}, f"only where it is flatter than {degrees:g} deg")
        return found if found is not None and found.share < self.options.most else None

    def boxed(self, share: float, *, deep: bool = False) -> Smaller | None:
        """Return the part of the region in a box about its middle, with a share of its extents.

        deep: whether the box is smaller along the region's direction, too, from the top downwards; None for a flat
        region.
        """
        patch = Patch.of(self.mesh, job_region(self.job))
        points = patch.vertices[np.unique(patch.faces)]
        low, high = points.min(axis=0), points.max(axis=0)
        view = normalised(self.job.part.si.region_direction)
        along, margin = int(np.abs(view).argmax()), 0.01 * float((high - low).max())
        middle, half = 0.5 * (low + high), 0.5 * share * (high - low)
        corners = np.stack([middle - half, middle + half])
        corners[:, along] = low[along] - margin, high[along] + margin
        if deep:
            if high[along] - low[along] < self.options.flat * float((high - low).max()):
                return None
            depth = share * (high[along] - low[along])
            if view[along] > 0.0:
                corners[0, along] = high[along] - depth
            else:
                corners[1, along] = low[along] + depth
        box = np.round(from_si(corners, "mm"), 1) + 0.0
        return self._smaller({"region_box_mm": box.tolist()}, "only what lies in a box")

    def _smaller(self, keys: dict[str, Any], words: str) -> Smaller | None:
        try:
            job = self.job.with_(part=keys)
            share = RegionShare.of(self.mesh, job_region(job)).inside / self.area
            sketch = Sketch.of_region(job, self.mesh, self.tool, self.options.points)
        except InputError:  # the box is flat
            return None
        return None if sketch is None else Smaller(words, {"part": keys}, sketch, min(float(share), 1.0))
