"""Jobs that `pentapod new PART` proposes: unit, side, region, cutter and strategy from size and shape."""

from __future__ import annotations

import json

import numpy as np
import pytest
import trimesh

from pentapod.base.errors import MeshError
from pentapod.cli.commands.new import dome_stl, job_text
from pentapod.cli.main import run as run_cli
from pentapod.job import Job, run
from pentapod.job.build.placement import job_constraints
from pentapod.job.build.reach import check_reach
from pentapod.job.build.region import job_region, region_report
from pentapod.job.build.toolpath import job_toolpath
from pentapod.job.build.values import job_machine, job_mesh
from pentapod.job.proposal.proposal import propose
from pentapod.machine.machine import Machine
from pentapod.mesh.patch import Patch
from pentapod.toolpath import SegmentKind
from slotted_parts import slotted

DESK = Machine.load("desk")


def dome(scale=1.0, turn=lambda facets: facets):
    """Facets of a shallow dome over a square of 60 units."""
    facets = trimesh.load_mesh(trimesh.util.wrap_as_stream(dome_stl(cells=12)), file_type="stl", process=False)
    return trimesh.Trimesh(**trimesh.triangles.to_kwargs(turn(scale * facets.triangles)), process=False)


def proposed(folder, shape, name="part.stl"):
    shape.export(folder / name)
    proposal = propose(folder / name, DESK, "desk")
    tables = {**proposal.tables, "part": {"mesh": name, **proposal.tables["part"]}}
    (folder / "part.toml").write_text(job_text(tables, proposal.reasons), encoding="utf-8")
    return Job.load(folder / "part.toml"), proposal


def with_debris(shape, count=3):
    """A shape and a few pieces of 2 units beside it, of two facets each."""
    corners = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.1], [2.0, 2.0, 0.0], [0.0, 2.0, 0.1]])
    pieces = [
        trimesh.Trimesh(corners + np.array([70.0 + 5.0 * k, 9.0 * k, 4.0]), [[0, 1, 2], [0, 2, 3]])
        for k in range(count)
    ]
    return trimesh.util.concatenate([shape, *pieces])


SHAPES = {
    "dome": (dome, {}),
    "dome in metres": (lambda: dome(1e-3), {"unit": "m"}),
    "dome in inches": (lambda: dome(1 / 25.4), {"unit": "inch"}),
    "dome wound downwards": (lambda: dome(turn=lambda facets: facets[:, ::-1]), {"flip": True}),
    "scan with debris": (lambda: with_debris(dome()), {"least_body_mm": 11.2}),
    "two open parts": (lambda: with_debris(dome(0.05)), {}),
    "dome on its side": (lambda: dome(turn=lambda f: f[..., [2, 0, 1]]), {"region_direction": (1.0, 0.0, 0.0)}),
    "plate on edge": (lambda: trimesh.creation.box((90, 4, 70)), {"region_direction": (0.0, 1.0, 0.0)}),
    "block": (lambda: trimesh.creation.box((80, 60, 31)), {}),
    "block inside out": (lambda: inside_out(trimesh.creation.box((80, 60, 31))), {"repair": True}),
}


def inside_out(shape):
    shape.invert()
    return shape


@pytest.mark.parametrize("name", SHAPES)
def test_unit_and_side_follow_from_size_and_shape(tmp_path, name):
    make, expected = SHAPES[name]
    job, proposal = proposed(tmp_path, make())
    usual = {"unit": "mm", "least_body_mm": None, "flip": False, "repair": False, "region_direction": (0.0, 0.0, 1.0)}
    assert {key: getattr(job.part, key) for key in usual} == usual | expected
    mesh, machine = job_mesh(job), job_machine(job)
    assert mesh.diagnosis.problems == ()
    walls = "block" in name or "plate" in name
    assert job.part.region_angle_deg is None
    assert job.toolpath.steep_deg == (60.0 if walls else None)
    assert any("upright walls" in remark for remark in proposal.remarks) == walls
    assert (job.part.region_box_mm is not None) == walls
    assert "problem" not in str(region_report(job, mesh))
    check_reach(job, machine, mesh)
    assert job.axis.mode == "auto"
    assert job.placement.mode == "table"
    assert f"unit is {usual['unit'] if 'unit' not in expected else expected['unit']}: a guess" in proposal.remarks[0]
    assert "a guess: the file does not say it" in job.path.read_text()


