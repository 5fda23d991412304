"""Samples of a toolpath: the limit of the axes where a wide cone exceeds it."""

import numpy as np
import pytest

from pentapod.geometry.directions import angle_between, normalised, rotation_minimising_frames
from pentapod.planning.problem.common_axis import CommonAxis
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.planning.problem.tilt_field import lean

LIMIT = np.radians(70.0)


@pytest.fixture
def wide():
    """Own axes 50 to 90 deg from the common direction, with a cone of 40 deg around axes between them."""
    rng = np.random.default_rng(5)
    turn, down = rng.uniform(0.0, 2.0 * np.pi, 30), np.radians(rng.uniform(50.0, 90.0, 30))
    own = np.stack([np.sin(down) * np.cos(turn), np.sin(down) * np.sin(turn), np.cos(down)], axis=1)
    centres = np.cumsum(rng.uniform(0.0, 1e-3, (30, 3)), axis=0)
    whole = ToolpathSamples(centres, own, 3e-3, np.radians(15.0))
    return whole.towards(CommonAxis(np.eye(3)[2], 0.0, LIMIT)).widened(own, np.radians(40.0), LIMIT)


def test_axes_are_inside_as_long_as_their_angle_from_the_own_axes_is_below_the_limit(wide):
    axes = normalised(np.random.default_rng(6).normal(size=(40, 30, 3)))
    within = angle_between(axes, wide.own[None]) <= LIMIT
    assert within.any()
    assert not within.all()
    np.testing.assert_array_equal(wide.inside(axes) >= 0.0, within)
    rows = np.array([3, 7, 20])
    np.testing.assert_array_equal(wide.inside(axes[:, rows], rows), wide.inside(axes)[:, rows])
    np.testing.assert_array_equal(wide.at(rows).inside(axes[:, rows]), wide.inside(axes)[:, rows])


def test_a_cone_around_the_own_axes_keeps_the_limit_by_itself(wide):
    plain = ToolpathSamples(wide.tilt_centres, wide.own, 3e-3, 0.1).widened(wide.own, 0.5, LIMIT)
    assert plain.tilt == 0.5
    assert plain.inside(plain.nominal) is None


def test_derivatives_by_the_lean_are_those_of_differences(wide):
    frames, rows = rotation_minimising_frames(wide.nominal), np.arange(0, 30, 2)
    leans, step = np.random.default_rng(7).uniform(-0.6, 0.6, (len(rows), 2)), 1e-6

    def inside(leans):
        b = np.einsum("na,nak->nk", leans, frames[rows])
        return wide.inside(lean(wide.nominal[rows], b), rows)

    found = wide.inside_by_lean(frames[rows], leans, rows)
    for k in range(2):
        off = step * np.eye(2)[k]
        np.testing.assert_allclose(found[:, k], (inside(leans + off) - inside(leans - off)) / (2.0 * step), atol=1e-8)
