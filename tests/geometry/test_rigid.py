"""Rigid transforms are a group that acts on points and preserves distances."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from pentapod.base.errors import ArrayError
from pentapod.geometry import RigidTransform

numbers = st.floats(-10.0, 10.0, allow_subnormal=False)


@st.composite
def transforms(draw: st.DrawFn) -> RigidTransform:
    vector = [draw(st.floats(-3.0, 3.0)) for _ in range(3)]
    return RigidTransform(Rotation.from_rotvec(vector).as_matrix(), np.array([draw(numbers) for _ in range(3)]))


def same(a: RigidTransform, b: RigidTransform) -> bool:
    return bool(np.allclose(a.matrix, b.matrix, rtol=0.0, atol=1e-12))


@given(transforms(), transforms(), transforms())
def test_rigid_transforms_form_a_group(a: RigidTransform, b: RigidTransform, c: RigidTransform) -> None:
    one = RigidTransform.identity()
    assert same((a @ b) @ c, a @ (b @ c))
    assert same(a @ one, a)
    assert same(one @ a, a)
    assert same(a @ a.inverse(), one)
    assert same(a.inverse() @ a, one)


@given(transforms(), transforms(), st.lists(st.tuples(numbers, numbers, numbers), min_size=2, max_size=5))
def test_rigid_transforms_act_on_points_and_keep_distances(a: RigidTransform, b: RigidTransform, points: list) -> None:
    x = np.array(points)
    np.testing.assert_allclose((a @ b).apply(x), a.apply(b.apply(x)), atol=1e-12)
    np.testing.assert_allclose(a.inverse().apply(a.apply(x)), x, atol=1e-12)
    np.testing.assert_allclose(a.rotate(x[0] - x[1]), a.apply(x[0]) - a.apply(x[1]), atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(a.apply(x[0]) - a.apply(x[1])), np.linalg.norm(x[0] - x[1]), atol=1e-12)
    homogeneous = np.c_[x, np.ones(len(x))] @ a.matrix.T
    np.testing.assert_allclose(a.apply(x), homogeneous[:, :3], atol=1e-12)


@given(transforms())
def test_rigid_transform_comes_back_from_its_matrix(a: RigidTransform) -> None:
    assert same(RigidTransform.from_matrix(a.matrix), a)


def test_rigid_transform_applies_to_batches_and_copies_its_arrays() -> None:
    rotation = Rotation.from_euler("z", 90, degrees=True).as_matrix()
    shift = np.array([1.0, 0.0, 0.0])
    a = RigidTransform(rotation, shift)
    shift[0] = 7.0
    assert a.apply(np.ones((2, 4, 3))).shape == (2, 4, 3)
    np.testing.assert_allclose(a.apply([1.0, 0.0, 0.0]), [1.0, 1.0, 0.0], atol=1e-15)
    with pytest.raises(ValueError, match="read-only"):
        a.translation[0] = 2.0


@pytest.mark.parametrize(
    "rotation",
    [np.diag([1.0, 1.0, -1.0]), 1.001 * np.eye(3), np.eye(3) * np.nan, np.eye(2)],
    ids=["reflection", "scaled", "nan", "2x2"],
)
def test_rigid_transform_refuses_what_is_no_rotation(rotation: np.ndarray) -> None:
    with pytest.raises(ArrayError):
        RigidTransform(rotation, np.zeros(3))


def test_rigid_transform_refuses_a_matrix_with_a_wrong_last_row() -> None:
    with pytest.raises(ArrayError, match="last row"):
        RigidTransform.from_matrix(np.diag([1.0, 1.0, 1.0, 2.0]))
