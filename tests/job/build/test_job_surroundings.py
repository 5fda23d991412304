"""Jobs with a fixture and a holder: planned around, refused by name, and judged from the program file alone."""

from __future__ import annotations

import pytest
import trimesh

from pentapod.base.errors import JobError, MeshError
from pentapod.job import Job, judge, run
from pentapod.job.build.specification import job_collision_world
from pentapod.job.build.values import job_machine, job_mesh
from pentapod.mesh.io.stl import write_stl

HELD = "diameter_mm = 10\nshank_mm = [[20, 8, 8]]\nholder_mm = [[25, 20, 30]]"
FIXTURE = '[fixture]\nmesh = "{}.stl"\nunit = "mm"\n[feed]'
BODIES = ("legs", "spindle", "tool body")


@pytest.fixture
def meshes(tmp_path):
    """A vise beside the part, lower than its top; a plate across the spindle; a column through the part."""
    vise, plate = trimesh.creation.box((20.0, 60.0, 20.0)), trimesh.creation.box((400.0, 400.0, 5.0))
    vise.apply_translation([60.0, 0.0, -15.0])
    plate.apply_translation([0.0, 0.0, 120.0])
    column = trimesh.creation.box((10.0, 10.0, 60.0))
    for name, shape in (("vise", vise), ("plate", plate), ("column", column)):
        (tmp_path / f"{name}.stl").write_bytes(write_stl(shape.triangles, name))
    return tmp_path


def with_fixture(name):
    return ("diameter_mm = 10", HELD), ("[feed]", FIXTURE.format(name))


def test_a_job_with_holder_and_vise_is_done_and_judged(make_job, meshes):
    out = meshes / "out"
    outcome = run(Job.load(make_job(*with_fixture("vise"))), out)
    assert outcome.passed, outcome.refusal or [c for c in outcome.verdict.certificates if not c.passed]
    found = {c.claim: c for c in outcome.verdict.certificates}
    expected = {f"{body} clear of the {thing}" for body in BODIES for thing in ("part", "fixture")}
    assert expected | {"legs clear of the tool body"} <= found.keys()
    assert all(found[name].unit == "mm" and found[name].value > found[name].bound for name in expected)

    # The same program, judged for jobs whose fixture or holder is another: from the file alone.
    for change, caught in (
        (with_fixture("plate"), {"spindle clear of the fixture"}),
        (with_fixture("column"), {"tool body clear of the fixture"}),
    ):
        verdict = judge(Job.load(make_job(*change, name="other.toml")), out / "program.csv")
        wrong = {c.claim for c in verdict.certificates if not c.passed}
        assert wrong >= caught, wrong


def test_a_fixture_in_the_way_is_refused_by_name(make_job, meshes):
    outcome = run(Job.load(make_job(*with_fixture("plate"))), meshes / "out", advice=None)
    assert outcome.refusal is not None
    blamed = [b for b in outcome.refusal.diagnosis if b.constraint == "spindle touches the fixture"]
    assert blamed
    assert blamed[0].unit == "mm"
    assert blamed[0].shortfall > 0.0


def test_what_stays_in_the_machine_is_called_table(make_job, meshes):
    text = FIXTURE.format("plate").replace('unit = "mm"', 'unit = "mm"\nframe = "machine"')
    job = Job.load(make_job(("[feed]", text)))
    made = job_collision_world(job, job_machine(job), job_mesh(job))
    assert [(o.name, o.clamped) for o in made.obstacles] == [("part", True), ("table", False)]
    assert [(s.kind, s.high) for s in made.tool] == [("shank", job_machine(job).bodies.shaft_end)]  # the assumed stem


def test_a_holder_above_the_joints_is_an_error(make_job):
    job = Job.load(make_job(("diameter_mm = 10", "diameter_mm = 10\nholder_mm = [[95, 40, 40]]")))
    with pytest.raises(JobError, match="lowest platform joint"):
        job_collision_world(job, job_machine(job), job_mesh(job))


def test_a_broken_fixture_mesh_is_an_error(make_job, tmp_path):
    (tmp_path / "vise.stl").write_text("no mesh")
    job = Job.load(make_job(*with_fixture("vise")))
    with pytest.raises(MeshError):
        job_collision_world(job, job_machine(job), job_mesh(job))
