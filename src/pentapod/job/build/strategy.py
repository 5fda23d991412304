"""From a job's table [toolpath] to the options of its strategy."""

from __future__ import annotations

import numpy as np

from pentapod.base.keys import fields_from, oversized
from pentapod.base.units import from_si
from pentapod.job.schema.job import Job
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.region import Region
from pentapod.toolpath.axis.orientation import Orientation
from pentapod.toolpath.gouge.report import GougeOptions
from pentapod.toolpath.options import PathOptions
from pentapod.toolpath.strategies.registry import STRATEGIES

_LARGEST_TOLERANCE = 0.1  # of the part's largest extent


def job_options(job: Job) -> PathOptions:
    """Return the options of the job's strategy, its files read.

    Raises ToolpathError for a drawing, picture or list of points that cannot be used.
    """
    options, feed = STRATEGIES[job.toolpath.strategy].options, job.feed.si
    return options(
        region=job_region(job),
        chordal=job.tolerance.si.chordal,
        feed=feed.cut,
        link_feed=feed.cut if feed.link is None else feed.link,
        **fields_from(options, job.toolpath, job.files),
    )


def job_region(job: Job) -> Region:
    """Return which part of the surface a job machines."""
    return Region(**fields_from(Region, job.part))


def job_sink(job: Job) -> float:
    """Return how far below the surface the job's strategy goes on purpose, metres."""
    strategy = job.toolpath.strategy
    return STRATEGIES[strategy].options.sink_of(job.toolpath.si) if strategy in STRATEGIES else 0.0


def check_sizes(job: Job, mesh: Mesh) -> None:
    """Raise JobError for a tolerance or another length that makes no sense for the part."""
    extent = float(np.ptp(mesh.bounds, axis=0).max())
    largest = f"the part, whose largest extent is {from_si(extent, 'mm'):.4g} mm"
    remedy = "check part.unit and part.scale"
    for key, value in (("chordal_mm", job.tolerance.si.chordal), ("path_mm", job.tolerance.si.path)):
        if value > _LARGEST_TOLERANCE * extent:
            expected = f"at most {from_si(_LARGEST_TOLERANCE * extent, 'mm'):.3g}"
            what = f"the tolerance is too large for {largest}"
            raise job.error("tolerance", key, what, expected=expected, remedy=remedy)
    options: dict[str, type] = {"axis": Orientation, "gouge": GougeOptions}
    if job.toolpath.strategy in STRATEGIES:
        options["toolpath"] = STRATEGIES[job.toolpath.strategy].options
    for table, cls in options.items():
        values = fields_from(cls, getattr(job, table))
        if (item := oversized(cls, values, extent)) is not None:
            expected = f"at most {from_si(item.key.of_part * extent, 'mm'):.4g}"
            raise job.error(table, item.file_key, f"too large for {largest}", expected=expected, remedy=remedy)
