"""The laws of the protocol `Robot`, for every family: poses and legs are inverse, slopes are slopes, one formula."""

from itertools import pairwise

import casadi as ca
import numpy as np
import pytest
from built_machines import with_errors

from pentapod import Machine
from pentapod.base.errors import MachineError
from pentapod.kinematics import AsBuiltPentapod, GeneralPentapod, Robot, RolledPlatform, SixLegPlatform
from pentapod.kinematics.arithmetic import NUMPY, Arithmetic

DESK = Machine.load("desk")
GENERAL = GeneralPentapod(DESK.robot.base_joints[:, :2], DESK.robot.offsets + 1e-3 * np.array([4, -3, 2, 5, -4]))
SIX_LEGS = SixLegPlatform(DESK.robot, np.array([-0.3, -0.5, 0.02]), np.array([0.08, -0.05, -0.02]))
ROBOTS: dict[str, Robot] = {
    "quadratic": DESK.robot,
    "general": GENERAL,
    "as built": AsBuiltPentapod.of(DESK.robot, base_errors=2e-4, radii=[0.006, 0.0, 0.004, 0.0, 0.0], zeros=5e-4),
    "as built, general": with_errors(GENERAL, 2e-4, 3),
    "six legs": RolledPlatform(SIX_LEGS),
    "six legs, general": RolledPlatform(SixLegPlatform(GENERAL, [0.1, 0.5, 0.0], [0.0, 0.09, 0.1]), -1),
}


@pytest.fixture(params=ROBOTS)
def robot(request: pytest.FixtureRequest) -> Robot:
    return ROBOTS[request.param]


