"""The numbered examples that draw: each runs as its first lines say, and leaves a picture with something in it."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
DRAWING = sorted(p for p in (ROOT / "examples").glob("*.py") if "matplotlib" in p.read_text(encoding="utf-8"))


@pytest.mark.parametrize("script", DRAWING, ids=lambda p: p.stem)
def test_example_draws(script: Path, tmp_path: Path) -> None:
    from matplotlib.image import imread

    picture = tmp_path / "picture.png"
    command = [sys.executable, "-W", "error", str(script), "--out", str(picture)]
    answer = subprocess.run(
        command, capture_output=True, text=True, check=False, env={**os.environ, "MPLBACKEND": "Agg"}
    )
    assert answer.returncode == 0, answer.stderr
    pixels = imread(picture)
    assert min(pixels.shape[:2]) > 300
    assert len(np.unique(pixels.reshape(-1, pixels.shape[2]), axis=0)) > 20
    text = script.read_text(encoding="utf-8")
    kept = ROOT / text.split("--out ", 1)[1].split()[0]
    assert kept.is_file(), "the picture is kept in docs/"
