"""[placement]: what a job allows is what the planner gets, and mistakes are named."""

from __future__ import annotations

import numpy as np
import pytest

from pentapod.base.errors import JobError
from pentapod.job import Job
from pentapod.job.build.placement import job_constraints
from pentapod.job.build.values import job_machine, job_mesh
from pentapod.planning import PlacementConstraints
from pentapod.planning.problem.constraints import FREE

HEAD = "[placement]\n"


def load(make_job, placement: str) -> Job:
    path = make_job()
    path.write_text(path.read_text().split(HEAD)[0] + HEAD + placement)
    return Job.load(path)


def constraints_of(job: Job) -> PlacementConstraints:
    return job_constraints(job, job_machine(job), job_mesh(job))


def test_placement_mode_free_bounds_nothing(make_job):
    assert constraints_of(load(make_job, 'mode = "free"\n')) is FREE


def test_placement_box_and_largest_turn(make_job):
    constraints = constraints_of(
        load(make_job, "box_mm = [[10, 90, 500], [-10, 20, 600]]\nrotation_deg = [180, 0, 0]\nlargest_turn_deg = 30\n")
    )
    np.testing.assert_allclose(constraints.low, [-0.01, 0.02, 0.5])
    np.testing.assert_allclose(constraints.high, [0.01, 0.09, 0.6])
    np.testing.assert_allclose(constraints.reference, np.diag([1.0, -1.0, -1.0]), atol=1e-15)
    assert constraints.largest_turn == pytest.approx(np.pi / 6.0)


@pytest.mark.parametrize("up", [(0, 0, 1), (0, -1, 0), (1, 2, -2)])
def test_placement_on_a_table_rests_on_the_lowest_point(up, make_job):
    """Every allowed placement: the mesh touches the table's surface from above and is nowhere below it."""
    job = load(make_job, f'mode = "table"\ntable_z_mm = 640\ntable_x_mm = [-50, 50]\nup = {list(up)}\n')
    constraints, rng = constraints_of(job), np.random.default_rng(0)
    random = np.linalg.qr(rng.normal(size=(20, 3, 3)))[0]
    random *= np.linalg.det(random)[:, None, None]
    rotations, origins = constraints.within(random, rng.normal(size=(20, 3)), rng)
    vertices = job_mesh(job).vertices
    for rotation, origin in zip(rotations, origins, strict=True):
        z = (vertices @ rotation.T + origin)[:, 2]
        assert z.max() == pytest.approx(0.64, abs=1e-9)  # z points down, from the base to the table
        assert abs(origin[0]) <= 0.05


def test_the_digest_of_a_job_counts_the_turn_on_the_table(make_job):
    """And a job that does not give it keeps its digest."""
    table = 'mode = "table"\ntable_z_mm = 640\n'
    free, turned = load(make_job, table), load(make_job, f"{table}table_turn_deg = [0, 0]\n")
    constraints = constraints_of(turned)
    assert (constraints.largest_turn, constraints.motion.shape) == (0.0, (6, 2))
    np.testing.assert_allclose(constraints.reference, np.diag([1.0, -1.0, -1.0]), atol=1e-15)
    assert free.digest == load(make_job, table).digest != turned.digest


def test_fixture_poses_are_the_placements_to_choose_from(make_job):
    constraints = constraints_of(
        load(make_job, 'mode = "fixture"\nposes_mm_deg = [[1, 2, 3, 0, 0, 0], [4, 5, 6, 0, 0, 90]]\n')
    )
    first, second = constraints.poses
    np.testing.assert_allclose(first.translation, [1e-3, 2e-3, 3e-3])
    np.testing.assert_allclose(second.rotate([1.0, 0.0, 0.0]), [0.0, 1.0, 0.0], atol=1e-15)
    assert not constraints.moves


MISTAKES = {
    'mode = "table"': ("placement.table_z_mm", "missing"),
    'mode = "table"\ntable_z_mm = 600\ntable_x_mm = [5, 4]': ("placement.table_x_mm", "empty"),
    'mode = "table"\ntable_z_mm = 600\ntable_turn_deg = [90, 0]': ("placement.table_turn_deg", "empty"),
    'mode = "free"\ntable_turn_deg = [0, 0]': ("placement.table_turn_deg", "means nothing"),
    'mode = "table"\ntable_z_mm = 600\nup = [0, 0, 0]': ("placement.up", "zero"),
    'mode = "table"\ntable_z_mm = 600\nbox_mm = [[0, 0, 0], [1, 1, 1]]': ("placement.box_mm", "means nothing"),
    'mode = "fixture"': ("placement.poses_mm_deg", "missing"),
    'mode = "fixture"\nposes_mm_deg = []': ("placement.poses_mm_deg",),
    'mode = "fixture"\nposes_mm_deg = [[1, 2, 3, 0, 0]]': ("placement.poses_mm_deg", "too few numbers"),
    'mode = "free"\nup = [0, 1, 0]': ("placement.up", "means nothing"),
    "rotation_deg = [180, 0, 0]": ("placement.largest_turn_deg", "bounds nothing"),
    "largest_turn_deg = 200": ("placement.largest_turn_deg", "out of range"),
    'mode = "fixed"\nposition_mm = [0, 0, 0]\ntable_z_mm = 3': ("placement.table_z_mm", 'mode = "table"'),
    'mode = "shelf"': ("placement.mode", "shelf"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistakes_are_one_clear_line(mistake, make_job):
    with pytest.raises(JobError) as caught:
        load(make_job, mistake + "\n")
    for piece in MISTAKES[mistake]:
        assert piece in str(caught.value)
