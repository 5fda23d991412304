"""Accuracy of the forward kinematics against fifty-digit arithmetic, from far away to a nanometre from a singularity.

The oracle is a pose in fifty digits, its legs as distances between its joints, and the condition number by inverting
the 6×6 Jacobian of these distances (with |i| = 1): nothing of the closed form.
"""

import mpmath as mp
import numpy as np
import pytest

from pentapod.kinematics import LinearPentapod, architectural_measure
from pentapod.machine import Machine, sample_work_volume
from pentapod.numerics.kernels import kernels_used

DISTANCES = [10.0**-k for k in range(10)]
DIGITS = 50


@pytest.fixture
def desk() -> Machine:
    return Machine.load("desk")


def exact_pose(pentapod: LinearPentapod, surface: str, distance: float, rng) -> tuple[list, list]:
    """A pose in mpmath at a distance from w = 0 (radians: metres at a lever of 1 m) or from S = 0 (metres)."""
    size = np.abs(pentapod.base - pentapod.base[2]).max()
    p = [mp.mpf(x) for x in np.append(pentapod.base[2], 0.0) + rng.uniform(-1.5, 1.5, 3) * size]
    i = [mp.mpf(x) for x in rng.normal(size=3)]
    side = int(rng.choice([-1, 1]))
    if surface == "w":
        flat = mp.sqrt(i[0] ** 2 + i[1] ** 2)
        across = mp.cos(distance) / flat
        return p, [i[0] * across, i[1] * across, side * mp.sin(distance)]
    length = mp.sqrt(sum(x * x for x in i))
    i = [x / length for x in i]
    delta, third = mp.mpf(pentapod.delta), [mp.mpf(float(c)) for c in (pentapod.offsets[2], pentapod.base[2, 0])]
    # The singular plane for this direction: through leg 3's attachment for the point that leg 3 holds.
    normal = [delta * i[2], 0, 1 - delta * i[0]]
    value = normal[0] * p[0] + normal[2] * p[2] + (third[0] - delta * third[1]) * i[2]
    steep = mp.sqrt(normal[0] ** 2 + normal[2] ** 2)
    step = (side * mp.mpf(distance) - value / steep) / steep
    return [c + step * n for c, n in zip(p, normal, strict=True)], i


def exact_legs(pentapod: LinearPentapod, p: list, i: list) -> tuple[list, mp.matrix]:
    """Leg lengths, and the bound (6,) of the pose's change when each leg changes by 2⁻⁵² of its length."""
    lengths, jacobian = [], mp.matrix(6, 6)
    for leg, (xy, offset) in enumerate(zip(pentapod.base, pentapod.offsets, strict=True)):
        attachment, z = [mp.mpf(float(c)) for c in (*xy, 0.0)], mp.mpf(float(offset))
        d = [p[c] + z * i[c] - attachment[c] for c in range(3)]
        lengths.append(mp.sqrt(sum(x * x for x in d)))
        for c in range(3):
            jacobian[leg, c], jacobian[leg, 3 + c] = d[c] / lengths[-1], z * d[c] / lengths[-1]
    for c in range(3):
        jacobian[5, 3 + c] = i[c]
    inverse = jacobian**-1
    bounds = [sum(abs(inverse[r, leg]) * lengths[leg] for leg in range(5)) * mp.mpf(2) ** -52 for r in range(6)]
    return lengths, bounds


def norm(vector: list) -> mp.mpf:
    return mp.sqrt(sum(x * x for x in vector))


