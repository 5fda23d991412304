"""A job for a machine with guides: where they stand is in the program, judged, and told."""

from __future__ import annotations

import json
import re
from importlib import resources

import numpy as np
import pytest

from pentapod.base.errors import InputError, MachineError, ProgramError
from pentapod.base.refusal import Refusal
from pentapod.job import Job, judge, run, task
from pentapod.job.build.values import job_machine
from pentapod.machine.machine import Machine
from pentapod.planning import PlacedPath
from pentapod.program import read_csv
from pentapod.program.posts import PostInput
from pentapod.report import write_report
from pentapod.view import open_run
from pentapod.view.viewed import ViewedRun

DESK = (resources.files("pentapod.machine") / "library" / "desk.toml").read_text(encoding="utf-8")
GUIDES = "[guides]\nleast_mm = -40\ngreatest_mm = [40, 40, 40, 0, 40]\n\n[legs]"


@pytest.fixture(scope="module")
def machine_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("machine") / "sliding.toml"
    path.write_text(DESK.replace("[legs]", GUIDES, 1), encoding="utf-8")
    return path


@pytest.fixture
def job(make_job, machine_file):
    changes = ('name = "desk"', f'file = "{machine_file}"'), ("stepover_mm = 15", "stepover_mm = 25")
    return Job.load(make_job(*changes))


def verdict_of(job, program):
    return {certificate.claim: certificate.passed for certificate in judge(job, program).certificates}


def test_guides_from_the_plan_to_the_verdict(job, tmp_path):
    outcome = run(job, tmp_path, writers={"report.html": write_report})
    assert outcome.passed
    rail_positions = outcome.find(PlacedPath).placement.rail_positions
    assert any(rail_positions)
    program = read_csv(tmp_path / "program.csv")
    assert program.rail_positions == rail_positions
    assert program.provenance.machine_digest == outcome.machine.digest != job_machine(job).digest
    np.testing.assert_array_equal(outcome.machine.rail_positions, rail_positions)
    claims = json.loads((tmp_path / "verdict.json").read_text())["certificates"]
    room = next(c for c in claims if c["claim"] == "guides within their travel")
    least, greatest = job_machine(job).guides.travel.T
    assert room["value"] == pytest.approx(
        1e3 * float(np.minimum(rail_positions - least, greatest - rail_positions).min()), abs=1e-9
    )
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert f"<dt>guides 1 to 5</dt><dd>set to {1e3 * rail_positions[0]:.3f}".replace("-", "−") in page
    assert f"guides 1 to 5 at {1e3 * rail_positions[0]:.3f}" in outcome.stages[2].remark
    # Other programs that need the machine get it with its guides there.
    np.testing.assert_array_equal(PostInput(program, job_machine(job)).the_machine().rail_positions, rail_positions)

    opened = open_run(tmp_path)
    np.testing.assert_array_equal(opened.machine.rail_positions, rail_positions)
    shown = ViewedRun.of(opened)
    pose = opened.machine.robot.leg_lengths(
        shown.signals.tips[40] + opened.machine.tool_length * shown.signals.axes[40], -shown.signals.axes[40]
    )
    assert pose == pytest.approx(program.legs[40], abs=1e-9)
    assert shown.placed.placement.rail_positions == pytest.approx(rail_positions)

    changed = tmp_path / "changed.csv"
    for stand in ("[0.0, 0.0]", '["a", 0, 0, 0, 0]', "3"):
        changed.write_text(elsewhere(tmp_path, stand))
        with pytest.raises(ProgramError, match="5 numbers of mm"):
            read_csv(changed)
    changed.write_text(elsewhere(tmp_path))  # where they stand has to be said
    assert verdict_of(job, changed)["guides within their travel"] is False


def elsewhere(folder, stand=None):
    """The program's text with guides that stand elsewhere, or that are not told."""
    text = (folder / "program.csv").read_text()
    line = re.search(r"# guides_mm = \[.*\]\n", text)[0]
    return text.replace(line, f"# guides_mm = {stand}\n" if stand else "")


@pytest.mark.slow  # in the fast lane: guides of which the program does not tell where they stand
def test_guides_that_stand_elsewhere_fail(job, tmp_path):
    run(job, tmp_path)
    changed = tmp_path / "changed.csv"
    for stand, failing in (
        ("[0.0, 0.0, 0.0, 0.0, 0.0]", "machine"),  # another machine, whose legs do not lead along the path
        ("[0.0, 0.0, 40.001, 0.0, 0.0]", "guides within their travel"),
    ):
        changed.write_text(elsewhere(tmp_path, stand))
        claims = verdict_of(job, changed)
        assert claims[failing] is False
        assert claims["tip deviation"] is False


def test_where_guides_were_to_stand_is_kept_of_a_job_without_a_program(job, tmp_path, monkeypatch):
    """A time law that is refused leaves a placement, which is looked at with the guides where it wants them."""
    monkeypatch.setattr(task, "retime", lambda *_, **__: Refusal("timing", "no law"))
    outcome = run(job, tmp_path, advice=None)
    assert outcome.refusal.cause == "no law"
    assert not (tmp_path / "program.csv").exists()
    rail_positions = outcome.find(PlacedPath).placement.rail_positions
    assert any(rail_positions)
    with np.load(tmp_path / "plan.npz") as archive:
        np.testing.assert_allclose(archive["placed.guides_mm"], 1e3 * np.array(rail_positions), atol=1e-9)
    np.testing.assert_array_equal(open_run(tmp_path).machine.rail_positions, rail_positions)


def test_machine_files_with_guides(machine_file):
    machine = Machine.load(machine_file)
    np.testing.assert_allclose(machine.guides.travel[:, 0], -0.04)
    np.testing.assert_allclose(machine.guides.travel[:, 1], [0.04, 0.04, 0.04, 0.0, 0.04])
    moved = machine.at([0.01, 0.0, 0.0, 0.0, -0.02])
    np.testing.assert_allclose(moved.robot.base - machine.robot.base, [[0, 0.01], *[[0, 0]] * 3, [0, -0.02]])
    assert moved.digest != machine.digest
    assert moved.at(np.zeros(5)).digest == machine.digest
    assert Machine.load("desk").guides is None
    with pytest.raises(MachineError, match="no guides"):
        Machine.load("desk").at(np.zeros(5))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("least_mm = -40", "least_mm = 10", "base_mm is not within the travel"),
        ("least_mm = -40", "least_mm = -40\ndirection = [[0, 2], [0, 1], [0, 1], [0, 1], [0, 1]]", "unit directions"),
        ("least_mm = -40", "lowest_mm = -40", "unknown key"),
    ],
)
def test_wrong_guides_are_named(machine_file, tmp_path, old, new, words):
    path = tmp_path / "wrong.toml"
    path.write_text(machine_file.read_text().replace(old, new))
    with pytest.raises(InputError, match=words) as caught:
        Machine.load(path)
    assert caught.value.key.startswith("guides.")
    assert caught.value.line
