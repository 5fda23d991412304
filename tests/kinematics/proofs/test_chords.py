"""Chords: no moment leaves what is proven, near what another proof finds; nothing is proven across a singularity."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BPoly

from pentapod.base.errors import ArrayError
from pentapod.kinematics import AsBuiltPentapod, Component, LinearPentapod, prove_chords, prove_tip_tube
from pentapod.kinematics.krawczyk.krawczyk_kernels import angle_within

BASE = np.array([[-0.552, -0.229], [-0.312, 0.510], [0.155, 0.577], [0.429, -0.417], [-0.078, -0.563]])
ROBOT = LinearPentapod.quadratic(BASE, 0.2125)
POSE = np.array([0.08, 0.01, 0.45, 0.1, -0.15])
OFFSETS = np.array([0.0, 0.19])
BASE_AXES = np.tile([0.0, 0.0, 1.0], (5, 1))


def direction(u, v, sign=1.0):
    return np.stack([u, v, sign * np.sqrt(1.0 - u**2 - v**2)], axis=-1)


def motions(seed, count, degree, step=1e-3):
    """Bernstein coefficients (count, 5, degree + 1) of legs near poses that step by `step` and bend as much."""
    random = np.random.default_rng(seed)
    pose = POSE + 0.1 * random.uniform(-1, 1, (count, 1, 5))
    pose = pose + step * random.uniform(-1, 1, (count, degree + 1, 5))
    i = direction(pose[..., 3], pose[..., 4])
    component = Component.parse("++")
    assert (ROBOT.branch(pose[..., :3], i) == component).all()
    return ROBOT.leg_lengths(pose[..., :3], i).swapaxes(1, 2), component


def prove(legs, component, **options):
    start, end = ROBOT.pose(legs[..., 0], component), ROBOT.pose(legs[..., -1], component)
    return prove_chords(ROBOT, legs, start, end, component, offsets=OFFSETS, base_axes=BASE_AXES, **options)


def along(legs, component, times):
    """Points (T, H, A, 3), directions and leg vectors of the motion at these times; legs by scipy."""
    lengths = np.array([[BPoly(c[:, None], [0.0, 1.0])(times) for c in interval] for interval in legs])
    position, i = ROBOT.pose(np.moveaxis(lengths, -1, 0), component)
    return position[:, :, None] + OFFSETS[:, None] * i[:, :, None], i, ROBOT.leg_vectors(position, i)


def largest_angle(a, b):
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(axis=-1)).max(axis=0)


@pytest.mark.parametrize("degree", [1, 2, 3])
@pytest.mark.parametrize("step", [1e-5, 1e-3, 3e-2])
def test_no_moment_leaves_the_bounds(degree, step):
    legs, component = motions(degree, 40, degree, step)
    found = prove(legs, component)
    assert found.proven.all()
    times = np.linspace(0.0, 1.0, 41)
    points, i, vectors = along(legs, component, times)
    share = times[:, None, None]
    chord = points[0] * (1.0 - share[..., None]) + points[-1] * share[..., None]
    off = np.linalg.norm(points - chord, axis=-1).max(axis=0)
    assert (off <= found.deviations).all()
    # The middle coefficient of a quadratic that vanishes at both ends is twice its largest value.
    assert (found.deviations <= 3.2 * off + 1e-11 + step**2).all()
    turned = largest_angle(i, i[0] * (1.0 - share) + i[-1] * share)
    assert (turned <= found.angles).all()
    speeds = (np.linalg.norm(np.diff(points, axis=0), axis=-1) * 40.0).max(axis=0)
    assert (speeds <= found.speeds).all()
    assert (found.speeds <= 1.6 * speeds + 1e-9).all()
    lengths = np.linalg.norm(vectors, axis=-1)
    base = vectors[..., 2] / lengths
    platform = np.einsum("thjk,thk->thj", vectors, i) / lengths
    assert (found.base_cosines <= base.min(axis=0)).all()
    assert (found.base_cosines >= base.min(axis=0) - 6.0 * step - 1e-10).all()
    assert (found.platform_cosines[..., 0] <= platform.min(axis=0)).all()
    assert (found.platform_cosines[..., 1] >= platform.max(axis=0)).all()
    assert (found.platform_cosines[..., 1] <= platform.max(axis=0) + 6.0 * step + 1e-10).all()


def test_speed_of_legs_on_rings_is_bounded_to_a_thousandth():
    """Straight ways of up to 1 mm."""
    machine = AsBuiltPentapod.of(ROBOT, radii=[0.03, 0.01, 0.02, 0.025, 0.03], base_errors=2e-4, zeros=3e-4)
    random = np.random.default_rng(5)
    pose = POSE + 0.1 * random.uniform(-1, 1, (40, 1, 5))
    pose = pose + 1e-3 * random.uniform(-1, 1, (40, 1, 5)) * np.linspace(0.0, 1.0, 4)[:, None]
    readings = machine.leg_lengths(pose[..., :3], direction(pose[..., 3], pose[..., 4]))
    t, m = np.linspace(0.0, 1.0, 4)[:, None], np.arange(4)
    bernstein = np.array([1.0, 3.0, 3.0, 1.0]) * t**m * (1.0 - t) ** (3 - m)
    legs, component = np.einsum("mk,hkj->hjm", np.linalg.inv(bernstein), readings), Component.parse("++")
    start, end = (machine.pose(legs[..., k], component) for k in (0, -1))
    found = prove_chords(machine, legs, start, end, component, offsets=OFFSETS, base_axes=BASE_AXES)
    assert found.proven.all()
    points = [p[:, None] + OFFSETS[:, None] * i[:, None] for p, i in (start, end)]
    mean = np.linalg.norm(points[1] - points[0], axis=-1)
    assert (mean <= found.speeds + 1e-9).all()
    assert (found.speeds <= 1.001 * mean + 1e-9).all()


@pytest.mark.parametrize("degree", [1, 3])
def test_agrees_with_the_tube_of_ball_arithmetic(degree):
    """The other proof takes polynomials through the motion; its distance from the same chord is as large."""
    legs, component = motions(7, 30, degree, 3e-3)
    found = prove(legs, component)
    (p0, i0), (p1, i1) = ROBOT.pose(legs[..., 0], component), ROBOT.pose(legs[..., -1], component)
    chord = np.stack([p0 + OFFSETS[1] * i0, p1 + OFFSETS[1] * i1], axis=-1)
    tube = prove_tip_tube(ROBOT, legs, component).tip_deviation(chord, OFFSETS[1])
    assert (found.deviations[:, 1] >= 0.9 * tube).all()
    assert (found.deviations[:, 1] <= 3.2 * tube + 1e-10).all()


def test_wrong_end_poses_are_told():
    """Whatever poses it is given, the bounds hold of the chord between them."""
    legs, component = motions(3, 20, 3, 1e-4)
    (p0, i0), end = ROBOT.pose(legs[..., 0], component), ROBOT.pose(legs[..., -1], component)
    shifted = p0 + np.array([0.0, 0.0, 1e-4])
    found = prove_chords(ROBOT, legs, (shifted, i0), end, component, offsets=OFFSETS, base_axes=BASE_AXES, depth=0)
    assert found.proven.all()
    assert (found.deviations >= 1e-4 - 1e-9).all()


def test_another_component_is_not_proven():
    legs, component = motions(3, 20, 3, 1e-4)
    start, end = ROBOT.pose(legs[..., 0], component), ROBOT.pose(legs[..., -1], component)
    for name in ("+-", "-+", "--"):
        other = Component.parse(name)
        found = prove_chords(ROBOT, legs, start, end, other, offsets=OFFSETS, base_axes=BASE_AXES, depth=0)
        assert not found.proven.any()


@pytest.mark.parametrize("through", [0, 2])
def test_nothing_is_proven_through_a_singularity(through):
    """From a pose and back to it, by way of legs that have no pose: through w = 0, or through S = 0."""
    legs = ROBOT.leg_lengths([0.08, 0.01, 0.45], direction(0.1, -0.15))
    beyond = ROBOT.leg_lengths([0.08, 0.01, 0.45], direction(0.1, -0.15))
    beyond[through] *= 0.3
    there = 2.0 * beyond - legs
    motion = np.stack([legs, there, legs], axis=-1)[None]
    assert np.isnan(ROBOT.pose(beyond, (1, 1))[0]).any()
    assert not prove(motion, Component.parse("++")).proven.any()


def test_near_a_singularity_halving_helps():
    """A long way beside w = 0: too much for one chord, and enough of them prove it."""
    u = np.linspace(-0.25, 0.25, 4)
    i = np.stack([u, np.sqrt(1.0 - u**2 - 0.2**2), np.full(4, 0.2)], axis=-1)
    legs = ROBOT.leg_lengths(np.tile([0.08, 0.01, 0.45], (4, 1)), i).T[None]
    component = Component.parse("++")
    assert not prove(legs, component, depth=0).proven.any()
    found = prove(legs, component, depth=10)
    assert found.proven.all()
    times = np.linspace(0.0, 1.0, 201)
    points, i, _ = along(legs, component, times)
    share = times[:, None, None, None]
    off = np.linalg.norm(points - points[0] * (1.0 - share) - points[-1] * share, axis=-1).max(axis=0)
    assert (off <= found.deviations).all()
    assert (found.deviations <= 1.5 * off).all()
    assert (np.linalg.norm(np.diff(points, axis=0), axis=-1) * 200.0 <= found.speeds).all()
    share = share[..., 0]
    assert (largest_angle(i, i[0] * (1.0 - share) + i[-1] * share) <= found.angles).all()


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1), st.sampled_from([1, 3]), st.floats(1e-6, 1e-2))
def test_a_chord_is_no_worse_than_its_halves_say(seed, degree, step):
    """Cut in two by hand, the halves prove no larger speed, and no larger angles."""
    legs, component = motions(seed, 3, degree, step)
    whole = prove(legs, component)
    from pentapod.numerics.bernstein import split

    for half in split(legs):
        part = prove(half, component)
        # Half the chord is known more closely, up to what is of second order in it.
        assert (2.0 * part.speeds <= whole.speeds * (1.0 + step) + 1e-9).all()
        assert (part.base_cosines >= whole.base_cosines - step**2 - 1e-9).all()


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"offsets": [[0.1]]}, "offsets"),
        ({"base_axes": np.zeros((4, 3))}, "base_axes"),
        ({"depth": -1}, "depth"),
        ({"component": (1, 0)}, "component"),
        ({"leg_coefficients": np.ones((2, 5, 1))}, "leg_coefficients"),
        ({"start": (np.zeros((3, 3)), np.zeros((3, 3)))}, "start"),
    ],
)
def test_bad_input(change, key):
    legs, component = motions(3, 2, 3)
    pose = ROBOT.pose(legs[..., 0], component)
    given_ = {
        "leg_coefficients": legs,
        "start": pose,
        "end": pose,
        "component": component,
        "offsets": OFFSETS,
        "base_axes": BASE_AXES,
        **change,
    }
    with pytest.raises(ArrayError, match=key):
        prove_chords(ROBOT, **given_)


def test_no_pose_no_proof():
    legs = np.full((1, 5, 2), 0.02)
    nowhere = np.full((1, 3), np.nan)
    found = prove_chords(
        ROBOT, legs, (nowhere, nowhere), (nowhere, nowhere), (1, 1), offsets=OFFSETS, base_axes=BASE_AXES
    )
    assert not found.proven[0]
    assert np.isinf(found.deviations).all()
    assert np.isinf(found.speeds).all()
    assert (found.base_cosines == -1.0).all()
    assert (found.platform_cosines == [-1.0, 1.0]).all()


def test_directions_may_turn_by_more_than_a_right_angle_when_little_is_known() -> None:
    """Between a unit vector and any vector at a distance; from a distance of 1 on, every angle occurs."""
    rng = np.random.default_rng(9)
    for distance in (1e-9, 0.1, 0.7, 0.999, 1.0, 1.0001, 1.5):
        offsets = rng.normal(size=(3000, 3))
        offsets *= distance / np.linalg.norm(offsets, axis=1)[:, None]
        offsets[0] = (0.0, 0.0, -distance)
        other = np.array([0.0, 0.0, 1.0]) + offsets
        lengths = np.linalg.norm(other, axis=1)
        angles = np.arccos(np.clip(other[lengths > 0.0, 2] / lengths[lengths > 0.0], -1.0, 1.0))
        assert angles.max() <= angle_within(distance) + 2e-8
    assert angle_within(0.5) == pytest.approx(np.arcsin(0.5), rel=1e-12)
