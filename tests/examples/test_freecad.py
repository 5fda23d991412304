"""The FreeCAD macro, run in FreeCAD without a window: faces and tool become a job, and its program is shown."""

import json
import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

import pentapod
from pentapod import Job
from pentapod.machine import Machine

HERE = Path(__file__).parent
MACRO = HERE.parents[1] / "examples" / "freecad" / "pentapod_macro.py"
pytestmark = pytest.mark.skipif(shutil.which("freecadcmd") is None, reason="FreeCAD (freecadcmd) is not installed")


WINDOW = ["xvfb-run", "-a", "-s", "-screen 0 1280x900x24", "freecad"]


def session(folder: Path, until: str, changes=(), program=("freecadcmd",)) -> dict:
    """Run the session in FreeCAD's own Python, and pentapod in ours; return what it found."""
    command = folder / "pentapod"
    code = "from pentapod.cli.main import main; main()"
    source = Path(pentapod.__file__).parents[1]
    command.write_text(f'#!/bin/sh\nPYTHONPATH="{source}" exec "{sys.executable}" -c "{code}" "$@"\n')
    command.chmod(0o755)
    words = {"FOLDER": folder, "MACRO": MACRO, "UNTIL": until, "CHANGES": json.dumps(changes), "PENTAPOD": command}
    home = {"HOME": folder, "XDG_CACHE_HOME": os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")}
    home["QTWEBENGINE_DISABLE_SANDBOX"] = 1  # of FreeCAD's start page; it would not start as root
    environment = {**os.environ, **{name: str(value) for name, value in {**words, **home}.items()}}
    done = subprocess.run(
        [*program, str(HERE / "freecad_session.py")], capture_output=True, text=True, check=False, env=environment,
        stdin=subprocess.DEVNULL, timeout=500,
    )  # fmt: skip
    assert (folder / "result.json").exists(), (done.stdout + done.stderr)[-3000:]
    return json.loads((folder / "result.json").read_text())


def test_faces_and_tool_become_a_job(tmp_path):
    """The box holds the face, the cone its normals: 8.6 and 5.7 degrees to the sides, 20.9 to the corners."""
    found = session(tmp_path, "job")
    first = tomllib.loads(found["job"])
    assert first["tool"] == {"type": "ball", "diameter_mm": 6.0}
    assert first["feed"]["cut_mm_min"] == pytest.approx(1800.0)
    low, high = np.array(first["part"]["region_box_mm"])
    assert low[:2] == pytest.approx([-25.1, -20.1], abs=0.02)
    assert high == pytest.approx([35.1, 20.1, 17.1], abs=0.02)
    assert first["part"]["region_direction"] == pytest.approx([0.0, 0.0, 1.0], abs=0.01)
    assert first["part"]["region_angle_deg"] == pytest.approx(np.degrees(np.arcsin(np.hypot(0.3, 0.2))) + 1.0, abs=1.0)
    again = tomllib.loads(found["again"])
    assert again["part"] == {"mesh": "part.stl", "unit": "mm"}, "no faces: the whole part"
    assert again["tool"] == {"type": "bull", "diameter_mm": 6.0, "corner_mm": 2.0}, "its flat part has a radius of 1 mm"
    assert (first["axis"], again["axis"]) == ({"tilt_deg": 15.0}, {"tilt_deg": 0.0})
    assert "stepover_mm = 2.5  # mine" in found["again"], "what the user changed stays"
    assert [key for key in again if key not in first] == []
    edges, none, chamfer = found["errors"]
    assert "select faces" in edges
    assert "select a tool" in none
    assert "45 Deg. Chamfer is not a ball" in chamfer
    assert Job.load(tmp_path / "job.toml").part.mesh


def in_the_middle() -> list[tuple[str, str]]:
    """Changes of the job that leave nothing to search for."""
    centre = np.round(Machine.load("desk").work.centre * 1e3, 3).tolist()
    fixed = f'mode = "fixed"\nposition_mm = {centre}\nrotation_deg = [180, 0, 0]\ncomponent = "++"'
    return [('mode = "free"', fixed), ("stepover_mm = 1", "stepover_mm = 8"), ("tilt_deg = 15.0", "tilt_deg = 0"),
            ("axis_deg = 0.5", "axis_deg = 0.5\nleft_share = 1\nleft_mm = 2")]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("changes", [in_the_middle(), [("stepover_mm = 1", "stepover_mm = 2")]], ids=["fixed", "free"])
def test_program_is_shown_where_it_cuts(changes, tmp_path):
    found = session(tmp_path, "path", changes)
    assert found["label"].endswith("verdict passed"), found["label"]
    assert found["objects"] == ["Pentapod", "PentapodPath", "PentapodAxes"], "what was shown before is replaced"
    distances = np.array(found["distances"])
    touching = np.abs(distances - 3.0) < 0.05
    assert distances.min() > 3.0 - 0.05
    assert touching.mean() > 0.5
    tips = np.array(found["tips"])
    assert len(tips) > 500
    assert tips[:, 0].min() > -40
    assert tips[:, 0].max() < 50
    assert {"G1"} <= set(found["kinds"]) <= {"G0", "G1"}
    assert "cut_mm_mn" in found["error"]
    assert "did you mean" in found["error"]


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("xvfb-run") is None, reason="xvfb, a display without a screen, is not installed")
def test_selection_in_the_window_is_sent(tmp_path):
    """The macro as FreeCAD runs it: the selected face and tool controller, its own folder, the group in the tree."""
    found = session(tmp_path, "window", [*in_the_middle(), ("stepover_mm = 8", "stepover_mm = 3")], WINDOW)
    assert found["label"].endswith("verdict passed"), found["label"]
    assert found["objects"] == ["PentapodPath", "PentapodAxes"]
    assert "region_box_mm" in found["job"]
    assert "stepover_mm = 3" in found["job"], "what the user changed stays"
    assert (tmp_path / "part_pentapod" / "out" / "program.csv").is_file()
    assert (tmp_path / "window.png").stat().st_size > 10_000
