"""pentapod simulate on a small job, as a user or a script meets it."""

from __future__ import annotations

import json
import re
import sys
from importlib import resources
from pathlib import Path

import pytest

from page_arrays import page_arrays, page_data
from pentapod.cli.main import run
from pentapod.program import read_csv

sys.path.append(str(Path(__file__).parents[1] / "simulate"))
from program_files import write_job


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    """A job and a program of four seconds, below 6300 mm/min."""
    return write_job(tmp_path_factory.mktemp("simulate"), 4.0)


def simulate(planned, *options):
    job, program = planned
    return run(["simulate", program, "--job", job, *options])


def test_servo_as_text_and_json(planned, capsys):
    assert simulate(planned) == 0
    said = capsys.readouterr()
    assert said.err.startswith("note: the program was made from another job")
    assert said.out.startswith("servo: ")
    assert "contour error: " in said.out
    assert simulate(planned, "--json") == 0
    plain = json.loads(capsys.readouterr().out)
    assert simulate(planned, "--json", "--correct") == 0
    corrected = json.loads(capsys.readouterr().out)
    assert plain["rows"] == len(read_csv(planned[1]).legs)
    assert plain["passed"] is True
    assert 0.0 < plain["contour_error_mm"]["largest_on_cuts"] <= plain["contour_error_mm"]["largest"] < 0.1
    assert corrected["contour_error_mm"]["rms"] < plain["contour_error_mm"]["rms"]
    assert simulate(planned, "--json", "--seed", "1") == 0
    assert json.loads(capsys.readouterr().out)["contour_error_mm"] != plain["contour_error_mm"]


def test_plots_show_every_measure_with_its_extremes(planned, tmp_path, capsys):
    page = tmp_path / "simulation.html"
    assert simulate(planned, "--json", "--plots", str(page)) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["plots"] == str(page)
    text = page.read_text(encoding="utf-8")
    assert "<link" not in text
    assert re.search(r"setpoints, .* s; job .*\.toml, machine desk", text)
    rows = page_data(text)["plots"]["rows"]
    assert rows[0]["title"] == "contour error, mm"
    assert [row["title"] for row in rows[-2:]] == ["error of each leg, mm", "force of each drive, N"]
    assert [len(row["series"]) for row in rows] == [1] * (len(rows) - 2) + [5, 5]
    drawn = page_arrays(text)[rows[0]["array"]]
    assert drawn.max() == pytest.approx(said["contour_error_mm"]["largest"], rel=2e-5)


def test_a_page_needs_a_name_that_browsers_open(planned, tmp_path, capsys):
    assert simulate(planned, "--plots", str(tmp_path / "page")) == 2
    assert "its name must end with .html" in capsys.readouterr().err
    assert not list(tmp_path.glob("page*"))


def test_simulate_within_a_bound_is_a_check(planned, capsys):
    assert simulate(planned, "--within", "1", "-q") == 0
    assert capsys.readouterr() == ("", "")
    assert simulate(planned, "--within", "0.0001", "-q") == 1
    assert capsys.readouterr().err.endswith(" mm, exceeds 0.0001 mm\n")


def test_drives_come_from_the_machine_file(planned, tmp_path, capsys):
    job, program = (Path(name) for name in planned)
    desk = (resources.files("pentapod.machine") / "library" / "desk.toml").read_text(encoding="utf-8")
    (job.parent / "mine.toml").write_text(desk + "\n[drives]\ndead_time_ms = 20\n", encoding="utf-8")
    (job.parent / "mine_job.toml").write_text(job.read_text().replace('name = "desk"', 'file = "mine.toml"'))
    assert run(["simulate", str(program), "--job", str(job.parent / "mine_job.toml")]) == 1
    said = capsys.readouterr().err
    assert said.startswith("refused: simulation: the legs run away")
    assert said.count("\n") == 1


