"""The numbered examples that draw: each runs as its first lines say, and leaves a picture with something in it."""

import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
DRAWING = sorted(p for p in (ROOT / "examples").glob("*.py") if "matplotlib" in p.read_text(encoding="utf-8"))
FIRST = DRAWING[0]
QUICK = ("12_around_a_singular_surface", "13_legs_and_tool")


@pytest.fixture(autouse=True)
def off_screen(monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "Agg")


def check(script: Path, picture: Path) -> None:
    from matplotlib.image import imread

    pixels = imread(picture)
    assert min(pixels.shape[:2]) > 300
    assert len(np.unique(pixels.reshape(-1, pixels.shape[2]), axis=0)) > 20
    text = script.read_text(encoding="utf-8")
    kept = ROOT / text.split("--out ", 1)[1].split()[0]
    assert kept.is_file(), "the picture is kept in docs/"


@pytest.mark.parametrize(
    "script", [pytest.param(p, id=p.stem, marks=() if p.stem in QUICK else pytest.mark.slow) for p in DRAWING]
)
def test_example_draws(script, tmp_path, monkeypatch):
    from matplotlib import pyplot

    monkeypatch.setattr(sys, "argv", [str(script), "--out", str(tmp_path / "picture.png")])
    try:
        runpy.run_path(str(script), run_name="__main__")
    finally:
        pyplot.close("all")
    check(script, tmp_path / "picture.png")


@pytest.mark.slow
def test_an_example_draws_from_the_shell(tmp_path):
    command = [sys.executable, "-W", "error", str(FIRST), "--out", str(tmp_path / "picture.png")]
    answer = subprocess.run(command, capture_output=True, text=True, check=False)
    assert answer.returncode == 0, answer.stderr
    check(FIRST, tmp_path / "picture.png")
