"""Measures: a tool that is where it should be, and one that is off by a known way."""

import numpy as np
import pytest

from pentapod.simulate import Played, Reference, Tracking
from short_motion import motion, placed


@pytest.fixture(scope="module")
def reference():
    return Reference(*motion(1.2))


def tracking(reference, move=(0.0, 0.0, 0.0), turn=0.0):
    """The motion itself, moved by some metres and turned by a small angle about the machine's x axis."""
    i = reference.directions[::2]
    c, s = np.cos(turn), np.sin(turn)
    i = i @ np.array([[1, 0, 0], [0, c, s], [0, -s, c]])
    legs = reference.program.legs
    played = Played(legs, reference.tips[::2] + np.array(move), i, np.zeros_like(legs))
    home = reference.program.placement.inverse()
    return Tracking(played, reference, placed().transformed(home), 5e-5)


def by_name(tracking):
    return {measure.name: measure for measure in tracking.measures}


def test_tracking_errors_of_an_exact_motion_are_zero(reference):
    exact = by_name(tracking(reference))
    for name in ("contour error", "tip error", "leg error"):
        assert exact[name].largest < 1e-12
    assert exact["axis error"].largest < 1e-12
    # The toolpath is 40 chords of the motion.
    assert 0.05 < exact["toolpath deviation"].largest < 1.0


def test_tracking_errors_of_a_shift_are_its_length(reference):
    """Along the path it is lag; across it, contour error; never more than the shift."""
    exact, moved = by_name(tracking(reference)), by_name(tracking(reference, move=(0.0, 0.0, 1e-4)))
    assert moved["tip error"].values == pytest.approx(np.full(len(reference.program.legs), 0.1))
    assert moved["contour error"].values.max() <= 0.1 + 1e-12
    assert moved["contour error"].largest > 0.09
    change = moved["toolpath deviation"].largest - exact["toolpath deviation"].largest
    assert 0.0 < abs(change) <= 0.1


def test_tracking_errors_of_a_rotation_are_its_angle(reference):
    twist = by_name(tracking(reference, turn=1e-3))["axis error"]
    lean = reference.directions[::2]
    about_x = np.hypot(lean[:, 1], lean[:, 2])  # what lies along the axis of turning does not move
    assert twist.values == pytest.approx(np.degrees(1e-3) * about_x, rel=1e-6)
    assert twist.key == "axis_error_deg"


def test_tracking_separates_cuts_from_rapids(reference):
    t = tracking(reference)
    # `placed` is a rapid, then a cut; the motion is slow at both ends and never stops between.
    assert not t.cutting[0]
    assert t.cutting[-1]
    assert np.abs(np.diff(t.cutting.astype(int))).sum() == 1
    said = t.to_dict()["contour_error_mm"]
    assert set(said) == {"largest", "rms", "time_s", "largest_on_cuts"}
    assert len(t.lines()) == len(t.measures)
