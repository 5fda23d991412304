"""Smaller regions, and other sizes, for a job: what to write into [part], and what share of the area it keeps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.base.units import from_si, to_si
from pentapod.geometry.directions import angle_between, normalised
from pentapod.job.advice.axes import Changes
from pentapod.job.advice.sketch import Sketch
from pentapod.job.build.region import covers_region, job_region
from pentapod.job.schema.job import Job
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.region_share import RegionShare


@dataclass(frozen=True, eq=False)
class Smaller:
    """A smaller region. keeps (N,): the points of a sketch that it keeps; share: of the area of the job's region."""

    words: str
    changes: Changes
    keeps: Bools
    share: float


@dataclass(frozen=True, eq=False)
class Regions:
    """Smaller regions of one job. area: share of the surface in its own region, 0 to 1."""

    job: Job
    mesh: Mesh
    sketch: Sketch
    area: float

    @classmethod
    def of(cls, job: Job, mesh: Mesh, sketch: Sketch) -> Regions | None:
        """Return the regions of a job; None where its strategy covers none, or it holds nothing."""
        if not covers_region(job):
            return None
        area = RegionShare.of(mesh, job_region(job)).inside
        return cls(job, mesh, sketch, area) if area > 0.0 else None

    def flatter(self, degrees: float) -> Smaller:
        """Return the part of the region within an angle of its direction."""
        direction = normalised(self.job.part.si.region_direction)
        keeps = angle_between(self.sketch.normals, direction) <= to_si(degrees, "deg")
        return self._smaller({"region_angle_deg": degrees}, f"only where it is flatter than {degrees:g} deg", keeps)

    def boxed(self, share: float, *, deep: bool = False) -> Smaller:
        """Return the part of the region in a box about its middle, with a share of its extents.

        deep: whether the box is smaller along the region's direction, too; from the top downwards.
        """
        contacts = self.sketch.contacts[self.sketch.cutting]
        low, high = contacts.min(axis=0), contacts.max(axis=0)
        view = normalised(self.job.part.si.region_direction)
        along = int(np.abs(view).argmax())
        middle, half = 0.5 * (low + high), 0.5 * share * (high - low)
        margin = 0.01 * float((high - low).max())
        corners = np.stack([middle - half, middle + half])
        corners[0, along], corners[1, along] = low[along] - margin, high[along] + margin
        if deep:
            top = 1 if view[along] > 0.0 else 0
            corners[1 - top, along] = corners[top, along] + (1 - 2 * top) * (
                share * (high[along] - low[along]) + 2.0 * margin
            )
        own = self.job.part.si.region_box
        if own is not None:
            own = np.sort(np.array(own), axis=0)
            corners = np.stack([np.maximum(corners[0], own[0]), np.minimum(corners[1], own[1])])
        box = np.round(from_si(corners, "mm"), 1) + 0.0
        return self._smaller({"region_box_mm": box.tolist()}, "only what lies in a box", self._inside(box))

    def _inside(self, box: Floats) -> Bools:
        low, high = to_si(box, "mm")
        inside = (self.sketch.contacts >= low - 1e-6) & (self.sketch.contacts <= high + 1e-6)
        across = np.abs(normalised(self.job.part.si.region_direction)) < np.abs(self.job.part.si.region_direction).max()
        # Places above the part count with what is below them.
        return np.where(self.sketch.cutting, inside.all(axis=1), (inside | ~across).all(axis=1))

    def _smaller(self, keys: dict[str, object], words: str, keeps: Bools) -> Smaller:
        region = job_region(self.job.with_(part=keys))
        share = RegionShare.of(self.mesh, region).inside / self.area
        return Smaller(words, {"part": keys}, keeps, float(min(share, 1.0)))
