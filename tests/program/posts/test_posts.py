"""Every post: round trip, the same bytes, and what the numbers mean to those who do not know us."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline, CubicSpline

from pentapod.base.errors import InputError, ProgramError
from pentapod.base.files import packed_arrays
from pentapod.cli.main import run
from pentapod.program import Program, read_csv, write_csv
from pentapod.program.posts import (
    POSTS,
    Column,
    PostInput,
    Table,
    find_post,
    leg_columns,
    post_names,
    read_post,
    table_post,
)
from pentapod.toolpath.formats.npz import toolpath_arrays
from pentapod.toolpath.linking.partition import Piece
from plugins import install
from short_motion import given, passed, post, round_trip


def available(name):
    if name == "hdf5":
        pytest.importorskip("h5py")
    return name


@pytest.mark.parametrize("interpolation", ["cubic", "linear"])
@pytest.mark.parametrize("name", POSTS)
def test_round_trip(name, interpolation, tmp_path):
    round_trip(given(interpolation=interpolation, duration=0.3), available(name), tmp_path)


@pytest.mark.parametrize("name", POSTS)
def test_where_the_guides_stand_and_which_set_up_it_is_come_back(name, tmp_path):
    what = given(duration=0.1)
    piece = Piece(3, 17, (-np.inf, 0.1, -0.0123456789), (0.2, np.inf, 1.0 / 3.0))
    source = dataclasses.replace(what.program.provenance, piece=piece)
    program = dataclasses.replace(
        what.program, rail_positions=(0.0123456789, -1.0 / 300.0, 0.0, -0.0, 0.04), provenance=source
    )
    round_trip(dataclasses.replace(what, program=program), available(name), tmp_path)


@pytest.mark.parametrize("name", POSTS)
def test_a_file_that_is_missing_or_cut_off_is_refused(name, tmp_path):
    files = post(given(duration=0.6), available(name), tmp_path)  # long enough that the rows are in the largest file
    read_post(tmp_path, name)
    entry = max(files, key=lambda file: file.stat().st_size)
    content = entry.read_bytes()
    entry.write_bytes(content[: len(content) * 2 // 3])
    with pytest.raises(InputError):
        read_post(tmp_path, name)
    entry.unlink()
    with pytest.raises(InputError, match=entry.name):
        read_post(tmp_path, name)


def test_cubic_segments_are_the_controllers_spline(tmp_path):
    what = given()
    post(what, "pvt", tmp_path)
    lines = [x for x in (tmp_path / "program.pvt.csv").read_text().splitlines() if not x.startswith("#")]
    assert lines[0].startswith("time_s,leg1_mm,leg1_mm_s,leg2_mm")
    table = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    ours = CubicHermiteSpline(table[:, 0], table[:, 1::2], table[:, 2::2])
    wanted = CubicSpline(what.program.times, 1e3 * what.program.legs, bc_type="clamped")
    dense = np.linspace(0.0, what.program.duration, 20_011)
    assert np.abs(ours(dense) - wanted(dense)).max() < 2e-8
    assert np.abs(table[[0, -1], 2::2]).max() == 0.0


def test_cam_tables_are_numbers_alone(tmp_path):
    what = given()
    post(what, "cam", tmp_path)
    for leg in range(5):
        table = np.loadtxt(tmp_path / f"cam_leg{leg + 1}.txt")
        assert table.shape == (len(what.program.legs), 2)
        assert np.abs(np.diff(table[:, 0]) - 1.0).max() < 1e-9
        assert np.abs(table[:, 1] - 1e3 * what.program.legs[:, leg]).max() < 1e-8


def test_ros_messages_are_yaml_and_their_quintics_are_our_cubics(tmp_path):
    yaml = pytest.importorskip("yaml")
    what = given(duration=0.4)
    post(what, "ros2-yaml", tmp_path)
    post(what, "ros2-json", tmp_path)
    message = yaml.safe_load((tmp_path / "joint_trajectory.yaml").read_text())
    assert message == json.loads((tmp_path / "joint_trajectory.json").read_text())
    assert message["joint_names"] == ["leg1", "leg2", "leg3", "leg4", "leg5"]
    stamps = [p["time_from_start"] for p in message["points"]]
    times = np.array([s["sec"] + 1e-9 * s["nanosec"] for s in stamps])
    assert np.abs(times - what.program.times).max() < 1e-9
    x, v, a = (np.array([p[n] for p in message["points"]]) for n in ("positions", "velocities", "accelerations"))
    h, wanted = what.program.period, CubicSpline(what.program.times, what.program.legs, bc_type="clamped")
    # The quintic that meets position, velocity and acceleration at both ends, halfway.
    middle = (x[1:] + x[:-1]) / 2 + 5 * h / 32 * (v[:-1] - v[1:]) + h**2 / 64 * (a[:-1] + a[1:])
    assert np.abs(middle - wanted(what.program.times[:-1] + h / 2)).max() < 1e-11


def test_linear_programs_have_no_velocities_in_ros(tmp_path):
    post(given(duration=0.1, interpolation="linear"), "ros2-json", tmp_path)
    assert set(json.loads((tmp_path / "joint_trajectory.json").read_text())["points"][3]) == {
        "positions",
        "time_from_start",
    }


@pytest.mark.parametrize("name", ["ros2-json", "ros2-yaml"])
def test_a_ros_point_at_another_time_is_refused(name, tmp_path):
    entry = post(given(duration=0.1), name, tmp_path)[0]
    text = entry.read_text()
    assert '"nanosec": 7000000}' in text
    entry.write_text(text.replace('"nanosec": 7000000}', '"nanosec": 7000001}'))
    with pytest.raises(ProgramError, match="not a multiple of the period"):
        read_post(tmp_path, name)


def test_hdf5_says_its_units(tmp_path):
    h5py = pytest.importorskip("h5py")
    what = given(duration=0.1)
    post(what, "hdf5", tmp_path)
    with h5py.File(tmp_path / "program.h5") as archive:
        assert archive["legs_mm"].attrs["unit"] == "mm"
        assert np.abs(archive["legs_mm"][:] - 1e3 * what.program.legs).max() < 1e-9
        assert archive["time_s"][-1] == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ("\n0.002000000,", "\n0.002500000,", "multiple of the period"),
        ("time_s,", "time_ms,", "titles"),
        ("\n0.003000000,", "\n0.003000000,1,", "columns"),
        ("\n0.003000000,", "\n0.003000000,x", "finite"),
        ("# rows = 301", "# rows = 302", "number of rows"),
        ("# rows = 301", "# rows = 300", "number of rows"),
        ("# interpolation", "# interpretation", "interpretation: unknown key"),
    ],
)
def test_what_is_wrong_with_a_table_is_said(old, new, what, tmp_path):
    (file,) = post(given(duration=0.3), "pvt", tmp_path)
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))
    with pytest.raises(ProgramError, match=what) as caught:
        read_post(tmp_path, "pvt")
    assert "program.pvt.csv" in str(caught.value)


def test_files_of_two_programs_are_not_mixed(tmp_path):
    """Each leg's file has a header of its own; those of one folder are one program's."""
    columns = leg_columns("L{leg}", "length", "mm", 8)
    each = table_post("each", "", Table({f"leg{column.leg}.txt": (column,) for column in columns}))
    what = given(duration=0.3)
    other = dataclasses.replace(what.program, provenance=dataclasses.replace(what.program.provenance, job_digest="1"))
    for name, content in each.write(what).items():
        (tmp_path / name).write_bytes(content)
    assert each.read(tmp_path).legs.tobytes() == what.program.legs.tobytes()
    (tmp_path / "leg4.txt").write_bytes(each.write(PostInput(other))["leg4.txt"])
    with pytest.raises(ProgramError, match=r"leg4\.txt.*the header is not that of leg1\.txt"):
        each.read(tmp_path)


def test_a_velocity_that_is_not_the_splines_is_refused(tmp_path):
    (file,) = post(given(duration=0.3), "pvt", tmp_path)
    lines = file.read_text().splitlines()
    cells = lines[100].split(",")
    cells[2] = f"{float(cells[2]) + 1e-6:.8f}"
    file.write_text("\n".join([*lines[:100], ",".join(cells), *lines[101:]]) + "\n")
    with pytest.raises(ProgramError, match="velocity"):
        read_post(tmp_path, "pvt")


OTHERS = """
from pentapod.program.posts import Column, Table, leg_columns, table_post

