"""pentapod modes, and ik and fk on machines of other families."""

import json
import re

import numpy as np
import pytest

from pentapod.cli.main import run
from pentapod.machine import Machine


def legs_in_the_middle(name: str) -> str:
    machine, i = Machine.load(name), np.array([0.0, 0.0, 1.0])
    legs = machine.robot.leg_lengths(machine.work.centre - machine.tool_length * i, i)
    return ",".join(f"{1e3 * length:.6f}" for length in legs)


def test_the_mode_that_fits_is_shown(capsys):
    legs = legs_in_the_middle("desk")
    assert run(["modes", "--legs", legs]) == 0
    text = capsys.readouterr().out
    assert text.startswith("desk: 4 modes (proven complete), 1 fits")
    assert re.search(r"\+\+  tip \(85\.000, -17\.000, 467\.000\) mm, tool axis .*: fits", text)
    assert run(["modes", "--legs", legs, "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert content["proven"] is True
    assert [mode["fits"] for mode in content["modes"]] == [True, False, False, False]
    assert content["modes"][0]["tip_mm"] == pytest.approx([85.0, -17.0, 467.0], abs=1e-4)
    assert all(mode["excluded"] for mode in content["modes"][1:])


def test_rails_move_the_pose(capsys):
    legs = legs_in_the_middle("guide")
    assert run(["modes", "--legs", legs, "-m", "guide", "--rails", "20,20,20,20,20", "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert content["modes"][0]["tip_mm"] == pytest.approx([85.0, 3.0, 467.0], abs=1e-4)  # all alike: a shift along y


def test_legs_without_a_pose_are_refused(capsys):
    assert run(["modes", "--legs", "630,640,650,660,6600"]) == 1
    assert "refused: modes: these legs have no pose that is proven; leg 5 reads 6600 mm" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--legs", "630,640"], "expected 5 numbers, mm"),
        (["--legs", "630,640,650,660,x"], "--legs: wrong numbers"),
        (["--legs", "630,640,650,660,670", "--rails", "1,2"], "no guides|--rails: wrong numbers"),
        (["--legs", "630,640,650,660,670", "--rails", "1,2,3,4,5"], "this machine has no guides"),
        (["--legs", "630,640,650,660,670", "--error", "-1"], "--error"),
    ],
)
def test_wrong_input_is_one_line(words, told, capsys):
    assert run(["modes", *words]) == 2
    said = capsys.readouterr().err
    assert re.search(told, said)
    assert said.count("\n") == 1


def test_fk_undoes_ik_on_the_general_machine(capsys):
    x, y, z = Machine.load("bench-general").work.centre * 1e3
    assert run(["ik", *map(str, (x, y, z, 0.1, -0.2, -1.0)), "-m", "bench-general", "--json"]) == 0
    legs = json.loads(capsys.readouterr().out)
    numbers = [str(legs[f"leg{k}_mm"]) for k in range(1, 6)]
    assert run(["fk", *numbers, "-c", legs["component"], "-m", "bench-general", "--json"]) == 0
    back = json.loads(capsys.readouterr().out)
    assert [back[name] for name in ("x_mm", "y_mm", "z_mm")] == pytest.approx([x, y, z], abs=1e-6)
    assert back["singularity_mm"] > 100.0
    assert "singularity_deg" not in back  # no closed form gives it
    assert run(["fk", *numbers, "-c", "+0", "-m", "bench-general"]) == 2
    assert 'expected "-+", "--", "++", "+-"' in capsys.readouterr().err
