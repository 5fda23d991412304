"""The meshes kept beside the jobs are what their script makes, sound, and fine enough."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

from pentapod.mesh.io.stl import read_stl
from pentapod.toolpath import load_mesh

FOLDER = Path(__file__).parents[2] / "toolpaths"
SLOPES_DEG = {"dome": 40.0, "saddle": 35.0, "wavy": 19.5, "relief": 16.5, "rail": 20.4, "oversize": 17.5}
FACETS_WITHIN_UM = {"dome": 5.0, "saddle": 5.0, "wavy": 15.0, "relief": 10.0, "rail": 15.0, "oversize": 50.0}


@pytest.fixture(scope="module")
def make_parts():
    spec = importlib.util.spec_from_file_location("make_parts", FOLDER / "make_parts.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["make_parts"] = module
    spec.loader.exec_module(module)
    return module


def test_the_script_makes_the_files_that_are_kept(make_parts, tmp_path, capsys):
    """Same bytes from run to run; the same numbers as kept, whatever the mathematics library's last bit."""
    folders = [tmp_path / "one", tmp_path / "two"]
    for folder in folders:
        folder.mkdir()
        make_parts.main(folder)
    names = sorted(p.name for p in FOLDER.glob("*.stl"))
    assert [sorted(p.name for p in folder.iterdir()) for folder in folders] == [names, names]
    for name in names:
        one, two = ((folder / name).read_bytes() for folder in folders)
        assert one == two
        kept, made = read_stl(FOLDER / name, (FOLDER / name).read_bytes()), read_stl(folders[0] / name, one)
        np.testing.assert_allclose(made, kept, atol=1e-4)
    assert "dome.stl" in capsys.readouterr().out


@pytest.mark.parametrize("name", SLOPES_DEG)
def test_parts_are_sound_and_as_steep_as_said(make_parts, name):
    path = FOLDER / f"{name}.stl"
    assert path.stat().st_size < 2_000_000
    mesh = load_mesh(path, "mm")
    assert mesh.diagnosis.problems == ()
    assert mesh.diagnosis.repairs == ()
    assert mesh.diagnosis.bodies == 1
    assert mesh.diagnosis.border_loops == (2 if name == "wavy" else 1)
    steepest = np.degrees(np.arccos(mesh.facet_normals[:, 2].min()))
    assert steepest == pytest.approx(SLOPES_DEG[name], abs=0.5)
    assert 1e3 * make_parts.chord_error(name) < FACETS_WITHIN_UM[name]
