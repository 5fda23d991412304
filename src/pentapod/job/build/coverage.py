"""From a job to what its program is to machine: the region of the part, and how much may be left there."""

from __future__ import annotations

from pentapod.job.build.strategy import job_options, job_region
from pentapod.job.build.tool import job_tool
from pentapod.job.build.values import job_toolpath
from pentapod.job.schema.job import Job
from pentapod.job.schema.strategies import CoverTable
from pentapod.mesh.mesh import Mesh
from pentapod.toolpath.options import PathOptions
from pentapod.verify import Coverage

_MM = 1e-3


def job_coverage(job: Job, mesh: Mesh) -> Coverage:
    """Return what a job's program is to machine: nothing where its strategy draws lines and covers no surface.

    Where the job says how much may be left, its region is to be machined whatever the strategy.
    """
    table, given = job.toolpath, job.tolerance.left_mm
    covers = isinstance(table, CoverTable)
    if not covers and given is None:
        return Coverage.nothing(f'the strategy "{table.strategy}" covers no region')
    return Coverage.of(
        mesh,
        job_tool(job),
        job_options(job) if covers else PathOptions(region=job_region(job)),
        path_tolerance=job.tolerance.path_mm * _MM,
        left=None if given is None else given * _MM,
        share=job.tolerance.left_share,
        whole=lambda: job_toolpath(job, mesh)[0],
    )
