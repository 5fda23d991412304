"""Margins: zero exactly at the limits, the same in NumPy and casadi, and true to geometry that shares no formula."""

import dataclasses

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import minimize

from pentapod.kinematics.component import COMPONENTS, Component
from pentapod.kinematics.mode import Mode
from pentapod.machine import Machine
from pentapod.planning.limits.limit import Comforts
from pentapod.planning.limits.margins import Margins

PLUS = Component(1, 1)


def poses(machine, count, spread=0.05, seed=0):
    """Tips near the middle of the work volume, axes within 25 degrees of −z."""
    rng = np.random.default_rng(seed)
    tips = machine.work.centre + rng.uniform(-spread, spread, (count, 3))
    lean = rng.uniform(-0.3, 0.3, (count, 2))
    axes = np.c_[lean, -np.ones(count)]
    return tips, axes / np.linalg.norm(axes, axis=1, keepdims=True)


@pytest.mark.parametrize("component", COMPONENTS, ids=str)
def test_numpy_and_casadi_agree(desk, component):
    margins = Margins.of(desk, component)
    tip, axis = ca.SX.sym("tip", 3), ca.SX.sym("axis", 3)
    function = ca.Function("f", [tip, axis], [margins.symbolic(tip, axis)])
    tips, axes = poses(desk, 200, spread=0.3)
    expected = np.array([np.asarray(function(t, a)).ravel() for t, a in zip(tips, axes, strict=True)])
    np.testing.assert_allclose(margins(tips, axes), expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("name", ["bench-general", "spr"])
def test_margins_know_a_branch_by_the_signs_of_a_file(name):
    """A file has two signs alone; of robots with an order the second one says where the tool points."""
    machine = Machine.load(name)
    tips, axes = poses(machine, 50)
    (branch,) = np.unique(machine.robot.branch(tips + machine.tool_length * axes, -axes), axis=0).tolist()
    values = Margins.of(machine, Component(*branch))(tips, axes)
    np.testing.assert_array_equal(values, Margins.of(machine, Mode(*branch))(tips, axes))
    assert branch[0] == -1 or name == "bench-general"
    assert (values > 0.0).all()


@pytest.mark.parametrize("shape", [(300,), (60, 5)])
def test_the_smallest_margin_is_that_of_all_limits(desk, shape):
    """Without legs that touch it is that of the others, bit for bit."""
    margins = Margins.of(desk, PLUS)
    tips, axes = (each.reshape(*shape, 3) for each in poses(desk, 300, spread=0.3, seed=2))
    values = margins.own(tips, axes)
    pairs = np.array(["touch" in limit.name and limit.name.startswith("legs") for limit in margins.own_limits])
    assert pairs.sum() == 10
    np.testing.assert_array_equal(margins.least_own(tips, axes), values.min(axis=-1))
    np.testing.assert_array_equal(margins.least_own(tips, axes, pairs=False), values[..., ~pairs].min(axis=-1))
    assert (values.argmin(axis=-1) >= pairs.argmax()).any(), "some are nearest to a leg"


def test_signs_are_those_of_the_limits_themselves(desk):
    """Each row's sign against the limit evaluated from joint positions, with angles by arc cosine."""
    tips, axes = poses(desk, 2000, spread=0.3, seed=1)
    values = Margins.of(desk, PLUS)(tips, axes)
    p = tips + desk.tool_length * axes
    joints = p[:, None, :] - desk.robot.offsets[:, None] * axes[:, None, :]
    legs = joints - np.c_[desk.robot.base, np.zeros(5)]
    length = np.linalg.norm(legs, axis=2)
    np.testing.assert_array_equal(values[:, 0:5] > 0, length > desk.legs.min_length)
    np.testing.assert_array_equal(values[:, 5:10] > 0, length < desk.legs.max_length)
    signs = desk.robot.branch(p, -axes)
    np.testing.assert_array_equal(values[:, 10] > 0, signs[:, 0] > 0)
    np.testing.assert_array_equal(values[:, 11] > 0, signs[:, 1] > 0)
    base = np.arccos(np.einsum("nij,ij->ni", legs, desk.joints.base_axes) / length)
    np.testing.assert_array_equal(values[:, 12:17] > 0, base < desk.joints.base_cone)
    platform = np.arccos(np.einsum("nij,nj->ni", -legs, axes) / length)
    np.testing.assert_array_equal(values[:, 17:27:2] > 0, platform < desk.joints.platform_range[:, 1])
    np.testing.assert_array_equal(values[:, 18:27:2] > 0, platform > desk.joints.platform_range[:, 0])


def test_what_cannot_be_exceeded_is_no_limit(desk):
    """A platform joint that may close or open wholly: a leg along the tool axis does not come near a limit."""
    free = dataclasses.replace(desk, joints=dataclasses.replace(desk.joints, platform_range=np.array([0.0, np.pi])))
    foot, tip = np.array([*desk.robot.base[2], 0.0]), desk.work.centre
    for way in (tip - foot, foot - tip):
        along = np.repeat(way[None] / np.linalg.norm(way), 50, axis=0) + np.random.default_rng(4).normal(
            0.0, 0.05, (50, 3)
        )
        axes = along / np.linalg.norm(along, axis=1, keepdims=True)
        margins = Margins.of(free, PLUS)
        values, limits = margins(np.tile(tip, (50, 1)), axes), margins.limits
        angles = [k for k, limit in enumerate(limits) if limit.name.startswith("platform joint 3")]
        assert len(angles) == 2
        assert values[:, angles].min() >= 1.0
        assert all(limits[k].shortfall(1.5) >= 0.0 for k in angles)


def test_gaps_between_legs_match_a_numerical_search(desk):
    tips, axes = poses(desk, 12, seed=2)
    values = Margins.of(desk, PLUS)(tips, axes)[:, 27:]
    a = np.c_[desk.robot.base, np.zeros(5)]
    b = (tips + desk.tool_length * axes)[:, None] - desk.robot.offsets[:, None] * axes[:, None]
    pairs = [(j, k) for j in range(5) for k in range(j + 1, 5)]
    for n in range(len(tips)):
        for column, (j, k) in enumerate(pairs):

            def between(x, n=n, j=j, k=k):
                return np.sum(np.square(a[j] + x[0] * (b[n, j] - a[j]) - a[k] - x[1] * (b[n, k] - a[k])))

            least = min(
                minimize(between, start, bounds=[(0, 1), (0, 1)], options={"ftol": 1e-16}).fun
                for start in ((0.1, 0.1), (0.9, 0.9), (0.5, 0.5))
            )
            gap = values[n, column] * Comforts().legs + 2 * desk.bodies.leg_radius
            assert abs(gap) == pytest.approx(np.sqrt(least), abs=2e-6)


def test_a_leg_that_has_passed_through_another_has_a_negative_gap(desk):
    """Turning the tool half way round carries legs through each other; no sample in between may look safe again."""
    angle = np.linspace(0.0, 2.0, 4000)  # tilt far beyond the machine's own range
    axes = np.c_[np.sin(angle), np.zeros_like(angle), -np.cos(angle)]
    tips = np.broadcast_to(desk.work.centre, axes.shape)
    margins = Margins.of(desk, PLUS)(tips, axes)[:, 27:]
    crossed = (margins < -0.32 - 1e-9).any(axis=1)  # −0.32: axes of 16 mm legs in contact
    assert crossed.any()
    assert not crossed[0]


def test_shortfalls_are_in_the_units_of_the_limit(desk):
    margins = Margins.of(desk, PLUS)
    by_name = {limit.name: k for k, limit in enumerate(margins.limits)}
    axis = np.array([0.0, 0.0, -1.0])
    tip = desk.work.centre + np.array([0.0, 0.0, 0.4])  # too deep: the legs are too short for it
    values = margins(tip, axis)
    length = desk.robot.leg_lengths(tip + desk.tool_length * axis, -axis)
    k = int(np.argmax(length - desk.legs.max_length))
    row = by_name[f"leg {k + 1} too long"]
    excess_mm = (length[k] - desk.legs.max_length[k]) * 1e3
    assert margins.limits[row].unit == "mm"
    assert margins.limits[row].shortfall(values[row]) == pytest.approx(excess_mm, rel=1e-9)
    tilted = np.array([np.sin(1.4), 0.0, -np.cos(1.4)])
    values = margins(desk.work.centre, tilted)
    legs = desk.robot.leg_vectors(desk.work.centre + desk.tool_length * tilted, -tilted)
    for leg in range(5):
        row = by_name[f"base joint {leg + 1} beyond its cone"]
        if values[row] < 0:
            cosine = legs[leg] @ desk.joints.base_axes[leg] / np.linalg.norm(legs[leg])
            beyond = np.degrees(np.arccos(cosine) - desk.joints.base_cone[leg])
            assert margins.limits[row].unit == "deg"
            assert margins.limits[row].shortfall(values[row]) == pytest.approx(beyond, rel=1e-9)