COLUMNS = (Column("t", "time", "ms", 3), *leg_columns("L{leg}", "length", "um", 5))
MINE = table_post("mine", "a table of a user", Table({"legs.txt": COLUMNS}, separator=";", comment="%"))
BAD = 3


def make():
    return MINE
"""


@pytest.fixture
def others(tmp_path, monkeypatch):
    names = {"good": "others:MINE", "maker": "others:make", "bad": "others:BAD"}
    install(tmp_path / "site", monkeypatch, {"pentapod.posts": names}, others=OTHERS)


@pytest.mark.parametrize("name", ["good", "maker"])
def test_a_post_of_ones_own(name, others, tmp_path):
    assert name in post_names()
    round_trip(given(duration=0.2), name, tmp_path)
    lines = (tmp_path / "legs.txt").read_text().splitlines()
    assert lines[0].startswith("% pentapod_program")
    assert lines[-1].startswith("200.000;")


def test_posts_that_are_none(others):
    with pytest.raises(InputError, match="names no post"):
        find_post("bad")
    with pytest.raises(InputError, match='did you mean "halstreamer"'):
        find_post("halstreamr")


def test_a_coarse_table_says_what_it_loses(tmp_path):
    coarse = table_post("coarse", "", Table({"a.txt": leg_columns("L{leg}", "length", "mm", 3)}))
    assert coarse.loses == {"digits"}
    with pytest.raises(InputError, match="length of a leg is missing"):
        Table({"a.txt": leg_columns("L{leg}", "length", "mm", 3)[:4]})
    with pytest.raises(InputError, match="unknown unit"):
        Column("t", "time", "mm", 3)
    with pytest.raises(InputError, match="wrong leg"):
        Column("t", "length", "mm", 3)


def test_a_post_without_what_it_needs(tmp_path):
    with pytest.raises(InputError, match=r"plan\.npz"):
        post(PostInput(given(duration=0.1).program), "apt", tmp_path / "x")
    assert not (tmp_path / "x").exists()


def planned(folder):
    """A run's folder as far as posts look at it: program.csv and plan.npz."""
    what = given(duration=0.3)
    program, path, back = what.program, what.toolpath, what.program.placement.inverse()
    write_csv(program, folder / "program.csv")
    arrays = toolpath_arrays(path.transformed(back)) | {
        "placed.tips_mm": 1e3 * path.tips,
        "placed.axes": path.axes,
        "program.legs_mm": 1e3 * program.legs,
    }
    (folder / "plan.npz").write_bytes(packed_arrays(arrays))
    judged(folder)
    return what


