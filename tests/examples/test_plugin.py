"""The example package `examples/plugin`: what it adds by entry points is known and works."""

from __future__ import annotations

import re
import secrets
import subprocess
import sys
import tomllib
from contextlib import contextmanager
from pathlib import Path

import pytest

import pentapod
from pentapod import Job, LegPath, PlacedPath, Program, load_mesh, read_post, retime, run, write_post
from pentapod.cli.commands.new import dome_stl
from pentapod.cli.main import run as command
from pentapod.cutters import CUTTERS
from pentapod.kinematics import GeneralPentapod
from pentapod.machine import read_machine
from pentapod.machine.reader import machine_bytes
from pentapod.mesh import MESH_FORMATS
from pentapod.program.posts import POSTS, PostInput
from pentapod.timing import Explanation
from pentapod.toolpath import STRATEGIES
from plugins import install
from usual_job import job_text

PLUGIN = Path(__file__).parents[2] / "examples" / "plugin"
CHANGES = (
    ('mesh = "part.stl"', 'mesh = "part.off"'),
    ('type = "ball"', 'type = "engraver"\nheight_mm = 12'),
    ("[toolpath]", '[toolpath]\nstrategy = "diagonal"\nturn_deg = 10'),
    ("left_share = 1", "left_share = 1\nleft_mm = 2"),  # a point leaves high ridges, which take long to measure finely
)
LIMITS = ("[placement]", '[limits]\nuse = ["table", "running-in"]\n\n[placement]')


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The package as it stands when it is installed; for `with` blocks, outside of which nothing is known of it."""
    groups = tomllib.loads((PLUGIN / "pyproject.toml").read_text(encoding="utf-8"))["project"]["entry-points"]
    folder = tmp_path_factory.mktemp("site")

    @contextmanager
    def installed():
        with pytest.MonkeyPatch.context() as patch:
            install(folder / secrets.token_hex(4), patch, groups)
            patch.syspath_prepend(PLUGIN)
            yield

    return installed


@pytest.fixture(scope="module")
def planned(site, tmp_path_factory):
    """What a job reached that names the package's mesh format, strategy and cutter."""
    folder, text = tmp_path_factory.mktemp("planned"), job_text()
    for old, new in (*CHANGES, LIMITS):
        text = text.replace(old, new)
    (folder / "part.stl").write_bytes(dome_stl(cells=12))
    load_mesh(folder / "part.stl", "m").to_trimesh().export(folder / "part.off")
    (folder / "job.toml").write_text(text, encoding="utf-8")
    with site():
        return run(Job.load(folder / "job.toml"), folder / "out")


def test_nothing_of_it_is_known_before_it_is_installed(make_job):
    assert "off" not in MESH_FORMATS
    assert "drives-ms" not in POSTS
    assert "diagonal" not in STRATEGIES
    assert "engraver" not in CUTTERS
    with pytest.raises(pentapod.InputError, match="unknown strategy"):
        Job.load(make_job(*CHANGES[2:]))
    with pytest.raises(pentapod.InputError, match=r"limits\.use: no such limit \(got 'table'\); installed: none"):
        Job.load(make_job(LIMITS))


def test_limits_of_the_package_hold_in_jobs_that_name_them_alone(site, make_job, tmp_path):
    with site():
        outcome = run(Job.load(make_job()), tmp_path / "out")
        unknown = make_job((LIMITS[0], LIMITS[1].replace("table", "tabel")))
        with pytest.raises(pentapod.InputError) as caught:
            Job.load(unknown)
    assert "tool tip in the table" not in outcome.find(PlacedPath).margin_names
    assert "leg velocity while running in" not in {use.quantity for use in outcome.find(Explanation).uses}
    message = "limits.use: no such limit (got 'tabel'); installed: running-in, table"
    assert str(caught.value) == f"{unknown}:27: {message}"


def test_a_job_is_planned_with_mesh_format_strategy_cutter_and_limits_of_the_package(planned, site, tmp_path):
    assert planned.unwrap().passed, [c for c in planned.verdict.certificates if not c.passed]
    assert "tool tip in the table" in planned.find(PlacedPath).margin_names
    names = {use.quantity for use in planned.find(Explanation).uses}
    assert "leg velocity while running in" in names, names
    folder = tmp_path / "post"
    with site():
        (file,) = write_post(PostInput(planned.find(Program)), "drives-ms", folder, verdict=planned.to_dict())
        assert (read_post(folder, "drives-ms").legs == planned.find(Program).legs).all()
    assert file.read_text(encoding="utf-8").startswith("% pentapod_program")


def test_a_file_that_trimesh_cannot_read_as_off_gets_one_line(site, tmp_path):
    for content, message in ((b"solid", "does not begin with"), (b"OFF\n3 1 0\n0 0 x\n", "cannot be read as OFF")):
        (tmp_path / "part.off").write_bytes(content)
        with site(), pytest.raises(pentapod.InputError, match=message) as caught:
            load_mesh(tmp_path / "part.off", "mm")
        assert "part.off" in str(caught.value)
        assert "\n" not in str(caught.value)


def test_the_limit_of_the_package_holds_in_the_time_law(planned):
    path, machine = planned.find(LegPath), planned.machine
    assert retime(path, machine).unwrap().duration < planned.find(Program).duration


def test_the_command_line_lists_what_the_package_adds(site, capsys):
    with site():
        assert command(["post", "--formats"]) == 0
    assert "the workshop's drives" in capsys.readouterr().out


def test_a_machine_file_names_the_family_of_the_package(site):
    heights = "platform_mm = [-110.4, -38.2, 20.0, 64.1, 108.4]"
    text = re.sub(r"^delta = .*$", f'family = "any-heights"\n{heights}', machine_bytes("desk").decode(), flags=re.M)
    with pytest.raises(pentapod.InputError, match=r"geometry\.family.*unknown robot family"):
        read_machine(text, "own.toml")
    with site():
        machine = read_machine(text, "own.toml")
    assert isinstance(machine.robot, GeneralPentapod)
    assert machine.robot.offsets[2] == 0.02


@pytest.mark.slow
def test_pip_installs_the_package(tmp_path):
    pip = [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--no-build-isolation", "--target", tmp_path]
    subprocess.run([*pip, PLUGIN], check=True)
    code = "from pentapod.program.posts import find_post; print(find_post('drives-ms').about)"
    path = {"PYTHONPATH": f"{tmp_path}:{Path(pentapod.__file__).parents[1]}"}
    made = subprocess.run([sys.executable, "-c", code], env=path, capture_output=True, text=True, check=True)
    assert made.stdout == "the workshop's drives\n"
