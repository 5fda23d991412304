"""Withheld programs: a program that fails its own verdict is refused, and no program.csv is written."""

import importlib
import json
from dataclasses import replace

import pytest

import concave_parts
from pentapod.cli.commands.new import dome_stl, job_text
from pentapod.job import Job, run
from pentapod.job.advice.options import Tried
from pentapod.job.build.left import foreseen, missed_by_drops
from pentapod.job.build.specification import job_specification
from pentapod.job.build.toolpath import Reports, job_toolpath
from pentapod.job.build.values import job_machine, job_mesh
from pentapod.job.pipeline.run import tried
from pentapod.job.withheld import withheld
from pentapod.mesh.io.stl import write_stl
from pentapod.toolpath.gouge.report import GougeReport
from pentapod.verify import Claim, Verdict
from pentapod.verify.replay.claim import Finding
from pentapod.verify.surface.surface_left import SURFACE_LEFT
from pentapod.verify.verdict.verdict import Certificate, Place
from refused_jobs import cap

TABLES = {
    "part": {"mesh": "part.stl", "unit": "mm"},
    "machine": {"name": "desk"},
    "tool": {"type": "ball", "diameter_mm": 6.0},
    "toolpath": {"stepover_mm": 4.0},
    "feed": {"cut_mm_min": 1500.0},
}


def certificate(claim, passed, value=0.5):
    return Certificate(claim, passed, value, 0.1, "mm", Place(1.25, 1250, 3), "measured")


def test_a_verdict_without_failures_withholds_nothing():
    assert withheld(Verdict((certificate("gouge", True), certificate("stops", True)))) is None


def test_the_refusal_names_claims_that_fail_with_value_bound_and_time():
    names = ("gouge", "tip deviation", "leg 1 speed", "leg 2 speed", "leg 3 speed")
    refusal = withheld(Verdict(tuple(certificate(name, name == "leg 3 speed") for name in names)))
    assert refusal is not None
    assert "gouge 0.5 mm (at most 0.1) at 1.250 s; tip deviation" in str(refusal)
    assert "and 1 more claim" in str(refusal)
    assert "leg 3" not in str(refusal)


@pytest.mark.slow
def test_a_program_that_fails_its_verdict_is_not_left_as_program(tmp_path):
    (tmp_path / "part.stl").write_bytes(dome_stl(cells=12))
    (tmp_path / "job.toml").write_text(job_text(), encoding="utf-8")
    job, out = Job.load(tmp_path / "job.toml"), tmp_path / "out"
    never = Claim("never", lambda _: Finding(False, 1.0, 0.0, "", Place(), "always fails"))
    outcome = run(job, out, claims=(never,), advice=None)
    assert not outcome.passed
    assert "never" in outcome.refusal.cause
    assert [c.claim for c in outcome.verdict.certificates if not c.passed] == ["never"]
    assert {path.name for path in out.iterdir()} == {"withheld.csv", "plan.npz", "verdict.json", "manifest.json"}
    assert json.loads((out / "verdict.json").read_text())["refusal"]["stage"] == "verdict"
    assert run(job, out).passed
    assert {path.name for path in out.iterdir()} == {"program.csv", "plan.npz", "verdict.json", "manifest.json"}


def test_a_plan_for_advice_is_not_made_where_its_toolpath_leaves_too_much(tmp_path):
    """As often as not, too much was left for the same reason as in the run."""
    (tmp_path / "part.stl").write_bytes(dome_stl(cells=12))
    (tmp_path / "job.toml").write_text(job_text(), encoding="utf-8")
    stages: set[str] = set()
    job = Job.load(tmp_path / "job.toml").with_(tolerance={"left_mm": 0.05})
    ended = tried(job, lambda stage, *_: stages.add(stage), left_first=True)
    assert ended == Tried("verdict", failed=frozenset((SURFACE_LEFT,)), left=ended.left)
    assert 50.0 < ended.left < 100.0
    assert "toolpath" in stages
    assert "placement" not in stages


def test_a_toolpath_that_leaves_out_what_the_shank_forbids_is_refused_before_it_is_planned(tmp_path):
    mesh = concave_parts.mesh("pocket_boss")
    (tmp_path / "part.stl").write_bytes(write_stl(1e3 * mesh.vertices[mesh.faces], "pocket"))
    tables = {**TABLES, "axis": {"mode": "fixed", "direction": [0.3, 0.0, 1.0]}}
    outcome = run(Job.from_dict(tables, tmp_path), tmp_path / "out", advice=None)
    assert outcome.refusal.stage == "toolpath"
    assert "shank or holder would cut into the part" in outcome.refusal.cause
    assert [stage.name for stage in outcome.stages] == ["mesh", "toolpath", "foreseen"]
    assert not (tmp_path / "out" / "program.csv").exists()
    upright = Job.from_dict({**tables, "axis": {"mode": "auto"}}, tmp_path)
    assert refused_of(upright) is None


