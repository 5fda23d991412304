"""pentapod override: a program with changes of the override, as a user or a script meets it."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

from compiled_kinematics import compiled
from pentapod.cli.main import run
from pentapod.program import write_csv
from short_motion import motion


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    """The path of a program of three seconds."""
    file = tmp_path_factory.mktemp("play") / "program.csv"
    write_csv(motion(3.0)[0], file)
    return str(file)


@compiled
def test_override_as_text_json_and_setpoints(program, tmp_path, capsys):
    out = tmp_path / "played.csv"
    assert run(["override", program, "0.5:50", "1.5:hold", "2.5:resume", "3:100", "-o", str(out)]) == 0
    said = capsys.readouterr().out
    assert re.search(r"played for 4\.\d+ s, to the end; the program of 3\.000 s", said)
    shares = [float(x) for x in re.findall(r"([\d.]+) % of the limit", said)]
    assert len(shares) == 3
    assert max(shares) <= 100.0
    table = np.loadtxt(out, delimiter=",", skiprows=1)
    assert {0.0, 0.5, 1.0} <= set(table[:, 7])
    assert run(["override", program, "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["passed"]
    assert said["to_the_end"]
    assert said["duration_s"] == pytest.approx(3.0, abs=0.05)
    assert said["off_path_um"] < 1e-3
    # The setpoints are a log that monitor reads.
    assert run(["monitor", str(out), "--program", program, "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["complete"]
    assert len(said["holds"]) == 1
    assert said["contour_error_mm"]["largest"] < 1e-3


@compiled
@pytest.mark.parametrize("word", ["hold", "abort", "0"])
def test_override_ends_standing_where_it_is_not_resumed(program, capsys, word):
    assert run(["override", program, f"1:{word}", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert not said["to_the_end"]
    assert said["pace"]["least"] == 0.0
    # An abort is for good.
    assert run(["override", program, f"1:{word}", "2:resume" if word != "0" else "2:100", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["to_the_end"] is (word != "abort")


@compiled
def test_override_says_that_a_program_is_beyond_the_limits(tmp_path, capsys):
    write_csv(motion(0.76)[0], tmp_path / "program.csv")
    assert run(["override", str(tmp_path / "program.csv"), "-q"]) == 1
    assert "a limit is exceeded" in capsys.readouterr().err


@pytest.mark.parametrize("words", [["x:50"], ["1"], ["1:fast"], ["-1:50"], ["1:2"], ["1:150"], ["2:50", "1:100"]])
def test_bad_changes_have_one_line(program, capsys, words):
    assert run(["override", program, "--", *words]) == 2
    said = capsys.readouterr().err
    assert said.startswith("error: changes: ")
    assert said.count("\n") == 1


def test_override_without_a_compiler_names_the_remedy(program, capsys, monkeypatch):
    monkeypatch.setenv("PATH", "/nowhere")
    assert run(["override", program]) == 2
    said = capsys.readouterr().err
    assert said.startswith("error: cc: the player is C, and there is no compiler; install one")
