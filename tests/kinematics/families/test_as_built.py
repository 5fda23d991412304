"""Machines as built: leg lengths and Jacobians, against LinuxCNC's formula in the effector's frame, and mpmath."""

import mpmath
import numpy as np
import pytest

from pentapod.base.errors import ArrayError, MachineError
from pentapod.kinematics import AsBuiltPentapod, LinearPentapod


def effector_frame(a: float, b: float) -> np.ndarray:
    """LinuxCNC's rotation of the effector for the angles A and B in radians: Ry(B) Rx(A)."""
    about_x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    about_y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    return about_y @ about_x


def strut(base, p, rotation, z, r):
    """A strut's length as pentakins has it: in the effector's frame."""
    x, y, height = rotation.T @ (base - p)
    return np.sqrt((height - z) ** 2 + (np.sqrt(x * x + y * y) - r) ** 2)


def nearest_on_ring(base, p, i, z, r, turns=20001):
    """The distance to a circle by looking at its points."""
    e1 = np.cross(i, [1.0, 0.3, 0.2])
    e1 /= np.linalg.norm(e1)
    e2 = np.cross(i, e1)
    angle = np.linspace(0, 2 * np.pi, turns)[:, None]
    points = p + z * i + r * (np.cos(angle) * e1 + np.sin(angle) * e2)
    return np.linalg.norm(points - base, axis=1).min()


@pytest.fixture
def built(paper: LinearPentapod) -> AsBuiltPentapod:
    rng = np.random.default_rng(5)
    return AsBuiltPentapod.of(
        paper,
        base_errors=rng.normal(size=(5, 3)) * 0.05,
        offset_errors=rng.normal(size=5) * 0.05,
        radii=[0.0, 0.3, 0.02, 0.0, 0.5],
        zeros=rng.normal(size=5) * 0.01,
    )


def test_leg_lengths_are_those_of_pentakins(built):
    rng = np.random.default_rng(0)
    p = rng.uniform((-2, -2, 2), (2, 2, 6), (200, 3))
    angles = rng.uniform(-1.0, 1.0, (200, 2))
    frames = [effector_frame(a, b) for a, b in angles]
    axes = np.array([frame[:, 2] for frame in frames])
    a, b = angles.T
    assert np.allclose(axes, np.c_[np.cos(a) * np.sin(b), -np.sin(a), np.cos(a) * np.cos(b)], atol=1e-15)
    expected = [
        [strut(built.base[k], p[n], frames[n], built.offsets[k], built.radii[k]) for k in range(5)] for n in range(200)
    ]
    assert np.abs(built.leg_lengths(p, axes) - built.zeros - expected).max() < 1e-14


def test_a_ring_is_a_circle_that_the_leg_ends_on(built, random_poses, paper):
    p, i = random_poses(paper, 12)
    for n in range(len(p)):
        for k in range(5):
            length = built.leg_lengths(p[n], i[n])[k] - built.zeros[k]
            nearest = nearest_on_ring(built.base[k], p[n], i[n], built.offsets[k], built.radii[k])
            assert -1e-14 < nearest - length < 1e-7


def test_without_errors_it_is_the_nominal_machine(pentapod, random_poses):
    p, i = random_poses(pentapod, 500)
    same = AsBuiltPentapod.of(pentapod)
    legs = pentapod.leg_lengths(p, i)
    assert np.abs(same.leg_lengths(p, i) - legs).max() < 1e-14 * legs.max()
    assert same.leg_lengths(np.zeros((3, 1, 3)) + p[0], i[:4]).shape == (3, 4, 5)


@mpmath.workdps(50)
def test_inverse_kinematics_to_fifty_digits(built):
    rng = np.random.default_rng(2)
    for _ in range(20):
        p, i = rng.uniform(-2, 2, 3), rng.normal(size=3)
        i /= np.linalg.norm(i)
        legs = built.leg_lengths(p, i)
        axis = mpmath.matrix([mpmath.mpf(c) for c in i])
        axis /= mpmath.norm(axis)
        for k in range(5):
            d = mpmath.matrix([mpmath.mpf(a) - mpmath.mpf(c) for a, c in zip(built.base[k], p, strict=True)])
            height = (d.T * axis)[0]
            rho = mpmath.norm(d - height * axis)
            exact = mpmath.sqrt((height - mpmath.mpf(built.offsets[k])) ** 2 + (rho - mpmath.mpf(built.radii[k])) ** 2)
            assert abs(legs[k] - exact - mpmath.mpf(built.zeros[k])) < 1e-14


