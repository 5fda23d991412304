"""What the shipped machine `desk` is advertised for, sampled densely."""

from itertools import pairwise

import numpy as np
import pytest

from pentapod.kinematics.component import Component
from pentapod.machine import Machine, check, clearances, sample_work_volume


@pytest.fixture(scope="module")
def desk():
    return Machine.load("desk")


@pytest.fixture(scope="module")
def volume(desk):
    return sample_work_volume(desk.work, rings=3, around=20, levels=5)


def leg_forces(machine, tips, axes):
    """Norms of the leg forces under unit tip forces along x, y, z and the worst direction: by least squares.

    Balance of forces, and of moments about the origin: 6 equations, 5 legs.
    """
    result = []
    for tip, axis in zip(tips, axes, strict=True):
        joints = tip + (machine.tool_length - machine.robot.offsets)[:, None] * axis
        e = joints - np.column_stack([machine.robot.base, np.zeros(5)])
        e /= np.linalg.norm(e, axis=1, keepdims=True)
        wrench = np.concatenate([e, np.cross(joints, e)], axis=1).T
        load = np.concatenate([np.eye(3), np.cross(np.tile(tip, (3, 1)), np.eye(3)).T])
        forces, _, rank, _ = np.linalg.lstsq(wrench, load, rcond=None)
        assert rank == 5
        np.testing.assert_allclose(wrench @ forces, load, atol=1e-9)
        result.append(np.linalg.norm(forces, 2))
    return np.array(result)


def test_is_a_plausible_machine(desk):
    legs, robot = desk.legs, desk.robot
    assert legs.max_length.max() <= 1.9 * legs.min_length.min()
    assert np.ptp(legs.min_length) == np.ptp(legs.max_length) == 0.0  # identical legs
    assert np.linalg.norm(robot.base, axis=1).max() <= 0.6
    assert np.degrees(desk.joints.base_cone.max()) <= 60
    assert (desk.joints.base_axes[:, 2] > 0).all()
    assert desk.bodies.leg_radius >= 0.008
    assert desk.bodies.shaft_radius >= 0.010
    assert min(b - a for a, b in pairwise(sorted(robot.offsets))) >= 0.045
    assert desk.tool_length - robot.offsets.max() >= 0.085
    assert (legs.max_velocity <= 0.6).all()
    assert (legs.max_acceleration <= 10).all()
    assert (legs.max_jerk <= 500).all()
    np.testing.assert_array_equal(np.round(1e3 * robot.base, 9), np.round(1e3 * robot.base))


def test_is_advertised_for_enough(desk):
    assert desk.work.diameter >= 0.150
    assert desk.work.height >= 0.060
    assert desk.work.tilt >= np.radians(27)


def test_keeps_its_limits_everywhere_in_its_work_volume(desk):
    report = check(desk, rings=3, around=20, levels=5)
    assert report.passed, [finding for finding in report.findings if not finding.passed]
    assert report.branch == Component(1, 1)
    assert report.margins[0] >= np.arcsin(0.85)
    assert report.margins[1] >= 0.2
    assert report.least_turn >= np.radians(45)
    assert report.clearance >= 0.0025
    assert report.amplification <= 5.5
    assert desk.architecture >= 0.02
    assert report.length_range[:, 0].min() >= desk.legs.min_length.max() + 0.004
    assert report.length_range[:, 1].max() <= desk.legs.max_length.min() - 0.004


def test_amplification_by_least_squares(desk, volume):
    tips, axes = volume
    chosen = np.random.default_rng(7).choice(len(tips), 400, replace=False)
    worst = leg_forces(desk, tips[chosen], axes[chosen]).max()
    assert worst <= 6.0
    assert worst <= check(desk, rings=3, around=20, levels=5).amplification * (1 + 1e-9)


def test_random_poses_in_the_volume_are_no_worse_than_the_sampled_ones(desk):
    rng = np.random.default_rng(11)
    n = 40_000
    radius, turn = 0.5 * desk.work.diameter * np.sqrt(rng.random(n)), rng.uniform(0, 2 * np.pi, n)
    up = (rng.random(n) - 0.5) * desk.work.height
    tips = desk.work.centre + np.stack([radius * np.cos(turn), radius * np.sin(turn), up], axis=1)
    lean, azimuth = desk.work.tilt * np.sqrt(rng.random(n)), rng.uniform(0, 2 * np.pi, n)
    axes = np.stack([np.sin(lean) * np.cos(azimuth), np.sin(lean) * np.sin(azimuth), -np.cos(lean)], axis=1)
    p = tips + desk.tool_length * axes
    lengths = desk.robot.leg_lengths(p, -axes)
    assert lengths.min() >= desk.legs.min_length[0]
    assert lengths.max() <= desk.legs.max_length[0]
    assert clearances(desk, p, -axes).min() >= 0.002
    assert (desk.robot.branch(p, -axes) == [1, 1]).all()


@pytest.mark.parametrize("degrees", [0.0, 15.0, 75.0])
def test_reaches_a_dome_of_150_mm_with_40_degree_slopes(desk, degrees):
    """A square dome, 40 degrees steep at its corners; tool within 15 degrees of the normal; retract 25 mm.

    Placed flat on the table near the middle of the work volume. Its corners lie outside of that, so it must
    be turned suitably about the vertical: the square's sides along x and y, or up to 25 degrees from there.
    """
    side, tilt, retract = 0.150, np.radians(15.0), 0.025
    sphere = side / np.sqrt(2) / np.sin(np.radians(40.0))
    x, y = (a.ravel() for a in np.meshgrid(*2 * [np.linspace(-side / 2, side / 2, 31)]))
    turn = np.radians(degrees)
    x, y = x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn)
    radius = np.hypot(x, y)
    slope = np.arcsin(radius / sphere)
    lean = np.maximum(slope - tilt, 0.0)
    out = np.stack([x, y], axis=1) / np.maximum(radius, 1e-12)[:, None]
    axes = np.column_stack([np.sin(lean)[:, None] * out, -np.cos(lean)])
    tips = np.column_stack([x, y, sphere * (1 - np.cos(slope))])  # +z is down: the crown is highest
    tips, axes = np.concatenate([tips, tips - np.array([0, 0, retract])]), np.tile(axes, (2, 1))

    def fits(shift):
        at = tips + desk.work.centre + shift
        p = at + desk.tool_length * axes
        vectors = desk.robot.leg_vectors(p, -axes)
        lengths = np.linalg.norm(vectors, axis=-1)
        e = vectors / lengths[..., None]
        base = np.arccos(np.einsum("nki,ki->nk", e, desk.joints.base_axes))
        seen = np.arccos(np.einsum("nki,ni->nk", -e, axes))
        low, high = desk.joints.platform_range.T
        return (
            (lengths > desk.legs.min_length + 0.003).all()
            and (lengths < desk.legs.max_length - 0.003).all()
            and (base < desk.joints.base_cone).all()
            and ((seen > low) & (seen < high)).all()
            and clearances(desk, p, -axes).min() > 0.002
            and leg_forces(desk, at[::29], axes[::29]).max() <= 6.0
        )

    shifts = [np.array([dx, dy, dz]) for dx in (-0.02, 0) for dy in (0,) for dz in (0.02, 0)]
    assert any(fits(shift) for shift in shifts)
