"""Rounded polylines: C2, exact at the ends and on straight stretches, within the tolerance everywhere."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from pentapod.errors import ArrayError
from pentapod.geometry.rounding import rounded


def within(tolerance):
    return lambda u, on_curve, on_line: np.linalg.norm(on_curve - on_line, axis=1) > tolerance


def chord_parameter(points):
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000), st.integers(3, 12), st.sampled_from([1e-2, 1e-3, 1e-5]))
def test_curve_stays_within_the_tolerance(seed, count, tolerance):
    points = np.random.default_rng(seed).uniform(-1.0, 1.0, (count, 3))
    u = chord_parameter(points)
    curve = rounded(u, points, within(tolerance))
    # An oracle that knows nothing of parameters: dense points of the curve against dense points of the polyline.
    dense = np.unique(np.concatenate([curve.t + k * np.append(np.diff(curve.t), 0.0) for k in np.linspace(0, 1, 9)]))
    fine = np.concatenate([np.linspace(a, b, 3000) for a, b in pairwise(points)])
    distance, _ = cKDTree(fine).query(curve(np.clip(dense, u[0], u[-1])))
    spacing = np.diff(u).max() / 3000
    assert distance.max() <= np.hypot(1.05 * tolerance, spacing)
    np.testing.assert_allclose(curve(u[[0, -1]]), points[[0, -1]], atol=1e-14)


def test_straight_stretches_are_reproduced_exactly():
    points = np.array([[0.0, 0.0], [0.3, 0.0], [1.0, 0.0], [1.0, 2.0]])
    u = chord_parameter(points)
    curve = rounded(u, points, within(1e-3))
    at = np.linspace(0.0, 0.9, 50)
    np.testing.assert_allclose(curve(at), np.c_[at, 0.0 * at], atol=1e-13)


def test_second_derivative_is_continuous():
    points = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.2, 1.3]])
    u = chord_parameter(points)
    curve = rounded(u, points, within(1e-2))
    inner = np.unique(curve.t)[1:-1]
    h = 1e-11
    jump = np.abs(curve(inner + h, 2) - curve(inner - h, 2)).max()
    assert jump <= 1e-6 * np.abs(curve(inner, 2)).max() + 3 * h * np.abs(curve(inner, 3)).max()
    assert curve.k == 3
    assert np.unique(curve.t[4:-4]).size == curve.t[4:-4].size  # simple knots


def test_parameters_must_increase():
    with pytest.raises(ArrayError, match="increase strictly"):
        rounded(np.array([0.0, 1.0, 1.0]), np.zeros((3, 2)), within(1.0))
