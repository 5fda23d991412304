"""The six-leg platform as a robot: its roll is where the twist is largest, and no roll leaves what is proven."""

import numpy as np
import pytest
from scipy.interpolate import BPoly

from pentapod.base.errors import MachineError
from pentapod.kinematics import GeneralPentapod, LinearPentapod, RolledPlatform, SixLegPlatform
from pentapod.kinematics.arithmetic import NUMPY

UP, MIDDLE = np.array([0.0, 0.0, 1.0]), np.array([0.08, 0.01, 0.45])
BASE = np.array([[-0.552, -0.229], [-0.312, 0.510], [0.155, 0.577], [0.429, -0.417], [-0.078, -0.563]])
QUADRATIC = LinearPentapod.quadratic(BASE, 0.2125)
GENERAL = GeneralPentapod(BASE, QUADRATIC.offsets + 1e-3 * np.array([12.0, -9.0, 7.0, 15.0, -11.0]))
ROBOTS = {
    "quadratic": RolledPlatform(SixLegPlatform(QUADRATIC, [0.5, 0.1, 0.0], [0.06, 0.05, 0.03])),
    "general": RolledPlatform(SixLegPlatform(GENERAL, [-0.4, 0.2, 0.01], [-0.08, 0.02, -0.05]), -1),
}
OFFSETS, TIMES = np.array([-0.1, 0.19]), np.linspace(0.0, 1.0, 17)
BASE_AXES = np.tile([0.0, 0.6, 0.8], (6, 1))


@pytest.fixture(params=ROBOTS)
def robot(request: pytest.FixtureRequest) -> RolledPlatform:
    return ROBOTS[request.param]


