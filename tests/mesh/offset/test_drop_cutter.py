"""Drop cutter against closed forms and against OpenCAMLib."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import concave_parts
from pentapod import Mesh
from pentapod.mesh.offset.drop_cutter import drop_cutter
from pentapod.mesh.query.tree import FacetTree

R = 3e-3


def dropped(part, places):
    return drop_cutter(FacetTree.of(part), np.asarray(places, dtype=float), R)


def test_drop_cutter_rests_on_a_facet_an_edge_and_a_vertex():
    part = Mesh.of([(0.0, 0.0, 0.0), (0.02, 0.0, 0.0), (0.0, 0.02, 0.0)], [(0, 1, 2)])
    aside = 2e-3
    places = [(5e-3, 5e-3), (5e-3, -aside), (-aside, -1e-3), (-R - 1e-6, 0.01)]
    lower = np.sqrt([R**2 - aside**2, R**2 - aside**2 - 1e-6])
    np.testing.assert_allclose(dropped(part, places), [R, *lower, -np.inf], atol=1e-15)


def test_drop_cutter_in_a_v_groove_rests_on_both_sides():
    """The groove of 90° rises by a tenth along y; the ball touches planes with the slopes ±1 and 1/10."""
    y = np.array([8e-3, 12e-3, 17e-3])
    found = dropped(concave_parts.mesh("valley"), np.stack([np.full(3, 20e-3), y], axis=1))
    np.testing.assert_allclose(found, 6e-3 + 0.1 * y + R * np.sqrt(2.0 + 0.1**2), atol=1e-12)


def test_drop_cutter_stops_above_a_gap_that_is_too_narrow():
    """Between two ribs 5 mm apart the ball rests on their edges."""
    found = dropped(concave_parts.mesh("ribs"), [(26.5e-3, 15e-3), (16e-3, 15e-3)])
    np.testing.assert_allclose(found, [18e-3 + np.sqrt(R**2 - 2.5e-3**2), 10e-3 + R], atol=1e-12)


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**31), count=st.integers(1, 40))
def test_drop_cutter_matches_opencamlib_on_any_soup(seed, count):
    ocl = pytest.importorskip("opencamlib", reason="opencamlib has no wheel for this Python")
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-20.0, 20.0, (count, 1, 3)) + rng.uniform(-8.0, 8.0, (count, 3, 3))
    places = rng.uniform(-25.0, 25.0, (50, 2))
    surface, cutter, drop = ocl.STLSurf(), ocl.BallCutter(2e3 * R, 50.0), ocl.BatchDropCutter()
    for facet in corners:
        surface.addTriangle(ocl.Triangle(*(ocl.Point(*map(float, corner)) for corner in facet)))
    drop.setSTL(surface)
    drop.setCutter(cutter)
    for x, y in places:
        drop.appendPoint(ocl.CLPoint(float(x), float(y), -100.0))
    drop.run()
    theirs = np.array([point.z for point in drop.getCLPoints()])
    ours = dropped(Mesh.of(1e-3 * corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)), 1e-3 * places)
    np.testing.assert_allclose(np.maximum(1e3 * (ours - R), -100.0), theirs, atol=1e-6)
