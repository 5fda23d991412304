"""Models for simulators: their loops close at every row with the legs as the program has them; Gazebo's parser."""

import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from closed_loops import Closed, in_mjcf
from pentapod.base.errors import ProgramError
from pentapod.kinematics import AsBuiltPentapod
from pentapod.machine import LegModel, Machine
from pentapod.machine.leg_model import robot_zeros
from pentapod.program.posts import PostInput, read_post, write_post
from short_motion import loop, motion, post

ROBOTS = ["desk", "bench-general", "hexa", "spr", "prpu", "as built"]


def made(name, seconds=0.3):
    """A machine with a program; one as built has rings, joints off the plane, and scales with zeros."""
    machine = Machine.load("desk" if name == "as built" else name)
    if name == "as built":
        errors, zeros = 2e-4 * np.sin(np.arange(15.0)).reshape(5, 3), 5e-4 * np.cos(np.arange(5.0))
        radii = [0.0, 0.012, 0.0, 0.03, 0.02]
        robot = AsBuiltPentapod.of(machine.robot, base_errors=errors, zeros=zeros, radii=radii)
        machine = replace(machine, robot=robot)
    return PostInput(loop(machine, seconds), machine)


def table(folder):
    """Times (N,) and readings (N, n) of legs.csv, as anybody reads it."""
    lines = [line for line in (folder / "legs.csv").read_text().splitlines() if not line.startswith("#")]
    rows = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    return rows[:, 0], rows[:, 1:]


def check_rows(closed: Closed, machine, program, positions, every: int = 50) -> None:
    """Slides at the rows' positions: loops closed, legs as long as the program says, the tool where it should be."""
    robot = machine.robot
    for row in range(0, len(program.legs), every):
        assert closed.stand(positions[row]) < 1e-9, row
        apart = [closed.apart(base, k + 1) for k, base in enumerate(robot.base_joints)]
        assert np.abs(np.array(apart) + robot_zeros(robot) - program.legs[row]).max() < 1e-6, row
        position, direction = robot.pose(program.legs[row], program.component)
        tip = position + machine.tool_length * direction
        assert np.abs(closed.data.site("tip").xpos - tip).max() < 1e-6, row
        if machine.limb is not None:
            _, end = machine.limb.ends(position, direction)
            assert np.abs(closed.site("platform_on_strut", "platformlimb") - end).max() < 1e-6, row
            assert np.abs(closed.data.body("strut").xpos - end).max() < 1e-6, row
        axis = closed.data.body("platform").xmat[2::3]
        assert np.abs(axis - direction).max() < 1e-6, row


@pytest.mark.parametrize("name", ROBOTS)
def test_loops_of_mjcf_close_at_the_rows(name, tmp_path):
    what = made(name)
    program, machine = what.program, what.machine
    post(what, "mjcf", tmp_path)
    times, legs = table(tmp_path)
    assert np.abs(times - program.times).max() < 1e-9
    closed = Closed((tmp_path / "machine.xml").read_text())
    check_rows(closed, machine, program, legs)
    assert np.ptp(legs, axis=0).min() > 1e-3


@pytest.mark.parametrize("name", ROBOTS)
def test_loops_of_sdf_close_at_the_rows(name, tmp_path):
    """By the positions in the ROS message, which are zero where the model stands."""
    yaml = pytest.importorskip("yaml")
    what = made(name)
    program, machine = what.program, what.machine
    post(what, "sdf", tmp_path)
    message = yaml.safe_load((tmp_path / "joint_trajectory.yaml").read_text())
    positions = np.array([point["positions"] for point in message["points"]])
    assert message["joint_names"] == [f"leg{k + 1}" for k in range(machine.robot.n_legs)]
    assert not positions[0].any()
    check_rows(Closed(in_mjcf((tmp_path / "machine.sdf").read_text())), machine, program, positions)


