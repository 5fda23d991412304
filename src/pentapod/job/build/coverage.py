"""Coverage from a job: the region to be machined, and the material that may be left there."""

from __future__ import annotations

from pentapod.job.build.strategy import job_options, job_region
from pentapod.job.build.tool import job_tool
from pentapod.job.build.values import job_toolpath
from pentapod.job.schema.job import Job
from pentapod.mesh.mesh import Mesh
from pentapod.toolpath.options import CoverOptions, PathOptions
from pentapod.toolpath.strategies.registry import STRATEGIES
from pentapod.verify import Coverage


def job_coverage(job: Job, mesh: Mesh) -> Coverage:
    """Return the region that a job's program must machine; none where its strategy covers no surface.

    Where the job says how much may be left, its region is to be machined whatever the strategy.
    """
    strategy, tolerance = job.toolpath.strategy, job.tolerance.si
    covers = strategy in STRATEGIES and issubclass(STRATEGIES[strategy].options, CoverOptions)
    if not covers and tolerance.left is None:
        return Coverage.nothing(f'the strategy "{strategy}" covers no region')
    return Coverage.of(
        mesh,
        job_tool(job),
        job_options(job) if covers else PathOptions(region=job_region(job)),
        path_tolerance=tolerance.path,
        left=tolerance.left,
        share=tolerance.left_share,
        whole=lambda: job_toolpath(job, mesh)[0],
    )