def test_jacobian_is_the_derivative(built, random_poses, paper):
    p, i = random_poses(paper, 40, seed=3)
    p[:, 2] += 6.0
    rng = np.random.default_rng(4)
    dp, turn = rng.normal(size=p.shape), rng.normal(size=p.shape)
    di = np.cross(turn, i)
    angle = np.linalg.norm(di, axis=1)[:, None]

    def legs_at(h: float) -> np.ndarray:
        return built.leg_lengths(p + h * dp, np.cos(h * angle) * i + np.sin(h * angle) * di / angle)

    h = 1e-3
    slope = (8 * (legs_at(h) - legs_at(-h)) - (legs_at(2 * h) - legs_at(-2 * h))) / (12 * h)
    rates = built.jacobian(p, i) @ np.concatenate([dp, di], axis=1)[..., None]
    assert np.abs(slope - rates[..., 0]).max() < 1e-8
    assert np.abs(rates).max() > 1.0


def test_a_ring_around_its_own_base_joint_has_no_derivative(paper):
    machine = AsBuiltPentapod.of(paper, radii=[0, 0, 0.1, 0, 0])
    jacobian = machine.jacobian([0.0, 0.0, 3.0], [0.0, 0.0, 1.0])  # the line passes through base joint 3
    assert np.isnan(jacobian[2]).all()
    assert np.isfinite(np.delete(jacobian, 2, axis=0)).all()
    assert machine.leg_lengths([0.0, 0.0, 3.0], [0.0, 0.0, 1.0])[2] == pytest.approx(np.hypot(3.0, 0.1))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"radii": [0, 0, -1e-3, 0, 0]}, r"leg 3: its ring has a negative radius .*got -0.001"),
        ({"base_errors": np.zeros((4, 3))}, r"base_errors has shape \(4, 3\); expected shape \(5, 3\)"),
        ({"zeros": np.nan}, "zeros is not finite"),
        ({"offset_errors": "long"}, "offset_errors is not an array of numbers"),
    ],
)
def test_bad_machines(paper, changes, message):
    with pytest.raises(MachineError, match=message):
        AsBuiltPentapod.of(paper, **changes)


def test_bad_shapes(paper):
    with pytest.raises(MachineError, match=r"base has shape \(5, 2\)"):
        AsBuiltPentapod(paper.base, paper.offsets, np.zeros(5), np.zeros(5))
    with pytest.raises(ArrayError, match=r"position has shape \(2,\)"):
        AsBuiltPentapod.of(paper).leg_lengths([1.0, 2.0], [0, 0, 1])


def test_it_is_read_only(built):
    with pytest.raises(ValueError, match="read-only"):
        built.base[0, 0] = 1.0


def test_loads_on_the_ends_of_legs_are_those_of_virtual_work():
    base = np.array([(0.586, -0.120), (0.224, 0.554), (-0.326, 0.498), (-0.597, -0.039), (-0.055, -0.595)])
    machine = AsBuiltPentapod.of(LinearPentapod.quadratic(base, 0.185), radii=[0.03, 0.0, 0.1, 0.05, 0.2])
    size, rng = 1e-6, np.random.default_rng(2)
    position, direction = rng.uniform(0.2, 0.6, (6, 3)), rng.normal((0.0, 0.0, 4.0), 1.0, (6, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    shift, turn = rng.normal(size=(6, 3)), np.cross(rng.normal(size=(6, 3)), direction)
    for leg in range(5):
        force = rng.normal(size=(6, 3))
        on_p, on_i = machine.pose_loads(position, direction, leg, force)
        ends = []
        for sign in (1.0, -1.0):
            moved = direction + sign * size * turn
            moved /= np.linalg.norm(moved, axis=1)[:, None]
            ends.append(machine.platform_joints(position + sign * size * shift, moved)[:, leg])
        work = np.einsum("nc,nc->n", force, ends[0] - ends[1]) / (2.0 * size)
        np.testing.assert_allclose((on_p * shift).sum(axis=1) + (on_i * turn).sum(axis=1), work, atol=1e-7)
