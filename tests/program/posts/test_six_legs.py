"""Programs of a machine with six legs: their file, and every post, come back as they were."""

import numpy as np
import pytest

from linuxcnc_runs import play, real
from pentapod.base.errors import ProgramError
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.component import COMPONENTS
from pentapod.machine import Machine
from pentapod.program import Program, Provenance, quantised, read_csv, write_csv
from pentapod.program.posts import POSTS, PostInput, write_post
from short_motion import loop, poses, post, round_trip

HEXA = Machine.load("hexa")


def program(count: int = 200) -> Program:
    tips, i = poses(np.arange(count + 1) / count)
    legs = quantised(HEXA.robot.leg_lengths(tips - HEXA.tool_length * i, i))
    source = Provenance("hexa", HEXA.digest, "job", "0.1.0", None)
    placement = RigidTransform(np.eye(3), np.zeros(3))
    return Program(HEXA.controller.period, legs, "cubic", COMPONENTS[0], placement, source)


def test_file_names_six_legs(tmp_path) -> None:
    write_csv(program(), tmp_path / "program.csv")
    lines = (tmp_path / "program.csv").read_text().splitlines()
    assert "# legs = 6" in lines
    assert "time_s,leg1_mm,leg2_mm,leg3_mm,leg4_mm,leg5_mm,leg6_mm" in lines
    np.testing.assert_array_equal(read_csv(tmp_path / "program.csv").legs, program().legs)
    text = (tmp_path / "program.csv").read_text()
    for old, new, words in (("# legs = 6\n", "", "wrong column names"), ("legs = 6", "legs = 0", "a count of 1 to")):
        (tmp_path / "other.csv").write_text(text.replace(old, new))
        with pytest.raises(ProgramError, match=words):
            read_csv(tmp_path / "other.csv")


@pytest.mark.parametrize("name", [name for name in POSTS if name not in {"gcode", "toolpath"}])
def test_post_comes_back(name: str, tmp_path) -> None:
    if name == "hdf5":
        pytest.importorskip("h5py")
    if POSTS[name].takes_toolpath and name != "linuxcnc":
        pytest.skip("this post writes the toolpath, not the legs")
    round_trip(PostInput(program(), HEXA), name, tmp_path)


def test_linuxcnc_has_an_axis_for_each_leg(tmp_path) -> None:
    write_post(PostInput(program(), HEXA), "linuxcnc", tmp_path, unverified=True)
    assert "coordinates=XYZUVW" in (tmp_path / "trivkins/pentapod.ini").read_text()
    assert "JOINTS = 6" in (tmp_path / "trivkins/pentapod.ini").read_text()
    assert "names=leg1,leg2,leg3,leg4,leg5,leg6" in (tmp_path / "stream/stream.hal").read_text()
    assert not (tmp_path / "kinematics").exists()
    told = (tmp_path / "README.md").read_text(encoding="utf-8")
    assert "no kinematics module for such a machine" in told
    assert "play the setpoints (stream/)" in told


@pytest.mark.slow
@real
@pytest.mark.parametrize("name", ["hexa", "spr", "prpu"])
def test_linuxcnc_plays_the_legs_of_platforms(name: str, tmp_path) -> None:
    """As setpoints, unchanged by the limits of the legs, and as axes of their own, to the last row."""
    machine = Machine.load(name)
    moved = loop(machine, 2.0)
    post(PostInput(moved, machine), "linuxcnc", tmp_path)
    legs, plan = machine.robot.n_legs, 1e3 * moved.legs
    table = play(tmp_path / "stream")
    before, after = table[:, :legs], table[:, legs : 2 * legs]
    np.testing.assert_array_equal(before, after)
    first = int(np.flatnonzero(np.abs(np.diff(after, axis=0)).max(axis=1) > 0.0)[0])
    starts = range(max(0, first - 100), first + 2)
    assert min(np.abs(after[k : k + len(plan)] - plan).max() for k in starts if k + len(plan) <= len(after)) < 1e-6
    axes = play(tmp_path / "trivkins")
    assert np.abs(axes[-1, :legs] - plan[-1]).max() < 1e-6