def test_long_motions_that_the_shank_forbids_count_by_their_length(tmp_path):
    """On flat walls cuts are long: a few of thousands of motions may be a fifth of the surface."""
    (tmp_path / "part.stl").write_bytes(dome_stl(cells=12))
    job = Job.from_dict({**TABLES, "axis": {"mode": "fixed", "direction": [0.0, 0.0, 1.0]}}, tmp_path)
    few = GougeReport(motions=3000, gouging=100, depths=(0.0, 5e-4, 0.0), dropped=100, dropped_share=0.19)
    toolpath = job_toolpath(job, job_mesh(job))[0]
    assert "on 19 % of the cuts" in str(foreseen(job, Reports((few,)), toolpath, None))
    assert "part.region_direction" not in str(foreseen(job, Reports((few,)), toolpath, None))
    sideways = job.with_(axis={"mode": "fixed", "direction": [1.0, 0.0, 0.0]})
    told = str(foreseen(sideways, Reports((few,)), toolpath, None))
    assert "(axis.direction is 90 deg from part.region_direction)" in told
    assert foreseen(job, Reports((replace(few, dropped=1000, dropped_share=0.01),)), toolpath, None) is None


def leaning(folder, degrees, lean, **tables):
    """A job for a cap of a sphere, the tool beside its normals by `lean` mm per mm of height; the rim is forbidden."""
    vertices, faces = cap(25.0, degrees)()
    (folder / "part.stl").write_bytes(write_stl(vertices[faces], "cap"))
    return Job.from_dict({**TABLES, "axis": {"mode": "fixed", "direction": [lean, 0.0, 1.0]}, **tables}, folder)


def refused_of(job):
    machine, mesh = job_machine(job), job_mesh(job)
    toolpath, reports = job_toolpath(job, mesh, machine=machine)
    return foreseen(job, reports, toolpath, job_specification(job, machine, mesh, lambda: toolpath).cutting)


@pytest.mark.slow
def test_what_the_passes_beside_dropped_cuts_reach_is_not_missed(tmp_path):
    """Nearly as much is dropped of both caps; of the second the ball reaches all on its way beside that."""
    assert "about 0.47 % of the region" in str(refused_of(leaning(tmp_path, 80.0, 0.3)))
    assert refused_of(leaning(tmp_path, 75.0, 0.35)) is None


@pytest.mark.slow
def test_what_dropped_cuts_leave_is_about_what_the_verdict_finds(tmp_path):
    job = leaning(tmp_path, 75.0, 0.45, tolerance={"left_share": 0.02})
    outcome = run(job, tmp_path / "out", advice=None)
    assert outcome.passed
    (found,) = (each.value for each in outcome.verdict.certificates if each.claim == SURFACE_LEFT)
    machine, mesh = job_machine(job), job_mesh(job)
    toolpath, reports = job_toolpath(job, mesh, machine=machine)
    (gouges,) = (each for each in reports.parts if isinstance(each, GougeReport))
    cutting = job_specification(job, machine, mesh, lambda: toolpath).cutting
    assert 100.0 * missed_by_drops(cutting, toolpath, gouges.dropped_centres) == pytest.approx(found, rel=0.1)


@pytest.mark.slow
def test_a_little_more_that_may_be_left_needs_no_other_plan(tmp_path, monkeypatch):
    """The plan would write the same program, which is judged again; that it does, a plan shows."""
    job = leaning(tmp_path, 75.0, 0.45, tolerance={"left_share": 0.008})
    with monkeypatch.context() as patched:
        patched.setattr(importlib.import_module("pentapod.job.pipeline.run"), "tried", lambda *_, **__: Tried("again"))
        outcome = run(job, tmp_path / "out")
    (advice,) = outcome.refusal.advice
    assert list(advice.tables) == ["tolerance"]
    assert list(advice.tables["tolerance"]) == ["left_share"]
    again = run(job.with_(**advice.tables), tmp_path / "again", advice=None)
    assert again.passed
    assert again.margin == advice.margin


@pytest.mark.slow
def test_a_tool_that_may_lean_is_advised_to_where_its_shank_would_touch(tmp_path):
    job = leaning(tmp_path, 80.0, 0.3)
    outcome = run(job, tmp_path / "out")
    assert outcome.refusal.stage == "toolpath"
    assert outcome.refusal.advice[0].tables == {"gouge": {"remedy": ["tilt", "drop"]}}
    assert outcome.refusal.advice[0].kept == 1.0
