"""Concave parts are machined whole: nothing is left but what the ball's shape forbids, nothing is cut too deep."""

import numpy as np
import pytest

import concave_parts
from left_material import Left, Reachable, left
from pentapod.job import Job
from pentapod.job.build.toolpath import job_toolpath

R, STEPOVER, CHORDAL = 3e-3, 4e-3, 1e-5
MOST_BEYOND = {"raster": 1e-3, "offset": 5e-3, "spiral": 5e-3}


def measured(name, strategy, parts=None) -> tuple[Left, Reachable]:
    """What a job such as `pentapod new` writes leaves on a part, and the ball's reach."""
    mesh = concave_parts.mesh(name, parts)
    reachable = Reachable(mesh, R, 2e-4)
    tables = {
        "part": {"mesh": "dome.stl", "unit": "mm"},
        "tool": {"type": "ball", "diameter_mm": 2e3 * R},
        "toolpath": {"strategy": strategy, "stepover_mm": 1e3 * STEPOVER},
        "axis": {"mode": "auto"},
        "feed": {"cut_mm_min": 1500},
    }
    toolpath, _ = job_toolpath(Job.from_dict(tables, "toolpaths"), mesh)
    return left(reachable.samples(4000), toolpath, STEPOVER), reachable


def holds(found: Left, reachable: Reachable, strategy: str):
    assert found.beyond <= MOST_BEYOND[strategy]
    assert found.over <= CHORDAL + 2e-5  # of the measure itself
    assert found.gouge <= CHORDAL + 1e-6
    assert found.air <= 0.25 * found.cut
    assert found.lifts <= 1 + reachable.regions(np.radians(90.0))


@pytest.mark.parametrize("name", ["stairs", pytest.param("crossing_slots", marks=pytest.mark.slow)])
def test_raster_leaves_what_the_ball_forbids(name):
    holds(*measured(name, "raster"), "raster")


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
