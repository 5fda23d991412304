"""The search: the same bits after an interruption and on any number of processes; its front; its files."""

import json
import shutil
import tomllib
from dataclasses import replace
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from designs import geometry_of
from pentapod.base.errors import InputError, PentapodError
from pentapod.batch import Engine
from pentapod.batch.tasks.engine import LOG
from pentapod.cli.main import run
from pentapod.design import members, proof_tasks
from pentapod.design import search as module
from pentapod.design.design_file import DesignFile
from pentapod.design.evaluation import Sample, worst_poses
from pentapod.design.figures import in_poses
from pentapod.design.members import job_on_design
from pentapod.design.part_poses import PartPoses
from pentapod.design.proof import FORCES, SHAPE, ProofOptions, prove, worst_of
from pentapod.design.proof_tasks import proof_of, proof_task, prove_in
from pentapod.design.search import search, undominated
from pentapod.job import Job
from pentapod.machine import Machine, check

LOGS = (LOG, ".lock")
TOOLPATHS = Path(__file__).parents[2] / "toolpaths"


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


def test_a_search_of_another_version_begins_anew(design_file, tmp_path, caplog):
    file = DesignFile.load(design_file())
    members._check_folder(file, tmp_path)
    (tmp_path / "designs.bin").write_bytes(b"evaluations")
    members._check_folder(file, tmp_path)
    assert (tmp_path / "designs.bin").exists()
    before = json.loads((tmp_path / "search.json").read_text(encoding="utf-8"))
    (tmp_path / "search.json").write_text(json.dumps(before | {"versions": {"pentapod": "0.0.1"}}), encoding="utf-8")
    members._check_folder(file, tmp_path)
    assert "the search begins anew" in caplog.text
    assert not (tmp_path / "designs.bin").exists()
    assert json.loads((tmp_path / "search.json").read_text(encoding="utf-8")) == before


@pytest.fixture
def narrow(design_file):
    """A file whose proofs are quick: a small work volume."""
    return design_file(("centre_z_mm = [350, 800]", "diameter_mm = [9, 10]\nheight_mm = [4, 5]\ntilt_deg = [5, 6]"),
                       ("amplification = 5.3", "amplification = 4.9"))  # fmt: skip


def test_command_writes_machines_that_hold(narrow, tmp_path, capsys, monkeypatch):
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
    assert page.count(">middle of the work volume<") == 2 * len(front["members"])
    proofs = [path.name for path in (out / "tasks").glob("proof-*/row.json")]
    assert len(proofs) == len(front["members"]) + len(front["dropped"])
    before = files(out)
    monkeypatch.setattr(Engine, "submit", None)  # nothing is proven again
    assert run(["design", str(narrow), "-o", str(out), "-j", "1", "-q"]) == 0
    assert before == files(out)


def files(folder):
    return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.name not in LOGS
            and path.is_file()}  # fmt: skip


@pytest.mark.slow
def test_command_writes_the_same_files_on_two_workers_and_after_a_proof_was_lost(narrow, tmp_path):
    for workers in ("1", "2"):
        run(["design", str(narrow), "-o", str(tmp_path / workers), "-j", workers, "-q"])
    assert files(tmp_path / "1") == files(tmp_path / "2")
    shutil.rmtree(next((tmp_path / "2" / "tasks").glob("proof-*")))
    (tmp_path / "2" / "front.json").unlink()
    run(["design", str(narrow), "-o", str(tmp_path / "2"), "-j", "2", "-q"])
    assert files(tmp_path / "1") == files(tmp_path / "2")


