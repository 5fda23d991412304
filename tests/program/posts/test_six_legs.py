"""Programs of a machine with six legs: their file, and every post, come back as they were."""

import numpy as np
import pytest

from pentapod.base.errors import ProgramError
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.component import COMPONENTS
from pentapod.machine import Machine
from pentapod.program import Program, Provenance, quantised, read_csv, write_csv
from pentapod.program.posts import POSTS, PostInput, write_post
from short_motion import poses, round_trip

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
    assert not (tmp_path / "pentakins").exists()
