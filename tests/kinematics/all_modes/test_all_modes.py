"""All assembly modes by exhaustive search: those of Newton's method from random starts, and of the closed forms."""

import numpy as np
import pytest

from pentapod.base.errors import ArrayError
from pentapod.kinematics import (
    AsBuiltPentapod,
    GeneralPentapod,
    LinearPentapod,
    RingedPentapod,
    SearchOptions,
    all_poses,
)

BASE = np.array([(0.586, -0.120), (0.224, 0.554), (-0.326, 0.498), (-0.597, -0.039), (-0.055, -0.595)])
DESK = LinearPentapod.quadratic(BASE, 0.185)


def case(seed):
    """A machine with errors, rings on every second one, and the readings of a pose in its work volume."""
    rng = np.random.default_rng(seed)
    machine = AsBuiltPentapod.of(
        DESK,
        base_errors=rng.uniform(-2e-4, 2e-4, (5, 3)),
        offset_errors=rng.uniform(-2e-4, 2e-4, 5),
        zeros=rng.uniform(-5e-4, 5e-4, 5),
        radii=rng.uniform(0.0, 0.03, 5) if seed % 2 else 0.0,
    )
    i = np.append(rng.uniform(-0.4, 0.4, 2), 1.0)
    i /= np.linalg.norm(i)
    return machine, machine.leg_lengths(rng.uniform((0.0, -0.1, 0.22), (0.17, 0.07, 0.32)), i)


def equations(machine, x):
    """Lengths by decomposition along and across the line, and |i|² (N, 6), of x = (p, i) (N, 6)."""
    p, i = x[:, None, :3], x[:, None, 3:]
    unit = i / np.linalg.norm(i, axis=2, keepdims=True)
    along = ((machine.base - p) * unit).sum(axis=2)
    across = np.linalg.norm(machine.base - p - along[..., None] * unit, axis=2)
    lengths = np.sqrt((along - machine.offsets) ** 2 + (across - machine.radii) ** 2) + machine.zeros
    return np.column_stack([lengths, (x[:, 3:] ** 2).sum(axis=1)])


def newton_poses(machine, readings, starts, seed):
    """The distinct poses that Newton's method with differences finds from random starts."""
    rng = np.random.default_rng(seed)
    x = np.column_stack([rng.uniform(-1.0, 1.0, (starts, 3)), rng.normal(size=(starts, 3))])
    x[:, 3:] /= np.linalg.norm(x[:, 3:], axis=1)[:, None]
    wanted = np.append(readings, 1.0)
    with np.errstate(all="ignore"):
        for _ in range(40):
            f = equations(machine, x)
            slopes = np.stack([(equations(machine, x + 1e-7 * e) - f) / 1e-7 for e in np.eye(6)], axis=2)
            good = np.isfinite(slopes).all(axis=(1, 2)) & (np.abs(np.linalg.det(slopes)) > 1e-14)
            x, f, slopes = x[good], f[good], slopes[good]
            step = np.linalg.solve(slopes, (wanted - f)[..., None])[..., 0]
            x = x + step / np.maximum(1.0, np.abs(step).max(axis=1, keepdims=True) / 0.3)
        x = x[np.abs(equations(machine, x) - wanted).max(axis=1) < 1e-11]
    found = []
    for pose in x:
        if all(np.abs(pose - other).max() > 1e-6 for other in found):
            found.append(pose)
    return np.array(found)


def check_modes(seed, starts):
    """The poses found, which hold all proven branches; Newton from random starts finds the same."""
    machine, readings = case(seed)
    found = all_poses(machine, readings)
    assert found.complete, seed
    poses = np.column_stack([found.position, found.direction])
    assert 2 <= len(poses) <= 4
    branches = np.array(machine.branches, dtype=np.float64)
    proven = np.concatenate(machine.pose(np.broadcast_to(readings, (4, 5)), branches), axis=1)
    others = [proven[np.isfinite(proven[:, 0])]] + ([newton_poses(machine, readings, starts, seed)] if starts else [])
    for same in others:
        assert len(same) == len(poses), seed
        for pose in same:
            assert np.abs(poses - pose).max(axis=1).min() < 1e-8, seed
    return len(poses)


@pytest.mark.parametrize("seed", range(4))
def test_all_poses_are_those_of_newton(seed):
    check_modes(seed, 300)


@pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in range(1, 5))])
def test_with_base_joints_anywhere_in_space_the_search_and_newton_agree(seed):
    rng = np.random.default_rng(seed)
    machine = AsBuiltPentapod(
        rng.uniform(-1, 1, (5, 3)), rng.uniform(-0.5, 0.5, 5), rng.uniform(0, 0.05, 5) * (seed % 2), np.zeros(5)
    )
    i = rng.normal(size=3)
    readings = machine.leg_lengths(rng.uniform(-1, 1, 3), i / np.linalg.norm(i))
    found = all_poses(machine, readings)
    theirs = newton_poses(machine, readings, 1000, seed)
    poses = np.column_stack([found.position, found.direction])
    assert found.complete
    assert len(poses) == len(theirs)
    for pose in theirs:
        assert np.abs(poses - pose).max(axis=1).min() < 1e-8


GENERAL = GeneralPentapod(BASE, np.array([0.11, 0.03, -0.06, -0.12, 0.01]))


@pytest.mark.parametrize("robot", [pytest.param(DESK, marks=pytest.mark.slow), GENERAL], ids=repr)
def test_all_poses_are_those_of_the_closed_form(robot):
    rng = np.random.default_rng(3)
    for _ in range(10):
        i = np.append(rng.uniform(-0.4, 0.4, 2), 1.0)
        i /= np.linalg.norm(i)
        legs = robot.leg_lengths(rng.uniform((0.0, -0.1, 0.22), (0.17, 0.07, 0.32)), i)
        found = all_poses(robot, legs)
        closed = np.concatenate(
            robot.pose(np.broadcast_to(legs, (4, 5)), np.array(robot.branches, dtype=float)), axis=1
        )
        poses = np.column_stack([found.position, found.direction])
        assert found.complete
        assert len(poses) == len(closed[np.isfinite(closed[:, 0])])
        for pose in closed[np.isfinite(closed[:, 0])]:
            assert np.abs(poses - pose).max(axis=1).min() < 1e-9


def test_legs_that_reach_nothing_have_no_pose():
    found = all_poses(DESK, np.full(5, 0.1))
    assert found.complete
    assert len(found.position) == 0


def test_errors_of_the_legs_are_counted():
    machine, readings = case(2)
    assert all_poses(machine, readings, leg_error=1e-5).complete
    assert not all_poses(machine, readings, leg_error=0.2, options=SearchOptions(most_boxes=20_000)).complete


@pytest.mark.parametrize("legs", [np.full(4, 0.6), np.array([0.6, 0.6, np.nan, 0.6, 0.6]), np.full(5, -1.0)])
def test_what_is_no_set_of_legs_is_an_error(legs):
    with pytest.raises(ArrayError, match="legs"):
        all_poses(DESK, legs)


@pytest.mark.slow
def test_the_modes_of_a_thousand_machines_are_proven_complete_and_those_of_3000_newton_starts():
    assert {check_modes(seed, 0 if seed % 10 else 3000) for seed in range(1000)} <= {2, 3, 4}


@pytest.mark.slow
def test_large_rings_have_eight_modes_where_a_linear_pentapod_has_four():
    """LinuxCNC's sample of pentakins, base in a plane: a counterexample to four modes with rings."""
    base = 1e-3 * np.array([[-418, -500, 226], [418, -500, 226], [0, -500, 396], [418, -500, -424], [-418, -500, -424]])
    offsets = 1e-3 * np.array([111, 83.5, 57.5, -34.5, -60.5])
    sample = RingedPentapod(base, offsets, np.full(5, 0.0803), np.array([0.0, 0.0, -0.112]))
    i = np.array([0.05, 0.02, 1.0]) / np.linalg.norm([0.05, 0.02, 1.0])
    legs = sample.leg_lengths(sample.home + np.array([0.01, 0.02, 0.005]), i)
    found = all_poses(sample, legs)
    assert found.complete
    assert len(found.position) == 8
    np.testing.assert_allclose(sample.leg_lengths(found.position, found.direction), np.tile(legs, (8, 1)), atol=1e-11)
    mirrored = found.position * [1.0, -1.0, 1.0] - [0.0, 1.0, 0.0]  # in the plane of the base
    assert (np.linalg.norm(mirrored[:, None] - found.position, axis=2).min(axis=1) < 1e-9).all()
