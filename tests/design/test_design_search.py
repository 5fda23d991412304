"""The search: the same bits after an interruption and on any number of processes; its front; its files."""

import json

import numpy as np
import pytest

from pentapod.base.errors import InputError
from pentapod.cli.main import run
from pentapod.design import search as module
from pentapod.design.design_file import DesignFile
from pentapod.design.search import search, undominated
from pentapod.design.workers import worker_processes
from pentapod.machine import Machine, check


def test_undominated_rows():
    goals = np.array([[1.0, 3.0], [2.0, 2.0], [2.0, 3.0], [3.0, 1.0], [2.0, 2.0]])
    assert undominated(goals).tolist() == [True, True, False, True, False]


def test_a_search_that_was_killed_ends_with_the_same_bits(design_file, tmp_path, monkeypatch):
    file, whole, killed = DesignFile.load(design_file()), tmp_path / "whole", tmp_path / "killed"
    whole.mkdir()
    killed.mkdir()
    expected = search(file, whole)
    rows = (whole / "designs.bin").read_bytes()
    (killed / "designs.bin").write_bytes(rows[: len(rows) // 2 + 3])  # within a row
    computed = []
    monkeypatch.setattr(module, "evaluated", lambda *given: computed.append(len(given[1])) or evaluated(*given))
    found = search(file, killed)
    assert 0 < sum(computed) < expected.designs
    assert (killed / "designs.bin").read_bytes() == rows
    assert found.vectors.tobytes() == expected.vectors.tobytes()
    assert found.values.tobytes() == expected.values.tobytes()
    assert found.designs == expected.designs


def evaluated(*given):
    from pentapod.design.evaluation import evaluated as real

    return real(*given)


@pytest.mark.slow
def test_processes_do_not_change_the_result(design_file, tmp_path):
    file = DesignFile.load(design_file())
    (tmp_path / "one").mkdir()
    (tmp_path / "two").mkdir()
    search(file, tmp_path / "one")
    with worker_processes(2) as pool:
        search(file, tmp_path / "two", pool)
    assert (tmp_path / "one" / "designs.bin").read_bytes() == (tmp_path / "two" / "designs.bin").read_bytes()


def test_evaluations_of_another_version_are_not_taken(design_file, tmp_path):
    """Where a stored design is not the one that is asked for, it is evaluated anew from there on."""
    file = DesignFile.load(design_file())
    expected = search(file, tmp_path)
    rows = np.fromfile(tmp_path / "designs.bin", dtype="<f8")
    changed = rows.copy()
    changed[len(rows) // 2 :] += 1e-3
    changed.tofile(tmp_path / "designs.bin")
    assert search(file, tmp_path).vectors.tobytes() == expected.vectors.tobytes()
    assert (np.fromfile(tmp_path / "designs.bin", dtype="<f8") == rows).all()


@pytest.fixture
def narrow(design_file):
    """A file whose proofs are quick: a small work volume."""
    return design_file(("centre_z_mm = [350, 800]", "diameter_mm = [9, 10]\nheight_mm = [4, 5]\ntilt_deg = [5, 6]"),
                       ("amplification = 5.3", "amplification = 4.9"))  # fmt: skip


def test_command_writes_machines_that_hold(narrow, tmp_path, capsys):
    out = tmp_path / "designs"
    assert run(["design", str(narrow), "-o", str(out), "-j", "1"]) == 0
    said = capsys.readouterr().out
    assert "member-01: amplification" in said
    front = json.loads((out / "front.json").read_text(encoding="utf-8"))
    table = (out / "front.csv").read_text(encoding="utf-8").splitlines()
    assert len(table) == 1 + len(front["members"])
    for member in front["members"]:
        machine = Machine.load(out / member["machine"])
        report = check(machine)
        assert report.passed
        assert report.amplification <= member["proven"]["amplification"] <= 4.9
        assert 1e3 * report.clearance >= member["proven"]["clearance_mm"] >= 2.0
        assert 1e3 * report.length_range.min() >= member["proven"]["shortest_leg_mm"]
        assert front["means"]["amplification"].startswith("bound over all poses")
    page = (out / "design.html").read_text(encoding="utf-8")
    assert page.count("<svg") == 1 + 2 * len(front["members"])
    before = {path.name: path.read_bytes() for path in out.iterdir() if path.is_file()}
    assert run(["design", str(narrow), "-o", str(out), "-j", "1", "-q"]) == 0
    assert before == {path.name: path.read_bytes() for path in out.iterdir() if path.is_file()}


def test_command_says_that_nothing_holds_and_refuses_another_folder(narrow, tmp_path, capsys):
    out = tmp_path / "designs"
    text = narrow.read_text(encoding="utf-8").replace("amplification = 4.9", "amplification = 0.5")
    narrow.write_text(text, encoding="utf-8")
    assert run(["design", str(narrow), "-o", str(out), "-j", "1", "-q"]) == 1
    assert "no design holds" in capsys.readouterr().err
    narrow.write_text(text.replace("seed", "seed") + "seed = 2\n", encoding="utf-8")
    assert run(["design", str(narrow), "-o", str(out), "-j", "1"]) == 2
    assert "the folder holds another search" in capsys.readouterr().err


def test_missing_pymoo_is_an_error_that_says_what_to_install(design_file, tmp_path, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "pymoo.algorithms.moo.nsga2", None)
    with pytest.raises(InputError, match=r'pip install "pentapod\[design\]"'):
        search(DesignFile.load(design_file()), tmp_path)
