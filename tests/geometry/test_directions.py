"""Angles keep their digits at 0 and π; tangent frames are right-handed everywhere."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from pentapod.base.errors import ArrayError
from pentapod.geometry import angle_between, arc_weights, normalised, partway, tangent_frame
from pentapod.geometry.directions import fastest_turn, turned

numbers = st.floats(-1.0, 1.0, allow_subnormal=False)


@given(st.tuples(numbers, numbers, numbers), st.floats(1e-6, 1e6))
def test_normalised_has_unit_length_whatever_the_scale(v: tuple, factor: float) -> None:
    assume(np.linalg.norm(v) > 1e-3)
    assert abs(np.linalg.norm(normalised(v)) - 1.0) < 4e-16
    np.testing.assert_allclose(normalised(np.multiply(factor, v)), normalised(v), atol=4e-16)


def test_normalised_refuses_a_zero_vector() -> None:
    with pytest.raises(ArrayError, match="axis has zero length"):
        normalised([[0.0, 0.0, 1.0], [0.0, 0.0, 0.0]], "axis")


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-8, 1e-3, 1.0, np.pi / 2, 3.0])
def test_angle_between_a_vector_and_its_rotation(angle: float) -> None:
    rng = np.random.default_rng(1)
    a = normalised(rng.normal(size=(50, 3)))
    t1, _ = tangent_frame(a)
    np.testing.assert_allclose(angle_between(a, np.cos(angle) * a + np.sin(angle) * t1), angle, rtol=0, atol=1e-15)
    np.testing.assert_allclose(angle_between(a, -(np.cos(angle) * a + np.sin(angle) * t1)), np.pi - angle, atol=1e-15)


def test_partway_divides_the_turn_evenly_even_between_opposites() -> None:
    rng = np.random.default_rng(2)
    a = normalised(rng.normal(size=(60, 3)))
    b = normalised(rng.normal(size=(60, 3)))
    b[:20], b[20:30], b[30:40] = -a[:20], a[20:30], normalised(1e-9 * b[30:40] - a[30:40])
    share = rng.uniform(0, 1, 60)
    found = partway(a, b, share)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1.0, atol=1e-15)
    np.testing.assert_allclose(angle_between(a, found), share * angle_between(a, b), atol=1e-8)
    np.testing.assert_allclose(angle_between(found, b), (1 - share) * angle_between(a, b), atol=1e-8)


def test_arc_weights_match_partway() -> None:
    rng = np.random.default_rng(4)
    a, share = normalised(rng.normal(size=(40, 3))), rng.uniform(0, 1, 40)
    angle = np.concatenate([[0.0, 1e-12, 1e-8, 1e-3], rng.uniform(0.0, 3.0, 36)])[:, None]
    b = np.cos(angle) * a + np.sin(angle) * tangent_frame(a)[0]
    first, second = arc_weights(angle[:, 0], share)
    np.testing.assert_allclose(first[:, None] * a + second[:, None] * b, partway(a, b, share), atol=1e-15)
    opposite = arc_weights(np.array([np.pi]), np.array([0.25]))
    np.testing.assert_allclose(np.concatenate(opposite), [0.75, 0.25], atol=1e-6)


def test_angle_between_keeps_the_digits_of_small_angles() -> None:
    exact = 1e-9 * (1.0 - 1e-18 / 3.0)  # the arc tangent's series
    assert abs(angle_between([0.0, 0.0, 1.0], [1e-9, 0.0, 1.0]) / exact - 1.0) < 1e-15


@given(st.floats(0.0, 2 * np.pi), st.floats(0.0, np.pi))
def test_tangent_frames_are_right_handed_and_orthonormal(longitude: float, polar: float) -> None:
    d = np.array([np.sin(polar) * np.cos(longitude), np.sin(polar) * np.sin(longitude), np.cos(polar)])
    frame = np.stack([*tangent_frame(d), d])
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(frame) > 0.0


@pytest.mark.parametrize("pole", [1.0, -1.0])
def test_tangent_frames_are_smooth_through_each_pole(pole: float) -> None:
    at_pole = np.stack(tangent_frame([0.0, 0.0, pole]))
    for turn in np.linspace(0.0, 2 * np.pi, 16):
        near = Rotation.from_rotvec(1e-6 * np.array([np.cos(turn), np.sin(turn), 0.0])).apply([0.0, 0.0, pole])
        assert np.abs(np.stack(tangent_frame(near)) - at_pole).max() < 2e-6


def test_tangent_frame_in_the_upper_half_is_transported_along_the_great_circle() -> None:
    rng = np.random.default_rng(2)
    d = normalised(np.abs(rng.normal(size=(20, 3))))
    turns = np.cross([0.0, 0.0, 1.0], d)
    turns *= (np.arccos(d[:, 2]) / np.linalg.norm(turns, axis=1))[:, None]
    carried = Rotation.from_rotvec(turns)
    t1, t2 = tangent_frame(d)
    np.testing.assert_allclose(t1, carried.apply([1.0, 0.0, 0.0]), atol=1e-14)
    np.testing.assert_allclose(t2, carried.apply([0.0, 1.0, 0.0]), atol=1e-14)


@pytest.mark.parametrize("apart_deg", [0.0, 40.0, 171.0, 171.9, 172.0, 175.0, 179.9, 180.0])
def test_no_turn_is_faster_than_its_bound(apart_deg: float) -> None:
    """Nearly opposite directions are joined by a way that is longer than the arc between them."""
    rng, by, share = np.random.default_rng(7), np.array([0.0, 0.0, 1.0]), np.linspace(0.0, 1.0, 2001)
    for start in (by, -by, *normalised(rng.normal(size=(40, 3)))):
        beside = normalised(np.cross(start, rng.normal(size=3)))
        end = np.cos(np.radians(apart_deg)) * start + np.sin(np.radians(apart_deg)) * beside
        way = turned(start, end, share, by)
        fastest = 2000.0 * float(angle_between(way[1:], way[:-1]).max())
        assert fastest <= fastest_turn(start, end) + 1e-6
        assert fastest_turn(start, end) <= 1.15 * float(angle_between(start, end)) + 1e-12
