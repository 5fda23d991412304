"""The command line, `run` and `verify` make the same claims about a program, of the same files."""

import dataclasses
import json
from hashlib import sha256
from importlib import resources

import numpy as np
import pytest

from pentapod import (
    CollisionWorld,
    Cutting,
    Job,
    Machine,
    RasterOptions,
    RigidTransform,
    judge,
    load_mesh,
    read_csv,
    write_csv,
)
from pentapod.base.version import __version__, library_versions, processor_kind
from pentapod.cli.main import run as command
from pentapod.job import run
from pentapod.job.artefacts import REPORT
from pentapod.job.build.placement import job_constraints
from pentapod.job.build.tool import job_tool
from pentapod.job.build.toolpath import job_toolpath
from pentapod.kinematics import Component
from pentapod.report import write_report
from pentapod.verify import Coverage, verify


@pytest.fixture(scope="module")
def planned(usual_run, tmp_path_factory):
    """The usual job, its outcome, and the folder of a run with a report."""
    job, folder = usual_run[0], tmp_path_factory.mktemp("planned")
    return job, run(job, folder, writers={REPORT: write_report}), folder


def from_python(job, program, sink=0.0):
    """The verdict as README asks for it, on a toolpath that may be sunk into the part."""
    part, tool, machine = load_mesh(job.mesh_path, "mm"), job_tool(job), Machine.load("desk")
    toolpath = job_toolpath(job, part)[0]
    coverage = Coverage.of(part, tool, RasterOptions(stepover=15e-3), path_tolerance=50e-6, share=1.0)
    return verify(
        program, machine, toolpath.transformed(RigidTransform(np.eye(3), np.array([0.0, 0.0, -sink]))),
        tilt=0.0, constraints=job_constraints(job, machine, part), component=Component.parse("++"),
        collision_world=CollisionWorld.of(machine, tool, part),
        path_tolerance=50e-6, axis_tolerance=np.radians(0.5), job_digest=job.digest,
        cutting=Cutting.of(part, tool, coverage=coverage),
    )  # fmt: skip


def claims(content):
    return [c["claim"] for c in content["certificates"]] + [n["claim"] for n in content["not_judged"]]


def test_claims_are_the_same(planned, capsys):
    job, outcome, folder = planned
    assert command(["verify", str(folder / "program.csv"), "--job", str(job.path), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said == json.loads((folder / "verdict.json").read_text(encoding="utf-8")) == outcome.to_dict()
    named = {c.claim for c in outcome.verdict.certificates}
    assert {"placement as the job asks", "component as asked", "controller", "surface left on the region"} <= named
    python = from_python(job, folder / "program.csv")
    assert python.passed
    assert claims(python.to_dict()) == claims(said)


def test_a_program_sunk_into_the_part_passes_nowhere(planned, tmp_path):
    """Two millimetres too deep, with the header as it was."""
    job, outcome, folder = planned
    program, machine = read_csv(folder / "program.csv"), outcome.machine
    position, direction = machine.robot.pose(program.legs, program.component)
    down = program.placement.rotation @ [0.0, 0.0, -2e-3]
    sunk = write_csv(
        dataclasses.replace(program, legs=machine.robot.leg_lengths(position + down, direction)),
        tmp_path / "sunk.csv",
    )
    assert command(["verify", str(sunk), "--job", str(job.path), "--quiet"]) == 1
    for verdict in (judge(job, sunk), from_python(job, sunk), from_python(job, sunk, sink=2e-3)):
        assert not verdict.passed
        gouge = next(c for c in verdict.certificates if c.claim == "gouge on cuts and links")
        assert gouge.value == pytest.approx(2.0, abs=0.06)
        assert not gouge.passed


def test_a_drawing_is_named_by_its_bytes(make_job, tmp_path):
    """In the verdict on a job that cannot be done too."""
    drawing = (
        b'<svg xmlns="http://www.w3.org/2000/svg" width="9mm" height="9mm" viewBox="0 0 9 9"><path d="M1 1L8 8"/></svg>'
    )
    (tmp_path / "a.svg").write_bytes(drawing)
    job = make_job(
        ("stepover_mm = 15\nspacing_mm = 4", 'strategy = "drawing"\nfile = "a.svg"'),
        ("position_mm = [", "position_mm = [1000.0, 0, 700] # ["),
    )
    assert run(Job.load(job), tmp_path / "out", advice=None).refusal is not None
    found = json.loads((tmp_path / "out" / "verdict.json").read_text(encoding="utf-8"))["sha256"]
    assert found["toolpath_file"] == sha256(drawing).hexdigest()
    assert found["toolpath_curve"] is None


def test_the_files_are_named_by_their_bytes(planned, capsys):
    job, outcome, folder = planned
    library = resources.files("pentapod.machine") / "library" / "desk.toml"
    files = {"program": folder / "program.csv", "job": job.path, "machine": library, "mesh": job.mesh_path}
    wanted = {name: sha256(file.read_bytes()).hexdigest() for name, file in files.items()}
    found = json.loads((folder / "verdict.json").read_text(encoding="utf-8"))
    assert found["sha256"] == dict.fromkeys(found["sha256"]) | wanted
    made_by = {"pentapod": __version__, "libraries": library_versions(), "processor": processor_kind()}
    assert found["judged_by"] == made_by
    page = (folder / REPORT).read_text(encoding="utf-8")
    for told in (*wanted.values(), *made_by.values()):
        assert told in page
    # A job that was changed since it was read is no file's; a program alone names itself.
    moved = dataclasses.replace(job, tables=job.tables.model_copy(update={"verify": job.verify.model_copy(
        update={"waive": ("job",)})}))  # fmt: skip
    assert judge(moved, folder).sources == dataclasses.replace(outcome.verdict.sources, job=None)
    assert from_python(job, folder / "program.csv").sources.program == wanted["program"]
    capsys.readouterr()
