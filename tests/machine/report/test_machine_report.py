"""The report on a machine: against single poses computed one by one, and on machines that fail."""

import dataclasses

import numpy as np
import pytest

from pentapod.kinematics.component import Component
from pentapod.machine import Machine, WorkVolume, check, explain, sample_work_volume
from pentapod.machine.parts import Park


@pytest.fixture(scope="module")
def desk():
    return Machine.load("desk")


def test_distance_to_the_work_volume_is_across_or_along_it():
    volume = WorkVolume(np.array([0.1, -0.2, 0.5]), 0.2, 0.06, np.radians(30))
    assert volume.outside(np.array([[0.1, -0.2, 0.5], [0.19, -0.2, 0.529]])) == 0.0
    assert volume.outside(np.array([[0.1, -0.2, 0.5], [0.25, -0.2, 0.5]])) == pytest.approx(0.05)
    assert volume.outside(np.array([[0.1, -0.2, 0.2]])) == pytest.approx(0.27)


def test_sample_covers_the_boundary_and_stays_inside():
    volume = WorkVolume(np.array([0.1, -0.2, 0.5]), 0.2, 0.06, np.radians(30))
    tips, axes = sample_work_volume(volume, rings=2, around=8, levels=3)
    assert tips.shape == axes.shape == (3 * 17 * 17, 3)
    radius = np.linalg.norm(tips[:, :2] - volume.centre[:2], axis=1)
    lean = np.arctan2(np.linalg.norm(axes[:, :2], axis=1), -axes[:, 2])
    np.testing.assert_allclose(np.linalg.norm(axes, axis=1), 1.0, atol=1e-14)
    assert radius.max() == pytest.approx(0.1)
    assert lean.max() == pytest.approx(np.radians(30))
    assert np.ptp(tips[:, 2]) == pytest.approx(0.06)
    extreme = np.isclose(radius, 0.1) & np.isclose(lean, np.radians(30)) & np.isclose(tips[:, 2], 0.53)
    assert extreme.sum() == 64


def test_report_equals_poses_looked_at_one_by_one(desk):
    report = check(desk, rings=1, around=4, levels=2)
    tips, axes = sample_work_volume(desk.work, rings=1, around=4, levels=2)
    lengths, cones, seen = [], [], []
    for tip, axis in zip(tips, axes, strict=True):
        p = tip + desk.tool_length * axis
        for k in range(5):
            foot = np.append(desk.robot.base[k], 0.0)
            leg = p - desk.robot.offsets[k] * axis - foot
            length = np.sqrt(leg @ leg)
            lengths.append(length)
            cones.append(np.arccos(leg @ desk.joints.base_axes[k] / length))
            seen.append(np.arccos(-leg @ axis / length))
    lengths, cones, seen = (np.reshape(values, (-1, 5)) for values in (lengths, cones, seen))
    assert report.poses == len(tips)
    np.testing.assert_allclose(report.length_range, np.stack([lengths.min(0), lengths.max(0)], axis=1))
    np.testing.assert_allclose(report.base_angle, cones.max(0))
    np.testing.assert_allclose(report.platform_range, np.stack([seen.min(0), seen.max(0)], axis=1))


def test_denser_samples_find_no_better_worst(desk):
    coarse, dense = check(desk, rings=1, around=4, levels=2), check(desk, rings=2, around=8, levels=3)
    assert (dense.length_range[:, 0] <= coarse.length_range[:, 0]).all()
    assert dense.amplification >= coarse.amplification
    assert dense.clearance <= coarse.clearance


def test_desk_passes_and_is_explained(desk):
    report = check(desk)
    text = explain(report)
    assert report.passed
    assert report.branch == Component(1, 1)
    for words in ("machine desk", desk.digest, "keeps its own limits", report.clearance_pair, "stroke"):
        assert words in text


@pytest.mark.parametrize(
    ("change", "name"),
    [
        (lambda m: {"legs": dataclasses.replace(m.legs, min_length=m.legs.max_length - 0.1)}, "shortest"),
        (lambda m: {"legs": dataclasses.replace(m.legs, max_length=m.legs.min_length + 0.1)}, "longest"),
        (lambda m: {"joints": dataclasses.replace(m.joints, base_cone=np.radians(5))}, "base joint"),
        (
            lambda m: {"joints": dataclasses.replace(m.joints, platform_range=np.radians([60, 100]))},
            "platform joint, least",
        ),
        (
            lambda m: {"joints": dataclasses.replace(m.joints, platform_range=np.radians([10, 60]))},
            "platform joint, most",
        ),
        (lambda m: {"bodies": dataclasses.replace(m.bodies, leg_radius=0.03)}, "clearance, legs"),
        (lambda m: {"bodies": dataclasses.replace(m.bodies, shaft_radius=0.06)}, "-shaft"),
        (lambda m: {"tool_length": m.tool_length + 0.25}, "tip force"),
        (
            lambda m: {"work": dataclasses.replace(m.work, centre=np.array([0.0, 0.0, m.tool_length]))},
            "components met",
        ),
    ],
)
def test_a_machine_that_fails_is_told_why(desk, change, name):
    report = check(dataclasses.replace(desk, **change(desk)), rings=1, around=8, levels=3)
    assert not report.passed
    failed = [finding for finding in report.findings if not finding.passed]
    assert any(name in finding.name for finding in failed)
    assert all(finding.where.startswith("tip (") for finding in failed)
    text = explain(report)
    assert "does not keep its own limits" in text
    assert all(finding.name in text for finding in failed)


def test_rails_that_pass_an_architectural_singularity_are_told():
    guide = Machine.load("guide")
    assert "least F on the rails" in explain(check(guide, rings=1, around=4, levels=2))
    far = dataclasses.replace(guide.guides, travel=np.tile([-0.9, 0.9], (5, 1)))
    report = check(dataclasses.replace(guide, guides=far), rings=1, around=4, levels=2)
    assert [found.name for found in report.findings if not found.passed] == ["least F on the rails, by that at home"]


def test_limits_that_the_park_pose_exceeds_are_told(desk):
    """By hand: the legs at that pose, beside their strokes."""
    tip, axis = np.array([0.3, 0.0, 0.1]), np.array([0.0, 0.0, -1.0])
    report = check(dataclasses.replace(desk, park=Park(tip=tip)), rings=1, around=4, levels=2)
    legs = 1e3 * np.linalg.norm(
        tip + (desk.tool_length - desk.robot.offsets[:, None]) * axis - desk.robot.base_joints, axis=1
    )
    short = {f"park pose, leg {k + 1} shortest": legs[k] for k in np.flatnonzero(legs < 489.0)}
    failed = {found.name: found.value for found in report.findings if not found.passed}
    assert short
    assert {name: failed[name] for name in failed if "shortest" in name} == pytest.approx(short)
    assert any("base joint" in name for name in failed)
    good = check(dataclasses.replace(desk, park=Park(tip=desk.work.centre)), rings=1, around=4, levels=2)
    assert good.passed
    assert not any("park" in found.name for found in good.findings)
