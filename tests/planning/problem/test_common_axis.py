"""A common direction of the tool axes: the limits of the lean are kept, and axes stay smooth along the path."""

import numpy as np
import pytest
from domes import dome

from pentapod.geometry import angle_between
from pentapod.planning.placement.common_axes import cap_centre, directions
from pentapod.planning.problem.common_axis import CommonAxis
from pentapod.planning.problem.constraints import FREE, PlacementConstraints
from pentapod.planning.problem.problem import PlacementProblem
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.planning.tool_axis.spline import AxisSpline, within_discs

UP = np.array([0.0, 0.0, 1.0])
TILT = np.radians(15.0)


def towards(path, cone_deg, limit_deg):
    own = ToolpathSamples.of(path, TILT)
    return own, own.towards(CommonAxis(UP, np.radians(cone_deg), np.radians(limit_deg)))


@pytest.fixture(scope="module")
def steep():
    return dome(0.08, 85.0)


@pytest.mark.parametrize(("cone", "limit"), [(0.0, 90.0), (10.0, 90.0), (25.0, 60.0), (0.0, 60.0), (40.0, 20.0)])
def test_nominal_axes_keep_the_limit_from_the_normal_and_the_cone_where_both_can_be_kept(steep, cone, limit):
    own, samples = towards(steep, cone, limit)
    np.testing.assert_allclose(np.linalg.norm(samples.nominal, axis=1), 1.0, atol=1e-12)
    assert np.degrees(angle_between(samples.nominal, own.nominal)).max() < limit
    if cone + limit > 86.0:
        assert np.degrees(angle_between(samples.nominal, UP)).max() <= cone + 1e-9


def test_normals_near_the_common_direction_are_kept(cap):
    own, samples = towards(cap, 80.0, 90.0)
    far = np.degrees(angle_between(own.nominal, UP)) < 20.0
    mean = CommonAxis(UP, np.radians(80.0), np.radians(90.0)).options.width / 0.1  # the dome's radius is about 0.1 m
    assert angle_between(samples.nominal, own.nominal)[far].max() < mean


def test_a_cone_of_zero_makes_a_fixed_axis(steep):
    _, samples = towards(steep, 0.0, 90.0)
    np.testing.assert_allclose(samples.nominal, np.tile(UP, (len(steep), 1)), atol=1e-12)


def test_axes_turn_more_slowly_than_the_normals_do(steep):
    own, samples = towards(steep, 20.0, 90.0)
    turn = [np.linalg.norm(np.diff(each.nominal, axis=0), axis=1).max() for each in (own, samples)]
    assert turn[1] < 0.5 * turn[0]


@pytest.mark.parametrize("limit", [60.0, 75.0, 90.0])
def test_no_tilt_field_and_no_spline_of_the_axes_leaves_the_limit(steep, desk, limit):
    own, samples = towards(steep, 5.0, limit)
    problem = PlacementProblem.of(samples, desk)
    rng = np.random.default_rng(1)
    spline = AxisSpline.of(samples, problem.cone)
    size = spline.hessian.shape[1] // 2
    for _ in range(10):
        field = problem.within_cone(rng.normal(scale=2.0, size=(problem.basis.shape[1], 2)))
        leant = problem.axes(field)
        assert np.degrees(angle_between(leant, own.nominal)).max() < limit
        leans = spline.leans(within_discs(rng.normal(scale=3.0, size=(size, 2))))
        across = leans - (leans * samples.nominal).sum(axis=1, keepdims=True) * samples.nominal
        axes = samples.nominal + across
        assert np.degrees(angle_between(axes, own.nominal)).max() < limit
    assert problem.steepness(field).max() == pytest.approx(1.0)  # the cone is used to its edge somewhere


def test_the_cap_of_directions_has_its_centre_and_no_duplicates_are_compared(steep):
    rng = np.random.default_rng(2)
    angle, turn = rng.uniform(0.0, np.radians(50.0), 400), rng.uniform(0.0, 2.0 * np.pi, 400)
    angle[:3], turn[:3] = np.radians(50.0), [0.0, 2.1, 4.2]  # three on the edge hold the cap
    cap = np.stack([np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle)], axis=1)
    assert np.degrees(angle_between(cap_centre(cap), UP)) < 1.0
    (only,) = directions(steep.axes, FREE)
    np.testing.assert_allclose(only, UP)
    turned = directions(steep.axes, PlacementConstraints.table(0.7, up=(1.0, 0.0, 1.0)))
    assert len(turned) == 2
    np.testing.assert_allclose(turned[0], np.sqrt([0.5, 0.0, 0.5]))