@pytest.mark.skipif(
    shutil.which("ign") is None, reason="Debian's packages ignition-tools and libsdformat-dev are not installed"
)
@pytest.mark.parametrize("name", ["desk", *(pytest.param(n, marks=pytest.mark.slow) for n in ("prpu", "as built"))])
def test_sdf_is_valid_to_the_parser_of_gazebo(name, tmp_path):
    """libsdformat checks schema, names, frames and joints; what it prints again closes too."""
    what = made(name, 0.1)
    program, machine = what.program, what.machine
    post(what, "sdf", tmp_path)
    file = tmp_path / "machine.sdf"
    done = subprocess.run(["ign", "sdf", "-k", str(file)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "Valid."
    printed = subprocess.run(["ign", "sdf", "-p", str(file)], capture_output=True, text=True, check=True).stdout
    check_rows(Closed(in_mjcf(printed)), machine, program, program.legs - program.legs[0])
    file.write_text(file.read_text().replace("<child>rod2</child>", "<child>rod9</child>"))
    wrong = subprocess.run(["ign", "sdf", "-k", str(file)], capture_output=True, text=True, check=False)
    assert "rod9" in wrong.stdout + wrong.stderr


def test_masses_of_sdf_are_those_of_mjcf(tmp_path):
    given = made("prpu", 0.1)
    for form in ("mjcf", "sdf"):
        post(given, form, tmp_path / form)
    ours = Closed((tmp_path / "mjcf/machine.xml").read_text()).model
    theirs = Closed(in_mjcf((tmp_path / "sdf/machine.sdf").read_text())).model
    assert np.array_equal(ours.opt.gravity, theirs.opt.gravity)
    for name in ("platform", "leg3", "rod3", "limb", "strut"):
        one, other = ours.body(name), theirs.body(name.replace("leg", "cylinder"))
        assert one.mass == pytest.approx(other.mass, rel=1e-9), name
        assert one.ipos == pytest.approx(other.ipos, abs=1e-9), name
        assert np.sort(one.inertia) == pytest.approx(np.sort(other.inertia), rel=1e-6), name


def test_the_script_of_the_page_plays_the_table(tmp_path, monkeypatch, capsys):
    """Without feed-forward it comes to rest within the sag of the drives under the weight."""
    pytest.importorskip("pandas", reason="pandas is not installed")
    program, machine = motion(duration=0.6)
    still = replace(program, legs=np.concatenate([program.legs, np.repeat(program.legs[-1:], 200, axis=0)]))
    post(PostInput(still, machine), "mjcf", tmp_path / "mujoco")
    page = (Path(__file__).parents[3] / "docs/posts.md").read_text(encoding="utf-8")
    (script,) = re.findall(r"```python\n(import mujoco\n.*?)```", page, re.S)
    monkeypatch.chdir(tmp_path)
    exec(compile(script, "posts.md", "exec"), {})
    played = np.array([float(word) for word in capsys.readouterr().out.strip(" []\n").split()])
    position, direction = machine.robot.pose(program.legs[-1], program.component)
    assert np.abs(played - position - machine.tool_length * direction).max() < 50e-6
    first, direction = machine.robot.pose(program.legs[0], program.component)
    assert np.linalg.norm(played - first - machine.tool_length * direction) > 5e-3


def test_message_of_another_program_is_refused(tmp_path):
    program, machine = motion(duration=0.1)
    post(PostInput(program, machine), "sdf", tmp_path)
    message = tmp_path / "joint_trajectory.yaml"
    message.write_text(message.read_text().replace("0.0", "0.1", 1))
    with pytest.raises(ProgramError, match=r"joint_trajectory\.yaml.*not that of legs\.csv"):
        read_post(tmp_path, "sdf")


def test_unverified_models_say_so(tmp_path):
    program, machine = motion(duration=0.1)
    for form in ("mjcf", "sdf"):
        for file in write_post(PostInput(program, machine), form, tmp_path, unverified=True):
            assert "UNVERIFIED" in file.read_text().splitlines()[0], file
    Closed((tmp_path / "machine.xml").read_text())
    in_mjcf((tmp_path / "machine.sdf").read_text())


def test_simulated_legs_have_no_leg_model(tmp_path):
    program, machine = motion(duration=0.1)
    bent = replace(machine, leg_model=LegModel(backlash=10e-6, expansion=1e-5, temperature=27))
    given = PostInput(program, bent)
    post(given, "mjcf", tmp_path)
    assert np.array_equal(read_post(tmp_path, "mjcf", bent).legs, program.legs)
    assert np.abs(table(tmp_path)[1] - program.legs).max() < 1e-11