@pytest.mark.parametrize(
    ("options", "words"),
    [(["--engine", "magic"], "magic"), (["--seed", "-1"], "seed"), (["--within", "0"], "within")],
)
def test_simulate_refuses_bad_options(planned, options, words, capsys):
    assert simulate(planned, *options) == 2
    said = capsys.readouterr().err
    assert words in said
    assert said.count("\n") == 1


def test_simulate_refuses_bad_files(planned, tmp_path, capsys):
    job, program = planned
    assert run(["simulate", str(tmp_path / "none.csv"), "--job", job]) == 2
    assert run(["simulate", program, "--job", str(tmp_path / "none.toml")]) == 2
    (tmp_path / "other.toml").write_text(Path(job).read_text().replace("[toolpath]", "length_mm = 205\n[toolpath]"))
    for name in ("part.stl", "path.npz"):
        (tmp_path / name).write_bytes((Path(job).parent / name).read_bytes())
    assert run(["simulate", program, "--job", str(tmp_path / "other.toml")]) == 2
    text = Path(program).read_text(encoding="utf-8").splitlines(keepends=True)
    row = text[60].split(",")
    row[3] = f"{float(row[3]) * 3.0:.6f}"
    (tmp_path / "broken.csv").write_text("".join([*text[:60], ",".join(row), *text[61:]]), encoding="utf-8")
    assert run(["simulate", str(tmp_path / "broken.csv"), "--job", job]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 4
    assert all(line.startswith("error: ") for line in lines)
    assert "not the machine that the program was made for" in lines[2]
    assert "no pose on this machine" in lines[3]


def test_mujoco_as_text_and_json(planned, tmp_path, capsys):
    pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    model = tmp_path / "model.xml"
    assert simulate(planned, "--engine", "mujoco", "--export", str(model), "--cutting-force", "40", "--json") == 0
    said = capsys.readouterr()
    assert said.err.count("\n") == 1
    content = json.loads(said.out)
    assert content["same_job"] is False
    assert content["tip_error_mm"]["largest"] <= 0.02
    assert content["axis_error_deg"]["largest"] <= 0.0057
    assert content["closure_error_mm"]["largest"] <= 0.02
    assert content["cutting"]["tip_error_mm"]["largest"] > content["tip_error_mm"]["largest"]
    spans = [c["leg_forces_n"] for c in (content, content["cutting"])]
    assert max(spans[1]["most"]) - min(spans[1]["least"]) > max(spans[0]["most"]) - min(spans[0]["least"])
    assert model.read_text(encoding="utf-8").startswith("<mujoco")
    # An error of a millimetre is seen, and said where a bound was given.
    wrong = ["--engine", "mujoco", "--base-error", "4", "0.9", "0", "0.5", "--offset-error", "1", "0.2"]
    assert simulate(planned, *wrong, "--within", "0.1") == 1
    said = capsys.readouterr()
    assert said.out.startswith("mujoco: 4001 setpoints, 4 s; job ")
    assert "leg forces 1 to 5" in said.out
    last = said.err.splitlines()[-1]
    assert last.startswith("the contour error, ")
    assert float(last.split()[3]) > 0.5  # millimetres


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--correct", "--engine", "mujoco"], "--correct needs --engine servo"),
        (["--cutting-force", "5"], "--cutting-force needs --engine mujoco"),
        (["--export", "m.xml"], "--export needs --engine mujoco"),
        (["--engine", "mujoco", "--base-error", "6", "0", "0", "0"], "base-error"),
    ],
)
def test_options_of_the_other_engine(planned, options, words, capsys):
    assert simulate(planned, *options) == 2
    said = capsys.readouterr().err
    assert words in said
    assert said.count("\n") == 1


def test_simulate_without_mujoco_names_the_extra(planned, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    assert simulate(planned, "--engine", "mujoco") == 2
    assert capsys.readouterr().err == 'error: mujoco: this engine needs MuJoCo; pip install "pentapod[sim]"\n'
