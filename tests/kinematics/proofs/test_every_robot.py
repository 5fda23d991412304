"""The proofs that a robot is asked for, of each family: no moment leaves what is proven, and it is close."""

import numpy as np
import pytest
from scipy.interpolate import BPoly

from pentapod.kinematics import AsBuiltPentapod, GeneralPentapod, LinearPentapod, RingedPentapod, Robot

BASE = np.array([[-0.552, -0.229], [-0.312, 0.510], [0.155, 0.577], [0.429, -0.417], [-0.078, -0.563]])
QUADRATIC = LinearPentapod.quadratic(BASE, 0.2125)
GENERAL = GeneralPentapod(BASE, QUADRATIC.offsets + 1e-3 * np.array([12.0, -9.0, 7.0, 15.0, -11.0]))
ERRORS = 2e-4 * np.random.default_rng(0).choice([-1.0, 1.0], size=(5, 3))
ROBOTS: dict[str, Robot] = {
    "quadratic": QUADRATIC,
    "general": GENERAL,
    "as built": AsBuiltPentapod.of(
        QUADRATIC, base_errors=ERRORS, radii=[0.02, 0.0, 0.01, 0.015, 0.0], zeros=[5e-4, -5e-4, 0.0, 5e-4, 5e-4]
    ),
    "as built, general": AsBuiltPentapod.of(GENERAL, base_errors=ERRORS, radii=0.004, zeros=5e-4),
    "pentakins": RingedPentapod(
        np.column_stack([BASE, [0.1, -0.05, 0.0, 0.05, 0.1]]), QUADRATIC.offsets, np.full(5, 0.03), [0.08, 0.01, 0.45]
    ),
}
OFFSETS = np.array([-0.1, 0.0, 0.19])
BASE_AXES = np.tile([0.0, 0.6, 0.8], (5, 1))
TIMES = np.linspace(0.0, 1.0, 17)


@pytest.fixture(params=ROBOTS)
def robot(request: pytest.FixtureRequest) -> Robot:
    return ROBOTS[request.param]


def motions(robot: Robot, count: int, degree: int, step: float):
    """Bernstein coefficients (count, 5, degree + 1) of readings near poses of one branch, and the branch."""
    random = np.random.default_rng(degree)
    x = np.array([0.08, 0.01, 0.45, 0.1, -0.15]) + 0.1 * random.uniform(-1, 1, (count, 1, 5))
    x = x + step * random.uniform(-1, 1, (count, degree + 1, 5))
    i = np.stack([x[..., 3], x[..., 4], np.sqrt(1.0 - x[..., 3] ** 2 - x[..., 4] ** 2)], axis=-1)
    branches = robot.branch(x[..., :3], i)
    assert (branches == branches[0, 0]).all()
    return robot.leg_lengths(x[..., :3], i).swapaxes(1, 2), tuple(branches[0, 0].tolist())


def along(robot: Robot, legs: np.ndarray, branch: tuple[int, ...]):
    """Poses (T, H, 3) at the times, legs by scipy."""
    lengths = np.array([[BPoly(c[:, None], [0.0, 1.0])(TIMES) for c in interval] for interval in legs])
    position, direction = robot.pose(np.moveaxis(lengths, -1, 0), branch)
    assert np.isfinite(position).all()
    return position, direction


