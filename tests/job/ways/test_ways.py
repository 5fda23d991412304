"""Ways from the park pose to a program and back: made with the plan, judged from their files, refused by name."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from parked_jobs import DESK, parked_job
from pentapod.base.errors import MachineError
from pentapod.cli.main import run as run_command
from pentapod.geometry import RigidTransform
from pentapod.job import judge, run
from pentapod.job.build.specification import job_specification
from pentapod.job.build.values import job_machine, job_mesh
from pentapod.job.ways.claims import with_ways
from pentapod.job.ways.ways import park_row
from pentapod.kinematics.component import Component
from pentapod.machine import Machine
from pentapod.machine.machine import read_machine
from pentapod.program import quantised, read_csv, write_csv
from pentapod.toolpath.formats import read_toolpath
from pentapod.verify import Replay

slow = pytest.mark.slow


def specification_of(job, out):
    machine, mesh = job_machine(job), job_mesh(job)
    return job_specification(job, machine, mesh, lambda: read_toolpath(out / "plan.npz", "npz"))


def certificates(verdict):
    return {each.claim: each for each in verdict.certificates}


def test_a_park_pose_changes_neither_digest_nor_program(parked):
    job, out = parked
    assert job_machine(job).digest == job_machine(job, Machine.load("desk")).digest
    program = read_csv(out / "program.csv")
    assert program.provenance.machine_digest == Machine.load("desk").digest


def test_ways_join_the_park_pose_and_the_program_to_the_bit(parked):
    job, out = parked
    program, there, back = (read_csv(out / name) for name in ("program.csv", "way_in.csv", "way_out.csv"))
    stands = quantised(park_row(job_machine(job)))
    assert np.abs(there.legs[0] - stands).max() <= 1e-11
    assert np.abs(back.legs[-1] - stands).max() <= 1e-11
    assert there.legs[-1].tobytes() == program.legs[0].tobytes()
    assert back.legs[0].tobytes() == program.legs[-1].tobytes()


def test_the_verdict_of_a_run_names_the_ways(parked):
    content = json.loads((parked[1] / "verdict.json").read_text())
    claims = {each["claim"]: each for each in content["certificates"]}
    assert claims["way in"]["passed"]
    assert claims["way out"]["passed"]
    assert content["sha256"]["way_in"] != content["sha256"]["way_out"]
    assert set(json.loads((parked[1] / "manifest.json").read_text())["files"]) >= {"way_in.csv", "way_out.csv"}


def through_the_part(way, job):
    """Straight into the part and on, in the same number of rows, from rest to rest."""
    machine = job_machine(job)
    position, direction = machine.robot.pose(way.legs[[0, -1]], way.component)
    u = np.linspace(0.0, 1.0, 4001)[:, None]
    s = u**4 * (35 - 84 * u + 70 * u**2 - 20 * u**3)
    line = position[0] + s * (position[1] - position[0]) + 0.06 * (16.0 * (s * (1.0 - s)) ** 2) * [0.0, 0.0, 1.0]
    axis = direction[0] + s * (direction[1] - direction[0])
    legs = quantised(machine.robot.leg_lengths(line, axis / np.linalg.norm(axis, axis=1, keepdims=True)))
    legs[0], legs[-1] = way.legs[0], way.legs[-1]
    return replace(way, legs=legs)


def test_forged_ways_are_caught(copied):
    job, out = copied
    program, way = read_csv(out / "program.csv"), read_csv(out / "way_in.csv")
    back = read_csv(out / "way_out.csv")
    turned = RigidTransform(way.placement.rotation, way.placement.translation + 1e-6)
    quick = np.r_[0, 1 : len(way.legs) - 1 : 4, len(way.legs) - 1]
    forged = {
        "begins away from the park pose": replace(way, legs=quantised(way.legs + 1e-6)),
        "ends away from the program's first row": replace(way, legs=np.vstack([way.legs[:-1], program.legs[5]])),
        "begins away": back,
        "the component is not that of the program": replace(way, component=Component.parse("+-")),
        "the placement is not that of the program": replace(way, placement=turned),
        "the job is not that": replace(way, provenance=replace(way.provenance, job_digest="0" * 16)),
        "fails: gouge on rapids": through_the_part(way, job),
        "fails: leg rates, leg accelerations": replace(way, legs=way.legs[quick]),
    }
    specification = specification_of(job, out)
    for words, each in forged.items():
        write_csv(each, out / "way_in.csv")
        own, claims = with_ways(specification, out)
        found = claims[0](Replay(program, own))
        assert not found.passed, words
        assert words in found.method, (words, found.method)
    verdict = judge(job, out / "program.csv")
    assert not verdict.passed
    assert [c.claim for c in verdict.certificates if not c.passed] == ["way in"]


@pytest.mark.slow
def test_ways_that_are_missing_are_not_judged(copied):
    job, out = copied
    (out / "way_out.csv").unlink()
    verdict = judge(job, out / "program.csv")
    assert not verdict.passed
    assert certificates(verdict)["way in"].passed
    assert [(each.claim, "way_out.csv" in each.why) for each in verdict.not_judged] == [("way out", True)]


@pytest.mark.parametrize(
    ("tip", "cause"),
    [
        pytest.param(
            "[85, -17, 1400]",
            "the park pose is not within the limits of the machine in the program's component ++: leg",
            marks=slow,
        ),
        ("[85, -17, 480]", "the park pose is not within the limits"),  # in the dome, which hangs down to z 467
    ],
)
def test_park_poses_that_cannot_be_are_refused(tmp_path, tip, cause):
    job = parked_job(tmp_path, f"\n[park]\ntip_mm = {tip}\n")
    refusal = run(job, tmp_path / "out").refusal
    assert refusal is not None
    assert refusal.stage == "way in"
    assert cause in str(refusal)
    assert "park.tip_mm" in refusal.remedy
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"plan.npz", "verdict.json", "manifest.json"}


@pytest.mark.parametrize(("top_mm", "passes"), [pytest.param(402.0, True, marks=slow), (398.0, False)])
def test_the_cutter_keeps_clear_of_the_fixture_on_a_way(tmp_path, top_mm, passes):
    """A ball of 10 mm parked at z 400, over a block or with its lowest 2 mm in it; the shank begins 5 mm higher."""
    job = parked_job(tmp_path, "\n[park]\ntip_mm = [0, -17, 400]\n")
    block = trimesh.creation.box((20.0, 20.0, 10.0), trimesh.transformations.translation_matrix((0, -17, top_mm + 5)))
    block.export(tmp_path / "block.stl")
    fixture = {"mesh": "block.stl", "unit": "mm", "frame": "machine"}
    outcome = run(job.with_(fixture=fixture), tmp_path / "out", advice=None)
    assert outcome.passed == passes, outcome.refusal
    if not passes:
        assert outcome.refusal.stage == "way in"
        assert "the park pose is not within the limits" in str(outcome.refusal)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ("[park]\ntip = [85, -17, 430]", "park.tip"),
        ("[park]\ntip_mm = [85, -17]", "park.tip_mm"),
        ("[park]\naxis = [0, 0, -1]", "park.tip_mm: a park pose needs its tip"),
        ("[park]\ntip_mm = [85, -17, 430]\naxis = [0, 0, -2]", "park.axis"),
    ],
)
def test_wrong_keys_of_a_park_pose_are_one_error(table, words):
    with pytest.raises(MachineError) as caught:
        read_machine(f"{DESK}\n{table}\n", "own.toml")
    assert words.split(":")[0] in str(caught.value)
    assert words.rsplit(": ", 1)[-1] in str(caught.value)
    assert "own.toml" in str(caught.value)


def test_machines_without_a_park_pose_have_no_ways(tmp_path):
    machine = read_machine(DESK, "desk.toml")
    assert machine.park.pose is None


def test_the_set_up_sheet_names_the_park_pose(parked, tmp_path):
    _, out = parked
    assert run_command(["sheet", str(out), "-o", str(tmp_path / "sheet.html"), "--quiet"]) == 0
    text = (tmp_path / "sheet.html").read_text(encoding="utf-8")
    row = text[text.index(">park<") :][:300]
    assert "430" in row
    assert "614.401" in row
