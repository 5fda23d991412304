"""The 6-SPU platform: all its modes, against a polynomial system that is solved by monodromy."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from pentapod.base.errors import ArrayError, MachineError
from pentapod.kinematics import (
    AssemblyObstacle,
    GeneralPentapod,
    LinearPentapod,
    SixLegPlatform,
    platform_obstacles,
    singularity_polynomial,
)

BASE = np.array([(-0.4, 0.2), (-0.2, -0.4), (0.05, 0.1), (0.2, -0.4), (0.4, 0.4)])
PLATFORMS = {
    "quadratic": SixLegPlatform(LinearPentapod.quadratic(BASE, 0.6), [0.3, 0.5, 0.05], [0.2, -0.15, 0.1]),
    "general": SixLegPlatform(
        GeneralPentapod(BASE, [-0.3, 0.2, 0.1, -0.15, 0.4]), [-0.3, 0.45, -0.02], [-0.1, 0.25, 0.3]
    ),
}


@pytest.fixture(params=PLATFORMS.values(), ids=PLATFORMS.keys())
def platform(request: pytest.FixtureRequest) -> SixLegPlatform:
    return request.param


def random_poses(n: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    rotation, _ = np.linalg.qr(rng.normal(size=(n, 3, 3)))
    rotation *= np.sign(np.linalg.det(rotation))[:, None, None]
    return rng.uniform(-0.6, 0.6, (n, 3)), rotation


def test_leg_lengths_are_distances_between_the_joints(platform: SixLegPlatform) -> None:
    p, rotation = random_poses(50, 0)
    base = np.vstack([np.c_[platform.pentapod.base, np.zeros(5)], platform.sixth_base])
    joints = np.vstack([np.outer(platform.pentapod.offsets, [0, 0, 1]), platform.sixth_joint])
    for q, r, legs in zip(p, rotation, platform.leg_lengths(p, rotation), strict=True):
        np.testing.assert_allclose(legs, [np.linalg.norm(q + r @ b - a) for a, b in zip(base, joints, strict=True)])


def test_every_pose_is_found_again_in_its_mode(platform: SixLegPlatform) -> None:
    p, rotation = random_poses(20_000, 1)
    legs, label = platform.leg_lengths(p, rotation), platform.label(p, rotation)
    assert len(np.unique(label, axis=0)) == 8
    position, found = platform.pose(legs, label)
    error = np.abs(position - p).max(axis=-1) + np.abs(found - rotation).max(axis=(-1, -2))
    jacobian = platform.jacobian(p, rotation)
    inherent = np.finfo(float).eps * np.linalg.norm(legs, axis=1) / np.linalg.svd(jacobian, compute_uv=False)[:, -1]
    assert (error < 10 * inherent).all()
    assert np.median(error) < 1e-14
    np.testing.assert_allclose(np.linalg.det(found), 1.0, atol=1e-13)


def test_modes_come_in_the_order_of_their_labels_and_have_the_leg_lengths(platform: SixLegPlatform) -> None:
    p, rotation = random_poses(2000, 2)
    legs = platform.leg_lengths(p, rotation)
    positions, rotations = platform.assembly_modes(legs)
    assert positions.shape == (2000, 8, 3)
    assert rotations.shape == (2000, 8, 3, 3)
    exists = np.isfinite(positions).all(axis=-1)
    np.testing.assert_array_equal(exists, np.isfinite(rotations).all(axis=(-1, -2)))
    assert set(np.unique(exists.sum(axis=1))) == {2, 4, 6, 8}
    again = platform.leg_lengths(positions, rotations)
    np.testing.assert_allclose(again[exists], np.repeat(legs[:, None], 8, axis=1)[exists], atol=1e-12)
    np.testing.assert_array_equal(
        platform.label(positions, rotations)[exists], np.tile(platform.labels, (2000, 1, 1))[exists]
    )


class Monodromy:
    """All complex solutions of the leg equations, by following one of them around loops in the space of the legs.

    Unknowns p, i and, for six legs, the arm c: |p + z_k i − a_k|² = l_k², |p + z_6 i + c − a_6|² = l_6², i·i = 1,
    i·c = 0, c·c = r². The poses form one irreducible variety, so loops reach every solution from any other.
    """

    def __init__(self, platform: SixLegPlatform, seed: int, *, sixth: bool) -> None:
        self.platform, self.rng, self.sixth = platform, np.random.default_rng(seed), sixth

    def equations(self, x: np.ndarray, squared: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        robot, n = self.platform.pentapod, 9 if self.sixth else 6
        p, i, rows, values = x[:, :3], x[:, 3:6], [], []
        for a, z, length in zip(np.c_[robot.base, np.zeros(5)], robot.offsets, squared[:5], strict=True):
            d = p + z * i - a
            values.append((d * d).sum(axis=1) - length)
            rows.append(np.concatenate([2 * d, 2 * z * d, np.zeros((len(x), n - 6))], axis=1))
        values.append((i * i).sum(axis=1) - 1)
        rows.append(np.concatenate([0 * p, 2 * i, np.zeros((len(x), n - 6))], axis=1))
        if self.sixth:
            c, z = x[:, 6:], self.platform.sixth_joint[2]
            d = p + z * i + c - self.platform.sixth_base
            values += [(d * d).sum(axis=1) - squared[5], (i * c).sum(axis=1)]
            values.append((c * c).sum(axis=1) - (self.platform.sixth_joint[:2] ** 2).sum())
            rows.append(np.concatenate([2 * d, 2 * z * d, 2 * d], axis=1))
            rows.append(np.concatenate([0 * p, c, i], axis=1))
            rows.append(np.concatenate([0 * p, 0 * p, 2 * c], axis=1))
        return np.stack(values, axis=1), np.stack(rows, axis=1)

    def start(self) -> tuple[np.ndarray, np.ndarray]:
        """A random complex pose, and the squared legs that it has."""
        draw = lambda: self.rng.normal(size=3) * 0.5 + 0.4j * self.rng.normal(size=3)  # noqa: E731
        p, i, c = draw(), draw(), draw()
        i /= np.sqrt((i * i).sum())
        c -= (c * i).sum() * i
        c *= np.hypot(*self.platform.sixth_joint[:2]) / np.sqrt((c * c).sum())
        x = np.concatenate([p, i, c] if self.sixth else [p, i])[None]
        legs = [0, 1, 2, 3, 4, 6] if self.sixth else [0, 1, 2, 3, 4]  # the rows of the legs
        values, _ = self.equations(x, np.zeros(6))
        return x, values[0, legs]

    def follow(self, x: np.ndarray, start: np.ndarray, end: np.ndarray, bend: float = 2.0) -> np.ndarray:
        """Carry solutions (m, n) along a curved way of the squared legs from start to end; what is lost is dropped."""
        bends = bend * (self.rng.normal(size=len(start)) + 1j * self.rng.normal(size=len(start)))
        s, step = 0.0, 0.05
        while s < 1.0 and len(x):
            step = min(step, 1.0 - s)
            ahead = s + step
            y = first = x
            squared = (1 - ahead) * start + ahead * end + ahead * (1 - ahead) * bends
            for k in range(4):
                values, matrix = self.equations(y, squared)
                y = y - np.linalg.solve(matrix, values[..., None])[..., 0]
                first = y if k == 0 else first
            good = np.abs(self.equations(y, squared)[0]).max(axis=1) < 1e-9 * (1 + np.abs(y).max(axis=1) ** 2)
            good &= np.abs(y - first).max(axis=1) < 0.02 * (1 + np.abs(x).max(axis=1))
            if good.all():
                x, s, step = y, ahead, 1.6 * step
            elif step > 1e-4:
                step *= 0.4
            else:
                x = x[good]
        return x

    def all_solutions(self, quiet: int) -> tuple[np.ndarray, np.ndarray]:
        """The solutions over one point, after as many loops as `quiet` have brought nothing new."""
        x, base = self.start()
        silent = 0
        for _ in range(40):
            if silent == quiet:
                break
            middle = self.start()[1]
            back = self.follow(self.follow(x, base, middle), middle, base)
            fresh = [y for y in back if np.abs(x - y).max(axis=1).min() > 1e-6]
            distinct: list[np.ndarray] = []
            for y in fresh:
                if all(np.abs(y - other).max() > 1e-6 for other in distinct):
                    distinct.append(y)
            silent = 0 if distinct else silent + bool(len(back))  # a loop that lost all tells nothing
            x = np.concatenate([x, *[y[None] for y in distinct]])
        return x, base


@cache
def solved(name: str, sixth: bool) -> tuple[Monodromy, np.ndarray, np.ndarray]:
    oracle = Monodromy(PLATFORMS[name], 3, sixth=sixth)
    return oracle, *oracle.all_solutions(quiet=5)


@pytest.mark.parametrize(
    ("name", "lines", "poses"), [("quadratic", 4, 8), pytest.param("general", 8, 16, marks=pytest.mark.slow)]
)
def test_number_of_modes_over_the_complex_numbers(name: str, lines: int, poses: int) -> None:
    assert len(solved(name, sixth=False)[1]) == lines
    assert len(solved(name, sixth=True)[1]) == poses


@pytest.mark.parametrize("name", ["quadratic", pytest.param("general", marks=pytest.mark.slow)])
def test_the_real_modes_are_the_real_solutions_of_the_system(name: str) -> None:
    platform, (oracle, solutions, base) = PLATFORMS[name], solved(name, sixth=True)
    p, rotation = random_poses(3, 5)
    verdicts = 0
    for legs in platform.leg_lengths(p, rotation):
        real = oracle.follow(solutions, base, legs**2 + 0j, bend=0.3)
        apart = np.abs(real[:, None] - real[None]).max(axis=2)[np.triu_indices(len(real), 1)]
        if len(real) < len(solutions) or apart.min() < 1e-6:  # two ways have met, or one was lost: no verdict
            continue
        verdicts += 1
        real = real[np.abs(real.imag).max(axis=1) < 1e-7].real
        positions, rotations = platform.assembly_modes(legs)
        exists = np.isfinite(positions[:, 0])
        arm = rotations @ [*platform.sixth_joint[:2], 0.0]
        ours = np.concatenate([positions, rotations[..., 2], arm], axis=-1)[exists]
        assert len(ours) == len(real)
        for pose in ours:
            assert np.abs(real - pose).max(axis=1).min() < 1e-6
    assert verdicts >= 2


def test_the_singularities_are_those_of_the_line_and_the_twist(platform: SixLegPlatform) -> None:
    p, rotation = random_poses(300, 6)
    legs = platform.leg_lengths(p, rotation)
    line = singularity_polynomial(platform.pentapod, p, rotation[..., 2])
    expected = line * platform.twist(p, rotation) / legs.prod(axis=1)
    determinant = np.linalg.det(platform.jacobian(p, rotation))
    np.testing.assert_allclose(determinant, expected, rtol=1e-7, atol=1e-9 * np.abs(determinant).max())


def test_the_twist_vanishes_where_the_sixth_leg_lies_in_the_platforms_plane(platform: SixLegPlatform) -> None:
    p, rotation = random_poses(1, 7)
    i = rotation[0, :, 2]
    foot = p[0] + platform.sixth_joint[2] * i
    towards = platform.sixth_base - foot
    towards -= (towards @ i) * i
    towards /= np.linalg.norm(towards)
    beta = np.arctan2(platform.sixth_joint[1], platform.sixth_joint[0])
    first = np.cos(beta) * towards - np.sin(beta) * np.cross(i, towards)
    flat = np.stack([first, np.cross(i, first), i], axis=-1)
    assert abs(platform.twist(p[0], flat)) < 1e-15
    matrix = platform.jacobian(p[0], flat)
    assert np.linalg.svd(matrix, compute_uv=False)[-1] < 1e-14
    # there the sixth leg is at its shortest
    shortest, _ = platform.sixth_leg_range(p[0], i)
    assert platform.leg_lengths(p[0], flat)[5] == pytest.approx(shortest, rel=1e-14)


def test_the_jacobian_is_the_slope_of_the_leg_lengths(platform: SixLegPlatform) -> None:
    p, rotation = random_poses(40, 8)
    jacobian, step = platform.jacobian(p, rotation), 1e-6
    for k, axis in enumerate(np.eye(3)):
        slope = platform.leg_lengths(p + step * axis, rotation) - platform.leg_lengths(p - step * axis, rotation)
        np.testing.assert_allclose(jacobian[..., k], slope / (2 * step), atol=1e-8)
        change = step * np.cross(axis, np.eye(3)).T @ rotation
        slope = platform.leg_lengths(p, rotation + change) - platform.leg_lengths(p, rotation - change)
        np.testing.assert_allclose(jacobian[..., 3 + k], slope / (2 * step), atol=1e-8)


def test_the_range_of_the_sixth_leg_is_what_a_turn_about_the_line_gives(platform: SixLegPlatform) -> None:
    p, rotation = random_poses(10, 9)
    shortest, longest = platform.sixth_leg_range(p, rotation[..., 2])
    for q, r, low, high in zip(p, rotation, shortest, longest, strict=True):

        def sixth(turn: float, sign: float, q: np.ndarray = q, r: np.ndarray = r) -> float:
            c, s = np.cos(turn), np.sin(turn)
            return sign * float(platform.leg_lengths(q, r @ [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])[5])

        starts = np.linspace(0, 2 * np.pi, 13)
        least = min(minimize_scalar(sixth, (a, b), args=(1.0,)).fun for a, b in pairwise(starts))
        most = -min(minimize_scalar(sixth, (a, b), args=(-1.0,)).fun for a, b in pairwise(starts))
        assert (least, most) == pytest.approx((low, high), rel=1e-9)


def test_legs_without_a_pose_are_explained(platform: SixLegPlatform) -> None:
    p, rotation = random_poses(1, 10)
    legs = np.repeat(platform.leg_lengths(p, rotation), 5, axis=0)
    legs[1, 5] = 9.0
    legs[2, 0] = 9.0
    legs[3, 5] = np.nan
    legs[4, 2] = -1.0
    obstacles = platform_obstacles(platform, legs)
    assert list(obstacles.obstacle[[0, 1, 3, 4]]) == [
        0,
        AssemblyObstacle.SIXTH_LEG,
        AssemblyObstacle.NOT_A_LENGTH,
        AssemblyObstacle.NOT_A_LENGTH,
    ]
    assert AssemblyObstacle.NOT_A_LENGTH < obstacles.obstacle[2] < AssemblyObstacle.SIXTH_LEG
    positions, directions = platform.pentapod.assembly_modes(legs[1, :5])
    longest = platform.sixth_leg_range(positions, directions)[1].max()
    assert obstacles.shortfall[1] == pytest.approx((9.0 - longest) / 9.0)
    assert "sixth leg" in obstacles.explain(1)
    np.testing.assert_array_equal(np.isfinite(platform.assembly_modes(legs)[0]).any(axis=(1, 2)), obstacles.exists)


def test_bad_input_is_refused_with_what_was_received(platform: SixLegPlatform) -> None:
    p, rotation = random_poses(1, 11)
    legs = platform.leg_lengths(p, rotation)
    with pytest.raises(ArrayError, match=r"legs has shape \(5,\)"):
        platform.pose(legs[0, :5], (1, 1, 1))
    with pytest.raises(ArrayError, match=r"label has shape \(2,\)"):
        platform.pose(legs, (1, 1))
    with pytest.raises(ArrayError, match="label is out of range"):
        platform.pose(legs, (1, 1, 2))
    with pytest.raises(ArrayError, match=r"rotation has shape \(3,\)"):
        platform.leg_lengths(p[0], [0.0, 0.0, 1.0])
    with pytest.raises(MachineError, match="on the line"):
        SixLegPlatform(platform.pentapod, platform.sixth_base, [0.0, 0.0, 0.3])
    with pytest.raises(MachineError, match="not finite"):
        SixLegPlatform(platform.pentapod, [0.0, np.inf, 0.0], platform.sixth_joint)
    position, found = platform.pose(legs, [[0, 1, 1], [1, np.nan, 1], [1, 1, 0]])
    assert np.isnan(position).all()
    assert np.isnan(found).all()


def test_a_batch_is_its_elements(platform: SixLegPlatform) -> None:
    p, rotation = random_poses(6, 12)
    legs, label = platform.leg_lengths(p, rotation), platform.label(p, rotation)
    position, found = platform.pose(legs.reshape(2, 3, 6), label.reshape(2, 3, 3))
    assert position.shape == (2, 3, 3)
    assert found.shape == (2, 3, 3, 3)
    for k in range(6):
        alone = platform.pose(legs[k], label[k])
        np.testing.assert_allclose(position.reshape(6, 3)[k], alone[0], atol=1e-12)
        np.testing.assert_allclose(found.reshape(6, 3, 3)[k], alone[1], atol=1e-12)