@pytest.mark.parametrize(("degree", "step"), [(1, 1e-5), (3, 1e-5), (1, 1e-3), (3, 1e-3), (3, 1e-2)])
def test_no_moment_leaves_what_is_proven_of_chords(robot: Robot, degree: int, step: float) -> None:
    legs, branch = motions(robot, 4, degree, step)
    p, i = along(robot, legs, branch)
    found = robot.prove_chords(legs, (p[0], i[0]), (p[-1], i[-1]), branch, offsets=OFFSETS, base_axes=BASE_AXES)
    assert found.proven.all()
    points = p[:, :, None] + OFFSETS[:, None] * i[:, :, None]
    share = TIMES[:, None, None]
    off = np.linalg.norm(points - (1 - share[..., None]) * points[0] - share[..., None] * points[-1], axis=-1).max(0)
    assert (off <= found.deviations).all()
    assert (found.deviations <= 3.2 * off + 1e-11 + 2.0 * step**2).all()
    speeds = (np.linalg.norm(np.diff(points, axis=0), axis=-1) * 16.0).max(axis=0)
    assert (speeds <= found.speeds).all()
    assert (found.speeds <= 1.6 * speeds + 1e-9).all()
    chord = (1 - share) * i[0] + share * i[-1]
    turned = np.arctan2(np.linalg.norm(np.cross(i, chord), axis=-1), (i * chord).sum(axis=-1)).max(axis=0)
    assert (turned <= found.angles).all()
    vectors = robot.leg_vectors(p, i)
    vectors /= np.linalg.norm(vectors, axis=-1, keepdims=True)
    base, platform = (vectors * BASE_AXES).sum(axis=-1), np.einsum("thjk,thk->thj", vectors, i)
    assert (found.base_cosines <= base.min(axis=0)).all()
    assert (found.base_cosines >= base.min(axis=0) - 8.0 * step - 1e-10).all()
    assert (found.platform_cosines[..., 0] <= platform.min(axis=0)).all()
    assert (found.platform_cosines[..., 1] >= platform.max(axis=0)).all()
    assert (found.platform_cosines[..., 1] <= platform.max(axis=0) + 8.0 * step + 1e-10).all()


@pytest.mark.parametrize("step", [1e-6, 1e-4, 1e-3])
def test_no_lengths_in_the_hull_lead_further_than_the_enclosure(robot: Robot, step: float) -> None:
    legs, branch = motions(robot, 6, 3, step)
    p, i = robot.pose(legs[..., 0], branch)
    points, turn = robot.enclose((p, i), legs.swapaxes(1, 2), OFFSETS)
    assert np.isfinite(turn).all()
    reached, random = np.zeros(points.shape), np.random.default_rng(2)
    for k in range(12):
        shares = np.eye(4)[k] if k < 4 else random.dirichlet(np.full(4, 0.3))
        q, j = robot.pose(legs @ shares, branch)
        reached = np.fmax(reached, np.linalg.norm((q - p)[:, None] + OFFSETS[:, None] * (j - i)[:, None], axis=2))
        assert (np.linalg.norm(j - i, axis=1) <= turn * (1.0 + 1e-9) + 1e-12).all()
    assert (reached <= points * (1.0 + 1e-9) + 1e-12).all()
    assert np.median(points / reached) < 2.0


def test_motions_within_the_branch_are_proven(robot: Robot) -> None:
    legs, branch = motions(robot, 6, 3, 3e-3)
    joined = np.stack([legs[:1, :, 0], legs[:1, :, 1], legs[:1, :, 2], legs[:1, :, 3]], axis=-1)
    p, i = along(robot, joined, branch)
    proof = robot.prove(joined, (p[[0, -1], 0], i[[0, -1], 0]), branch, leg_error=2e-5)
    assert proof.holds
    assert proof.lower.shape == (1, len(robot.proven_measures))
    assert (proof.lower > 0.0).all()
    assert np.isnan(proof.doubt).all()


def test_motion_that_turns_back_at_a_singularity_is_not_proven(robot: Robot) -> None:
    """From a pose and back to it, by way of leg lengths that have no pose."""
    legs, branch = motions(robot, 1, 1, 0.0)
    here = legs[0, :, 0]
    beyond = here * np.array([1.0, 1.0, 0.55, 1.0, 1.0])
    assert np.isnan(robot.pose(beyond, branch)[0]).any()
    motion = np.stack([here, 2.0 * beyond - here, here], axis=-1)[None]
    p, i = robot.pose(np.stack([here, here]), branch)
    assert not robot.prove(motion, (p, i), branch).proven.any()
    found = robot.prove_chords(motion, (p[:1], i[:1]), (p[1:], i[1:]), branch, offsets=OFFSETS, base_axes=BASE_AXES)
    assert not found.proven.any()