def test_the_middle_of_the_region_stands_in_the_middle_of_the_work_volume(tmp_path):
    for name in ("dome", "dome on its side", "block"):
        job, _ = proposed(tmp_path, SHAPES[name][0]())
        mesh = job_mesh(job)
        constraints = job_constraints(job, DESK, mesh)
        heights = mesh.vertices @ np.array(job.part.region_direction)
        up = np.ptp(heights) * 0.5 * 1e3
        assert DESK.work.centre[2] * 1e3 == pytest.approx(job.placement.table_z_mm - up, abs=0.02)
        assert constraints.moves


def test_a_plate_thinner_than_the_ball_is_machined_where_the_ball_stays_above_its_foot(tmp_path):
    job, proposal = proposed(tmp_path, trimesh.creation.box((45, 45, 0.4)))
    mesh, ball = job_mesh(job), 0.5e-3 * job.tool.diameter_mm
    assert job.part.region_box_mm is None
    assert ball * (1.0 - np.cos(np.radians(job.part.region_angle_deg))) <= 0.4e-3
    assert job.toolpath.steep_deg is None
    assert any("into the table" in remark for remark in proposal.remarks)
    toolpath, _ = job_toolpath(job, mesh)
    centres = np.concatenate([s.tips + ball * s.axes for s in toolpath.segments if s.kind is SegmentKind.CUT])
    assert centres[:, 2].min() - ball >= mesh.bounds[0][2]
    assert np.ptp(centres[:, :2], axis=0).min() > 0.04


def ridged(height, count=24):
    """A plate of 60 × 40 × 1 units with ridges along x on it, whose sides are steeper than 60°."""
    y = np.linspace(-20.0, 20.0, 2 * count + 1)
    top = np.stack([y, np.where(np.arange(len(y)) % 2, 1.0 + height, 1.0)], axis=1)
    section = np.concatenate([top, np.stack([y, np.zeros(len(y))], axis=1)])
    corners = np.concatenate([np.c_[np.full(len(section), x), section] for x in (-30.0, 30.0)])
    n, k = len(y), np.arange(len(y) - 1)
    front = np.stack([k, k + 1, k + 1 + n, k + n], axis=1)  # strips from the top down to the foot
    below = np.stack([k + n, k + 1 + n, k + 1 + 3 * n, k + 3 * n], axis=1)
    sides = np.array([[0, n, 3 * n, 2 * n], [3 * n - 1, 4 * n - 1, 2 * n - 1, n - 1]])
    quads = np.concatenate([front, front[:, ::-1] + 2 * n, below, below[:, ::-1] - n, sides])
    return trimesh.Trimesh(corners, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]), process=False)


def test_a_part_low_beside_the_usual_ball_gets_a_smaller_one(tmp_path):
    """6 mm fit a part of 60 mm, but that ball would reach below the foot of all ridges."""
    job, proposal = proposed(tmp_path, ridged(2.2))
    assert job_mesh(job).diagnosis.watertight
    assert 0.3 * 6.0 <= job.tool.diameter_mm < 6.0
    assert "below most" in proposal.reasons["tool", "diameter_mm"]
    steepest = np.degrees(np.arctan(2.2 / (20.0 / 24.0)))
    assert job.part.region_angle_deg >= steepest
    assert 0.5 * job.tool.diameter_mm * (1.0 - np.cos(np.radians(steepest))) <= 1.0


def test_a_narrow_part_gets_a_narrow_ball(tmp_path):
    job, _ = proposed(tmp_path, trimesh.creation.box((60, 6, 5)))
    assert job.tool.diameter_mm == 2.0


def test_the_height_of_a_pole_counts_for_its_ball(tmp_path):
    """A pole on a plate, of which a box at the pole is machined from above: the work volume is not as high."""
    plate, pole = trimesh.creation.box((105, 105, 20)), trimesh.creation.capsule(height=150.0, radius=7.5)
    job, _ = proposed(tmp_path, trimesh.util.concatenate([plate, pole]))
    assert job.part.region_box_mm[0][2] > 10.0
    assert job.tool.diameter_mm >= 4.0


