"""Rapids between passes: how far the axis turns from one waypoint to the next, and where there are none."""

from __future__ import annotations

import numpy as np
import pytest

import toolpath_surfaces as surfaces
from pentapod.geometry import angle_between
from pentapod.geometry.directions import normalised
from pentapod.toolpath import CurveOptions, Mesh, SegmentKind, StandOff, make_toolpath
from pentapod.toolpath.linking.links import LinkStyle, rapid

VIEW = np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize("apart_deg", [40.0, 171.0, 172.0, 175.0, 179.9, 180.0])
def test_no_step_of_a_rapid_turns_the_axis_further_than_asked(apart_deg):
    """Nearly opposite axes turn by way of the view, which is longer than the arc between them."""
    style, rng = LinkStyle(VIEW, 0.02, 3e-3, 2e-3, 0.05), np.random.default_rng(6)
    for first in (VIEW, *normalised(rng.normal(size=(40, 3)))):
        beside = normalised(np.cross(first, rng.normal(size=3)))
        last = np.cos(np.radians(apart_deg)) * first + np.sin(np.radians(apart_deg)) * beside
        start, end = ((0.02 * rng.normal(size=3) * [1.0, 1.0, 0.2], axis, axis) for axis in (first, last))
        axes = rapid(start, end, style).axes
        assert angle_between(axes[1:], axes[:-1]).max() <= style.axis_step * (1.0 + 1e-6)


@pytest.mark.parametrize(("gap", "kinds"), [(11.9e-3, {"link"}), (12.1e-3, {"link", "rapid"})])
def test_a_tool_that_stands_off_crosses_a_gap_over_the_surface_where_a_lift_is_slower(gap, kinds):
    """Two lines on a wavy sheet; a lift is two approaches of 3 mm, and stops at their corners."""
    mesh = Mesh.of(*surfaces.grid(lambda x, y: 1e-3 * np.sin(50 * x) * np.cos(40 * y)))
    lines = [np.array([[side * gap / 2, 0.0], [side * 2e-2, 0.0]]) for side in (-1, 1)]
    lines[0] = lines[0][::-1]
    toolpath = make_toolpath(mesh, StandOff(5e-3), CurveOptions(lines=lines, position=(0.0, 0.0, 0.0), in_order=True))
    cuts = [k for k, s in enumerate(toolpath.segments) if s.kind is SegmentKind.CUT]
    between = toolpath.segments[cuts[0] + 1 : cuts[1]]
    assert {s.kind.value for s in between} == kinds
    if len(kinds) == 1:
        points = np.concatenate([s.tips - 5e-3 * s.axes for s in between])
        assert surfaces.surface_distance(mesh, points).max() < 1e-6
