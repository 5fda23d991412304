"""Sketch: a few points that stand for all that a job's tool has to do, from its toolpath or from its region."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.cutters.tool import Tool
from pentapod.geometry.directions import normalised
from pentapod.job.build.region import job_region
from pentapod.job.build.toolpath import job_axis_mode
from pentapod.job.schema.job import Job
from pentapod.job.schema.strategies import FILE
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.patch import Patch
from pentapod.mesh.query.distance import MeshDistance
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.toolpath.options import PathOptions
from pentapod.toolpath.toolpath import SegmentKind, Toolpath

IN_REGION, IN_REGION_M = 0.001, 1e-6
"""By how much normals (cosines) and points (metres) may be outside of a region: passes lie exactly on its borders."""


@dataclass(frozen=True, eq=False)
class Sketch:
    """Points (N, 3) of a path, workpiece frame, metres.

    contacts: on the surface, or above it. normals, axes: unit, of the surface and of the tool as the job says.
    """

    tool: Tool
    contacts: Floats
    normals: Floats
    axes: Floats

    @classmethod
    def of_toolpath(cls, job: Job, mesh: Mesh, tool: Tool, toolpath: Toolpath, count: int) -> Self:
        """Return a sketch of about `count` waypoints of a job's toolpath."""
        return cls.of_waypoints(job, mesh, tool, toolpath, ToolpathSamples.of(toolpath, 0.0).representatives(count))

    @classmethod
    def of_waypoints(cls, job: Job, mesh: Mesh, tool: Tool, toolpath: Toolpath, rows: Ints) -> Self:
        """Return a sketch of waypoints (N,) of a job's toolpath."""
        return cls._at(job, mesh, tool, toolpath, rows, _cutting(toolpath)[rows])

    @classmethod
    def of_cuts(cls, job: Job, mesh: Mesh, tool: Tool, toolpath: Toolpath, most: int) -> Self:
        """Return a sketch of the waypoints of a job's toolpath that cut, at most about `most` of them."""
        rows = np.flatnonzero(_cutting(toolpath))
        rows = rows[:: max(-(-len(rows) // most), 1)]
        return cls._at(job, mesh, tool, toolpath, rows, np.ones(len(rows), dtype=np.bool_))

    @classmethod
    def _at(cls, job: Job, mesh: Mesh, tool: Tool, toolpath: Toolpath, rows: Ints, cutting: Bools) -> Self:
        """Return the sketch of waypoints (N,). cutting (N,): which of them cut; the others have any normal."""
        centres, axes = toolpath.tilt_centres[rows], toolpath.axes[rows]
        normals = axes
        if job.toolpath.strategy != FILE and job.axis.mode not in ("normal", "auto"):
            from_part = MeshDistance.of(mesh).points(centres).normal
            known = cutting & (np.abs(from_part).sum(axis=1) > 0.0)
            normals = np.where(known[:, None], from_part, normalised(job.part.si.region_direction))
        return cls(tool, centres - max(tool.tilt_centre, 0.0) * normals, normals, axes)

    @classmethod
    def of_region(cls, job: Job, mesh: Mesh, tool: Tool, count: int) -> Self | None:
        """Return a sketch of about `count` points of a job's region, and of the places above; None if it is empty."""
        patch = Patch.of(mesh, job_region(job))
        if not len(patch.faces):
            return None
        extent = float(np.ptp(patch.vertices[np.unique(patch.faces)], axis=0).max())
        patch = patch.refined(extent / max(count, 1) ** 0.5)
        contacts, normals = patch.vertices[patch.faces].reshape(-1, 3), normalised(patch.normals.reshape(-1, 3))
        rows = ToolpathSamples(contacts, normals, 0.0, 0.0).representatives((count + 1) // 2)
        contacts, normals = contacts[rows], normals[rows]
        return cls(tool, contacts, normals, job_axis_mode(job).axes(contacts, normals))._with_above(job, mesh)

    def in_region(self, job: Job, mesh: Mesh, count: int) -> Self | None:
        """Return about `count` of these places that lie in a job's region, and places above; None if there are none."""
        region, slack = job_region(job), IN_REGION_M
        view = normalised(job.part.si.region_direction)
        rows = self.normals @ view >= np.cos(region.within) - IN_REGION
        if region.box is not None:
            low, high = region.bounds
            rows &= ((self.contacts >= low - slack) & (self.contacts <= high + slack)).all(axis=1)
        rows = np.flatnonzero(rows)
        if not len(rows):
            return None
        rows = rows[
            ToolpathSamples(self.contacts[rows], self.normals[rows], 0.0, 0.0).representatives((count + 1) // 2)
        ]
        return replace(
            self, contacts=self.contacts[rows], normals=self.normals[rows], axes=self.axes[rows]
        )._with_above(job, mesh)

    def _with_above(self, job: Job, mesh: Mesh) -> Self:
        """Return the sketch with the places above its points to which a tool retracts."""
        view = normalised(job.part.si.region_direction)
        style = job.toolpath.si if hasattr(job.toolpath, "clearance_mm") else PathOptions()
        level = float((mesh.vertices @ view).max()) + max(style.clearance, 2.0 * style.approach)
        above = self.contacts + np.maximum(level - self.contacts @ view, 0.0)[:, None] * view
        twice = {"normals": np.tile(self.normals, (2, 1)), "axes": np.tile(self.axes, (2, 1))}
        return replace(self, contacts=np.concatenate([self.contacts, above]), **twice)

    def within(self, low: float, high: float, along: int) -> Self:
        """Return the sketch of the points with a coordinate in a range, metres."""
        rows = (self.contacts[:, along] >= low) & (self.contacts[:, along] <= high)
        kept = {name: getattr(self, name)[rows] for name in ("contacts", "normals", "axes")}
        return replace(self, **kept)

    def scaled(self, factor: float) -> Self:
        """Return about the sketch of a part of another size: the places on it move, the tool stays."""
        return replace(self, contacts=factor * self.contacts)

    def samples(self, axes: Floats, tilt: float) -> ToolpathSamples:
        """Return the samples with nominal axes (N, 3), or (3,) for all, and a tilt cone, radians."""
        axes = np.broadcast_to(axes, self.contacts.shape)
        centres = self.tool.tips(self.contacts, self.normals, axes) + self.tool.tilt_centre * axes
        return ToolpathSamples(centres, axes, self.tool.tilt_centre, tilt)


def _cutting(toolpath: Toolpath) -> Bools:
    """Return which waypoints (N,) begin or end a motion that cuts."""
    kinds = np.array([toolpath.segments[k].kind is SegmentKind.CUT for k in toolpath.segment_of_interval])
    return np.append(kinds[:1], kinds) | np.append(kinds, kinds[-1:])
