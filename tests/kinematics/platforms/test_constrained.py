"""Platforms whose turn passive joints decide: the constraint holds, statics, proofs that no motion leaves."""

import numpy as np
import pytest
from scipy.interpolate import BPoly
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from pentapod.base.errors import MachineError
from pentapod.kinematics import leg_load_map
from pentapod.kinematics.arithmetic import NUMPY
from pentapod.kinematics.platforms.constrained import ConstrainedPlatform

AZIMUTH = np.radians([20.0, 110.0, 200.0, 290.0, -35.0])
BASE = 0.55 * np.stack([np.cos(AZIMUTH), np.sin(AZIMUTH)], axis=1)
AROUND = np.radians([50.0, 80.0, 230.0, 260.0])
JOINTS = np.column_stack([0.1 * np.cos(AROUND), 0.1 * np.sin(AROUND), [0.0, 0.05, 0.0, 0.05]])
ALL_BESIDE = 1e-3 * np.array([[-64, 77, 59], [-30, -95, 19], [81, -58, 48], [-97, -25, -61], [63, -78, -29]])
HOME, UP = np.array([0.0, 0.0, 0.35]), np.array([0.0, 0.0, 1.0])
ROBOTS = {
    "4-UPS+SPR": ConstrainedPlatform(BASE, np.vstack([JOINTS, [0.0, 0.0, -0.1]]), "revolute leg", HOME),
    "5-UPS+PRPU": ConstrainedPlatform(BASE, ALL_BESIDE, "universal joint", HOME, [0.6, 0.8]),
}
OFFSETS, TIMES = np.array([0.0, 0.2]), np.linspace(0.0, 1.0, 17)


@pytest.fixture(params=ROBOTS)
def robot(request: pytest.FixtureRequest) -> ConstrainedPlatform:
    return ROBOTS[request.param]


def poses(count: int, seed: int, spread: float = 0.05) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    i = rng.normal(scale=2.0 * spread, size=(count, 3)) + UP
    return HOME + rng.uniform(-spread, spread, (count, 3)), i / np.linalg.norm(i, axis=1, keepdims=True)


def test_passive_joints_hold_what_they_must(robot: ConstrainedPlatform) -> None:
    p, i = poses(40, 1)
    rotation = robot.rotation(p, i)
    np.testing.assert_allclose(np.linalg.det(rotation), 1.0, atol=1e-12)
    np.testing.assert_allclose(rotation[..., 2], i, atol=1e-12)
    y = rotation[..., 1]
    if robot.constraint == "revolute leg":
        held = robot.leg_vectors(p, i)[:, 4]
    else:
        held = np.broadcast_to([*robot.guide, 0.0], y.shape)
    np.testing.assert_allclose(np.einsum("nk,nk->n", y, held), 0.0, atol=1e-12)
    joints = p[:, None] + np.einsum("nij,kj->nki", rotation, robot.joints)
    np.testing.assert_allclose(robot.leg_lengths(p, i), np.linalg.norm(joints - robot.base_joints, axis=2), atol=1e-13)
    beside = joints - p[:, None] - robot.offsets[:, None] * i[:, None]
    np.testing.assert_allclose(np.linalg.norm(beside, axis=2), np.tile(robot.arms, (40, 1)), atol=1e-13)


def test_poses_are_those_of_an_optimiser_that_knows_rotations_alone(robot: ConstrainedPlatform) -> None:
    """Unknowns: position and rotation vector, six; equations: five legs and the passive joint."""
    p, i = poses(6, 2)
    legs = robot.leg_lengths(p, i)
    found = robot.pose(legs, robot.branch(p, i))
    anchor = robot.base_joints[4] if robot.constraint == "revolute leg" else np.array([*robot.guide, 0.0])

    def wrong(x: np.ndarray, lengths: np.ndarray, start: np.ndarray) -> np.ndarray:
        turned = Rotation.from_rotvec(x[3:]).as_matrix() @ start
        own = np.linalg.norm(x[:3] + robot.joints @ turned.T - robot.base_joints, axis=1)
        held = turned[:, 1] @ (x[:3] - anchor if robot.constraint == "revolute leg" else anchor)
        return np.append(own - lengths, held)

    for k in range(6):
        start = robot.rotation(HOME, UP)
        fit = least_squares(wrong, [*HOME, 0.0, 0.0, 0.0], args=(legs[k], start), xtol=1e-15, ftol=1e-15, gtol=1e-15)
        turned = Rotation.from_rotvec(fit.x[3:]).as_matrix() @ start
        np.testing.assert_allclose(found[0][k], fit.x[:3], atol=1e-9)
        np.testing.assert_allclose(found[1][k], turned[:, 2], atol=1e-9)


def test_singularity_is_where_the_wrenches_are_dependent(robot: ConstrainedPlatform) -> None:
    """Along a line of positions the margin is 0 where the least singular value of the legs' slopes is."""
    values = np.linspace(-0.34, 0.6, 4001)
    p = HOME + values[:, None] * np.array([0.35, 0.2, 1.0])
    i = np.broadcast_to(UP, p.shape)
    margin = robot.singularity_margins(list(p.T), list(i.T), robot.branches[0], NUMPY)[1]
    slopes = robot.jacobian(p, i)[..., [0, 1, 2, 3, 4]]  # at i = z changes of i are along x and y
    least = np.linalg.svd(slopes, compute_uv=False)[:, -1]
    crossed = np.flatnonzero(margin[1:] * margin[:-1] < 0.0)
    for k in crossed:
        assert least[k : k + 2].min() < 2e-3
    small = np.flatnonzero((least[1:-1] < least[2:]) & (least[1:-1] < least[:-2]) & (least[1:-1] < 1e-4)) + 1
    for k in small:
        assert np.abs(crossed - k).min() <= 2