def test_what_a_proof_may_find_beyond_the_sample_is_within_the_reserve(design_file):
    """Where the dense sample is coarse: its worst poses are made worse until little is left for the proof."""
    sizes = {"length": 6e-4, "angle": 6e-3, "clearance": 3e-4, "singular": 3e-3, "force": 6e-3}
    options, file = ProofOptions(around=4, levels=2, azimuths=4, **sizes), DesignFile.load(design_file())
    start = replace(geometry_of("desk"), diameter=0.02, height=0.01, tilt=np.radians(6.0))
    unknowns = replace(file.unknowns, start=start)
    vector = unknowns.vector()
    sample = Sample(unknowns, None, np.zeros((1, 5)), PartPoses(np.zeros((0, 3)), np.zeros((0, 3))))
    for _ in range(3):
        sample = replace(sample, unit=np.concatenate([sample.unit, worst_poses(sample, vector, options)]))
    design = unknowns.design(vector)
    axes = design.base_axes()
    here, proof = worst_of(in_poses(design, axes, *design.poses(sample.unit))), prove(design, axes, options)
    assert proof.settled
    for name, (sense, kind) in (SHAPE | dict.fromkeys(FORCES, (1.0, "force"))).items():
        step = getattr(options, kind) * (here[name] if name in FORCES else 1.0)
        assert sense * (proof.proven[name] - here[name]) <= options.reserve * step * 1.001, name


def test_a_proof_as_a_task_is_the_same_to_the_last_bit(tmp_path, monkeypatch):
    """Also one that has no bound of a force: the row goes through JSON."""
    design = replace(geometry_of("desk"), diameter=0.004, height=0.002, tilt=np.radians(2.0))
    row = prove_in(tmp_path, **json.loads(json.dumps(proof_task(design).arguments)))
    proof = prove(design, design.base_axes())
    assert vars(proof_of(json.loads(json.dumps(row)))) == vars(proof)
    monkeypatch.setattr(proof_tasks, "prove", lambda *_: replace(proof, proven={"amplification": np.inf}))
    row = prove_in(tmp_path, **proof_task(design).arguments)
    assert proof_of(json.loads(json.dumps(row, allow_nan=False))).proven == {"amplification": np.inf}
    with pytest.raises(PentapodError, match="out of memory"):
        proof_of({"status": "crashed", "cause": "out of memory"})


def test_command_says_that_nothing_holds_and_refuses_another_folder(narrow, tmp_path, capsys):
    out = tmp_path / "designs"
    text = narrow.read_text(encoding="utf-8").replace("amplification = 4.9", "amplification = 0.5")
    narrow.write_text(text, encoding="utf-8")
    assert run(["design", str(narrow), "-o", str(out), "-j", "1", "-q"]) == 1
    assert "no design keeps all needs" in capsys.readouterr().err
    narrow.write_text(text.replace("seed", "seed") + "seed = 2\n", encoding="utf-8")
    assert run(["design", str(narrow), "-o", str(out), "-j", "1"]) == 2
    assert "the folder holds another search" in capsys.readouterr().err


def test_an_interrupted_search_says_that_the_command_goes_on(design_file, tmp_path, monkeypatch, capsys):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(members, "design_machines", interrupted)
    assert run(["design", str(design_file()), "-o", str(tmp_path / "out"), "-q"]) == 130
    assert f"what is done is in {tmp_path / 'out'}: the same command goes on" in capsys.readouterr().err


def test_missing_pymoo_is_an_error_that_says_what_to_install(design_file, tmp_path, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "pymoo.algorithms.moo.nsga2", None)
    with pytest.raises(InputError, match=r'pip install "pentapod\[design\]"'):
        search(DesignFile.load(design_file()), tmp_path)


def test_a_table_moves_with_the_work_volume(design_file):
    """Its height counts from the base, whose distance from the work volume is a designer's choice."""
    file = DesignFile.load(design_file())
    job = Job.load(TOOLPATHS / "dome.toml")
    machine = tomllib.loads((resources.files("pentapod.machine.library") / "desk.toml").read_text(encoding="utf-8"))
    machine["work"]["centre_mm"][2] += 100.0
    moved = job_on_design(job, file, machine)
    assert (job.placement.table_z_mm, moved.placement.table_z_mm) == (450.0, pytest.approx(550.0))
    free = job.with_(placement={"mode": "free", "table_z_mm": None})
    assert job_on_design(free, file, {}) is free
