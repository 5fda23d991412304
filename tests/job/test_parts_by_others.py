"""Parts that others made, planned with every tolerance by default, above all how much may be left on their regions."""

from __future__ import annotations

import re

import numpy as np
import pytest
from trimesh.proximity import closest_point

from pentapod.cli.main import run as command
from pentapod.job import Job, run
from pentapod.job.build.values import job_mesh
from pentapod.toolpath import Toolpath

pytestmark = pytest.mark.parts

FACADE, TORUS = "facade_infill_open_mid_res.stl", "torus.STL"
SIDEWAYS = 'unit = "mm"\nregion_direction = [1, 0, 0]\n'
PARTS = {  # mesh, [part], stepover of a ball of 6 mm in mm
    "a wavy sheet with a hole": ("wavy_mesh_with_hole.ply", 'unit = "mm"\nscale = 10', 2),
    "a patch of a facade": (FACADE, SIDEWAYS + "region_box_mm = [[-100, -30, 70], [100, 30, 130]]", 3),
    "a facade": (FACADE, SIDEWAYS + "region_box_mm = [[-100, -60, 40], [100, 60, 160]]", 2),
    "a small torus": (TORUS, 'unit = "mm"\nscale = 20\nregion_angle_deg = 40', 3),
    "the top of a torus": (TORUS, 'unit = "mm"\nscale = 15\nregion_angle_deg = 20', 3),
    "a torus": (TORUS, 'unit = "mm"\nscale = 40\nregion_angle_deg = 40', 2),
    "a fan disk": ("fandisk.obj", 'unit = "mm"\nscale = 60\nregion_angle_deg = 30', 2),
    "a sphere": ("unit_sphere.STL", 'unit = "mm"\nscale = 50\nregion_angle_deg = 35', 2),
    "a tray": (
        "1002_tray_bottom.STL",
        'unit = "mm"\nscale = 0.3\nregion_direction = [0, 1, 0]\nregion_angle_deg = 30',
        3,
    ),
}
CLAIM = "surface left on the region"
QUICK = {"the top of a torus", "wavy_mesh_with_hole.ply"}
BY_DEFAULT = (
    FACADE, TORUS, "wavy_mesh_with_hole.ply", "fandisk.obj", "unit_sphere.STL", "1002_tray_bottom.STL",
    "octagonal_pocket.stl", "teapot.stl", "busted.STL", "wavy_vase_open_low_res.stl",
)  # fmt: skip


@pytest.fixture
def planned(tmp_path, parts):
    """Plan a part with a ball of 6 mm at a stepover, mm, and further keys of the toolpath."""

    def plan(mesh: str, part: str, stepover: float, toolpath: str = ""):
        assert (parts / mesh).is_file()
        job = tmp_path / "job.toml"
        job.write_text(
            f'[part]\nmesh = "${{PENTAPOD_PARTS}}/{mesh}"\n{part}\n[tool]\ntype = "ball"\ndiameter_mm = 6\n'
            f"[toolpath]\nstepover_mm = {stepover}\n{toolpath}\n[feed]\ncut_mm_min = 3000\n"
        )
        return run(Job.load(job), tmp_path / "out", advice=None)

    return plan


def left_on(outcome):
    return {c.claim: c for c in outcome.verdict.certificates}[CLAIM]


@pytest.mark.parametrize("name", [n if n in QUICK else pytest.param(n, marks=pytest.mark.slow) for n in PARTS])
def test_parts_by_others(name, planned):
    outcome = planned(*PARTS[name])
    assert outcome.passed, outcome.refusal or [c for c in outcome.verdict.certificates if not c.passed]
    assert left_on(outcome).bound == 0.1


@pytest.mark.parametrize("name", [n if n in QUICK else pytest.param(n, marks=pytest.mark.slow) for n in BY_DEFAULT])
def test_parts_by_others_are_planned_as_new_proposes(name, tmp_path, parts):
    job = tmp_path / "job.toml"
    assert command(["new", str(parts / name), "-o", str(job), "--quiet"]) == 0
    outcome = run(Job.load(job), tmp_path / "out", advice=None)
    assert outcome.passed, outcome.refusal or [c for c in outcome.verdict.certificates if not c.passed]


def test_a_soup_of_facets_is_no_part(tmp_path, parts, capsys):
    assert command(["new", str(parts / "soup.stl"), "-o", str(tmp_path / "job.toml")]) == 2
    assert "do not join" in capsys.readouterr().err


@pytest.mark.slow
def test_a_part_with_upright_walls_keeps_what_the_raster_left_out(planned):
    """It fails by that alone, and truly: at the place named the ball has room, and no motion takes it there.

    Fill would take the ball along the feet of the walls.
    """
    outcome = planned("octagonal_pocket.stl", 'unit = "m"\nscale = 0.6\nregion_angle_deg = 30', 2, "fill = false")
    assert [c.claim for c in outcome.verdict.certificates if not c.passed] == [CLAIM]
    left = left_on(outcome)
    assert 9.0 < left.value < 11.0
    radius, number = 3e-3, r"(-?[\d.]+)"
    found = re.search(rf"at x {number}, y {number}, z {number} mm", left.method)
    assert found is not None
    place = 1e-3 * np.array([float(text) for text in found.groups()])
    toolpath = outcome.find(Toolpath)
    assert toolpath is not None
    chords = np.stack([toolpath.tilt_centres[:-1], toolpath.tilt_centres[1:]], axis=1)
    along = np.clip(np.einsum("ij,ij->i", place - chords[:, 0], np.diff(chords, axis=1)[:, 0]), 0.0, None)
    along /= np.maximum((np.diff(chords, axis=1)[:, 0] ** 2).sum(axis=1), 1e-30)
    nearest = chords[:, 0] + np.minimum(along, 1.0)[:, None] * np.diff(chords, axis=1)[:, 0]
    missed = np.linalg.norm(nearest - place, axis=1).min()
    # A ball a little smaller has room nearer to the place, and goes straight up from there.
    centres = place + np.random.default_rng(0).uniform(-missed, missed, (50_000, 3))
    centres = centres[np.linalg.norm(centres - place, axis=1) < missed - 3e-4]
    mesh = job_mesh(outcome.job).to_trimesh()
    centres = centres[closest_point(mesh, centres)[1] > 0.98 * radius]
    lifts = centres[:, None] + np.linspace(0.0, 0.05, 101)[:, None] * [0.0, 0.0, 1.0]
    room = closest_point(mesh, lifts.reshape(-1, 3))[1].reshape(len(lifts), -1)
    assert (room.min(axis=1) > 0.98 * radius).any()


@pytest.mark.slow  # in the fast lane: refusals of smaller jobs, and their advice
def test_a_part_too_large_for_the_machine(planned, tmp_path):
    outcome = planned("wavy_vase_open_low_res.stl", 'unit = "mm"', 25)
    assert outcome.refusal is not None
    assert outcome.refusal.diagnosis
    assert not (tmp_path / "out" / "program.csv").exists()
