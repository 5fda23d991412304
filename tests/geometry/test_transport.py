"""Rotation-minimising frames: laws of parallel transport, and holonomy of a closed curve against its area."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pentapod.geometry.directions import rotation_minimising_frames


def circle(angle, count=4001):
    turn = np.linspace(0.0, 2.0 * np.pi, count)
    ring = np.full(count, np.cos(angle))
    return np.stack([np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), ring], axis=1)


def walk(seed, step):
    rng = np.random.default_rng(seed)
    d = np.cumsum(rng.normal(scale=step, size=(300, 3)), axis=0) + rng.normal(size=3)
    return d / np.linalg.norm(d, axis=1, keepdims=True)


@given(st.integers(0, 10_000), st.sampled_from([1e-3, 0.05, 0.5]))
def test_transported_pairs_are_right_handed_frames(seed, step):
    d = walk(seed, step)
    pairs = rotation_minimising_frames(d)
    whole = np.concatenate([pairs, d[:, None]], axis=1)
    np.testing.assert_allclose(whole @ whole.transpose(0, 2, 1), np.broadcast_to(np.eye(3), whole.shape), atol=1e-9)
    assert (np.linalg.det(whole) > 0.0).all()


@given(st.integers(0, 10_000), st.sampled_from([1e-3, 0.05]))
def test_transported_pair_turns_no_more_than_its_direction(seed, step):
    """What carries each pair to the next is the smallest rotation: about an axis across both directions."""
    d = walk(seed, step)
    frames = np.concatenate([rotation_minimising_frames(d), d[:, None]], axis=1)
    rotation = frames[1:].transpose(0, 2, 1) @ frames[:-1]
    angle = np.arccos(np.clip((np.trace(rotation, axis1=1, axis2=2) - 1.0) / 2.0, -1.0, 1.0))
    between = np.arctan2(np.linalg.norm(np.cross(d[:-1], d[1:]), axis=1), (d[:-1] * d[1:]).sum(axis=1))
    np.testing.assert_allclose(angle, between, atol=2e-7)


@pytest.mark.parametrize("angle", [0.3, np.pi / 2, 2.0, 3.0])
def test_transport_along_a_closed_curve_turns_by_the_enclosed_area(angle):
    """Gauss and Bonnet: around a cone of half angle α the pair turns by 2π (1 − cos α)."""
    pairs = rotation_minimising_frames(circle(angle))
    cosine, sine = (pairs[-1, 0] * pairs[0, 0]).sum(), (pairs[-1, 0] * pairs[0, 1]).sum()
    area = 2.0 * np.pi * (1.0 - np.cos(angle))
    assert np.exp(1j * np.arctan2(sine, cosine)) == pytest.approx(np.exp(1j * area), abs=1e-4)
