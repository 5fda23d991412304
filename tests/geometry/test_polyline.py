"""Arc length of polylines."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pentapod.base.errors import ArrayError
from pentapod.geometry import arc_length


def test_arc_length_of_a_known_polyline() -> None:
    np.testing.assert_allclose(arc_length([[0, 0], [3, 4], [3, 4], [3, 5]]), [0, 5, 5, 6])


def test_arc_length_of_one_point_is_zero() -> None:
    np.testing.assert_array_equal(arc_length([[1.0, 2.0, 3.0]]), [0.0])


@given(st.integers(2, 40), st.floats(0.0, 1.0))
def test_arc_length_does_not_depend_on_points_added_on_an_edge(n: int, at: float) -> None:
    points = np.random.default_rng(n).normal(size=(n, 3))
    extra = np.insert(points, 1, (1 - at) * points[0] + at * points[1], axis=0)
    length = arc_length(points)
    assert abs(arc_length(extra)[-1] - length[-1]) < 1e-12
    assert (np.diff(length) >= 0.0).all()
    assert length[-1] >= np.linalg.norm(points[-1] - points[0]) - 1e-12


def test_arc_length_refuses_a_single_vector() -> None:
    with pytest.raises(ArrayError):
        arc_length([1.0, 2.0, 3.0])
