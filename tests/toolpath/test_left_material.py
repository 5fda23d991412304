"""The measure of what is left, against closed forms: limits of a ball in corners, gaps, pits and on slopes."""

import numpy as np
import pytest

import concave_parts
from left_material import Reachable, Samples, left, nearest_facet
from pentapod.toolpath import Segment, SegmentKind, Toolpath

R = 3e-3
UP = np.array([0.0, 0.0, 1.0])


def limits(name, points):
    """What a ball leaves at points, in metres."""
    return Samples(Reachable(concave_parts.mesh(name), R, 1e-4), 1e-3 * np.array(points)).gap - R


@pytest.mark.slow
def test_limit_at_the_foot_of_a_wall_is_that_of_the_ball_in_the_corner():
    """The centre in the corner is R from both; at a height h of the wall, or at h from it, it leaves the same."""
    away = np.array([0.0, 0.5, 1.5, 2.9, 4.0])
    corner = 1e3 * (np.hypot(np.maximum(R - 1e-3 * away, 0.0), R) - R)
    floor = limits("pocket_boss", [(7.0 + a, 10.0, 10.0) for a in away])
    wall = limits("pocket_boss", [(7.0, 10.0, 10.0 + a) for a in away])
    np.testing.assert_allclose(1e3 * floor, corner, atol=5e-3)
    np.testing.assert_allclose(1e3 * wall, corner, atol=5e-3)


def test_limit_in_a_gap_that_is_too_narrow_is_the_way_from_its_edges():
    (found,) = limits("ribs", [(26.5, 15.0, 14.0)])
    assert 1e3 * found == pytest.approx(1.0 + np.sqrt(9.0 - 6.25), abs=0.01)


@pytest.mark.slow
def test_limit_at_the_tip_of_a_pit_and_in_hollows_wider_and_narrower_than_the_ball():
    (tip,) = limits("inward_cone", [(0.0, 0.0, 6.0)])
    assert 1e3 * tip == pytest.approx(3.0 * (np.sqrt(2.0) - 1.0), abs=0.06)
    # A sphere of 9 mm is touched everywhere below its rim.
    angle = np.radians([0.0, 20.0, 45.0, 60.0])
    np.testing.assert_allclose(
        limits("bowl", np.stack([9.0 * np.sin(angle), 0.0 * angle, 15.0 - 9.0 * np.cos(angle)], 1)), 0.0, atol=6e-6
    )
    lowest = 1.0 - np.sqrt(0.5)  # where a fillet of 1 mm is at 45°
    (corner,) = limits("fillet_below_the_ball", [(20.0 + 1.5 * lowest, 15.0, 8.0 + 1.5 * lowest)])
    assert 1e3 * corner == pytest.approx(1.5 * (np.sqrt(2.0) - 1.0), abs=0.01)
    (fillet,) = limits("fillet_above_the_ball", [(20.0 + 6.0 * lowest, 15.0, 8.0 + 6.0 * lowest)])
    assert fillet == pytest.approx(0.0, abs=1e-5)


def path(*lines):
    """A toolpath of upright cuts along lines of centres (mm), a rapid between them."""
    parts, last = [], None
    for line in lines:
        tips = 1e-3 * np.array(line, dtype=float) - R * UP
        if last is not None:
            both = np.stack([last, tips[0]])
            parts.append(Segment(SegmentKind.RAPID, both, np.tile(UP, (2, 1)), np.inf))
        parts.append(Segment(SegmentKind.CUT, tips, np.tile(UP, (len(tips), 1)), 0.02))
        last = tips[-1]
    return Toolpath(tuple(parts), tilt_centre=R)


def test_excess_between_two_passes_on_a_plane_is_that_of_the_chord():
    """On the top of the block: passes 4 mm apart leave √(R² + 2²) − R in the middle, which is just what is allowed."""
    reachable = Reachable(concave_parts.mesh("pocket_boss"), R, 2e-4)
    samples = Samples(reachable, 1e-3 * np.array([(25.0, y, 20.0) for y in (37.0, 38.0, 39.0)]))
    found = left(samples, path([(10, 37, 23), (40, 37, 23)], [(10, 41, 23), (40, 41, 23)]), 4e-3)
    expected = np.hypot(3.0, [0.0, 1.0, 2.0]) - 3.0
    np.testing.assert_allclose(1e3 * found.excess, expected, atol=2e-3)
    assert 1e3 * found.allowed[0] == pytest.approx(expected[-1], abs=0.15)
    assert (found.lifts, found.passes, found.gouge) == (1, 2, pytest.approx(0.0, abs=1e-12))
    assert (found.cut, found.air) == (pytest.approx(0.06), pytest.approx(np.hypot(0.03, 0.004)))


def test_gouge_is_the_depth_below_the_surface_between_the_waypoints_too():
    """A chord over the pocket's edge: at its deepest the centre is 1 mm below where the ball touches."""
    part = concave_parts.mesh("pocket_boss")
    reachable = Reachable(part, R, 4e-4)
    samples = Samples(reachable, 1e-3 * np.array([(3.0, 20.0, 20.0)]))
    found = left(samples, path([(2, 20, 22), (6, 20, 22)]), 4e-3)
    assert found.gouge == pytest.approx(1e-3, abs=1e-9)
    points = np.random.default_rng(0).uniform([0.0, 0.0, 0.022], [0.05, 0.04, 0.03], (300, 3))
    over_top = (points[:, 0] < 7e-3) | (points[:, 1] < 6e-3)
    assert nearest_facet(part, points[over_top]) == pytest.approx((points[over_top, 2] - 0.02).min(), abs=1e-9)
