"""Poses of machines as built, found quickly: those of the slow proof, proven as often, and never in another branch."""

import numpy as np
import pytest

from pentapod.kinematics import AsBuiltPentapod, Component, GeneralPentapod, LinearPentapod, as_built_pose
from pentapod.kinematics.families.as_built_quick import quick_poses

BASE = np.array([(0.586, -0.120), (0.224, 0.554), (-0.326, 0.498), (-0.597, -0.039), (-0.055, -0.595)])
DESK = LinearPentapod.quadratic(BASE, 0.185)
GENERAL = GeneralPentapod(BASE, DESK.offsets + np.array([0.004, -0.006, 0.0, 0.005, -0.003]))


def built(nominal, seed, ring=0.03):
    """Joints off by 0.2 mm, zeros by 0.5 mm, rings."""
    rng = np.random.default_rng(seed)
    return AsBuiltPentapod.of(
        nominal,
        base_errors=rng.uniform(-2e-4, 2e-4, (5, 3)),
        offset_errors=rng.uniform(-2e-4, 2e-4, 5),
        zeros=rng.uniform(-5e-4, 5e-4, 5),
        radii=rng.uniform(0.0, ring, 5),
    )


def poses(n, seed, lean=0.5):
    rng = np.random.default_rng(seed)
    i = np.c_[rng.uniform(-lean, lean, (n, 2)), np.ones(n)]
    i /= np.linalg.norm(i, axis=1)[:, None]
    return rng.uniform((0.0, -0.1, 0.20), (0.17, 0.07, 0.33), (n, 3)), i


@pytest.mark.parametrize("nominal", [DESK, GENERAL], ids=["quadratic", "general"])
@pytest.mark.parametrize("ring", [0.0, 0.03])
def test_quick_poses_are_proven_wherever_they_are_made(nominal, ring):
    p, i = poses(400, 1)
    machine = built(nominal, 2, ring)
    found = quick_poses(machine, nominal, machine.leg_lengths(p, i), nominal.branch(p, i))
    assert found[2].all()
    np.testing.assert_allclose(found[0], p, atol=1e-14)
    np.testing.assert_allclose(found[1], i, atol=1e-14)


@pytest.mark.parametrize("nominal", [DESK, GENERAL], ids=["quadratic", "general"])
def test_quick_poses_are_those_of_the_continuation(nominal):
    """In all branches, also those that a pose was not made in."""
    p, i = poses(40, 3)
    machine = built(nominal, 4, 0.01)
    legs = machine.leg_lengths(p, i)
    signs = np.array(nominal.branches)
    quick = quick_poses(machine, nominal, legs[:, None], signs)
    slow = as_built_pose(machine, nominal, legs[:, None], signs)
    both = quick[2] & slow.proven
    assert both.mean() > 0.6
    assert np.abs(quick[0] - slow.position)[both].max() < 1e-12
    assert np.abs(quick[1] - slow.direction)[both].max() < 1e-12
    np.testing.assert_array_equal(
        nominal.branch(quick[0], quick[1])[quick[2]], np.broadcast_to(signs, (40, 4, 2))[quick[2]]
    )


def test_the_order_of_a_batch_changes_poses_by_rounding_only():
    p, i = poses(100, 5)
    machine = built(DESK, 6)
    legs = machine.leg_lengths(p, i)
    forwards, backwards = (quick_poses(machine, DESK, rows, Component(1, 1)) for rows in (legs, legs[::-1].copy()))
    assert np.abs(forwards[0] - backwards[0][::-1]).max() < 1e-14


def test_beside_a_singularity_nothing_is_proven():
    """Directions within the errors of w = 0. Some of the readings have another pose, which may be found."""
    p, i = poses(50, 7)
    i[:, 2] = 1e-9
    i /= np.linalg.norm(i, axis=1)[:, None]
    machine = built(DESK, 8)
    legs = machine.leg_lengths(p, i)
    position, direction, proven = quick_poses(machine, DESK, legs, Component(1, 1))
    assert not (proven & (np.abs(direction[:, 2]) < 1e-6)).any()
    assert np.abs(machine.leg_lengths(position, direction) - legs)[proven].max(initial=0.0) < 1e-14


def test_readings_without_a_pose_have_none():
    legs = np.full((3, 5), np.nan)
    legs[1:] = [[0.1, 3.0, 0.1, 3.0, 0.1], [0.6, 0.6, 0.6, 0.6, 9.0]]
    position, direction, proven = quick_poses(built(DESK, 9), DESK, legs, Component(1, 1))
    assert not proven.any()
    assert np.isnan(position).all()
    assert np.isnan(direction).all()


@pytest.mark.parametrize("seed", [11, 12, 13])
def test_rows_beside_a_singularity_share_no_proof_that_one_of_them_does_not_have(seed):
    """Turning up to w = 0, with errors so large that proofs end before: where those of single rows end."""
    i = np.c_[np.linspace(0.8, 1.0, 1000), np.zeros((1000, 2))]
    i[:, 2] = np.sqrt(1.0 - i[:, 0] ** 2)
    rng = np.random.default_rng(seed)
    machine = AsBuiltPentapod.of(DESK, base_errors=rng.uniform(-2e-3, 2e-3, (5, 3)), radii=rng.uniform(0.0, 0.01, 5))
    legs = machine.leg_lengths(np.tile([0.1, 0.0, 0.25], (1000, 1)), i)
    position, direction, proven = quick_poses(machine, DESK, legs, Component(1, 1))
    ways = [machine_between(machine, DESK, s) for s in np.linspace(0.0, 1.0, 21)]
    dets = [np.linalg.det(leg_jacobian(way, position[proven], direction[proven])) for way in ways]
    assert (np.sign(dets) == np.sign(dets[0])).all()
    end = np.flatnonzero(~proven)[0]
    assert 400 < end < 900
    assert all(quick_poses(machine, DESK, legs[row], Component(1, 1))[2] for row in range(end - 10, end))


def machine_between(machine, nominal, share):
    """The machine whose errors are this share of another's."""
    parts = ((nominal.base_joints, machine.base), (nominal.offsets, machine.offsets), (0.0, machine.radii))
    base, offsets, radii = (a + share * (b - a) for a, b in parts)
    return AsBuiltPentapod(base, offsets, radii, machine.zeros)


def leg_jacobian(machine, position, direction):
    """Rows of the legs, and one for the direction's length."""
    rows = np.zeros((len(position), 6, 6))
    rows[:, :5] = machine.jacobian(position, direction)
    rows[:, 5, 3:] = direction
    return rows
