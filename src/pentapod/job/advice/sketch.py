"""Sketch: a few points that stand for all that a job's tool has to do, from its toolpath or from its region."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from pentapod.base.arrays import Floats
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
        rows = ToolpathSamples.of(toolpath, 0.0).representatives(count)
        kinds = np.array([toolpath.segments[k].kind is SegmentKind.CUT for k in toolpath.segment_of_interval])
        cutting = (np.append(kinds[:1], kinds) | np.append(kinds, kinds[-1:]))[rows]
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
        patch, view = Patch.of(mesh, job_region(job)), normalised(job.part.si.region_direction)
        if not len(patch.faces):
            return None
        extent = float(np.ptp(patch.vertices[np.unique(patch.faces)], axis=0).max())
        patch = patch.refined(extent / max(count, 1) ** 0.5)
        contacts, normals = patch.vertices[patch.faces].reshape(-1, 3), normalised(patch.normals.reshape(-1, 3))
        rows = ToolpathSamples(contacts, normals, 0.0, 0.0).representatives((count + 1) // 2)
        contacts, normals = contacts[rows], normals[rows]
        style = job.toolpath.si if hasattr(job.toolpath, "clearance_mm") else PathOptions()
        level = float((mesh.vertices @ view).max()) + max(style.clearance, 2.0 * style.approach)
        above = contacts + np.maximum(level - contacts @ view, 0.0)[:, None] * view
        axes = job_axis_mode(job).axes(contacts, normals)
        twice = {"normals": np.tile(normals, (2, 1)), "axes": np.tile(axes, (2, 1))}
        return cls(tool, np.concatenate([contacts, above]), **twice)

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
