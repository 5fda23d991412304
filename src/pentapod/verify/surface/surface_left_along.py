"""What a program will leave on its region, told by the claim about it from the toolpath alone."""

from __future__ import annotations

from pentapod.verify.replay.along_toolpath import AlongToolpath
from pentapod.verify.surface.limit_surface import is_ball_end
from pentapod.verify.surface.surface_left import SURFACE_LEFT, left_on
from pentapod.verify.verdict.specification import Specification
from pentapod.verify.verdict.verdict import Certificate, Place


def surface_left_along(specification: Specification) -> Certificate | None:
    """Return the claim about what is left on the region, for a tool that keeps exactly to its toolpath.

    The toolpath is that of a whole job. None where the claim is not judged, or where the program's axes may be others
    than the toolpath's, and more than a ball about the tilt centre cuts.
    """
    cutting = specification.cutting
    region = None if cutting is None or cutting.coverage is None else cutting.coverage.region
    if cutting is None or cutting.coverage is None or region is None or not region.areas.sum() > 0.0:
        return None
    motion = AlongToolpath(specification)
    if specification.tilt > 0.0 and not all(is_ball_end(motion, solid) for solid in cutting.cutter):
        return None
    found = left_on(motion, cutting.coverage, region, cutting, again=0)
    share, bound = 100.0 * found.missed / float(region.areas.sum()), 100.0 * cutting.coverage.share
    method = "share of the region on which a cutter that keeps exactly to the toolpath leaves more than allowed"
    return Certificate(SURFACE_LEFT, share <= bound, share, bound, "%", Place(), method)
