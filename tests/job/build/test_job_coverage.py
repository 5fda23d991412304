"""What a job's program is to machine, and how much it may leave: by its strategy and its tolerances."""

import numpy as np
import pytest

from pentapod.job import Job, run
from pentapod.job.build.specification import job_collision_world, job_coverage, job_cutting
from pentapod.job.build.toolpath import job_toolpath
from pentapod.job.build.values import job_machine, job_mesh
from pentapod.toolpath import write_stl

CLAIM = "surface left on the region"
STEPOVER = "stepover_mm = 15"
BY_DEFAULT = ("left_share = 1\n", "")


def block(scale=1.0):
    """STL of a block of 80 × 60 × 30 mm with a pocket 12 mm deep and a boss of 8 mm in it, walls upright."""
    xs, ys = scale * np.array([0, 15, 33, 47, 65, 80]), scale * np.array([0, 12, 23, 37, 48, 60])
    heights = np.full((7, 7), 0.0)
    heights[1:6, 1:6], heights[2:5, 2:5], heights[3, 3] = 30.0, 18.0, 26.0
    heights *= scale
    quads = []
    for i in range(1, 6):
        for j in range(1, 6):
            (x, u), (y, v), h = xs[i - 1 : i + 1], ys[j - 1 : j + 1], heights[i, j]
            quads += [[(x, y, h), (u, y, h), (u, v, h), (x, v, h)], [(x, v, 0), (u, v, 0), (u, y, 0), (x, y, 0)]]
            # A wall to each neighbour that is lower.
            for (a, b), low in (
                (((x, y), (u, y)), heights[i, j - 1]),
                (((u, y), (u, v)), heights[i + 1, j]),
                (((u, v), (x, v)), heights[i, j + 1]),
                (((x, v), (x, y)), heights[i - 1, j]),
            ):
                if low < h:
                    quads.append([(*a, low), (*b, low), (*b, h), (*a, h)])
    return write_stl(np.array(quads, dtype=float)[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 3), "block")


@pytest.fixture
def block_job(make_job):
    """A job on that block, at its own size or scaled."""

    def make(scale=1.0, stepover=4, diameter=6, cutter='type = "ball"'):
        changes = [(STEPOVER, f"stepover_mm = {stepover}"), ("diameter_mm = 10", f"diameter_mm = {diameter}")]
        changes += [('type = "ball"', cutter)]
        return Job.load(make_job(BY_DEFAULT, *changes, mesh=block(scale)))

    return make


def coverage(job):
    return job_coverage(job, job_mesh(job))


@pytest.mark.parametrize(
    ("way", "left"),
    [
        (STEPOVER, 1.25 * 5.0),  # wider than the ball: all that its radius holds
        ("stepover_mm = 3", 1.25 * (5.0 - np.sqrt(25.0 - 2.25))),
        ("scallop_mm = 0.2", 1.25 * 0.2),
    ],
)
def test_material_that_may_be_left_follows_from_the_job(make_job, way, left):
    found = coverage(Job.load(make_job(BY_DEFAULT, (STEPOVER, way))))
    assert found.left == pytest.approx(1e-3 * (left + 0.01 + 0.05))
    assert found.share == 1e-3
    said = make_job((STEPOVER, way), ("left_share = 1", "left_mm = 0.7\nleft_share = 0.02"))
    found = coverage(Job.load(said))
    assert (found.left, found.share) == pytest.approx((7e-4, 0.02))


def test_strategies_that_draw_lines_cover_nothing_unless_the_job_says_so(make_job):
    text = (STEPOVER, 'strategy = "text"\ntext = "A"\nheight_mm = 8')
    found = coverage(Job.load(make_job(text)))
    assert found.region is None
    assert "text" in found.why
    found = coverage(Job.load(make_job(text, ("path_mm = 0.05", "path_mm = 0.05\nleft_mm = 0.7"))))
    assert found.region is not None
    assert found.left == pytest.approx(7e-4)


def test_waterlines_leave_what_is_flat_to_others(make_job):
    job = Job.load(make_job((STEPOVER, 'strategy = "waterline"\nstepover_mm = 2\nshallowest_deg = 12')))
    region = coverage(job).region
    assert region is not None
    slopes = np.degrees(np.arccos(region.facet_normals[:, 2]))
    assert slopes.min() > 6.0  # facets of a few degrees; the normals between them are smooth
    assert region.areas.sum() < job_mesh(job).facet_areas.sum()


def test_a_beam_is_asked_for_half_the_distance_of_its_lines(make_job):
    jet = ('type = "ball"\ndiameter_mm = 10', 'type = "standoff"\nstandoff_mm = 5')
    found = coverage(Job.load(make_job(jet, (STEPOVER, "stepover_mm = 2"))))
    assert found.left == pytest.approx(1e-3 * (1.25 + 0.06))


def test_the_block_is_sound_and_its_region_is_what_faces_up_and_walls(block_job):
    job = block_job()
    mesh = job_mesh(job)
    assert mesh.diagnosis.watertight
    assert mesh.diagnosis.consistent
    assert not mesh.diagnosis.inverted
    region = coverage(job).region
    assert region is not None
    walls = mesh.facet_areas[np.abs(mesh.facet_normals[:, 2]) < 1e-9].sum()
    assert region.areas.sum() == pytest.approx(80e-3 * 60e-3 + walls, rel=1e-9)
    cutting = job_cutting(job, job_collision_world(job, job_machine(job), mesh))
    assert cutting is not None
    assert cutting.coverage is not None


@pytest.mark.slow
def test_a_block_whose_motions_were_dropped_does_not_pass(block_job, tmp_path):
    """Its motions that gouge are dropped: the floor keeps a strip along the walls that the ball could have cleared."""
    job = block_job(0.4, stepover=2, diameter=3, cutter='type = "bull"\ncorner_mm = 1')
    _, reports = job_toolpath(job, job_mesh(job))
    assert "dropped" in str(reports)
    outcome = run(job, tmp_path / "out")
    found = {c.claim: c for c in outcome.verdict.certificates}[CLAIM]
    assert not found.passed
    assert found.value > 1.0
    assert "out of reach" in found.method
    assert not outcome.verdict.passed
