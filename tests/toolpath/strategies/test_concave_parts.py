"""Concave parts are machined whole: nothing is left but what the ball's shape forbids, nothing is cut too deep."""

import numpy as np
import pytest
from scipy.spatial import KDTree

import concave_parts
from left_material import Left, Reachable, Samples, left
from pentapod.job import Job
from pentapod.job.build.region import job_region
from pentapod.job.build.toolpath import job_toolpath
from pentapod.mesh.topology import components
from pentapod.toolpath import SegmentKind
from pentapod.toolpath.surfaces.drive_surface import DriveSurface

R, STEPOVER, CHORDAL = 3e-3, 4e-3, 1e-5
MOST_BEYOND = {"raster": 1e-3, "offset": 5e-3, "spiral": 5e-3}


def regions_visited(job, mesh, toolpath) -> int:
    """Number of separate regions of the drive surface on which there are cuts.

    A wall that leans over by more than half a degree separates them. The drop cutter does not see that.
    """
    patch = DriveSurface.of(mesh, R, np.array([0.0, 0.0, 1.0])).patch(job_region(job))
    region = components(len(patch.vertices), *patch.topology.edges.T)[1]
    cuts = [segment for segment in toolpath.segments if segment.kind is SegmentKind.CUT]
    middles = np.array([(cut.tips + R * cut.axes)[len(cut.tips) // 2] for cut in cuts])
    return len(np.unique(region[KDTree(patch.vertices).query(middles)[1]]))


def box_across(mesh, first, last):
    """A box (2, 3) over shares of the part's extents along x and y."""
    low, high = mesh.bounds
    sides = np.array([low + first * (high - low), low + last * (high - low)])
    sides[:, 2] = low[2] - 1e-3, high[2] + 1e-3
    return sides


def measured(name, strategy, parts=None, stepover=STEPOVER, angle=None, box=None) -> tuple[Left, int]:
    """What a job such as `pentapod new` writes leaves on a part, and how many separate regions it machines.

    box: shares of the part's extents along x and y between which it is machined.
    """
    mesh = concave_parts.mesh(name, parts)
    sides = None if box is None else box_across(mesh, *box)
    reachable = Reachable(mesh, R, 2e-4)
    tables = {
        "part": {"mesh": "dome.stl", "unit": "mm"}
        | ({} if angle is None else {"region_angle_deg": angle})
        | ({} if sides is None else {"region_box_mm": (1e3 * sides).tolist()}),
        "tool": {"type": "ball", "diameter_mm": 2e3 * R},
        "toolpath": {"strategy": strategy, "stepover_mm": 1e3 * stepover},
        "axis": {"mode": "auto"},
        "feed": {"cut_mm_min": 1500},
    }
    job = Job.from_dict(tables, "toolpaths")
    toolpath, _ = job_toolpath(job, mesh)
    regions = reachable.regions(np.radians(90.0))
    if parts is not None:  # of generated parts the drop cutter sees all regions
        regions = max(regions, regions_visited(job, mesh, toolpath))
    samples = reachable.samples(4000 if box is None else 9000, 80.0 if angle is None else angle)
    if sides is not None:
        samples = Samples(
            reachable, samples.points[((samples.points > sides[0]) & (samples.points < sides[1])).all(axis=1)]
        )
    return left(samples, toolpath, stepover), regions


def holds(found: Left, regions: int, strategy: str):
    assert found.beyond <= MOST_BEYOND[strategy]
    assert found.over <= CHORDAL + 2e-5  # of the measure itself
    assert found.gouge <= CHORDAL + 1e-6
    assert found.air <= 0.25 * found.cut
    assert found.lifts <= 1 + regions


@pytest.mark.parametrize("name", ["stairs", pytest.param("crossing_slots", marks=pytest.mark.slow)])
def test_raster_leaves_what_the_ball_forbids(name):
    holds(*measured(name, "raster"), "raster")


@pytest.mark.parametrize("name", [
    "stairs", *(pytest.param(name, marks=pytest.mark.slow) for name in concave_parts.GENERATED if name != "stairs"),
])  # fmt: skip
@pytest.mark.parametrize(
    "angle", [25.0, pytest.param(40.0, marks=pytest.mark.slow), pytest.param(60.0, marks=pytest.mark.slow)]
)
def test_places_of_a_region_that_the_ball_touches_only_from_beside_it_are_machined(name, angle):
    """Floors of narrow pockets, corners and ends of grooves: the ball lies on what is steeper than the region."""
    found, _ = measured(name, "raster", stepover=2e-3, angle=angle)
    assert found.over <= CHORDAL + 2e-5  # of the measure itself
    assert found.gouge <= CHORDAL + 1e-6


@pytest.mark.parametrize("box", [(0.17, 0.71), pytest.param((0.3, 0.83), marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", [
    "ribs", *(pytest.param(name, marks=pytest.mark.slow) for name in concave_parts.GENERATED if name != "ribs"),
])  # fmt: skip
def test_places_in_a_box_that_the_ball_touches_only_from_beyond_it_are_machined(name, box):
    found, _ = measured(name, "raster", stepover=2e-3, box=box)
    assert found.over <= CHORDAL + 2e-5  # of the measure itself
    assert found.gouge <= CHORDAL + 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("strategy", MOST_BEYOND)
@pytest.mark.parametrize("name", concave_parts.GENERATED)
def test_every_concave_part_is_machined_whole(name, strategy):
    holds(*measured(name, strategy), strategy)


@pytest.mark.slow
@pytest.mark.parts
@pytest.mark.parametrize("strategy", MOST_BEYOND)
@pytest.mark.parametrize("name", concave_parts.BY_OTHERS)
def test_parts_by_others_are_machined_whole(parts, name, strategy):
    holds(*measured(name, strategy, parts), strategy)