def check(pentapod: LinearPentapod, surface: str, distance: float, count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    for _ in range(count):
        p, i = exact_pose(pentapod, surface, distance, rng)
        lengths, bounds = exact_legs(pentapod, p, i)
        delta, z3, x3 = (mp.mpf(float(c)) for c in (pentapod.delta, pentapod.offsets[2], pentapod.base[2, 0]))
        s = delta * i[2] * p[0] + (1 - delta * i[0]) * p[2] + (z3 - delta * x3) * i[2]
        component = (int(mp.sign(i[2])), int(mp.sign(s)))
        position, direction = pentapod.pose([float(x) for x in lengths], component)
        assert tuple(pentapod.branch(position, direction)) == component
        error = norm([mp.mpf(a) - b for a, b in zip(position.tolist(), p, strict=True)])
        turned = norm([mp.mpf(a) - b for a, b in zip(direction.tolist(), i, strict=True)])
        assert error <= 10 * norm(bounds[:3])
        assert turned <= 10 * norm(bounds[3:])


@pytest.mark.parametrize("surface", ["w", "S"])
def test_error_within_ten_times_the_condition_number(pentapod: LinearPentapod, surface: str) -> None:
    with mp.workdps(DIGITS):
        for k, distance in enumerate(DISTANCES):
            check(pentapod, surface, distance, 5, k)


@pytest.mark.slow
@pytest.mark.parametrize("surface", ["w", "S"])
def test_error_within_ten_times_the_condition_number_on_many_poses(
    pentapod: LinearPentapod, desk: Machine, surface: str
) -> None:
    with mp.workdps(DIGITS):
        for k, distance in enumerate(DISTANCES):
            check(pentapod, surface, distance, 100, 100 + k)
            check(desk.robot, surface, distance, 30, 200 + k)


@pytest.mark.parametrize("policy", ["never", "always"])
def test_the_named_component_never_flips_on_a_singularity(pentapod: LinearPentapod, random_poses, policy: str) -> None:
    p, i = random_poses(pentapod, 2000, seed=8)
    size = np.abs(pentapod.base - pentapod.base[2]).max()
    flat = i * (1.0, 1.0, 0.0)
    flat /= np.linalg.norm(flat, axis=1)[:, None]
    # Exactly on w = 0, and on S = 0 but for rounding: the lengths alone cannot tell the sides.
    normal = np.c_[pentapod.delta * i[:, 2], np.zeros(len(i)), 1.0 - pentapod.delta * i[:, 0]]
    s = pentapod.delta * i[:, 2] * p[:, 0] + (1.0 - pentapod.delta * i[:, 0]) * p[:, 2] + pentapod.lever * i[:, 2]
    steep = np.linalg.norm(normal, axis=1)
    on = p - (s / steep**2)[:, None] * normal
    # S is known to rounding; the plane is S / |normal| away, and where that normal vanishes the surfaces meet.
    known = 2e-13 * size * np.maximum(1.0, 1.0 / steep)
    for positions, directions in ((p, flat), (on, i)):
        legs = pentapod.leg_lengths(positions, directions)
        for component in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            with kernels_used(policy):
                position, direction = pentapod.pose(legs, component)
            assert (pentapod.branch(position, direction) == component).all()
            residual = np.abs(pentapod.leg_lengths(position, direction) - legs).max(axis=1)
            assert (residual <= known).all()
            assert np.median(residual) <= 2e-15 * size
            np.testing.assert_allclose(np.linalg.norm(direction, axis=1), 1.0, rtol=1e-14)


def test_legs_beyond_rounding_still_have_no_pose(pentapod: LinearPentapod, random_poses) -> None:
    # On w = 0 all joints are as far from the base as they can get: legs that ask for more have no pose.
    p, i = random_poses(pentapod, 500, seed=9)
    flat = i * (1.0, 1.0, 0.0)
    flat /= np.linalg.norm(flat, axis=1)[:, None]
    legs, (towards, _) = pentapod.leg_lengths(p, flat), np.random.default_rng(0).normal(size=(2, 500, 5))
    for side in (1.0, -1.0):
        changed = legs + side * 1e-9 * towards
        lost = np.isnan(pentapod.pose(changed, (1, 1))[0]).any(axis=1)
        gone = np.isnan(pentapod.pose(legs - side * 1e-9 * towards, (1, 1))[0]).any(axis=1)
        assert (lost | gone).mean() > 0.9  # one side of the surface has poses, the other has none
        assert not lost.all()


def test_every_pose_of_a_machines_work_volume_is_found_again_to_nine_digits(desk: Machine) -> None:
    tips, axes = sample_work_volume(desk.work, rings=7, around=24, levels=4)
    p, i = tips + desk.tool_length * axes, -axes
    assert len(p) > 100_000
    robot = desk.robot
    position, direction = robot.pose(robot.leg_lengths(p, i), robot.branch(p, i))
    # relative: to the distance from the origin, and to the unit length of the direction
    assert (np.linalg.norm(position - p, axis=1) <= 1e-9 * np.linalg.norm(p, axis=1)).all()
    assert (np.linalg.norm(direction - i, axis=1) <= 1e-9).all()


def test_a_hundred_thousand_random_poses_all_around_the_paper_machine_to_nine_digits(
    paper: LinearPentapod, random_poses
) -> None:
    p, i = random_poses(paper, 100_000)
    position, direction = paper.pose(paper.leg_lengths(p, i), paper.branch(p, i))
    error = np.maximum(
        np.linalg.norm(position - p, axis=1) / np.abs(paper.base).max(), np.linalg.norm(direction - i, axis=1)
    )
    assert (error <= 1e-9).all()
    assert (paper.branch(position, direction) == paper.branch(p, i)).all()


@pytest.mark.parametrize(("least_measure", "share"), [(0.01, 0.9999), (0.0, 0.999)])
def test_random_poses_of_random_designs_to_nine_digits_but_for_the_nearly_singular(
    random_poses, least_measure: float, share: float
) -> None:
    """Sound designs, then any: a pose within about 1e-7 of a singularity has no nine digits in its leg lengths."""
    rng, right, total = np.random.default_rng(0), 0, 0
    while total < 100_000:
        robot = LinearPentapod.quadratic(rng.uniform(-1.0, 1.0, (5, 2)), rng.uniform(0.1, 2.0))
        if architectural_measure(robot) < least_measure:
            continue
        p, i = random_poses(robot, 1000, seed=total)
        position, direction = robot.pose(robot.leg_lengths(p, i), robot.branch(p, i))
        size = np.abs(robot.base - robot.base[2]).max()
        error = np.maximum(np.linalg.norm(position - p, axis=1) / size, np.linalg.norm(direction - i, axis=1))
        right, total = right + int((error <= 1e-9).sum()), total + 1000
        assert (robot.branch(position, direction) == robot.branch(p, i)).all()
    assert right >= share * total


def test_legs_of_the_answer_are_those_asked_for_as_far_as_the_design_is_well_conditioned(random_poses) -> None:
    """In units of 2⁻⁵³ of the longest length, by the condition of the equations that the legs are put into."""
    rng = np.random.default_rng(1)
    for k in range(200):
        base, delta = rng.uniform(-1.0, 1.0, (5, 2)), rng.uniform(-1.5, 1.5)
        base[4] = base[4] if k % 2 else base[3] + 10.0 ** rng.uniform(-5.0, -0.5) * rng.normal(size=2)
        robot = LinearPentapod(base, delta * base[:, 0] + 0.1, delta)
        x, y = (np.delete(base, 2, axis=0) - base[2]).T / np.abs(base - base[2]).max()
        condition = np.linalg.cond(np.stack([x, y, x * x, x * y], axis=1))
        p, i = random_poses(robot, 200, seed=k)
        p, i = p[np.abs(i[:, 1]) > 0.05], i[np.abs(i[:, 1]) > 0.05]
        legs = robot.leg_lengths(p, i)
        position, direction = robot.pose(legs, robot.branch(p, i))
        found = np.isfinite(position).all(axis=1)
        longest = np.maximum(legs.max(axis=1), max(np.abs(base).max(), np.abs(robot.offsets).max()))
        off = np.abs(robot.leg_lengths(position, direction) - legs).max(axis=1) / longest * 2.0**53
        assert off[found].max() <= 10.0 * condition
