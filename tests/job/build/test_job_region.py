"""The part as a job sees it: turned over, its region told, and refused at once where its unit cannot be right."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pentapod.base.errors import JobError, ToolpathError
from pentapod.cli.commands.new import dome_stl
from pentapod.cli.main import run as run_cli
from pentapod.job import Job, run
from pentapod.job.build.reach import check_reach
from pentapod.job.build.region import region_report
from pentapod.job.build.toolpath import job_toolpath
from pentapod.job.build.values import job_machine, job_mesh
from pentapod.machine.machine import Machine
from pentapod.machine.reach import reach, tip_cells
from pentapod.mesh import write_stl
from pentapod.mesh.io.stl import read_stl
from refused_jobs import Refused, cap

UNIT = 'unit = "mm"'


def facets():
    return read_stl(Path("part.stl"), dome_stl(cells=12))


def turned_over():
    return write_stl(facets()[:, ::-1], "dome")


def checked(path):
    job = Job.load(path)
    check_reach(job, job_machine(job), job_mesh(job))


def test_a_sheet_that_shows_its_back_is_turned_over_by_flip(make_job):
    back = turned_over()
    job = Job.load(make_job(mesh=back))
    with pytest.raises(ToolpathError, match="faces away from the direction"):
        job_toolpath(job, job_mesh(job))
    job = Job.load(make_job((UNIT, UNIT + "\nflip = true"), mesh=back))
    mesh = job_mesh(job)
    assert "all facets turned over" in str(mesh.diagnosis)
    usual = Job.load(make_job(name="usual.toml"))
    np.testing.assert_allclose(
        job_toolpath(job, mesh)[0].tips, job_toolpath(usual, job_mesh(usual))[0].tips, atol=1e-12
    )


def test_flip_changes_the_digest_only_where_it_is_used(make_job):
    digests = [Job.load(make_job((UNIT, UNIT + more))).digest for more in ("", "\nflip = false", "\nflip = true")]
    assert digests[0] == digests[1] != digests[2]


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ("", []),
        ("\nregion_angle_deg = 8", ["problem: less than half of what faces the direction is machined", "is steeper"]),
        ("\nregion_box_mm = [[-7, -7, -9], [7, 7, 9]]", ["% is outside region_box_mm", "stepover_mm = 15 is wider"]),
    ],
)
def test_the_share_of_the_region_is_printed(make_job, tmp_path, capsys, more, words):
    job = make_job((UNIT, UNIT + more))
    assert run_cli(["toolpath", str(job), "-o", str(tmp_path / "a.npz")]) == 0
    said = capsys.readouterr().out
    assert "region: " in said
    assert ("region: 100 % of the surface" in said) == (not more)
    assert all(word in said for word in words)
    assert ("problem" in said) == bool(words)


def test_a_part_somewhat_too_wide_is_asked_about(make_job, tmp_path, capsys):
    job = make_job((UNIT, 'unit = "cm"\nscale = 0.4\nregion_box_mm = [[-30, -30, -99], [30, 30, 99]]'))
    assert run_cli(["toolpath", str(job), "-o", str(tmp_path / "a.npz")]) == 0
    said = capsys.readouterr().out
    assert 'the part is 240 mm wide, the work volume of the machine 150 mm: is unit = "cm" in [part] right?' in said


def test_a_part_that_is_smaller_than_its_cutter_is_asked_about(make_job, tmp_path, capsys):
    job = make_job((UNIT, 'unit = "mm"\nscale = 0.1'), ("stepover_mm = 15", "stepover_mm = 2"))
    assert run_cli(["toolpath", str(job)]) == 0
    said = capsys.readouterr().out
    assert 'the part is 6 mm wide, the cutter 10 mm: is unit = "mm" in [part] right?' in said
    assert "wrote" not in said


def test_an_open_surface_that_mostly_shows_its_back_is_told_of_flip(make_job):
    mostly = facets()
    mostly[30:] = mostly[30:, ::-1]
    job = Job.load(make_job(mesh=write_stl(mostly, "dome")))
    assert "flip = true" in str(region_report(job, job_mesh(job)))


@pytest.mark.parametrize(("unit", "width"), [("cm", "600"), ("inch", "1,524"), ("m", "60,000")])
def test_a_wrong_unit_is_refused_before_the_toolpath(make_job, unit, width):
    path = make_job((UNIT, f'unit = "{unit}"'))
    message = rf'job\.toml:3: part.unit: the part is {width} mm wide, the work volume 150 mm .*unit = "mm"\?'
    with pytest.raises(JobError, match=message):
        checked(path)
    assert run_cli(["plan", str(path), "-o", str(path.parent / "out"), "-q"]) == 2


def test_what_could_be_planned_is_not_refused_for_its_size(make_job):
    """A small region of a large part, more set-ups, lines that may lie anywhere."""
    inch = (UNIT, 'unit = "inch"')
    checked(make_job((UNIT, 'unit = "cm"\nregion_box_mm = [[-300, -300, -999], [300, 300, 999]]')))
    checked(make_job((UNIT, 'unit = "inch"\nregion_box_mm = [[-100, -100, -999], [100, 100, 999]]')))
    free = ('mode = "fixed"\nposition_mm', "# position_mm"), ("rotation_deg = [180, 0, 0]", "setups = 4")
    checked(make_job(inch, *free))
    with pytest.raises(JobError, match="scale"):
        checked(make_job((UNIT, 'unit = "mm"\nscale = 100'), *free))


def test_no_tip_is_farther_from_another_than_the_reach():
    """Tips of legs drawn at random: every one is in a cell, and no two are farther apart than the bound."""
    machine = Machine.load("desk")
    rng = np.random.default_rng(3)
    tips = rng.uniform([-0.7, -0.7, -0.2], [0.8, 0.7, 1.1], (200_000, 3))
    axes = rng.normal(size=tips.shape)
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    position = tips - machine.tool_length * axes
    vectors = machine.robot.leg_vectors(position, axes)
    lengths = np.linalg.norm(vectors, axis=2)
    legs, joints = machine.legs, machine.joints
    held = ((lengths >= legs.min_length) & (lengths <= legs.max_length)).all(axis=1)
    held &= (np.einsum("nki,ki->nk", vectors, joints.base_axes) >= np.cos(joints.base_cone) * lengths).all(axis=1)
    tips = tips[held]
    assert len(tips) > 1000
    middles, radius = tip_cells(machine)
    assert max(np.linalg.norm(middles - tip, axis=1).min() for tip in tips[:500]) <= radius
    apart = np.linalg.norm(tips[:, None] - tips[None, ::20], axis=2).max()
    assert 0.5 * reach(machine) < apart <= reach(machine)


def test_a_wrong_unit_is_told_where_the_box_in_the_right_one_holds_nothing(make_job):
    """A box of some millimetres beside the origin: no part of the region lies in it once the numbers are inches."""
    box = "\nregion_box_mm = [[25, 25, -99], [60, 60, 99]]"
    inch = make_job((UNIT, 'unit = "m"' + box.replace("-99", "30")))
    with pytest.raises(JobError, match=r'part.unit: .*unit = "mm"\?'):
        checked(inch)
    checked(make_job((UNIT, UNIT + box)))


@pytest.mark.slow
def test_waterlines_leave_large_flat_facets_out(tmp_path):
    """Three rings of facets, of 8, 25 and 42 deg: the smooth normals of the first one reach 17 deg."""
    tables = {"axis": {"mode": "auto"}, "toolpath": {"strategy": "waterline", "stepover_mm": 2.0}}
    tables["tolerance"] = {"left_share": 0.001}
    job = Job.load(Refused(cap(30.0, 50.0, 3), tables).write(tmp_path))
    assert run(job, tmp_path / "out", advice=None).passed
