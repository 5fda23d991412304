"""The map of what the cutter leaves: heights against balls at the program's rows, and what the page shows of it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from page_arrays import page_arrays, page_data
from pentapod.cli.commands.new import dome_stl
from pentapod.job import Job, run
from pentapod.mesh import Mesh
from pentapod.program import Program
from pentapod.report import write_report
from pentapod.toolpath import Toolpath
from pentapod.verify.verdict.material_left import MaterialLeft
from pentapod.view.opened_run import open_run
from pentapod.view.stored import placed_path, stored_outcome
from usual_job import job_text

RADIUS = 5e-3


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    folder = tmp_path_factory.mktemp("left")
    (folder / "part.stl").write_bytes(dome_stl(cells=12))
    (folder / "job.toml").write_text(job_text().replace("stepover_mm = 15", "stepover_mm = 4"), encoding="utf-8")
    return folder, run(Job.load(folder / "job.toml"), folder / "out")


def test_heights_are_those_above_which_no_ball_has_been(planned):
    """Along the normal, step by step, until a ball about one of the rows' centres holds the point."""
    _, outcome = planned
    left, program, toolpath = outcome.verdict.left, outcome.find(Program), outcome.find(Toolpath)
    position, direction = outcome.machine.robot.pose(program.legs, program.component)
    along = outcome.machine.tool_length - toolpath.tilt_centre
    centres = cKDTree(program.placement.inverse().apply(position + along * direction))
    mesh = outcome.find(Mesh)
    corners = mesh.vertices[mesh.faces]
    heights = np.arange(0.0, 1.5e-3, 2e-6)
    chosen = np.arange(0, len(left.points), len(left.points) // 60)
    for point, height in zip(left.points[chosen], left.heights[chosen], strict=True):
        normal = mesh.facet_normals[facet_of(corners, point)]
        far = centres.query(point + heights[:, None] * normal)[0]
        inside = np.flatnonzero(far <= RADIUS)
        truth = heights[inside[0]] if len(inside) else left.far
        assert -4e-6 <= height - truth <= 0.03 * left.allowed, "an upper bound, by straight stretches"
    assert np.quantile(left.heights, 0.9) > 0.2e-3, "the passes are wide apart"


def facet_of(corners, point) -> int:
    """The facet (F, 3, 3) that holds a point, by areas."""
    parts = [np.linalg.norm(np.cross(corners[:, k] - point, corners[:, k - 1] - point), axis=1) for k in range(3)]
    whole = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return int((sum(parts) - whole).argmin())


def test_points_are_spread_evenly_over_the_region(planned):
    _, outcome = planned
    points = outcome.verdict.left.points
    mesh = outcome.find(Mesh)
    middles = mesh.vertices[mesh.faces].mean(axis=1)
    side = points[:, 0] > 0.0
    areas = mesh.facet_areas[middles[:, 0] > 0.0].sum() / mesh.facet_areas.sum()
    assert side.mean() == pytest.approx(areas, abs=2e-3)
    nearest = cKDTree(points).query(points, k=2)[0][:, 1]
    assert nearest.max() < 3.0 * np.sqrt(mesh.facet_areas.sum() / len(points))


@pytest.mark.slow
def test_a_spot_is_shown_where_the_path_passes_it(planned, tmp_path):
    """A spot of 4 mm on the top of the part: the keys that tell it are beside it, and none is far away."""
    _, outcome = planned
    left, program, toolpath = outcome.verdict.left, outcome.find(Program), outcome.find(Toolpath)
    spot = left.points[left.points[:, 2].argmax()]
    heights = np.where(np.linalg.norm(left.points - spot, axis=1) < 4e-3, 1e-3, 0.0)
    verdict = replace(outcome.verdict, left=MaterialLeft(left.points, heights, left.allowed, left.far))
    shown = replace(outcome, verdict=verdict)
    arrays = page_arrays(write_report(shown, tmp_path / "report.html").read_text(encoding="utf-8"))
    times, told = arrays["key.time"][:, 0], arrays["key.left"][:, 0] > 0.5
    position, direction = outcome.machine.robot.pose(program.legs, program.component)
    along = outcome.machine.tool_length - toolpath.tilt_centre
    far = np.linalg.norm(program.placement.inverse().apply(position + along * direction) - spot, axis=1)
    key = np.searchsorted(times, program.times + 1e-9) - 1
    beside = np.unique(key[far < RADIUS + 1e-3])
    assert len(beside) > 2
    assert told[beside].all()
    assert 0 < told.sum() < 0.1 * len(told)
    # No farther than the spot's edge, half of the distance between passes, and a stretch between keys.
    nearest = np.array([far[key == k].min(initial=np.inf) for k in np.flatnonzero(told)])
    assert nearest.max() < RADIUS + 9e-3


def test_the_page_colours_the_path_by_it_and_so_does_a_run_read_back(planned, tmp_path):
    folder, outcome = planned
    page = write_report(outcome, tmp_path / "report.html").read_text(encoding="utf-8")
    left, shown = outcome.verdict.left, page_arrays(page)["key.left"][:, 0]
    scale = {scale["name"]: scale for scale in page_data(page)["motion"]["scales"]}["material left"]
    assert scale["worst"] == pytest.approx(1e3 * left.allowed)
    assert shown.max() == pytest.approx(1e3 * left.heights.max(), abs=1e-3)
    # Even passes leave even ridges: few keys miss them by the chance of where the points are.
    assert np.quantile(shown, 0.2) > 0.7 * np.quantile(shown, 0.9) > 0.2
    opened = open_run(folder / "out")
    back = stored_outcome(opened, placed_path(opened)).verdict.left
    assert np.abs(back.heights - left.heights).max() < 1e-12
    assert back.allowed == pytest.approx(left.allowed)
