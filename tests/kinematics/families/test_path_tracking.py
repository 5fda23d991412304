"""Following a mode where w passes through zero without a singularity."""

import numpy as np
import pytest

from pentapod.base.errors import ArrayError
from pentapod.kinematics import GeneralPentapod, Mode, follow, singularity_polynomial

BASE = np.array([(-0.4, 0.2), (-0.2, -0.4), (0.05, 0.1), (0.2, -0.4), (0.4, 0.4)])


@pytest.fixture
def pentapod() -> GeneralPentapod:
    return GeneralPentapod(BASE, [-0.3, 0.2, 0.1, -0.15, 0.4])


def swing(pentapod: GeneralPentapod, n: int, upto: float) -> tuple[np.ndarray, np.ndarray]:
    """A motion whose direction dips below the horizontal; the first of many random ones without a singularity."""
    rng, s = np.random.default_rng(3), np.linspace(0.0, 1.0, n)
    for _ in range(1000):
        turn = rng.uniform(-np.pi, np.pi)
        elevation = 0.5 - (0.5 + upto) * s
        i = np.stack([np.cos(turn) * np.cos(elevation), np.sin(turn) * np.cos(elevation), np.sin(elevation)], axis=-1)
        p = rng.uniform(-0.6, 0.6, 3) + s[:, None] * rng.uniform(-0.1, 0.1, 3)
        value = singularity_polynomial(pentapod, p, i)
        if np.abs(value).min() > 0.1 * np.abs(value).max() and (value * value[0] > 0).all():
            return p, i
    raise RuntimeError("no motion found")


@pytest.mark.parametrize("rows", [2, 3, 17, 1000])
def test_the_mirror_image_is_followed_through_w_equal_to_zero(pentapod: GeneralPentapod, rows: int) -> None:
    p, i = swing(pentapod, 1000, 0.4)
    assert (i[0, 2], np.sign(i[-1, 2])) == (pytest.approx(np.sin(0.5)), -1)
    assert (pentapod.branch(p, i)[:, 0] == pentapod.branch(p[0], i[0])[0]).all()
    legs = pentapod.leg_lengths(p, i)
    if rows < 1000:  # the legs then move linearly in between: another motion with the same ends
        chosen = np.linspace(0, 999, rows).round().astype(int)
        p, i, legs = p[chosen], i[chosen], legs[chosen]
    path = follow(pentapod, legs, p[0], i[0])
    assert path.lost_at is None
    np.testing.assert_allclose(path.position, p, atol=1e-10)
    np.testing.assert_allclose(path.direction, i, atol=1e-10)
    # the mode's name for the image has changed, the mode's order has not
    modes = pentapod.branch(path.position, path.direction)
    assert tuple(modes[0]) == Mode(int(modes[0, 0]), 1)
    assert tuple(modes[-1]) == Mode(int(modes[0, 0]), -1)


def test_the_other_image_is_followed_as_well(pentapod: GeneralPentapod) -> None:
    p, i = swing(pentapod, 50, 0.4)
    legs = pentapod.leg_lengths(p, i)
    start = pentapod.mirror(p[0], i[0])
    path = follow(pentapod, legs, *start)
    expected = pentapod.mirror(p, i)
    np.testing.assert_allclose(path.position, expected[0], atol=1e-10)
    np.testing.assert_allclose(path.direction, expected[1], atol=1e-10)


def test_small_steps_of_newton_agree(pentapod: GeneralPentapod) -> None:
    """Newton from row to row needs no notion of modes or images; the legs here are those of no prescribed pose."""
    p, i = swing(pentapod, 2, 0.4)
    ends = pentapod.leg_lengths(p, i)
    legs = ends[0] + np.linspace(0, 1, 400)[:, None] * (ends[1] - ends[0])
    path = follow(pentapod, legs[::57], p[0], i[0])
    x = np.r_[p[0], i[0]]
    for k, length in enumerate(legs):
        for _ in range(6):
            d = x[:3] + np.outer(pentapod.offsets, x[3:]) - np.c_[BASE, np.zeros(5)]
            value = np.append((d * d).sum(axis=1) - length**2, x[3:] @ x[3:] - 1)
            matrix = np.vstack([np.c_[2 * d, 2 * pentapod.offsets[:, None] * d], np.r_[0, 0, 0, 2 * x[3:]]])
            x = x - np.linalg.solve(matrix, value)
        if k % 57 == 0:
            np.testing.assert_allclose(np.r_[path.position[k // 57], path.direction[k // 57]], x, atol=1e-9)


def test_a_path_that_ends_in_nothing_says_where(pentapod: GeneralPentapod) -> None:
    p, i = swing(pentapod, 20, 0.4)
    legs = pentapod.leg_lengths(p, i)
    legs[12, 1] = 9.0
    path = follow(pentapod, legs, p[0], i[0])
    assert path.lost_at == 12
    assert np.isfinite(path.position[:12]).all()
    assert np.isnan(path.position[12:]).all()
    assert np.isnan(path.direction[12:]).all()


def test_bad_input_is_refused(pentapod: GeneralPentapod) -> None:
    p, i = swing(pentapod, 5, 0.4)
    legs = pentapod.leg_lengths(p, i)
    with pytest.raises(ArrayError, match=r"legs has shape \(5,\)"):
        follow(pentapod, legs[0], p[0], i[0])
    with pytest.raises(ArrayError, match=r"position has shape \(5, 3\)"):
        follow(pentapod, legs, p, i[0])
    with pytest.raises(ArrayError, match="does not have the legs of the first row"):
        follow(pentapod, legs, p[0] + 0.1, i[0])
    with pytest.raises(ArrayError, match="does not have the legs"):
        follow(pentapod, np.full((2, 5), np.nan), p[0], i[0])
