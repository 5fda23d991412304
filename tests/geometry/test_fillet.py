"""Rounded polylines: C3, exact at the ends and on straight stretches, within the tolerance everywhere."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from pentapod.base.errors import ArrayError
from pentapod.geometry.fillet import blended


def within(tolerance):
    return lambda differences, chords: np.linalg.norm(differences, axis=1).max(axis=1) > tolerance


def chord_parameter(points):
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000), st.integers(3, 12), st.sampled_from([1e-2, 1e-3, 1e-5]))
def test_blended_curve_stays_within_the_tolerance(seed, count, tolerance):
    points = np.random.default_rng(seed).uniform(-1.0, 1.0, (count, 3))
    u = chord_parameter(points)
    curve = blended(u, points, within(tolerance))
    # An oracle that knows nothing of parameters: dense points of the curve against dense points of the polyline.
    dense = np.unique(np.concatenate([curve.t + k * np.append(np.diff(curve.t), 0.0) for k in np.linspace(0, 1, 9)]))
    fine = np.concatenate([np.linspace(a, b, 3000) for a, b in pairwise(points)])
    distance, _ = cKDTree(fine).query(curve(np.clip(dense, u[0], u[-1])))
    spacing = np.diff(u).max() / 3000
    assert distance.max() <= np.hypot(1.05 * tolerance, spacing)
    np.testing.assert_allclose(curve(u[[0, -1]]), points[[0, -1]], atol=1e-14)


def test_blended_curve_reproduces_straight_parts_exactly():
    points = np.array([[0.0, 0.0], [0.3, 0.0], [1.0, 0.0], [1.0, 2.0]])
    u = chord_parameter(points)
    curve = blended(u, points, within(1e-3))
    at = np.linspace(0.0, 0.9, 50)
    np.testing.assert_allclose(curve(at), np.c_[at, 0.0 * at], atol=1e-13)


def test_blended_curve_is_c3_and_not_c4():
    points = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.2, 1.3]])
    curve = blended(chord_parameter(points), points, within(1e-2))
    inner = np.unique(curve.t)[1:-1]
    assert np.unique(curve.t[5:-5]).size == curve.t[5:-5].size  # simple knots
    h = 1e-11
    for order in (0, 1, 2, 3):
        jump = np.abs(curve(inner + h, order) - curve(inner - h, order)).max()
        assert jump <= 1e-6 * np.abs(curve(inner, order)).max() + 3 * h * np.abs(curve(inner, order + 1)).max()
    assert np.abs(curve(inner + h, 4) - curve(inner - h, 4)).max() > 1.0


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from([1e-2, 1e-4]))
def test_blended_spans_enclose_the_curve_and_cover_it(seed, tolerance):
    """The arguments of `too_far` enclose the curve: within at 41 places of each span, by numpy's own interpolation."""
    points = np.random.default_rng(seed).uniform(-1.0, 1.0, (5, 2))
    u = chord_parameter(points)
    largest = []

    def too_far(differences, chords):
        size = np.linalg.norm(differences, axis=1).max(axis=1)
        largest.append(size)
        return size > tolerance

    curve = blended(u, points, too_far)
    knots = np.unique(curve.t)
    at = (knots[:-1, None] + np.diff(knots)[:, None] * np.linspace(0.0, 1.0, 41)).ravel()
    on_line = np.column_stack([np.interp(at, u, column) for column in points.T])
    off = np.linalg.norm(curve(at) - on_line, axis=1)
    assert off.max() <= tolerance
    assert off.max() >= 0.3 * tolerance  # the bound is not so loose that corners are needlessly tight
    assert max(map(np.max, largest)) > tolerance  # it was refined at all


def test_blended_curve_of_a_micrometre_step_beside_metres():
    """Knots of very different spacing."""
    points = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1e-6], [0.0, 1e-6]])
    u = chord_parameter(points)
    curve = blended(u, points, within(1e-5))
    at = np.linspace(0.0, u[-1], 20_001)
    on_line = np.column_stack([np.interp(at, u, column) for column in points.T])
    assert np.linalg.norm(curve(at) - on_line, axis=1).max() <= 1e-5


def test_blended_curve_refuses_parameters_that_do_not_increase():
    with pytest.raises(ArrayError, match="increase strictly"):
        blended(np.array([0.0, 1.0, 1.0]), np.zeros((3, 2)), within(1.0))
