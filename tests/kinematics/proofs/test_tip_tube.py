"""Tubes around leg programs: proven bounds against fifty-digit poses, dense sampling, and motions that have none."""

import mpmath as mp
import numpy as np
import pytest
from numpy.polynomial import chebyshev

from pentapod.base.errors import ArrayError
from pentapod.kinematics import LinearPentapod, prove_tip_tube
from pentapod.machine import Machine
from pentapod.numerics.bernstein import elevate, from_power

ABOUT = 0.2


def course(pentapod: LinearPentapod, n: int, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Tips and directions (n + 1, 3) of a smooth motion above the middle of the base, `step` of time apart."""
    t = step * np.arange(n + 1)
    size = np.abs(pentapod.base - pentapod.base[2]).max()
    middle = np.append(pentapod.base.mean(axis=0), 1.2 * size)
    tips = middle + 0.15 * size * np.c_[np.cos(3 * t), np.sin(2.3 * t), np.sin(4 * t)]
    directions = np.c_[0.2 * np.sin(2 * t), 0.2 * np.cos(3 * t), np.ones(n + 1)]
    return tips, directions / np.linalg.norm(directions, axis=1)[:, None]


def interval_legs(pentapod: LinearPentapod, n: int, step: float, k: int) -> np.ndarray:
    """Bernstein coefficients (n, 5, k + 1) of legs that interpolate the course at k + 1 places of each interval."""
    tips, directions = course(pentapod, n * k, step / k)
    legs = pentapod.leg_lengths(tips - ABOUT * directions, directions)
    each = np.stack([legs[j : j + n * k : k] for j in range(k)] + [legs[k::k]], axis=-1)
    powers = np.linalg.solve(np.vander(np.linspace(0.0, 1.0, k + 1), increasing=True), each[..., None])[..., 0]
    return from_power(powers)


def values(coefficients: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Values (N, d, len(u)) of polynomials (N, d, k + 1), through the power basis: no de Casteljau."""
    k = coefficients.shape[-1] - 1
    nodes = 0.5 - 0.5 * np.cos(np.pi * (np.arange(k + 1) + 0.5) / (k + 1))
    bernstein = np.array([[mp.binomial(k, j) * x**j * (1 - x) ** (k - j) for j in range(k + 1)] for x in nodes])
    at_nodes = coefficients @ bernstein.astype(float).T
    fit = chebyshev.chebfit(2 * nodes - 1, at_nodes.reshape(-1, k + 1).T, k)
    return chebyshev.chebval(2 * u - 1, fit).reshape(*coefficients.shape[:-1], len(u))


@pytest.mark.parametrize("k", [1, 3, 5])
def test_bounds_hold_at_all_samples_and_are_close(pentapod: LinearPentapod, k: int) -> None:
    n, u = 30, np.linspace(0.0, 1.0, 41)
    legs = interval_legs(pentapod, n, 0.02, k)
    tips, directions = course(pentapod, n, 0.02)
    component = pentapod.branch(tips[0] - ABOUT * directions[0], directions[0])
    path, axes = (np.stack([a[:-1], a[1:]], axis=-1) for a in (tips, directions))
    tube = prove_tip_tube(pentapod, legs, component)
    assert tube.proven.all()
    assert max(tube.position_error.max(), tube.direction_error.max()) < 1e-9
    p, i = pentapod.pose(np.moveaxis(values(legs, u), 1, -1), component)
    deviation = np.linalg.norm(p + ABOUT * i - np.moveaxis(values(path, u), 1, -1), axis=-1).max(axis=1)
    bound = tube.tip_deviation(path, ABOUT)
    assert (bound >= deviation - 1e-14).all()
    assert (bound <= 1.02 * deviation + 1e-12).all()
    wanted = np.moveaxis(values(3.0 * axes, u), 1, -1)
    sine = np.linalg.norm(np.cross(i, wanted), axis=-1) / np.linalg.norm(wanted, axis=-1)
    angle = tube.axis_deviation(3.0 * axes)
    assert (angle >= np.arcsin(sine).max(axis=1) - 1e-14).all()
    assert (angle <= 1.02 * np.arcsin(sine).max(axis=1) + 1e-12).all()
    shifted = path + np.array([5e-5, 0.0, 0.0])[:, None]
    assert (tube.tip_deviation(shifted, ABOUT) >= 4.9e-5 - deviation).all()
    np.testing.assert_allclose(tube.tip_deviation(elevate(path, 3), ABOUT), bound, rtol=0.02, atol=1e-14)


def test_the_true_pose_in_fifty_digits_is_inside(pentapod: LinearPentapod) -> None:
    legs = interval_legs(pentapod, 4, 0.05, 3)
    tips, directions = course(pentapod, 4, 0.05)
    component = pentapod.branch(tips[0] - ABOUT * directions[0], directions[0])
    tube = prove_tip_tube(pentapod, legs, component)
    with mp.workdps(50):
        attachments = [[mp.mpf(float(c)) for c in (*xy, 0.0)] for xy in pentapod.base]
        for piece, (owner, start, width) in enumerate(zip(tube.interval, tube.start, tube.width, strict=True)):
            for t in (mp.mpf(0), mp.mpf(1) / 3, mp.mpf(1)):
                time = mp.mpf(start) + t * mp.mpf(width)
                lengths = [mp_value(c, time) for c in legs[owner]]
                near = [mp_value(tube.position[:, c, piece], t) for c in range(3)]
                near += [mp_value(tube.direction[:, c, piece], t) for c in range(3)]

                def equations(*x, lengths=lengths):
                    joints = [[x[c] + mp.mpf(float(z)) * x[3 + c] for c in range(3)] for z in pentapod.offsets]
                    found = [
                        sum((b - a) ** 2 for b, a in zip(joint, attachment, strict=True)) - length**2
                        for joint, attachment, length in zip(joints, attachments, lengths, strict=True)
                    ]
                    return [*found, x[3] ** 2 + x[4] ** 2 + x[5] ** 2 - 1]

                true = mp.findroot(equations, near, tol=1e-80)
                errors = np.concatenate([tube.position_error[:, piece], tube.direction_error[:, piece]])
                assert all(abs(true[c] - near[c]) <= mp.mpf(errors[c]) for c in range(6))


def mp_value(coefficients: np.ndarray, t: mp.mpf) -> mp.mpf:
    c = [mp.mpf(float(x)) for x in coefficients]
    k = len(c) - 1
    return sum(mp.binomial(k, j) * t**j * (1 - t) ** (k - j) * x for j, x in enumerate(c))


def test_long_intervals_are_halved_until_they_are_proven(paper: LinearPentapod) -> None:
    legs = interval_legs(paper, 5, 1.0, 5)
    tips, directions = course(paper, 5, 1.0)
    component = paper.branch(tips[0] - ABOUT * directions[0], directions[0])
    tube = prove_tip_tube(paper, legs, component)
    assert tube.proven.all()
    assert len(tube.start) > 5
    np.testing.assert_allclose(np.bincount(tube.interval, tube.width), 1.0)
    assert not prove_tip_tube(paper, legs, component, depth=0).proven.all()
    path = np.stack([tips[:-1], tips[1:]], axis=-1)
    u = np.linspace(0.0, 1.0, 101)
    p, i = paper.pose(np.moveaxis(values(legs, u), 1, -1), component)
    deviation = np.linalg.norm(p + ABOUT * i - np.moveaxis(values(path, u), 1, -1), axis=-1).max(axis=1)
    bound = tube.tip_deviation(path, ABOUT)
    assert (bound >= deviation).all()
    assert (bound <= 1.05 * deviation).all()


def test_a_leg_error_covers_every_motion_within_it(paper: LinearPentapod) -> None:
    legs, error = interval_legs(paper, 6, 0.02, 1), 1e-4
    tips, directions = course(paper, 6, 0.02)
    component = paper.branch(tips[0] - ABOUT * directions[0], directions[0])
    path = np.stack([tips[:-1], tips[1:]], axis=-1)
    sharp, covered = (prove_tip_tube(paper, legs, component, leg_error=e) for e in (0.0, error))
    assert covered.proven.all()
    bound = covered.tip_deviation(path, ABOUT)
    rng, worst = np.random.default_rng(0), 0.0
    for _ in range(50):
        off = legs + error * rng.choice([-1.0, 1.0], (6, 5, 1))
        p, i = paper.pose(off[..., 0], component)
        deviation = np.linalg.norm(p + ABOUT * i - path[..., 0], axis=-1)
        assert (deviation <= bound).all()
        worst = max(worst, float((deviation / bound).max()))
    assert worst > 0.2
    assert (sharp.tip_deviation(path, ABOUT) < bound).all()


def test_what_meets_a_singularity_or_has_no_pose_is_not_proven(paper: LinearPentapod) -> None:
    i = np.array([0.36, 0.48, 0.8])
    # S = 0 at this direction is the plane 0.4 x + 0.82 z = 0: legs that go on as they do before it have no pose.
    above, on = np.array([0.5, 0.25, 0.6]), np.array([0.5, 0.25, -0.2 / 0.82])
    there = paper.leg_lengths(on, i)
    through = np.stack([paper.leg_lengths(above, i), 2.0 * there - paper.leg_lengths(above, i)], axis=-1)
    still = np.repeat(paper.leg_lengths(above, i)[:, None], 2, axis=1)
    nowhere = np.array([1.0, 1.0, 9.0, 1.0, 1.0])[:, None] * np.ones(2)
    tube = prove_tip_tube(paper, np.stack([through, still, nowhere]), paper.branch(above, i))
    np.testing.assert_array_equal(tube.proven, [False, True, False])
    path = np.broadcast_to((above + ABOUT * i)[:, None], (3, 3, 1))
    np.testing.assert_array_equal(np.isinf(tube.tip_deviation(path, ABOUT)), [True, False, True])
    assert tube.tip_deviation(path, ABOUT)[1] < 1e-12
    axes = np.broadcast_to(i[:, None], (3, 3, 1))
    np.testing.assert_allclose(tube.axis_deviation(axes), [np.pi, 0.0, np.pi], atol=1e-12)
    assert tube.axis_deviation(-axes)[1] == np.pi


def test_the_component_is_the_one_named(paper: LinearPentapod) -> None:
    legs = interval_legs(paper, 3, 0.02, 1)
    for component in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        tube = prove_tip_tube(paper, legs, component)
        assert tube.proven.all()
        p, i = np.moveaxis(tube.position[0], 0, -1), np.moveaxis(tube.direction[0], 0, -1)
        assert (paper.branch(p, i) == component).all()


def test_a_program_of_a_machine_at_its_period() -> None:
    machine = Machine.load("desk")
    t = 1e-3 * np.arange(500)
    tips = np.array(machine.work.centre) + np.c_[0.04 * np.cos(3 * t), 0.04 * np.sin(2 * t), 0.02 * np.sin(4 * t)]
    directions = np.c_[0.2 * np.sin(2 * t), 0.2 * np.cos(3 * t), np.ones(500)]
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    robot, position = machine.robot, tips - machine.tool_length * directions
    legs = robot.leg_lengths(position, directions)
    tube = prove_tip_tube(robot, np.stack([legs[:-1], legs[1:]], axis=-1), robot.branch(position[0], directions[0]))
    bound = tube.tip_deviation(np.stack([tips[:-1], tips[1:]], axis=-1), machine.tool_length)
    assert 0.0 < bound.max() < 1e-7


def test_wrong_arguments(paper: LinearPentapod) -> None:
    legs = interval_legs(paper, 2, 0.02, 1)
    tube = prove_tip_tube(paper, legs, (1, 1))
    with pytest.raises(ArrayError, match="leg_coefficients"):
        prove_tip_tube(paper, legs[:, :4], (1, 1))
    with pytest.raises(ArrayError, match="not finite"):
        prove_tip_tube(paper, np.where(legs > 0, np.nan, legs), (1, 1))
    with pytest.raises(ArrayError, match="component"):
        prove_tip_tube(paper, legs, (1, 0))
    with pytest.raises(ArrayError, match="negative"):
        prove_tip_tube(paper, legs, (1, 1), leg_error=-1.0)
    for bad in (np.zeros((3, 3, 2)), np.zeros((2, 2, 2)), np.zeros((2, 3, 0))):
        with pytest.raises(ArrayError, match="path"):
            tube.tip_deviation(bad, ABOUT)
    assert prove_tip_tube(paper, legs[:0], (1, 1)).proven.shape == (0,)
