"""pentapod doctor and pentapod machine new: the installation, and a machine file to fill in."""

import json
import tempfile

import pytest

from pentapod.cli.install import doctor as module
from pentapod.cli.main import run
from pentapod.machine import Machine, shipped_machines


def test_doctor_names_versions_extras_and_folders(capsys):
    assert run(["doctor"]) == 0
    said = capsys.readouterr().out
    for word in ("python", "numpy", "extra batch", "LinuxCNC", "kernels", "can be written"):
        assert word in said
    assert run(["doctor", "--json"]) == 0
    assert {each["name"] for each in json.loads(capsys.readouterr().out)["findings"]} >= {"python", "libraries"}


def test_doctor_tells_what_is_missing_and_how_to_get_it(capsys, monkeypatch):
    known = module._version
    monkeypatch.setattr(module, "_version", lambda package: None if package in ("dask", "numpy") else known(package))
    assert run(["doctor"]) == 1
    said = capsys.readouterr().out
    assert 'pip install "pentapod[batch]"' in said
    assert "missing: numpy" in said


def test_doctor_fails_where_nothing_can_be_written(capsys, monkeypatch):
    def denied(**_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(tempfile, "TemporaryFile", denied)
    assert run(["doctor"]) == 1
    assert "cannot be written: permission denied" in capsys.readouterr().out


@pytest.mark.parametrize("like", shipped_machines())
def test_a_new_machine_has_the_values_of_the_other_and_a_remark_on_each_key(like, tmp_path, capsys):
    file = tmp_path / "mine.toml"
    assert run(["machine", "new", str(file), "--like", like]) == 0
    made, other = Machine.load(str(file)), Machine.load(like)
    assert made.digest == other.digest
    text = file.read_text(encoding="utf-8").splitlines()
    keys = [k for k, line in enumerate(text) if "=" in line and not line.startswith(("#", "name", "description"))]
    assert all(text[k - 1].startswith("# ") for k in keys)
    assert run(["machine", "new", str(file)]) == 2
    assert "the file is there already" in capsys.readouterr().err


def test_inverse_kinematics_beyond_the_strokes_ends_with_1(capsys):
    pose = ["0", "0", "700", "0", "0", "-1"]
    assert run(["ik", *pose]) == 0
    assert run(["ik", "0", "0", "1400", *pose[3:]]) == 1
    assert capsys.readouterr().out.splitlines()[-1].endswith("no")
