"""From touches to a program: the part of the usual job, clamped elsewhere, is found and planned again."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

sys.path.insert(0, str(Path(__file__).parents[2] / "registration"))
from forged_touches import PROBE, RADIUS, legs_at, touched

from pentapod.base import InputError
from pentapod.cli.commands.new import dome_stl
from pentapod.cli.main import run as pentapod
from pentapod.geometry import RigidTransform
from pentapod.job import Job, judge, run
from pentapod.job.clamped.placed_job import read_placement
from pentapod.job.clamped.registration import planned_placement, register_part
from pentapod.job.clamped.replan import replan
from pentapod.machine import Machine
from pentapod.mesh import load_mesh
from pentapod.planning import PlacedPath
from pentapod.program import read_csv
from pentapod.timing import Trajectory
from usual_job import job_text

OFF = RigidTransform(Rotation.from_rotvec([0.006, -0.005, 0.012]).as_matrix(), np.array([0.7e-3, -0.5e-3, 0.6e-3]))
HEAD = f"# probe_length_mm = {1e3 * PROBE}\n# tip_diameter_mm = {2e3 * RADIUS}\n"
HEAD += "leg1_mm,leg2_mm,leg3_mm,leg4_mm,leg5_mm\n"


@pytest.fixture(scope="module")
def usual(tmp_path_factory):
    """The usual job with a finer part, its run, and where the part truly is."""
    folder = tmp_path_factory.mktemp("clamped")
    (folder / "part.stl").write_bytes(dome_stl(cells=24))
    (folder / "job.toml").write_text(job_text(), encoding="utf-8")
    outcome = run(Job.load(folder / "job.toml"), folder / "out")
    planned = planned_placement(folder / "out")
    middle = planned.translation
    truth = RigidTransform(OFF.rotation @ planned.rotation, middle + OFF.translation)
    return folder, planned, truth, outcome


def forged(folder, truth, noise=5e-6, count=40, seed=0, **changes):
    """Write touches.csv of a part at a placement: the legs of an upright probe, by distances of joints alone."""
    mesh, machine = load_mesh(folder / "part.stl", "mm"), Machine.load("desk")
    rng = np.random.default_rng(seed)
    centres = truth.apply(touched(mesh, np.ones(len(mesh.faces)), count, seed)) + noise * rng.normal(size=(count, 3))
    centres[changes.get("outliers", [])] -= [0.0, 0.0, 0.5e-3]
    legs = 1e3 * legs_at(machine.robot, centres, np.tile([0.0, 0.0, -1.0], (count, 1)))
    legs = legs[:, changes.get("order", [0, 1, 2, 3, 4])] * changes.get("scale", 1.0)
    rows = "\n".join(",".join(f"{leg:.6f}" for leg in row) for row in legs)
    file = folder / f"touches-{seed}-{len(changes)}.csv"
    file.write_text(changes.get("head", HEAD) + rows + "\n", encoding="utf-8")
    return file


def off_across(folder, found, truth):
    mesh = load_mesh(folder / "part.stl", "mm")
    points, normals = mesh.vertices[mesh.faces].mean(axis=1), mesh.facet_normals
    return np.abs(((found.apply(points) - truth.apply(points)) * truth.rotate(normals)).sum(axis=1)).max()


def test_the_command_finds_the_part_and_plans_it_again(usual, capsys) -> None:
    folder, planned, truth, _ = usual
    touches, found = forged(folder, truth), folder / "found.toml"
    assert pentapod(["register", str(touches), "--job", str(folder / "job.toml"), "-o", str(found)]) == 0
    assert "40 of 40 touches used" in capsys.readouterr().out
    placement = read_placement(found)
    assert off_across(folder, planned, truth) > 500e-6
    assert off_across(folder, placement, truth) < 20e-6
    assert pentapod(["replan", str(folder / "out"), "--placement", str(found), "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert content["passed"] is True
    again = folder / "out" / "replanned"
    assert judge(Job.load(again / "placed-job.toml"), again).passed
    program, before = read_csv(again / "program.csv"), read_csv(folder / "out" / "program.csv")
    assert np.abs(program.placement.matrix - placement.matrix).max() < 1e-8
    assert program.duration == pytest.approx(before.duration, rel=0.03)
    robot = Machine.load("desk").robot
    tips = []
    for each in (before, program):
        p, i = robot.pose(each.legs, each.component)
        tips.append(each.placement.inverse().apply(p + Machine.load("desk").tool_length * i))
    for ends in (0, -1):  # the tool begins and ends at the same places of the part
        assert tips[0][ends] == pytest.approx(tips[1][ends], abs=1e-6)


@pytest.mark.slow
def test_leans_and_time_laws_are_those_of_the_run_before(usual) -> None:
    folder, _, truth, first = usual
    moved = replan(folder / "out", truth, folder / "moved")
    assert moved.passed
    placed, before = moved.find(PlacedPath), first.find(PlacedPath)
    leaning = [each.placement.transform.inverse().rotate(each.axes) for each in (before, placed)]
    assert leaning[0] == pytest.approx(leaning[1], abs=1e-12)
    laws = [outcome.find(Trajectory).laws for outcome in (first, moved)]
    for kept, law in zip(*laws, strict=True):  # the same law, or run slower as a whole
        assert 1.0 <= law.duration / kept.duration <= 1.03
        assert law.stations == pytest.approx(kept.stations, abs=1e-9)
        assert law.speeds * law.duration == pytest.approx(kept.speeds * kept.duration, abs=1e-6)


def test_a_part_that_is_far_away_is_planned_anew_or_refused(usual) -> None:
    folder, planned, _, _ = usual
    far = RigidTransform(planned.rotation, planned.translation + np.array([1.0, 0.0, 0.0]))
    assert replan(folder / "out", far, folder / "far").refusal is not None


def test_a_surface_that_is_known_less_well_than_asked_is_no_placement(usual, capsys) -> None:
    folder, _, truth, _ = usual
    touches, found = forged(folder, truth), folder / "within.toml"
    asked = ["register", str(touches), "--job", str(folder / "job.toml"), "-o", str(found), "--within"]
    assert pentapod([*asked, "0.0001", "--json"]) == 1
    said = capsys.readouterr()
    assert "--within asks for 0.0001 mm" in said.err
    content = json.loads(said.out)
    assert (content["registered"], content["out"], found.exists()) == (False, None, False)
    assert pentapod([*asked, f"{1.01e-3 * content['uncertainty_um']}"]) == 0
    assert found.exists()


def test_outliers_are_named_by_their_lines(usual, capsys) -> None:
    folder, _, truth, _ = usual
    touches = forged(folder, truth, outliers=[3, 20])
    found = register_part(Job.load(folder / "job.toml"), touches)
    assert [re.match(r"line (\d+)", name)[1] for name in found.outlier_names] == ["7", "24"]


WRONG = {
    "millimetres read as metres": ({"scale": 1e-3}, "leg1_mm: a leg beyond its stroke"),
    "swapped legs": ({"order": [1, 0, 2, 3, 4]}, "leg1_mm and leg2_mm are exchanged"),
    "swapped legs in a known component": (
        {"order": [0, 4, 2, 3, 1], "head": '# component = "++"\n' + HEAD},
        "leg2_mm and leg5_mm are exchanged",
    ),
    "three legs in wrong order": ({"order": [1, 2, 0, 3, 4]}, "the legs do not tell the component"),
    "no probe": ({"head": HEAD.replace("# probe_length_mm", "# length_mm")}, "unknown key"),
    "a key is missing": ({"head": HEAD.split("\n", 1)[1]}, "probe_length_mm: the key is missing"),
    "another machine": ({"head": '# machine = "steep"\n' + HEAD}, "touches of another machine"),
    "other columns": ({"head": HEAD.replace("leg2", "leg3")}, "wrong column names"),
    "semicolons": ({"head": HEAD.replace("_mm,leg", "_mm;leg")}, "with commas between the columns"),
    "text": ({"head": HEAD + "1,2,three,4,5\n"}, "not a row of finite numbers"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_lists_are_one_clear_error(usual, name) -> None:
    folder, _, truth, _ = usual
    changes, told = WRONG[name]
    job = Job.load(folder / "job.toml")
    file = forged(folder, truth, seed=2, **changes)
    with pytest.raises(InputError) as caught:
        register_part(job, file)
    assert told in str(caught.value)
    assert str(file) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_too_few_touches_are_an_error(usual) -> None:
    folder, _, truth, _ = usual
    with pytest.raises(InputError, match="too few touches"):
        register_part(Job.load(folder / "job.toml"), forged(folder, truth, count=6, seed=3))


def test_a_placement_file_is_checked(tmp_path) -> None:
    file = tmp_path / "found.toml"
    for text, told in {
        "": "is empty",
        "[part]\nx = 1": "the table is missing",
        '[placement]\nmode = "free"': "not a placement, but a choice",
        '[placement]\nmode = "fixed"\nposition = [1, 2, 3]': "unknown key",
        '[placement]\nmode = "fixed"\nmatrix = [[2,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]': "rotation",
    }.items():
        file.write_text(text, encoding="utf-8")
        with pytest.raises(InputError, match=told) as caught:
            read_placement(file)
        assert str(file) in str(caught.value)


def test_a_job_with_a_found_placement_names_the_same_files(usual) -> None:
    folder, _, truth, _ = usual
    (folder / "elsewhere").mkdir(exist_ok=True)
    file = folder / "found-too.toml"
    x, y, z = 1e3 * truth.translation
    angles = Rotation.from_matrix(truth.rotation).as_euler("xyz", degrees=True).tolist()
    file.write_text(f'[placement]\nmode = "fixed"\nposition_mm = [{x}, {y}, {z}]\nrotation_deg = {angles}\n')
    out = folder / "elsewhere" / "out"
    assert pentapod(["plan", str(folder / "job.toml"), "-o", str(out), "--placement", str(file), "-q"]) == 0
    job = Job.load(out / "placed-job.toml")
    assert job.mesh_path.resolve() == (folder / "part.stl").resolve()
    assert job.placement.component == "++"
    assert pentapod(["verify", str(out), "--job", str(out / "placed-job.toml"), "-q"]) == 0
    assert np.abs(planned_placement(out).matrix - truth.matrix).max() < 1e-8
