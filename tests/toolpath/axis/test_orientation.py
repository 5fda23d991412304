"""Tool axes: modes, lead and tilt, smoothing within its tolerance, rate limit, axis steps."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pentapod.base.errors import InputError
from pentapod.geometry import angle_between
from pentapod.toolpath import BallCutter, Mesh, RasterOptions, Segment, SegmentKind, StandOff, Toolpath, make_toolpath
from pentapod.toolpath.axis.modes import Between, Fixed, Normal, Pointed, with_lead_and_tilt
from pentapod.toolpath.axis.orientation import Orientation, oriented
from pentapod.toolpath.axis.smoothing import noise_tolerance, rate_limited, smoothed
from pentapod.toolpath.axis.steps import stepped
from toolpath_surfaces import grid


def grid_of_passes(noise=0.0, seed=0, passes=9, points=60):
    """Zigzag passes on a shallow dome, normals with noise: runs of contacts and normals."""
    rng, runs = np.random.default_rng(seed), []
    for k in range(passes):
        x = np.linspace(-0.03, 0.03, points) * (-1) ** k
        y = np.full(points, 2e-3 * k)
        contacts = np.stack([x, y, -(x**2 + y**2) / 0.2], 1)
        normals = np.stack([2 * x / 0.2, 2 * y / 0.2, np.ones(points)], 1) + noise * rng.normal(size=(points, 3))
        runs.append((contacts, normals / np.linalg.norm(normals, axis=1)[:, None]))
    return runs


def test_axis_modes_against_their_formulas():
    contacts, normals = grid_of_passes()[0]
    np.testing.assert_array_equal(Normal().axes(contacts, normals), normals)
    np.testing.assert_allclose(Fixed((0, 3, 4)).axes(contacts, normals), np.tile([0, 0.6, 0.8], (len(contacts), 1)))
    apex = np.array([0.0, 0.0, -0.2])
    axes = Pointed(apex).axes(contacts, normals)
    # Tip towards the apex: going on from the contact against the axis meets it.
    np.testing.assert_allclose(
        contacts - np.linalg.norm(contacts - apex, axis=1)[:, None] * axes, apex * np.ones((60, 1)), atol=1e-15
    )
    np.testing.assert_allclose(Pointed(apex, toward=False).axes(contacts, normals), -axes)
    line = Pointed(apex, along=(1, 0, 0)).axes(contacts, normals)
    np.testing.assert_allclose(line[:, 0], 0.0, atol=1e-15)
    np.testing.assert_allclose(np.cross(line, contacts - apex)[:, 0], 0.0, atol=1e-15)
    with pytest.raises(InputError, match="lies on the point"):
        Pointed(contacts[3]).axes(contacts, normals)


def test_between_is_exact_at_its_places_and_monotone_between():
    places = np.array([[-0.03, 0, 0], [0.03, 0, 0], [0, 0.02, 0]])
    directions = np.array([[-0.3, 0, 1], [0.3, 0, 1], [0, 0.4, 1.0]])
    mode = Between(places, directions)
    np.testing.assert_allclose(mode.axes(places, places), directions / np.linalg.norm(directions, axis=1)[:, None])
    x = np.linspace(-0.03, 0.03, 101)
    axes = Between(places[:2], directions[:2]).axes(np.stack([x, 0 * x, 0 * x], 1), np.zeros((101, 3)))
    assert (np.diff(axes[:, 0]) > 0).all()
    np.testing.assert_allclose(axes[50], [0, 0, 1], atol=1e-15)
    with pytest.raises(InputError, match="cancel"):
        Between(places[:2], np.array([[0, 0, 1.0], [0, 0, -1.0]])).axes(np.zeros((1, 3)), np.zeros((1, 3)))
    with pytest.raises(InputError, match="its place"):
        Between(places, directions[:2])


@given(lead=st.floats(-1.2, 1.2), tilt=st.floats(-1.2, 1.2), seed=st.integers(0, 999))
def test_lead_and_tilt_are_the_angles_seen_from_the_side_and_from_behind(lead, tilt, seed):
    rng = np.random.default_rng(seed)
    axis, feed = rng.normal(size=(2, 1, 3))
    axis /= np.linalg.norm(axis)
    found = with_lead_and_tilt(axis, feed, lead, tilt)[0]
    forwards = feed[0] - (feed[0] @ axis[0]) * axis[0]
    forwards /= np.linalg.norm(forwards)
    left = np.cross(axis[0], forwards)
    assert np.arctan2(found @ forwards, found @ axis[0]) == pytest.approx(lead, abs=1e-9)
    assert np.arctan2(found @ left, found @ axis[0]) == pytest.approx(tilt, abs=1e-9)
    assert np.linalg.norm(found) == pytest.approx(1.0)


def test_lead_and_tilt_keep_an_axis_along_its_feed():
    axis, feed = np.array([[0, 0, 1.0]]), np.array([[0, 0, 2.0]])
    np.testing.assert_allclose(with_lead_and_tilt(axis, feed, 0.3, 0.2), [[0, 0, 1.0]])


def test_smoothing_removes_noise_along_and_across_and_keeps_its_tolerance():
    noisy, clean = grid_of_passes(noise=0.02), grid_of_passes()
    tolerance = np.radians(6.0)
    axes = Orientation(smoothing=tolerance, reach=4e-3).axes(noisy)
    before = np.concatenate([angle_between(n, c) for (_, n), (_, c) in zip(noisy, clean, strict=True)])
    after = np.concatenate([angle_between(a, c) for a, (_, c) in zip(axes, clean, strict=True)])
    turned = np.concatenate([angle_between(a, n) for a, (_, n) in zip(axes, noisy, strict=True)])
    assert turned.max() <= tolerance * (1 + 1e-9)
    assert np.sqrt((after**2).mean()) < 0.6 * np.sqrt((before**2).mean())
    # Across: neighbours on the passes beside are nearer each other than before.
    across = [
        angle_between(path[k][:, :], path[k + 1][::-1]).mean()
        for path in ([n for _, n in noisy], axes)
        for k in range(len(noisy) - 1)
    ]
    assert np.mean(across[8:]) < 0.75 * np.mean(across[:8])


def test_smoothing_reaches_its_tolerance_at_a_crease_only():
    x = np.linspace(-0.02, 0.02, 81)
    points = np.stack([x, 0 * x, -np.abs(x)], 1)
    axes = np.stack([np.sign(x) * 0.3, 0 * x, np.ones(81)], 1)
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    found = smoothed(points, axes, 4e-3, np.radians(5.0))
    turned = angle_between(found, axes)
    assert turned.max() == pytest.approx(np.radians(5.0), rel=1e-6)
    # Away from the crease and the middle point nothing changes: two rounds of the reach do not get there.
    assert turned[np.abs(x) > 0.019].max() < np.radians(0.5)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000), degrees=st.floats(0.5, 20.0))
def test_rate_limit_holds_between_all_neighbours(seed, degrees):
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.uniform(0.2e-3, 2e-3, (50, 1)) * [1, 0.3, 0], axis=0)
    axes = (
        np.array([0, 0, 1.0])
        + rng.normal(size=(50, 3)) * rng.choice([0.05, 0.3])
        + np.array([0.5, 0, 0]) * (np.arange(50) > 25)[:, None]
    )
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    rate = np.radians(degrees) / 1e-3
    found = rate_limited(points, axes, rate)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert (angle_between(found[1:], found[:-1]) <= rate * steps * (1 + 1e-6)).all()
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1.0)
    np.testing.assert_array_equal(rate_limited(points, found, rate), found)


def test_rate_limit_leaves_slower_axes_unchanged():
    runs = grid_of_passes()
    axes = Orientation(rate=np.radians(5.0) / 1e-3).axes(runs)
    for found, (_, normals) in zip(axes, runs, strict=True):
        np.testing.assert_array_equal(found, normals)


@pytest.mark.parametrize("bad", [{"lead": 1.5}, {"tilt": -1.5}, {"smoothing": -0.1}, {"reach": 0.0}, {"rate": 0.0}])
def test_orientation_refuses_values_out_of_range(bad):
    with pytest.raises(InputError):
        Orientation(**bad)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10_000), tilt_centre=st.sampled_from([3e-3, 0.0, -5e-3]), degrees=st.floats(0.5, 30.0))
def test_axis_step_holds_and_the_tilt_centre_moves_straight(seed, tilt_centre, degrees):
    """Waypoints stay; inserted ones lie evenly on the straight path of the tilt centre."""
    rng = np.random.default_rng(seed)
    tips = np.cumsum(rng.normal(size=(9, 3)), axis=0) * 1e-3
    axes = rng.normal(size=(9, 3))
    axes[4] = -axes[3]
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    cut, rapid = (SegmentKind.CUT, 0.01), (SegmentKind.RAPID, np.inf)
    pieces = [(cut, slice(0, 5)), (rapid, slice(4, 9))]
    path = Toolpath(tuple(Segment(kind, tips[r], axes[r], feed) for (kind, feed), r in pieces), tilt_centre)
    step = np.radians(degrees)
    found = stepped(path, step)
    turns = angle_between(found.axes[1:], found.axes[:-1])
    assert turns.max() <= step * (1 + 1e-8)
    rows = [int(np.flatnonzero((found.tips == tip).all(axis=1))[0]) for tip in tips]
    np.testing.assert_array_equal(found.axes[rows], axes)
    for k, (a, b) in enumerate(pairwise(rows)):
        whole = float(angle_between(axes[k], axes[k + 1]))
        assert b - a == max(np.ceil(whole / step - 1e-9), 1)
        np.testing.assert_allclose(turns[a:b], whole / (b - a), atol=1e-7)
        straight = path.tilt_centres[k] + np.linspace(0, 1, b - a + 1)[:, None] * (
            path.tilt_centres[k + 1] - path.tilt_centres[k]
        )
        np.testing.assert_allclose(found.tilt_centres[a : b + 1], straight, atol=1e-15)
    assert stepped(found, step * (1 + 1e-6)) is found


def test_oriented_toolpath_keeps_its_contacts_and_segments():

    mesh = Mesh.of(*grid(lambda x, y: -(x**2 + y**2) / 0.2, width=0.05, cells=20))
    for tool in (BallCutter(3e-3), StandOff(5e-3)):
        path = make_toolpath(mesh, tool, RasterOptions(stepover=0.01))
        assert oriented(path, tool, Orientation()) is path
        turned = oriented(path, tool, Orientation(Fixed((0.1, 0, 1))))
        np.testing.assert_allclose(turned.axes, np.tile([0.1, 0, 1], (len(path), 1)) / np.hypot(0.1, 1), atol=1e-12)
        cut = np.concatenate([[s.kind == "cut"] * (len(s.tips) - 1) for s in path.segments] + [[False]])
        np.testing.assert_allclose(turned.tilt_centres[cut], path.tilt_centres[cut], atol=1e-15)
        led_path = oriented(path, tool, Orientation(lead=np.radians(10)))
        leads = angle_between(led_path.axes, path.axes)[cut]
        np.testing.assert_allclose(np.sort(leads)[len(leads) // 10 :], np.radians(10), atol=1e-9)
        assert [s.kind for s in led_path.segments] == [s.kind for s in path.segments]


def scan(noise_deg: float, shape: str = "wave", stepover: float = 4e-3, spacing: float = 0.4e-3):
    """Passes over a surface, with normals that have normal noise on either direction across, degrees."""
    rng = np.random.default_rng(5)
    x = np.arange(-0.03, 0.03, spacing)
    runs = []
    for y in np.arange(-0.03, 0.03, stepover):
        slope = {
            "wave": 0.4 * np.cos(2.0 * np.pi * x / 0.03),
            "roof": np.sign(np.sin(2.0 * np.pi * x / 0.013)) * 0.5,
            "flat": 0.0 * x,
            "arc": x / 0.035,
        }[shape]
        points = np.stack([x, np.full_like(x, y), np.cumsum(slope) * spacing], axis=1)
        normals = np.stack([-slope, 0.3 * y / 0.03 + 0.0 * x, np.ones_like(x)], axis=1)
        normals[:, :2] += np.tan(np.radians(noise_deg)) * rng.normal(size=(len(x), 2))
        runs.append((points, normals / np.linalg.norm(normals, axis=1)[:, None]))
    return runs


@pytest.mark.parametrize("shape", ["wave", "roof", "flat", "arc"])
def test_clean_axes_are_not_smoothed_by_default(shape):
    runs = scan(0.0, shape)
    for reach in (7.5e-3, 12e-3):
        for found, (_, normals) in zip(Orientation(reach=reach).axes(runs), runs, strict=True):
            np.testing.assert_array_equal(found, normals)


@pytest.mark.parametrize(("shape", "noise"), [("wave", 4.0), ("flat", 1.0), ("flat", 4.0), ("arc", 1.0), ("arc", 4.0)])
def test_noise_of_a_scan_is_measured_and_smoothed_by_default(shape, noise):
    runs, clean = scan(noise, shape), scan(0.0, shape)
    starts = np.cumsum([0, *(len(points) for points, _ in runs)])
    points, normals = (np.concatenate([run[k] for run in runs]) for k in range(2))
    assert np.degrees(noise_tolerance(points, normals, starts, 12e-3)) == pytest.approx(12.0 * noise, rel=0.3)
    axes = Orientation(reach=12e-3).axes(runs)
    turn = [np.degrees(angle_between(each[1:], each[:-1])).max() for each in (axes[7], runs[7][1], clean[7][1])]
    assert turn[0] < 0.2 * turn[1] + turn[2]


def test_axes_of_a_ball_in_grooves_go_on_where_its_contact_jumps():
    rng, radius = np.random.default_rng(1), 3e-3
    centres = np.repeat(np.stack([np.linspace(0.0, 0.06, 150), np.zeros(150), np.zeros(150)], axis=1), 2, axis=0)
    lean = np.radians(15.0) * (-1.0) ** np.arange(300) + np.radians(2.0) * rng.normal(size=300)
    normals = np.stack([np.sin(lean), np.zeros(300), np.cos(lean)], axis=1)
    runs = [(centres - radius * normals, normals)]
    jumps = []
    for known in (0.0, radius):
        (axes,) = Orientation(smoothing=np.radians(40.0)).axes(runs, known)
        jumps.append(float(np.degrees(angle_between(axes[::2], axes[1::2])).max()))
    assert jumps[0] > 0.2
    assert jumps[1] < 0.02


@pytest.mark.parametrize("stepover", [2.5e-3, 0.5e-3])
def test_smoothed_axes_turn_as_evenly_where_passes_are_dense(stepover):
    rng, xs = np.random.default_rng(3), np.arange(0.0, 20e-3, 0.3e-3)
    x, y = (each.ravel() for each in np.meshgrid(xs, np.arange(0.0, 20e-3, stepover)))
    waves = rng.uniform(-1.5e3, 1.5e3, (60, 2)) @ np.stack([x, y]) + rng.uniform(0.0, 6.0, (60, 1))
    leans = 0.1 * np.stack([np.sin(waves[::2]).sum(axis=0), np.sin(waves[1::2]).sum(axis=0)]) / np.sqrt(15.0)
    axes = np.stack([*leans, np.ones_like(x)], axis=1)
    axes = axes / np.linalg.norm(axes, axis=1, keepdims=True)
    found = smoothed(np.stack([x, y, 0.0 * x], axis=1), axes, 7.5e-3, np.radians(40.0)).reshape(-1, len(xs), 3)
    bends = np.linalg.norm(np.diff(found, 2, axis=1), axis=2)
    assert float(np.degrees(bends.max())) < 0.04


def test_the_axis_is_at_rest_at_both_ends_of_a_link():
    share = np.linspace(0.0, 1.0, 101)
    way = np.stack([0.1 * share, 0.0 * share, 0.0 * share], axis=1)
    kinds, up = (SegmentKind.CUT, SegmentKind.LINK, SegmentKind.CUT), np.tile([0.0, 0.0, 1.0], (101, 1))
    segments = [Segment(kind, way + np.array([0.1 * k, 0.0, 0.0]), up, 0.02) for k, kind in enumerate(kinds)]
    found = oriented(
        Toolpath(tuple(segments), 3e-3), BallCutter(3e-3), Orientation(Pointed(np.array([0.15, 0.0, -0.1])))
    )
    steps = angle_between(found.axes[101:200], found.axes[100:199])
    assert float(steps[[0, -1]].max()) < 0.02 * float(steps.max())
    assert float(steps.sum()) == pytest.approx(float(angle_between(found.axes[100], found.axes[199])), rel=1e-3)