def judged(folder, *, failed=()):
    """Write a verdict on the program as it is now, that passed but for these claims."""
    content = passed(read_csv(folder / "program.csv")) | {"passed": not failed}
    content["certificates"] = [{"claim": claim, "passed": False} for claim in failed]
    (folder / "verdict.json").write_text(json.dumps(content), encoding="utf-8")


def test_the_command(tmp_path, capsys):
    what = planned(tmp_path)
    source = str(tmp_path / "program.csv")
    for name in POSTS:
        assert run(["post", source, "--to", available(name), "-o", str(tmp_path / name)]) == 0, name
        back = read_post(tmp_path / name, name)
        if isinstance(back, Program):
            assert back.legs.tobytes() == what.program.legs.tobytes()
        else:
            assert np.abs(back.tips - what.toolpath.tips).max() < 1e-10
    capsys.readouterr()
    assert run(["post", source, "--to", "pvt", "-o", str(tmp_path / "p"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["files"] == [str(tmp_path / "p" / "program.pvt.csv")]
    assert run(["post", "--formats"]) == 0
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == list(POSTS)


def test_the_command_refuses(tmp_path, capsys):
    program = planned(tmp_path).program
    source, out = str(tmp_path / "program.csv"), tmp_path / "q"
    assert run(["post", source, "--to", "pvtt", "-o", str(out)]) == 2
    assert 'did you mean "pvt"?' in capsys.readouterr().err
    legs = program.legs.copy()
    legs[3] += 1e-6
    write_csv(dataclasses.replace(program, legs=legs), source)
    judged(tmp_path)
    assert run(["post", source, "--to", "apt", "-o", str(out)]) == 2
    assert "not that of this plan" in capsys.readouterr().err
    write_csv(dataclasses.replace(program, legs=program.legs[:-1]), source)
    judged(tmp_path)
    assert run(["post", source, "--to", "apt", "-o", str(out)]) == 2
    assert "not that of this plan" in capsys.readouterr().err
    (tmp_path / "plan.npz").write_bytes(b"PK nonsense")
    assert run(["post", source, "--to", "apt", "-o", str(out)]) == 2
    assert "plan.npz" in capsys.readouterr().err
    # It names the job, and that the machine, whose screws and springs count; who names the machine does without.
    assert run(["post", source, "--to", "pvt", "-o", str(out)]) == 2
    assert "plan.npz" in capsys.readouterr().err
    assert run(["post", source, "--to", "pvt", "--machine", "desk", "-o", str(tmp_path / "elsewhere")]) == 0
    assert capsys.readouterr().err == ""
    (tmp_path / "plan.npz").unlink()
    stranger = dataclasses.replace(program.provenance, machine="shed", machine_digest="0")
    write_csv(dataclasses.replace(program, provenance=stranger), source)
    judged(tmp_path)
    assert run(["post", source, "--to", "linuxcnc", "-o", str(out)]) == 2
    assert "--machine" in capsys.readouterr().err
    assert run(["post", source, "--to", "linuxcnc", "-o", str(out), "--machine", "desk"]) == 2
    assert "not the machine" in capsys.readouterr().err
    assert not out.exists()
