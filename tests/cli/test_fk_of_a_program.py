"""`pentapod fk --program`: the tool's path of a program, in the frame of the part."""

import json

import numpy as np
import pytest

from pentapod.cli.main import run
from pentapod.program import write_csv
from short_motion import motion, poses


@pytest.fixture
def program(tmp_path):
    made, _ = motion(duration=0.3)
    write_csv(made, tmp_path / "program.csv")
    return made


def test_tips_and_axes_are_those_of_the_motion(program, tmp_path, capsys):
    assert run(["fk", "--program", str(tmp_path / "program.csv")]) == 0
    title, *rows = capsys.readouterr().out.splitlines()
    assert title == "time_s,x_mm,y_mm,z_mm,i,j,k"
    table = np.array([[float(cell) for cell in row.split(",")] for row in rows])
    assert table[:, 0] == pytest.approx(program.times)
    tips, directions = poses(np.arange(301) / 300)
    placed = program.placement
    assert np.abs(placed.apply(table[:, 1:4] * 1e-3) - tips).max() < 1e-8
    assert np.abs(placed.rotate(table[:, 4:]) + directions).max() < 1e-7
    assert run(["fk", "--program", str(tmp_path / "program.csv"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)[17]["x_mm"] == pytest.approx(table[17, 1], abs=1e-8)


def test_wrong_uses_are_told(program, tmp_path, capsys):
    file = str(tmp_path / "program.csv")
    assert run(["fk", "--program", file, "600", "600", "600", "600", "600"]) == 2
    assert "--program takes no legs" in capsys.readouterr().err
    assert run(["fk", "--job", file]) == 2
    assert "--job needs --program" in capsys.readouterr().err
    assert run(["fk", "--program", file, "-m", "steep"]) == 2
    assert "not the machine" in capsys.readouterr().err