def test_walls_are_machined_down_to_where_the_ball_would_reach_into_the_table(tmp_path):
    job, proposal = proposed(tmp_path, SHAPES["block"][0]())
    mesh, ball = job_mesh(job), 0.5e-3 * job.tool.diameter_mm
    low, high = np.sort(1e-3 * np.array(job.part.region_box_mm), axis=0)
    assert low[2] - mesh.bounds[0][2] == pytest.approx(ball, abs=1e-5)
    assert (low[:2] < mesh.bounds[0][:2]).all()
    assert (high > mesh.bounds[1]).all()
    assert any("into the table" in remark for remark in proposal.remarks)
    toolpath, _ = job_toolpath(job, mesh)
    centres = np.concatenate([s.tips + ball * s.axes for s in toolpath.segments if s.kind is SegmentKind.CUT])
    assert centres[:, 2].min() - ball >= mesh.bounds[0][2] - 1e-5
    beside = centres[centres[:, 2] < mesh.bounds[1][2]]
    # On all four sides, and from the top of the walls to their foot, in waterlines no farther apart than a stepover.
    assert {tuple(np.sign(np.round(c[:2] / (mesh.bounds[1][:2] + 0.99 * ball), 0)).astype(int)) for c in beside} >= {
        (1, 0), (-1, 0), (0, 1), (0, -1)
    }  # fmt: skip
    lines = np.unique(np.round(beside[:, 2], 6))
    assert lines.min() < mesh.bounds[0][2] + ball + 0.6e-3 * job.toolpath.stepover_mm
    assert np.diff(lines).max() < 1.01e-3 * job.toolpath.stepover_mm


def test_steep_surfaces_get_waterlines_and_long_ones_passes_along_them(tmp_path):
    assert proposed(tmp_path, trimesh.creation.cone(20, 50))[0].toolpath.strategy == "waterline"
    assert proposed(tmp_path, trimesh.creation.box((30, 30, 60)))[0].toolpath.strategy == "raster"  # its top is flat
    job, _ = proposed(tmp_path, trimesh.creation.box((30, 90, 5)))
    assert (job.toolpath.strategy, job.toolpath.direction_deg) == ("raster", 90.0)
    assert proposed(tmp_path, trimesh.creation.box((90, 30, 5)))[0].toolpath.direction_deg == 0.0


def test_cutter_and_stepover_grow_with_the_part(tmp_path):
    sizes = [proposed(tmp_path, dome(scale))[0] for scale in (0.2, 0.7, 1.4, 2.4)]
    diameters = [job.tool.diameter_mm for job in sizes]
    assert diameters == sorted(set(diameters))
    assert all(0.2 * job.tool.diameter_mm < job.toolpath.stepover_mm < job.tool.diameter_mm for job in sizes)


def test_of_a_part_larger_than_the_machine_a_box_in_its_middle_is_machined(tmp_path):
    job, proposal = proposed(tmp_path, dome(10.0))
    box = np.array(job.part.region_box_mm)
    assert np.ptp(box, axis=0)[:2].max() == pytest.approx(1e3 * DESK.work.diameter)
    assert box.mean(axis=0)[:2] == pytest.approx([0.0, 0.0], abs=0.1)
    report = str(region_report(job, job_mesh(job)))
    assert "is outside region_box_mm" in report
    assert any("larger than the work volume" in remark for remark in proposal.remarks)


def test_where_the_middle_of_a_large_part_holds_nothing_the_box_is_elsewhere(tmp_path):
    """A frame of four bars around an opening; before, "no side of this surface can be machined" was said."""
    bars = [trimesh.creation.box((400, 30, 10)), trimesh.creation.box((30, 340, 10))]
    moved = [bar.copy().apply_translation(by) for bar, by in zip(bars, ((0, 185, 0), (185, 0, 0)), strict=True)]
    others = [bar.copy().apply_translation(by) for bar, by in zip(bars, ((0, -185, 0), (-185, 0, 0)), strict=True)]
    job, proposal = proposed(tmp_path, trimesh.util.concatenate(moved + others))
    assert Patch.of(job_mesh(job), job_region(job)).areas.sum() > 2000e-6
    assert any("a box where it holds most is machined" in remark for remark in proposal.remarks)


def test_the_box_on_a_large_plate_of_few_facets_is_at_its_top(tmp_path):
    """Only the boss below it has vertices in the middle; "no side of this surface can be machined" was said."""
    plate = trimesh.creation.box((400, 400, 10))
    boss = trimesh.creation.cylinder(10.0, 20.0).apply_translation((0, 0, -15))
    job, _ = proposed(tmp_path, trimesh.util.concatenate([plate, boss]))
    patch = Patch.of(job_mesh(job), job_region(job))
    assert patch.vertices[:, 2].max() == pytest.approx(5e-3)
    assert patch.areas.sum() > 0.5 * (0.8 * DESK.work.diameter) ** 2


