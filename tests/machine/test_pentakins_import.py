"""LinuxCNC's pentakins imported as a machine: the same legs in the same poses, rings and all."""

import re

import numpy as np
import pytest

from pentapod.base.errors import MachineError
from pentapod.cli.main import run
from pentapod.geometry.directions import angle_between
from pentapod.machine import Machine
from pentapod.machine.hal_import import read_pentakins

BASE = [
    (586.1, -120.0, 466.8),
    (224.2, 553.8, 467.1),
    (-325.9, 498.3, 466.9),
    (-597.0, -38.8, 467.2),
    (-55.1, -595.2, 467.0),
]
UP = np.array([0.0, 0.0, 1.0])
RINGS, HEIGHTS = [12.0, 0.0, 20.0, 12.5, 30.0], [88.0, 158.0, 258.5, 310.0, 206.0]


def hal(base=BASE):
    lines = ["# a machine", "loadrt pentakins"]
    for k, (joint, r, z) in enumerate(zip(base, RINGS, HEIGHTS, strict=True)):
        lines += [f"setp pentakins.base.{k}.{axis} {value}" for axis, value in zip("xyz", joint, strict=True)]
        lines += [f"setp pentakins.effector.{k}.r {r}", f"setp pentakins.effector.{k}.z   {z}"]
    return "\n".join([*lines, "#setp pentakins.screw-lead 10.0"]) + "\n"


@pytest.fixture
def machine(tmp_path):
    (tmp_path / "kinematics.hal").write_text(hal(), encoding="utf-8")
    assert run(["machine", "import", "hal", str(tmp_path / "kinematics.hal"), "-o", str(tmp_path / "mine.toml")]) == 0
    return Machine.load(tmp_path / "mine.toml")


def pentakins(tip, a, b):
    """Leg lengths, mm, of XYZ and angles A and B, radians, as LinuxCNC's manual has it: R = Ry(B) Rx(A)."""
    ca, sa, cb, sb = np.cos(a), np.sin(a), np.cos(b), np.sin(b)
    r = np.array([[cb, 0, sb], [0, 1, 0], [-sb, 0, cb]]) @ np.array([[1, 0, 0], [0, ca, -sa], [0, sa, ca]])
    there = (np.array(BASE) - tip) @ r
    return np.hypot(there[:, 2] - HEIGHTS, np.hypot(there[:, 0], there[:, 1]) - RINGS), r[:, 2]


def test_legs_are_those_of_pentakins_and_poses_come_back(machine):
    rng, mean = np.random.default_rng(0), np.mean([z for *_, z in BASE])
    for _ in range(50):
        tip, (a, b) = rng.uniform(-60.0, 60.0, 3), np.radians(rng.uniform(-20.0, 20.0, 2))
        lengths, axis = pentakins(tip, a, b)
        turned = np.array([1.0, -1.0, -1.0])
        at, i = 1e-3 * turned * (tip - [0.0, 0.0, mean]), -turned * axis
        p = at - machine.tool_length * i
        assert np.abs(1e3 * machine.robot.leg_lengths(p, i) - lengths).max() < 1e-6
        found = machine.robot.pose(1e-3 * lengths, machine.robot.branch(p, i))
        assert np.abs(found[0] - p).max() < 1e-9


def test_legs_at_home_are_in_the_middle_of_cones_and_ranges(machine):
    vectors = machine.robot.leg_vectors(machine.robot.home, UP)
    assert angle_between(vectors, machine.joints.base_axes).max() < 1e-8
    np.testing.assert_allclose(angle_between(vectors, UP), machine.joints.platform_range.mean(axis=1), atol=1e-8)
    np.testing.assert_allclose(machine.robot.home + machine.tool_length * UP, machine.work.centre)


def test_limits_of_the_legs_are_those_of_the_ini_file(tmp_path, capsys):
    (tmp_path / "kinematics.hal").write_text(hal(), encoding="utf-8")
    rows = "MIN_LIMIT = 400\nMAX_LIMIT = 1{k}00.5\nMAX_VELOCITY = 90\nMAX_ACCELERATION = 800\n"
    text = "[HAL]\nHALFILE = a.hal\nHALFILE = b.hal\n" + "".join(f"[JOINT_{k}]\n{rows.format(k=k)}" for k in range(5))
    (tmp_path / "pentapod.ini").write_text(text, encoding="utf-8")
    words = ["machine", "import", "hal", str(tmp_path / "kinematics.hal"), "--ini", str(tmp_path / "pentapod.ini")]
    assert run([*words, "-o", str(tmp_path / "mine.toml")]) == 0
    legs = Machine.load(tmp_path / "mine.toml").legs
    np.testing.assert_allclose(legs.max_length, [1.0005, 1.1005, 1.2005, 1.3005, 1.4005])
    assert (legs.min_length == 0.4).all()
    assert (legs.max_acceleration == 0.8).all()
    (tmp_path / "pentapod.ini").write_text(text.replace("MAX_LIMIT = 1300.5", ""), encoding="utf-8")
    assert run([*words, "-o", str(tmp_path / "other.toml")]) == 2
    assert "[JOINT_3] MAX_LIMIT: no number" in capsys.readouterr().err
    assert not (tmp_path / "other.toml").exists()


def test_only_a_machine_of_five_legs_fills_the_rest(tmp_path, capsys):
    (tmp_path / "kinematics.hal").write_text(hal(), encoding="utf-8")
    words = ["machine", "import", "hal", str(tmp_path / "kinematics.hal"), "-o", str(tmp_path / "mine.toml")]
    assert run([*words, "--like", "hexa"]) == 2
    assert "5 legs, not 6" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("pattern", "new", "said"),
    [
        (r"setp pentakins.base.3.y.*\n", "", "base.3.y: a parameter is missing"),
        (r"(base.2.x) .*", r"\1 wide", "not a number"),
        (r"#(setp pentakins.screw-lead)", r"\1", "not read"),
        (r"pentakins", "genhexkins", "not a configuration of pentakins"),
    ],
)
def test_what_is_wrong_in_a_hal_file_is_named(tmp_path, pattern, new, said):
    path = tmp_path / "kinematics.hal"
    path.write_text(re.sub(pattern, new, hal()), encoding="utf-8")
    with pytest.raises(MachineError, match=re.escape(said)):
        read_pentakins(path)
