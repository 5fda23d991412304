"""The pentapods that every kinematic test runs on, and random poses for them."""

import numpy as np
import pytest

from pentapod.kinematics import LinearPentapod

PAPER = np.array([(-2.0, 1.0), (-1.0, -2.0), (0.0, 0.0), (1.0, -2.0), (2.0, 2.0)])


def _pentapods() -> dict[str, LinearPentapod]:
    shifted = 0.2 * PAPER + (0.31, -0.17)
    return {
        "paper": LinearPentapod.quadratic(PAPER, 0.5),
        "desk-sized, leg 3 off the origin": LinearPentapod.quadratic(shifted, 1.3),
        "p anywhere on the line": LinearPentapod.from_offsets(shifted, 0.07 - 0.8 * (shifted[:, 0] - 0.1), -0.8),
    }


MACHINES = _pentapods()
LONG = "desk-sized, leg 3 off the origin"
"""In the long lane only: the others stand at the origin, and lie anywhere."""


@pytest.fixture(
    params=[pytest.param(m, id=name, marks=pytest.mark.slow if name == LONG else ()) for name, m in MACHINES.items()]
)
def pentapod(request: pytest.FixtureRequest) -> LinearPentapod:
    return request.param


@pytest.fixture
def paper() -> LinearPentapod:
    return MACHINES["paper"]


@pytest.fixture
def random_poses():
    """random_poses(pentapod, n, seed): positions and directions (n, 3) all around the machine."""

    def draw(pentapod: LinearPentapod, n: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
        rng = np.random.default_rng(seed)
        size = np.abs(pentapod.base - pentapod.base[2]).max()
        direction = rng.normal(size=(n, 3))
        direction /= np.linalg.norm(direction, axis=1)[:, None]
        return rng.uniform(-2.0, 2.0, size=(n, 3)) * size, direction

    return draw


@pytest.fixture
def leg_determinant():
    """The 5×5 determinant whose zeros are the singularities; it shares no formula with the package.

    Rows [d_i, z_i d_i·u1, z_i d_i·u2], u1 = i×k normalised, u2 = i×u1; equal to δ² w F S.
    """

    def determinant(pentapod: LinearPentapod, position: np.ndarray, direction: np.ndarray) -> np.ndarray:
        p, i = np.broadcast_arrays(position, direction)
        attachments = np.c_[pentapod.base, np.zeros(5)]
        z = pentapod.offsets
        d = p[..., None, :] + z[:, None] * i[..., None, :] - attachments
        u1 = np.cross(i, [0.0, 0.0, 1.0])
        u1 = u1 / np.linalg.norm(u1, axis=-1, keepdims=True)
        u2 = np.cross(i, u1)
        columns = [d, (z * np.einsum("...ij,...j->...i", d, u1))[..., None]]
        columns.append((z * np.einsum("...ij,...j->...i", d, u2))[..., None])
        return np.linalg.det(np.concatenate(columns, axis=-1))

    return determinant


@pytest.fixture
def conic_determinant():
    """F: zero where a conic through the five attachments passes through the point at infinity (0, 1, 0)."""

    def determinant(pentapod: LinearPentapod) -> float:
        x, y = pentapod.base.T
        return float(np.linalg.det(np.stack([x * x, x * y, x, y, np.ones(5)], axis=1)))

    return determinant