def poses(count: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Poses in and about the work volume, the tool pointing up."""
    rng = np.random.default_rng(seed)
    i = np.array([0.0, 0.0, 1.0]) + rng.normal(scale=0.2, size=(count, 3))
    i /= np.linalg.norm(i, axis=1, keepdims=True)
    return DESK.work.centre + rng.normal(scale=0.03, size=(count, 3)) - DESK.tool_length * i, i


def test_pose_of_the_leg_lengths_in_the_branch_is_the_pose(robot: Robot) -> None:
    p, i = poses(60)
    legs, branch = robot.leg_lengths(p, i), robot.branch(p, i)
    assert {tuple(signs) for signs in branch.tolist()} <= set(robot.branches)
    found = robot.pose(legs, branch)
    np.testing.assert_allclose(found[0], p, atol=1e-12)
    np.testing.assert_allclose(found[1], i, atol=1e-12)


def test_jacobian_is_the_slope_of_the_leg_lengths(robot: Robot) -> None:
    p, i = poses(20)
    dp, di = np.random.default_rng(2).normal(size=(2, 20, 3))
    di -= np.einsum("nk,nk->n", di, i)[:, None] * i
    h = 1e-5
    ahead, behind = (robot.leg_lengths(p + s * dp, i + s * di) for s in (h, -h))
    rates = robot.jacobian(p, i) @ np.concatenate([dp, di], axis=1)[..., None]
    np.testing.assert_allclose(rates[..., 0], (ahead - behind) / (2.0 * h), rtol=1e-7, atol=1e-7)


def test_leg_derivatives_along_a_curve_are_those_of_the_leg_lengths(robot: Robot) -> None:
    length, s = DESK.tool_length, np.linspace(-0.5, 0.5, 41)
    turn, one = 0.4 * s, np.ones_like(s)
    tips = [
        DESK.work.centre + 0.03 * np.stack([np.sin(s), s**2, s**3], axis=1),
        0.03 * np.stack([np.cos(s), 2.0 * s, 3.0 * s**2], axis=1),
        0.03 * np.stack([-np.sin(s), 2.0 * one, 6.0 * s], axis=1),
        0.03 * np.stack([-np.cos(s), 0.0 * one, 6.0 * one], axis=1),
    ]
    axes = [
        -(0.4**k) * np.stack([np.sin(turn + 0.5 * k * np.pi), 0.0 * s, np.cos(turn + 0.5 * k * np.pi)], axis=1)
        for k in range(4)
    ]
    found = robot.leg_derivatives(list(zip(tips, axes, strict=True)), length)
    assert [x.shape for x in found] == [(41, robot.n_legs)] * 4
    np.testing.assert_allclose(found[0], robot.leg_lengths(tips[0] + length * axes[0], -axes[0]), atol=1e-14)
    for lower, higher in pairwise(found):
        for leg in range(robot.n_legs):
            slope = np.polynomial.Chebyshev.fit(s, lower[:, leg], 14).deriv()(s)
            np.testing.assert_allclose(higher[:, leg], slope, atol=1e-9)


def test_one_formula_gives_the_leg_vectors_for_numbers_and_symbols(robot: Robot) -> None:
    p, i = poses(5)
    by_numbers = robot.vectors_of(p.T, i.T, NUMPY)
    lengths = robot.lengths_of(by_numbers, NUMPY)
    do, x, y = Arithmetic.casadi(), ca.SX.sym("p", 3), ca.SX.sym("i", 3)
    symbols = robot.vectors_of(ca.vertsplit(x), ca.vertsplit(y), do)
    formula = ca.Function(
        "legs", [x, y], [ca.vertcat(*(ca.vertcat(*d) for d in symbols)), ca.vertcat(*robot.lengths_of(symbols, do))]
    )
    for k in range(5):
        expected = robot.leg_vectors(p[k], i[k])
        np.testing.assert_allclose([[c[k] for c in d] for d in by_numbers], expected, atol=1e-15)
        vectors, readings = formula(p[k], i[k])
        np.testing.assert_allclose(np.asarray(vectors).reshape(-1, 3), expected, atol=1e-15)
        np.testing.assert_allclose(np.asarray(readings).ravel(), robot.leg_lengths(p[k], i[k]), atol=1e-15)
        np.testing.assert_allclose([length[k] for length in lengths], robot.leg_lengths(p[k], i[k]), atol=1e-15)
    found = robot.base_joints + robot.leg_vectors(p, i) - p[:, None]
    np.testing.assert_allclose(found, joints(robot, p, i), atol=1e-15)


def joints(robot: Robot, p: np.ndarray, i: np.ndarray) -> np.ndarray:
    """The platform joints from p: on the line, or beside it by the ring's radius, towards the base joint."""
    found = robot.offsets[:, None] * i[:, None, :]
    if isinstance(robot, RolledPlatform):
        found[:, 5] = robot.rotation(p, i) @ robot.platform.sixth_joint
    if isinstance(robot, AsBuiltPentapod):
        across = robot.base - p[:, None] - np.einsum("nkc,nc->nk", robot.base - p[:, None], i)[..., None] * i[:, None]
        found = found + robot.radii[:, None] * across / np.linalg.norm(across, axis=-1, keepdims=True)
    return found


def test_singularity_margins_are_positive_in_the_branch_alone(robot: Robot) -> None:
    p, i = poses(300, seed=4)
    p[:, 2] += np.random.default_rng(5).normal(scale=0.3, size=300)
    flip = np.where(np.arange(300) % 2 == 0, 1.0, -1.0)
    p[:, 2] *= flip
    i[:, 2] *= flip
    signs = robot.branch(p, i)
    assert len(np.unique(signs, axis=0)) == len(robot.branches)
    for branch in robot.branches:
        margins = np.stack(robot.singularity_margins(p.T, i.T, branch, NUMPY), axis=1)
        assert margins.shape == (300, len(robot.singularities))
        np.testing.assert_array_equal((margins > 0.0).all(axis=1), (signs == branch).all(axis=1))
        assert (branch.w * i[(signs == branch).all(axis=1), 2] > 0.0).all()


def test_distance_margin_is_never_more_than_the_way_to_the_singular_surface(robot: Robot) -> None:
    p, i = poses(40, seed=6)
    signs = robot.branch(p, i)
    ways = np.random.default_rng(7).normal(size=(200, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    for position, direction, branch in zip(p, i, signs, strict=True):
        named = next(label for label in robot.branches if label == tuple(branch))
        margin = float(robot.singularity_margins(position, direction, named, NUMPY)[1])
        assert (robot.branch(position + 0.999 * margin * ways, direction) == branch).all()


def test_conditioning_and_numbers_tell_robots_apart() -> None:
    assert all(robot.conditioning > 0.01 for robot in ROBOTS.values())
    texts = {str(dict(robot.numbers)) for robot in ROBOTS.values()}
    assert len(texts) == len(ROBOTS)


def test_machine_as_built_without_a_nominal_one_has_no_branches() -> None:
    built = ROBOTS["as built"]
    alone = AsBuiltPentapod(built.base_joints, built.offsets, np.zeros(5), np.zeros(5))
    with pytest.raises(MachineError, match="only beside its nominal geometry"):
        alone.pose(np.ones(5), (1, 1))
