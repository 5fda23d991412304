"""Parts that others made, planned with every tolerance by default, above all how much may be left on their regions."""

from __future__ import annotations

import pytest

from pentapod.job import Job
from pentapod.pipeline import run

pytestmark = pytest.mark.parts

WAVY, FACADE, TORUS = "wavy_mesh_with_hole.ply", "facade_infill_open_mid_res.stl", "torus.STL"
SIDEWAYS = 'unit = "mm"\nregion_direction = [1, 0, 0]\n'
PARTS = {  # mesh, [part], stepover of a ball of 6 mm in mm
    "a hole": (WAVY, 'unit = "mm"\nscale = 10\nregion_box_mm = [[35, 35, -100], [75, 75, 100]]', 3),
    "a wavy sheet": (WAVY, 'unit = "mm"\nscale = 10', 2),
    "a patch of a facade": (FACADE, SIDEWAYS + "region_box_mm = [[-100, -30, 70], [100, 30, 130]]", 3),
    "a facade": (FACADE, SIDEWAYS + "region_box_mm = [[-100, -60, 40], [100, 60, 160]]", 2),
    "a small torus": (TORUS, 'unit = "mm"\nscale = 20\nregion_angle_deg = 40', 3),
    "a torus": (TORUS, 'unit = "mm"\nscale = 40\nregion_angle_deg = 40', 2),
    "a fan disk": ("fandisk.obj", 'unit = "mm"\nscale = 60\nregion_angle_deg = 30', 2),
    "a sphere": ("unit_sphere.STL", 'unit = "mm"\nscale = 50\nregion_angle_deg = 35', 2),
    "a tray": (
        "1002_tray_bottom.STL",
        'unit = "mm"\nscale = 0.3\nregion_direction = [0, 1, 0]\nregion_angle_deg = 30',
        3,
    ),
}
QUICK = {"a hole", "a patch of a facade", "a small torus"}


@pytest.fixture
def planned(tmp_path, parts):
    """Plan a part with a ball of 6 mm at a stepover, mm."""

    def plan(mesh: str, part: str, stepover: float):
        assert (parts / mesh).is_file()
        job = tmp_path / "job.toml"
        job.write_text(
            f'[part]\nmesh = "${{PENTAPOD_PARTS}}/{mesh}"\n{part}\n[tool]\ntype = "ball"\ndiameter_mm = 6\n'
            f"[toolpath]\nstepover_mm = {stepover}\n[feed]\ncut_mm_min = 3000\n"
        )
        return run(Job.load(job), tmp_path / "out")

    return plan


def left_on(outcome):
    return {c.claim: c for c in outcome.verdict.certificates}["surface left on the region"]


@pytest.mark.parametrize("name", [n if n in QUICK else pytest.param(n, marks=pytest.mark.slow) for n in PARTS])
def test_parts_by_others(name, planned):
    outcome = planned(*PARTS[name])
    assert outcome.passed, outcome.refusal or [c for c in outcome.verdict.certificates if not c.passed]
    assert left_on(outcome).bound == 0.1


def test_a_part_too_large_for_the_machine(planned, tmp_path):
    outcome = planned("wavy_vase_open_low_res.stl", 'unit = "mm"', 25)
    assert outcome.refusal is not None
    assert outcome.refusal.blames
    assert not (tmp_path / "out" / "program.csv").exists()