def test_statics_are_virtual_work(robot: ConstrainedPlatform) -> None:
    p, i = poses(10, 3)
    loads = leg_load_map(robot, p, i, 0.2)[..., :3]
    h, rng = 1e-6, np.random.default_rng(4)
    dp, di = rng.normal(size=(2, 10, 3))
    di -= np.einsum("nk,nk->n", di, i)[:, None] * i
    work = np.einsum("nk,nk->n", dp + 0.2 * di, np.ones((10, 3)))
    ahead, behind = (robot.leg_lengths(p + s * dp, i + s * di) for s in (h, -h))
    by_legs = np.einsum("nk,nkc,nc->n", (ahead - behind) / (2.0 * h), loads, np.ones((10, 3)))
    np.testing.assert_allclose(by_legs, -work, rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize(("degree", "step"), [(1, 1e-5), (3, 1e-5), (1, 3e-4), (3, 3e-4)])
def test_no_moment_leaves_what_is_proven(robot: ConstrainedPlatform, degree: int, step: float) -> None:
    rng = np.random.default_rng(degree)
    p, i = poses(5, 5)
    p = p[:, None] + step * rng.uniform(-1, 1, (5, degree + 1, 3))
    i = i[:, None] + step * rng.uniform(-1, 1, (5, degree + 1, 3))
    legs = robot.leg_lengths(p, i / np.linalg.norm(i, axis=-1, keepdims=True)).swapaxes(1, 2)
    branch = robot.branch(HOME, UP)
    lengths = np.array([[BPoly(c[:, None], [0.0, 1.0])(TIMES) for c in interval] for interval in legs])
    at, along = robot.pose(np.moveaxis(lengths, -1, 0), branch)
    assert np.isfinite(at).all()
    start, end = (at[0], along[0]), (at[-1], along[-1])
    axes = np.tile([0.0, 0.6, 0.8], (5, 1))
    found = robot.prove_chords(legs, start, end, branch, offsets=OFFSETS, base_axes=axes)
    assert found.proven.all()
    points, share = at[:, :, None] + OFFSETS[:, None] * along[:, :, None], TIMES[:, None, None, None]
    off = np.linalg.norm(points - (1 - share) * points[0] - share * points[-1], axis=-1).max(axis=0)
    assert (off <= found.deviations).all()
    assert (np.linalg.norm(np.diff(points, axis=0), axis=-1).max(axis=0) * 16 <= found.speeds).all()
    vectors = robot.leg_vectors(at, along)
    unit = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    assert (np.einsum("tnkc,kc->tnk", unit, axes) >= found.base_cosines).all()
    cosines = np.einsum("tnkc,tnc->tnk", unit, along)
    assert (cosines >= found.platform_cosines[..., 0]).all()
    assert (cosines <= found.platform_cosines[..., 1]).all()
    moved = np.linalg.norm(robot.platform_joints(at, along) - robot.platform_joints(*start), axis=-1)
    assert (moved.max(axis=(0, 2)) <= found.beside).all()
    far, turn = robot.enclose(start, legs.swapaxes(1, 2), OFFSETS)
    assert np.isfinite(far).all() or step > 1e-4  # infinite where nothing is proven
    assert (np.linalg.norm(points - points[0], axis=-1).max(axis=0) <= far).all()
    assert (np.linalg.norm(along - along[0], axis=-1).max(axis=0) <= turn).all()
    assert (moved.max(axis=0) <= robot.enclose_joints(start, legs.swapaxes(1, 2))).all()
    for k in range(5):
        ends = (np.stack([start[0][k], end[0][k]]), np.stack([start[1][k], end[1][k]]))
        assert robot.prove(legs[k : k + 1], ends, branch, leg_error=1e-6).proven.all()


def test_a_motion_through_a_singularity_is_not_proven(robot: ConstrainedPlatform) -> None:
    values = np.linspace(-0.34, 0.6, 4001)
    p, i = HOME + values[:, None] * np.array([0.35, 0.2, 1.0]), np.broadcast_to(UP, (4001, 3))
    signs = robot.branch(p, i)[:, 0]
    crossed = np.flatnonzero(signs[1:] != signs[:-1])
    legs = robot.leg_lengths(p, i)
    coefficients = np.stack([legs[:-1], legs[1:]], axis=-1)
    proof = robot.prove(coefficients, (p, i), robot.branch(HOME, UP))
    assert not proof.proven[crossed].any()
    assert proof.proven.mean() > 0.5


def test_other_modes_have_the_same_legs(robot: ConstrainedPlatform) -> None:
    p, i = poses(1, 6)
    legs = robot.leg_lengths(p, i)[0]
    at, along = robot.all_poses(legs)
    assert len(at) >= 2
    np.testing.assert_allclose(robot.leg_lengths(at, along), np.tile(legs, (len(at), 1)), atol=1e-10)
    assert np.linalg.norm(at - p, axis=1).min() < 1e-9


def test_a_revolute_leg_beside_the_axis_is_refused() -> None:
    with pytest.raises(MachineError, match="beside the tool axis"):
        ConstrainedPlatform(BASE, np.vstack([JOINTS, [0.01, 0.0, -0.1]]), "revolute leg", HOME)
