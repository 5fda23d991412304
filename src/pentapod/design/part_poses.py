"""Poses of jobs' toolpaths, as far apart as possible, for the search for a machine that makes their parts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.values import Value
from pentapod.design.geometry import Geometry
from pentapod.job.build.toolpath import job_toolpath
from pentapod.job.build.values import job_mesh
from pentapod.job.schema.job import Job

HANGING = np.array([1.0, -1.0, -1.0])
"""A part stands under the base: its z points up to the base, the machine's down to the part."""


@dataclass(frozen=True, eq=False)
class PartPoses(Value):
    """Poses of parts. tips (N, 3): from the part's middle; directions (N, 3): from spindle to tip; machine axes."""

    tips: Floats
    directions: Floats

    @classmethod
    def of(cls, jobs: tuple[Job, ...], count: int) -> PartPoses:
        """Return `count` poses of each job's toolpath, far from each other, the tool as upright as it may lean."""
        found = [_of_job(job, count) for job in jobs]
        empty = np.zeros((0, 3))
        return cls(np.concatenate([empty, *(t for t, _ in found)]), np.concatenate([empty, *(d for _, d in found)]))

    def at(self, design: Geometry) -> tuple[Floats, Floats]:
        """Return the poses of the parts in the middle of a design's work volume."""
        return design.centre + self.tips, self.directions


def _of_job(job: Job, count: int) -> tuple[Floats, Floats]:
    toolpath, _ = job_toolpath(job, job_mesh(job))
    tips = (toolpath.tips - 0.5 * (toolpath.tips.max(axis=0) + toolpath.tips.min(axis=0))) * HANGING
    directions = _leant(-toolpath.axes * HANGING, 0.0 if job.axis.tilt_deg is None else float(job.axis.si.tilt))
    size = max(float(np.abs(tips).max()), 1e-9)
    rows = _farthest(np.concatenate([tips / size, directions], axis=1), count)
    return tips[rows], directions[rows]


def _leant(directions: Floats, most: float) -> Floats:
    """Return directions (N, 3) turned towards +z by at most an angle."""
    angle = np.arccos(np.clip(directions[:, 2], -1.0, 1.0))
    side = directions - directions[:, 2:] * (0.0, 0.0, 1.0)
    side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-12)
    left = np.maximum(angle - most, 0.0)[:, None]
    return np.asarray(np.cos(left) * (0.0, 0.0, 1.0) + np.sin(left) * side, dtype=np.float64)


def _farthest(points: Floats, count: int) -> list[int]:
    """Return rows of points (N, d), each the farthest from those before; the first is the farthest from the middle."""
    rows = [int(np.argmax(np.square(points - points.mean(axis=0)).sum(axis=1)))]
    far = np.square(points - points[rows[0]]).sum(axis=1)
    while len(rows) < min(count, len(points)):
        rows.append(int(np.argmax(far)))
        far = np.minimum(far, np.square(points - points[rows[-1]]).sum(axis=1))
    return rows