def test_facets_that_do_not_join_are_an_error(tmp_path):
    corners = np.random.default_rng(1).uniform(0.0, 40.0, (20, 3, 3))
    loose = trimesh.Trimesh(**trimesh.triangles.to_kwargs(corners), process=False)
    with pytest.raises(MeshError, match=r"the facets do not join.*20 bodies of 20 facets"):
        proposed(tmp_path, loose)


def test_a_file_that_states_its_unit_is_not_guessed(tmp_path):
    job, proposal = proposed(tmp_path, trimesh.Scene(dome(1e-3)), "part.glb")
    assert job.part.unit is None
    assert job.part.flip is False
    assert "a guess from its size" not in " ".join(proposal.remarks)
    assert proposal.remarks[0].startswith("the part is 60 x 60 x")


def test_new_writes_a_job_beside_the_part_or_elsewhere(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    dome().export("my part.stl")
    assert run_cli(["new", "my part.stl"]) == 0
    said = capsys.readouterr().out
    assert "if its unit is mm: a guess" in said
    assert "next: pentapod plan" in said
    assert Job.load("my part.toml").mesh_path.resolve() == tmp_path / "my part.stl"
    assert run_cli(["new", "my part.stl"]) == 2
    (tmp_path / "jobs").mkdir()
    assert run_cli(["new", "my part.stl", "-o", "jobs/a.toml", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["job"]["part"] == {"mesh": "../my part.stl", "unit": "mm"}
    assert Job.load("jobs/a.toml").mesh_path.resolve() == tmp_path / "my part.stl"
    assert run_cli(["new", "nowhere.stl"]) == 2
    assert run_cli(["new", "my part.stl", "-o", "b.toml", "--machine", "nothing"]) == 2
    assert not (tmp_path / "b.toml").exists()


def test_a_part_that_needs_repair_is_repaired_and_that_is_told(tmp_path):
    shape = trimesh.creation.box((80, 60, 31))
    many = np.concatenate([shape.triangles, np.repeat(shape.triangles[:1, :1], 3, axis=1)])
    flat = trimesh.Trimesh(**trimesh.triangles.to_kwargs(many), process=False)
    job, proposal = proposed(tmp_path, flat)
    assert job.part.repair
    assert "facets without area: 1" in " ".join(proposal.remarks)
    job_mesh(job)


def test_a_broken_part_gets_no_job(tmp_path):
    (tmp_path / "a.stl").write_bytes(b"solid text, not a mesh\n")
    with pytest.raises(MeshError):
        propose(tmp_path / "a.stl", DESK, "desk")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["dome", "dome in inches", "dome wound downwards", "dome on its side"])
def test_a_proposed_job_plans(tmp_path, name):
    job, _ = proposed(tmp_path, SHAPES[name][0]())
    outcome = run(job, tmp_path / "out")
    assert outcome.passed, outcome.refusal or [c for c in outcome.verdict.certificates if not c.passed]


@pytest.mark.slow
@pytest.mark.parametrize(("width", "turn"), [(6.0, 0.0), (6.0, 31.0), (6.02, 0.0)])
def test_a_slot_as_wide_as_the_ball_passes_at_once(width, turn, tmp_path):
    """As most drawings ask for it. The surface of the ball's centres has no width there."""
    job, _ = proposed(tmp_path, slotted(width, np.radians(turn)).apply_scale(1e3))
    assert job.tool.diameter_mm == 6.0
    outcome = run(job, tmp_path / "run", advice=None)
    assert outcome.passed, str(outcome.verdict)


def test_surface_behind_other_surface_does_not_count_for_the_side(tmp_path):
    """Towers in rows: from the front all their faces are more than their roofs, but most are hidden."""
    towers = [
        trimesh.creation.box(bounds=[[x, y, 0.0], [x + 4.0, y + 4.0, 12.0]])
        for x in range(0, 60, 8)
        for y in range(0, 60, 8)
    ]
    job, _ = proposed(tmp_path, trimesh.util.concatenate(towers))
    assert tuple(job.part.region_direction) == (0.0, 0.0, 1.0)
    one = trimesh.creation.box(bounds=[[0.0, 0.0, 0.0], [60.0, 20.0, 20.0]])
    one.apply_transform(trimesh.transformations.rotation_matrix(0.5 * np.pi, [0.0, 1.0, 0.0]))
    job, _ = proposed(tmp_path, one)
    assert job.part.region_direction[2] == 0.0
