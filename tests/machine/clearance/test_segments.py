"""Distances between segments against minimisers that know nothing of the closed form."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from pentapod.machine import segment_distance

coordinates = st.floats(-2.0, 2.0, allow_nan=False).map(lambda x: round(x, 3))
points = st.tuples(coordinates, coordinates, coordinates).map(np.array)


def by_scipy(a0, a1, b0, b1):
    def squared(q):
        gap = a0 + q[0] * (a1 - a0) - b0 - q[1] * (b1 - b0)
        return gap @ gap

    starts = [(0.5, 0.5), (0.0, 1.0), (1.0, 0.0)]
    found = [minimize(squared, q, bounds=[(0, 1), (0, 1)], tol=1e-14).fun for q in starts]
    return np.sqrt(min(found))


@settings(max_examples=150, deadline=None)
@given(points, points, points, points)
def test_equals_a_bounded_minimiser(a0, a1, b0, b1):
    assert segment_distance(a0, a1, b0, b1) == pytest.approx(by_scipy(a0, a1, b0, b1), abs=2e-4)


@settings(max_examples=200, deadline=None)
@given(points, points, points, points)
def test_symmetric_and_below_every_pair_of_points(a0, a1, b0, b1):
    distance = segment_distance(a0, a1, b0, b1)
    assert distance == pytest.approx(segment_distance(b1, b0, a1, a0), abs=1e-7)
    s = np.linspace(0, 1, 21)[:, None]
    on_a, on_b = a0 + s * (a1 - a0), b0 + s * (b1 - b0)
    pairs = np.linalg.norm(on_a[:, None] - on_b[None], axis=-1)
    step = (np.linalg.norm(a1 - a0) + np.linalg.norm(b1 - b0)) / 20
    assert pairs.min() - step <= distance <= pairs.min() + 1e-7


@pytest.mark.parametrize(
    ("segments", "expected"),
    [
        ([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)], 1.0),  # parallel, side by side
        ([(0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0)], 1.0),  # on one line, apart
        ([(0, 0, 0), (2, 0, 0), (1, 0, 0), (3, 0, 0)], 0.0),  # on one line, overlapping
        ([(-1, 0, 0), (1, 0, 0), (0, -1, 0.25), (0, 1, 0.25)], 0.25),  # crossing
        ([(0, 0, 0), (1, 0, 0), (3, 4, 0), (3, 4, 0)], np.sqrt(20)),  # segment and point
        ([(1, 1, 1), (1, 1, 1), (1, 1, 3), (1, 1, 3)], 2.0),  # two points
        ([(0, 0, 0), (1, 0, 0), (2, 1, 0), (2, -1, 0)], 1.0),  # end against inside
    ],
)
def test_known_distances(segments, expected):
    assert segment_distance(*segments) == pytest.approx(expected, abs=1e-12)


def test_broadcasts():
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(7, 1, 2, 3)), rng.normal(size=(4, 2, 3))
    batch = segment_distance(a[..., 0, :], a[..., 1, :], b[..., 0, :], b[..., 1, :])
    assert batch.shape == (7, 4)
    one = segment_distance(a[5, 0, 0], a[5, 0, 1], b[2, 0], b[2, 1])
    assert batch[5, 2] == pytest.approx(one, abs=1e-14)
