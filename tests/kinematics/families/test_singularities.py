"""w, S and the distances, against the leg Jacobian's determinant and against searching."""

import numpy as np
import pytest
from scipy.optimize import brentq, minimize, minimize_scalar

from pentapod.geometry import tangent_frame
from pentapod.kinematics import (
    LinearPentapod,
    orientation_distance,
    position_distance,
    singular_plane,
    singularity_values,
)


def test_the_leg_determinant_is_delta_squared_w_f_s(
    pentapod: LinearPentapod, random_poses, leg_determinant, conic_determinant
) -> None:
    p, i = random_poses(pentapod, 1000, seed=4)
    w, s = singularity_values(pentapod, p, i)
    expected = pentapod.delta**2 * w * conic_determinant(pentapod) * s
    np.testing.assert_allclose(leg_determinant(pentapod, p, i), expected, rtol=1e-9, atol=1e-12 * abs(expected).max())


def test_the_determinant_of_the_papers_figure(paper: LinearPentapod, leg_determinant, conic_determinant) -> None:
    assert conic_determinant(paper) == pytest.approx(264.0, rel=1e-13)
    p, i = np.array([0.5, 0.25, 3.0]), np.array([0.36, 0.48, 0.8])
    s = 0.5 * 0.8 * 0.5 - (0.5 * 0.36 - 1.0) * 3.0
    assert leg_determinant(paper, p, i) == pytest.approx(0.25 * 0.8 * 264.0 * s, rel=1e-12)
    np.testing.assert_allclose(singularity_values(paper, p, i), (0.8, s), rtol=1e-15)


def test_check_values_of_the_notes(paper: LinearPentapod) -> None:
    i = np.array([0.36, 0.48, 0.8])
    assert abs(position_distance(paper, [0.5, 0.25, 3.0], i) - 2.915517) < 5e-7
    assert abs(np.degrees(orientation_distance(paper, [0.5, 0.25, 3.0], i)) - 53.130102) < 5e-7
    assert abs(np.degrees(orientation_distance(paper, [-4.0, 0.25, 1.0], i)) - 30.686411) < 5e-7


def test_no_shorter_way_to_a_singular_position(pentapod: LinearPentapod, random_poses, leg_determinant) -> None:
    positions, directions = random_poses(pentapod, 12, seed=5)
    distances = position_distance(pentapod, positions, directions)
    size = np.abs(pentapod.base - pentapod.base[2]).max()
    for p, i, distance in zip(positions, directions, distances, strict=True):
        scale = leg_determinant(pentapod, p, i)
        found = minimize(
            lambda x, p=p: ((x - p) ** 2).sum() / size**2,
            p + 1e-3 * size,
            constraints={"type": "eq", "fun": lambda x, i=i, d=scale: leg_determinant(pentapod, x, i) / d},
            method="SLSQP",
            options={"ftol": 1e-14},
        )
        assert np.linalg.norm(found.x - p) == pytest.approx(distance, rel=1e-5)


@pytest.mark.parametrize("about", [pytest.param(0.0, marks=pytest.mark.slow), 0.35])
def test_no_smaller_turn_to_a_singular_direction(
    pentapod: LinearPentapod, random_poses, leg_determinant, about: float
) -> None:
    positions, directions = random_poses(pentapod, 6, seed=6)
    # near S = 0 too, where the cone is nearer than the equator
    positions[3:, 2] *= 0.05
    distances = orientation_distance(pentapod, positions, directions, about=about)
    headings, turns = np.linspace(0.0, 2 * np.pi, 48, endpoint=False), np.linspace(0.0, np.pi / 2, 300)[1:]
    for p, i, distance in zip(positions, directions, distances, strict=True):
        fixed = p + about * i

        def determinant(turn, heading, i=i, fixed=fixed):
            turn, heading = np.asarray(turn)[..., None], np.asarray(heading)[..., None]
            t1, t2 = tangent_frame(i)
            j = np.cos(turn) * i + np.sin(turn) * (np.cos(heading) * t1 + np.sin(heading) * t2)
            return leg_determinant(pentapod, fixed - about * j, j)

        def first_crossing(heading, determinant=determinant):
            values = determinant(np.append(0.0, turns), heading)
            crossed = np.flatnonzero(np.sign(values[1:]) != np.sign(values[0]))
            if not crossed.size:
                return np.pi
            k = crossed[0]
            return brentq(determinant, np.append(0.0, turns)[k], turns[k], args=(heading,), xtol=1e-13)

        found = [first_crossing(heading) for heading in headings]
        best = headings[int(np.argmin(found))]
        found += [minimize_scalar(first_crossing, bounds=(best - 0.2, best + 0.2), options={"xatol": 1e-7}).fun]
        assert min(found) == pytest.approx(distance, abs=1e-8)


def test_distances_are_zero_on_the_singularities_and_defined_at_the_odd_places(paper: LinearPentapod) -> None:
    assert position_distance(paper, [0.0, 0.3, 0.0], [0.36, 0.48, 0.8]) == 0.0
    assert orientation_distance(paper, [0.0, 0.3, 0.0], [0.36, 0.48, 0.8]) == 0.0
    assert orientation_distance(paper, [1.0, 0.3, 2.0], [0.6, 0.8, 0.0]) == 0.0
    one = LinearPentapod.quadratic(paper.base, 1.0)
    assert position_distance(one, [1.0, 2.0, 3.0], [1.0, 0.0, 0.0]) == 0.0  # singular wherever it is


def test_distances_take_batches(pentapod: LinearPentapod, random_poses) -> None:
    p, i = random_poses(pentapod, 6)
    for function in (position_distance, orientation_distance):
        whole = function(pentapod, p.reshape(2, 3, 3), i.reshape(2, 3, 3))
        assert whole.shape == (2, 3)
        np.testing.assert_allclose(whole[1, 2], function(pentapod, p[5], i[5]))
        assert function(pentapod, p[0], i).shape == (6,)


@pytest.mark.parametrize("tool_length", [0.0, 0.4])
def test_the_plane_of_singular_tips(
    pentapod: LinearPentapod, random_poses, leg_determinant, tool_length: float
) -> None:
    p, i = random_poses(pentapod, 300, seed=9)
    normal, offset = singular_plane(pentapod, i, tool_length=tool_length)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=-1), 1.0, rtol=1e-14)
    tips = p + tool_length * i
    height = (normal * tips).sum(axis=-1) - offset
    np.testing.assert_allclose(np.abs(height), position_distance(pentapod, p, i), rtol=1e-9, atol=1e-12)
    np.testing.assert_array_equal(np.sign(height), pentapod.branch(p, i)[:, 1])
    foot = tips - height[:, None] * normal - tool_length * i
    scale = np.abs(leg_determinant(pentapod, p, i)).max()
    np.testing.assert_allclose(leg_determinant(pentapod, foot, i), 0.0, atol=1e-12 * scale)


def test_no_plane_where_every_position_is_singular(paper: LinearPentapod) -> None:
    one = LinearPentapod.quadratic(paper.base, 1.0)
    normal, offset = singular_plane(one, [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    assert np.isnan(normal[0]).all()
    assert np.isnan(offset[0])
    np.testing.assert_allclose(normal[1], np.array([1.0, 0.0, 1.0]) / np.sqrt(2.0))  # paper's (21)
    assert offset[1] == 0.0
