"""The sample CAM files: they are what their script writes, their cuts are on the dome, and their jobs pass."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
import pytest

from pentapod import SegmentKind, read_toolpath
from pentapod.job import Job, run

TOOLPATHS = Path(__file__).parents[3] / "toolpaths"
MADE = runpy.run_path(str(TOOLPATHS / "make_cam.py"))


@pytest.mark.parametrize("name", MADE["FILES"])
def test_a_sample_file_is_what_its_script_writes_and_touches_the_dome(name):
    text = (TOOLPATHS / "cam" / name).read_text(encoding="ascii")
    assert text == MADE["FILES"][name]()
    path = read_toolpath(TOOLPATHS / "cam" / name)
    cuts = [segment for segment in path.segments if segment.kind is SegmentKind.CUT and len(segment.tips) > 10]
    assert len(cuts) == 5
    ball, sphere, slope = (1e-3 * MADE["BALL"], 1e-3 * MADE["SPHERE"], MADE["SLOPE"])
    middle = np.array([0.0, 0.0, -sphere * np.cos(slope)])
    for cut in cuts:
        gap = np.linalg.norm(cut.tips[1:] + ball * cut.axes[1:] - middle, axis=1) - sphere - ball
        assert np.abs(gap).max() < 4.4e-6, "half way between blocks 2 mm apart the chord is 4.3 µm within the sphere"
        assert (cut.axes[:, 2] > 0.92).all()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["three_axes", "five_axes"])
def test_a_sample_job_passes(name, tmp_path):
    assert run(Job.load(TOOLPATHS / "cam" / f"{name}.toml"), tmp_path / "out").passed