def poses(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    i = rng.normal(scale=0.2, size=(count, 3)) + UP
    return rng.uniform(-0.1, 0.1, (count, 3)) + MIDDLE, i / np.linalg.norm(i, axis=1, keepdims=True)


def motions(robot: RolledPlatform, count: int, step: float) -> tuple[np.ndarray, tuple[int, ...]]:
    """Bernstein coefficients (count, 6, 4) of readings near poses of one branch, and the branch."""
    p, i = poses(count, 1)
    random = np.random.default_rng(2)
    p = p[:, None] + step * random.uniform(-1, 1, (count, 4, 3))
    i = i[:, None] + step * random.uniform(-1, 1, (count, 4, 3))
    i /= np.linalg.norm(i, axis=-1, keepdims=True)
    branch = robot.branch(p, i)
    assert (branch == branch[0, 0]).all()
    return robot.leg_lengths(p, i).swapaxes(1, 2), tuple(branch[0, 0].tolist())


def test_the_roll_is_where_the_twist_is_largest(robot: RolledPlatform) -> None:
    p, i = poses(30, 3)
    rotation, platform = robot.rotation(p, i), robot.platform
    np.testing.assert_allclose(np.einsum("nij,nik->njk", rotation, rotation), np.eye(3)[None].repeat(30, 0), atol=1e-12)
    twist = robot.side * platform.twist(p, rotation)
    for turn in np.linspace(0.1, 2.0 * np.pi - 0.1, 24):
        c, s = np.cos(turn), np.sin(turn)
        turned = rotation @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        assert (robot.side * platform.twist(p, turned) < twist).all()
    np.testing.assert_allclose(robot.leg_lengths(p, i), platform.leg_lengths(p, rotation), atol=1e-14)
    np.testing.assert_allclose(robot.leg_vectors(p, i), platform.leg_vectors(p, rotation), atol=1e-14)


def test_the_platforms_own_forward_kinematics_finds_the_same_pose(robot: RolledPlatform) -> None:
    p, i = poses(30, 4)
    rotation, platform = robot.rotation(p, i), robot.platform
    found = platform.pose(robot.leg_lengths(p, i), platform.label(p, rotation))
    np.testing.assert_allclose(found[0], p, atol=1e-12)
    np.testing.assert_allclose(found[1], rotation, atol=1e-9)


def test_readings_of_another_roll_have_no_pose(robot: RolledPlatform) -> None:
    p, i = poses(5, 5)
    legs, branch = robot.leg_lengths(p, i), robot.branch(p, i)
    legs[:, 5] += 0.02
    assert np.isnan(robot.pose(legs, branch)[0]).all()


@pytest.mark.parametrize("step", [1e-5, 1e-4, 1e-3])
def test_no_moment_of_the_sixth_leg_leaves_what_is_proven_of_chords(robot: RolledPlatform, step: float) -> None:
    """The roll follows from the sixth reading, by the platform's own forward kinematics, off the law where it must."""
    legs, branch = motions(robot, 4, step)
    lengths = np.array([[BPoly(c[:, None], [0.0, 1.0])(TIMES) for c in interval] for interval in legs])
    lengths = np.moveaxis(lengths, -1, 0)
    p, rotation = robot.platform.pose(lengths, (*branch, robot.side))
    i = rotation[..., 2]
    found = robot.prove_chords(legs, (p[0], i[0]), (p[-1], i[-1]), branch, offsets=OFFSETS, base_axes=BASE_AXES)
    assert found.proven.all()
    assert found.deviations.shape == found.speeds.shape == (4, 2)
    vectors = robot.platform.leg_vectors(p, rotation)
    vectors /= np.linalg.norm(vectors, axis=-1, keepdims=True)
    base, platform = (vectors * BASE_AXES).sum(axis=-1), np.einsum("thjk,thk->thj", vectors, i)
    assert (found.base_cosines <= base.min(axis=0)).all()
    assert (found.base_cosines >= base.min(axis=0) - 60.0 * step).all()
    assert (found.platform_cosines[..., 0] <= platform.min(axis=0)).all()
    assert (found.platform_cosines[..., 1] >= platform.max(axis=0)).all()
    assert (found.platform_cosines[..., 1] <= platform.max(axis=0) + 60.0 * step).all()


def test_motions_within_the_branch_are_proven_with_the_angle_of_the_roll(robot: RolledPlatform) -> None:
    legs, branch = motions(robot, 5, 1e-4)
    for motion in legs:
        ends = np.stack([motion[:, 0], motion[:, -1]])
        p, i = robot.pose(ends, branch)
        proof = robot.prove(motion[None], (p, i), branch, leg_error=2e-6)
        assert proof.holds
        assert proof.lower.shape == (1, len(robot.proven_measures))
        assert 0.9 < proof.lower[0, -1] <= 1.0


def test_a_sixth_leg_that_lets_the_roll_go_is_not_proven(robot: RolledPlatform) -> None:
    """The line stays where it is; the sixth leg becomes as short as its arm allows, where it holds no roll."""
    p, i = (x[:1] for x in poses(1, 6))
    branch, rest = tuple(robot.branch(p, i)[0].tolist()), robot.leg_lengths(p, i)[0]
    shortest, _ = robot.platform.sixth_leg_range(p, i)
    motion = np.repeat(rest[:, None], 3, axis=1)
    motion[5, 1] = 2.0 * shortest[0] - rest[5]
    ends = np.concatenate([p, p]), np.concatenate([i, i])
    proof = robot.prove(motion[None], ends, branch)
    assert not proof.proven.any()
    np.testing.assert_array_equal(proof.doubt, [[0.0, 1.0]])
    found = robot.prove_chords(motion[None], (p, i), (p, i), branch, offsets=OFFSETS, base_axes=BASE_AXES)
    assert not found.proven.any()
    assert found.base_cosines[0, 5] == -1.0


def test_a_line_through_the_sixth_base_joint_is_singular(robot: RolledPlatform) -> None:
    i = np.array([0.1, 0.2, 0.9])
    i /= np.linalg.norm(i)
    p = robot.platform.sixth_base + 0.4 * i
    margins = robot.singularity_margins(list(p), list(i), robot.branches[0], NUMPY)
    assert margins[-1] == pytest.approx(0.0, abs=1e-15)


def test_there_are_two_sides() -> None:
    with pytest.raises(MachineError, match="two sides"):
        RolledPlatform(ROBOTS["quadratic"].platform, 0)
