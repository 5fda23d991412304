"""The example of the general pentapod prints what its first lines say."""

import runpy
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "examples" / "06_general_pentapod.py"


def test_it_prints_the_modes_the_swing_the_obstacles_and_the_platform(capsys: pytest.CaptureFixture[str]) -> None:
    runpy.run_path(str(SCRIPT), run_name="__main__")
    lines = capsys.readouterr().out.splitlines()
    modes = [line for line in lines if line.startswith("  mode")]
    assert len(modes) == 4
    assert all(("= -" if line[7] == "-" else "= +") in line.split("polynomial")[1] for line in modes)
    assert any("p = [0.1  0.05 0.6 ], i = [0.36 0.48 0.8 ]" in line for line in modes)
    swing = [line.split() for line in lines if line.startswith("  w =")]
    assert {words[4] for words in swing} == {"+1"}
    assert (swing[0][6], swing[-1][6]) == ("+1", "-1")
    assert sum("no assembly: violates" in line for line in lines) == 3
    platform = [line for line in lines if line.startswith("  label")]
    assert len(platform) == 8
    assert sum("no pose" in line for line in platform) % 2 == 0
