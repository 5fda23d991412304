"""Keys of the motion: between them the page is as exact as it says, for robots of all families."""

from __future__ import annotations

from importlib import resources

import numpy as np
import pytest

from page_arrays import page_arrays, page_data
from pentapod.job import Job, run
from pentapod.machine import Machine
from pentapod.machine.leg_ends import leg_ends, strut_ends
from pentapod.planning import PlacedPath
from pentapod.program import Program
from pentapod.report import write_report
from pentapod.report.page.keys import joints_beside, straight_rows
from pentapod.report.page.scene import machine_data

EXACT_MM = 0.02


def shown(scene, tips, axes, joints):
    """The joints (N, n_legs, 3) as the page's script puts them, mm."""
    heights = np.array(scene["machine"]["heights"])
    found = tips[:, None] + heights[:, None] * axes[:, None]
    found[:, scene["machine"]["beside"]] = joints.reshape(len(tips), -1, 3)
    return found


def test_keys_are_within_a_fiftieth_of_a_millimetre_of_the_program(make_job, tmp_path):
    outcome = run(Job.load(make_job(("tilt_deg = 0", "tilt_deg = 15"))), tmp_path / "out")
    text = write_report(outcome, tmp_path / "report.html").read_text(encoding="utf-8")
    arrays, program, machine = page_arrays(text), outcome.find(Program), outcome.machine
    assert program is not None
    position, direction = machine.robot.pose(program.legs, program.component)
    tips = 1e3 * (position + machine.tool_length * direction)
    times = arrays["key.time"][:, 0]
    assert len(times) < 0.2 * len(program.legs)
    assert times[[0, -1]] == pytest.approx(program.times[[0, -1]])
    between = {
        name: np.column_stack([np.interp(program.times, times, column) for column in arrays[name].T])
        for name in ("key.tip", "key.axis")
    }
    assert np.linalg.norm(between["key.tip"] - tips, axis=1).max() < EXACT_MM
    turned = between["key.axis"] / np.linalg.norm(between["key.axis"], axis=1, keepdims=True)
    joints = shown(page_data(text)["scene"], between["key.tip"], turned, np.zeros((len(tips), 0)))
    lengths = np.linalg.norm(joints - 1e3 * machine.robot.base_joints, axis=-1)
    assert np.abs(lengths - 1e3 * program.legs).max() < 2.0 * EXACT_MM


def test_keys_tell_the_worst_until_the_next(usual_run, tmp_path):
    outcome = usual_run[2]
    text = write_report(outcome, tmp_path / "report.html").read_text(encoding="utf-8")
    data, arrays, placed = page_data(text), page_arrays(text), outcome.find(PlacedPath)
    assert placed is not None
    least = arrays["key.margin"][:, 0]
    assert least.min() <= placed.smallest_margin + 1e-4
    key = int(least.argmin())
    nearest = data["motion"]["margins"][int(arrays["key.nearest"][key, 0])]
    assert f"smallest margin: {nearest}" in text
    assert data["motion"]["start"] == pytest.approx(arrays["key.time"][key, 0], abs=0.5)
    deviation = next(c.value for c in outcome.verdict.certificates if c.claim == "tip deviation")
    assert arrays["key.deviation"].max() <= deviation + 1e-4
    assert arrays["key.deviation"].max() > 0.3 * deviation
    seconds = {kind["name"]: kind["seconds"] for kind in data["motion"]["kinds"]}
    assert sum(seconds.values()) == pytest.approx(outcome.find(Program).duration, abs=2e-3)


@pytest.mark.parametrize("name", ["desk", "steep", "guide", "bench-general", "hexa", "spr", "prpu"])
def test_the_page_puts_the_joints_of_every_family_where_they_are(name):
    """The script knows the tool axis alone: joints beside it come as arrays, those on it by their heights."""
    machine, random = Machine.load(name), np.random.default_rng(5)
    tips = machine.work.centre + 0.02 * random.standard_normal((20, 3))
    axes = np.array([0.0, 0.0, -1.0]) + 0.1 * random.standard_normal((20, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    beside = joints_beside(machine, tips[0], axes[0])
    data = machine_data(machine, (), beside)
    ends = leg_ends(machine, tips, axes)[1]
    assert len(data["legs"]) == machine.robot.n_legs
    assert set(beside.tolist()) == set(np.flatnonzero(np.asarray(machine.robot.arms) > 0.0).tolist())
    found = shown({"machine": data}, 1e3 * tips, axes, 1e3 * ends[:, beside])
    assert np.abs(found - 1e3 * ends).max() < 1e-3
    assert (data["limb"] is None) == (machine.limb is None)
    if data["limb"] is not None:
        rail, height = np.array(data["limb"]["rail"]), data["limb"]["height"]
        along = (rail[1] - rail[0]) / np.linalg.norm(rail[1] - rail[0])
        joint = 1e3 * tips[0] + height * axes[0]
        foot = rail[0] + along * ((joint - rail[0]) @ along)
        assert np.stack([foot, joint]) == pytest.approx(1e3 * strut_ends(machine, tips[0], axes[0])[0], abs=1e-6)


def test_rows_that_are_kept_hold_the_others():
    times = np.linspace(0.0, 1.0, 2001)
    points = np.column_stack([np.sin(9.0 * times), np.cos(5.0 * times), times, *np.zeros((3, len(times)))])
    must = np.zeros(len(times), dtype=bool)
    must[777] = True
    kept = straight_rows(times, points, must, 1e-3)
    assert {0, 777, 2000} <= set(kept.tolist())
    assert len(kept) < 0.1 * len(times)
    between = np.column_stack([np.interp(times, times[kept], column[kept]) for column in points.T])
    assert np.linalg.norm(between - points, axis=1).max() < 1.0001e-3


@pytest.mark.parametrize("compensation", ["gravity", pytest.param("none", marks=pytest.mark.slow)])
def test_keys_tell_forces_and_deflection_as_the_verdict_does(make_job, tmp_path, compensation):
    text = (resources.files("pentapod.machine") / "library" / "desk.toml").read_text(encoding="utf-8")
    text = text.replace("min_length_mm", "stiffness_n_um = 20\nmin_length_mm", 1) + "\n[drives]\npeak_force_n = 300\n"
    (tmp_path / "soft.toml").write_text(text, encoding="utf-8")
    job = Job.load(make_job(('name = "desk"', 'file = "soft.toml"'))).with_(**{"output.compensation": compensation})
    outcome = run(job, tmp_path / "out")
    assert outcome.passed
    page = write_report(outcome, tmp_path / "report.html").read_text(encoding="utf-8")
    arrays, claims = page_arrays(page), {claim.claim: claim for claim in outcome.verdict.certificates}
    force = claims["leg forces"]
    assert 0.01 * arrays["key.push"].max() == pytest.approx(force.value / force.bound, abs=1e-3)
    assert arrays["key.deflection"].max() == pytest.approx(1e3 * claims["deflection"].value, rel=1e-3)
    scales = {scale["name"]: scale for scale in page_data(page)["motion"]["scales"]}
    assert scales["deflection of the tip"]["worst"] == pytest.approx(arrays["key.deflection"].max(), rel=1e-3)
    assert "deflection of the tip" in page
