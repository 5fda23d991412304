"""Rapids between passes: how far the axis turns from one waypoint to the next."""

from __future__ import annotations

import numpy as np
import pytest

from pentapod.geometry import angle_between
from pentapod.geometry.directions import normalised
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
