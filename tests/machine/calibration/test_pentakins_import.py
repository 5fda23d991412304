"""LinuxCNC's pentakins imported as a machine: the same legs in the same poses, rings and all."""

import re

import numpy as np
import pytest

from pentapod.base.errors import MachineError
from pentapod.cli.main import run
from pentapod.machine import Machine
from pentapod.machine.calibration.pentakins import read_pentakins

BASE = [
    (586.1, -120.0, 466.8),
    (224.2, 553.8, 467.1),
    (-325.9, 498.3, 466.9),
    (-597.0, -38.8, 467.2),
    (-55.1, -595.2, 467.0),
]
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


def test_a_base_along_the_tool_is_refused(tmp_path, capsys):
    """As in LinuxCNC's own sample, whose base joints are in the plane y = 500."""
    sample = [(-418, 500, -140), (418, 500, -140), (0, 500, -310), (418, 500, 510), (-418, 500, 510)]
    (tmp_path / "kinematics.hal").write_text(hal(sample), encoding="utf-8")
    assert run(["machine", "import", "hal", str(tmp_path / "kinematics.hal"), "-o", str(tmp_path / "mine.toml")]) == 2
    assert "off a plane across the tool" in capsys.readouterr().err
    assert not (tmp_path / "mine.toml").exists()


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
