"""Leg lengths, assembly modes and poses."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.optimize import root

from pentapod.base.errors import ArrayError
from pentapod.kinematics import COMPONENTS, Component, LinearPentapod, pose_jacobian, singularity_values

numbers = st.floats(-1.0, 1.0, allow_subnormal=False)


def test_check_values_of_the_notes(paper: LinearPentapod) -> None:
    p, i = np.array([0.5, 0.25, 3.0]), np.array([0.36, 0.48, 0.8])
    legs = paper.leg_lengths(p, i)
    np.testing.assert_allclose(legs**2, [10.9325, 12.5425, 9.3125, 17.8625, 17.3525], rtol=1e-15)
    positions, directions = paper.assembly_modes(legs)
    other = [-2.05646324, 0.25, 2.24074964]
    found = {str(c): (q, j) for c, q, j in zip(COMPONENTS, positions, directions, strict=True)}
    for name, (q, j) in found.items():
        np.testing.assert_allclose(j, [0.36, 0.48, 0.8 if name[0] == "+" else -0.8], atol=1e-14)
        if name in ("++", "--"):
            np.testing.assert_allclose(q, [0.5, 0.25, 3.0 if name == "++" else -3.0], atol=1e-14)
        else:
            np.testing.assert_allclose(q, other * np.array([1, 1, -1 if name[0] == "+" else 1]), atol=5e-9)
    t = np.einsum("ij,ij->i", positions, directions)
    np.testing.assert_allclose(t, [2.7, -2.412926477655, -2.412926477655, 2.7], atol=5e-13)


def test_leg_lengths_are_distances_between_the_joints(pentapod: LinearPentapod, random_poses) -> None:
    p, i = random_poses(pentapod, 200)
    for leg in range(5):
        joint = p + pentapod.offsets[leg] * i
        expected = [np.hypot(np.hypot(*(j[:2] - pentapod.base[leg])), j[2]) for j in joint]
        np.testing.assert_allclose(pentapod.leg_lengths(p, i)[:, leg], expected, rtol=1e-14)
    vectors = pentapod.leg_vectors(p, i)
    np.testing.assert_allclose(np.linalg.norm(vectors, axis=-1), pentapod.leg_lengths(p, i), rtol=1e-14)


def test_every_pose_is_found_again_in_its_own_component(pentapod: LinearPentapod, random_poses) -> None:
    p, i = random_poses(pentapod, 100_000)
    component = pentapod.branch(p, i)
    assert component.dtype == np.int8
    legs = pentapod.leg_lengths(p, i)
    position, direction = pentapod.pose(legs, component)
    size = np.abs(pentapod.base - pentapod.base[2]).max()
    error = np.linalg.norm(position - p, axis=1) / size + np.linalg.norm(direction - i, axis=1)
    # Lengths rounded to a double determine the pose to no better than this; near a singularity it is much.
    inherent = np.finfo(float).eps * np.linalg.norm(legs, axis=1) / size
    scale = np.array([1.0, 1.0, 1.0, size, size, size])[:, None]
    inherent *= np.linalg.norm(pose_jacobian(pentapod, p, i) * scale, axis=(1, 2))
    assert (error < 8.0 * inherent).all()
    sound = inherent < 1e-10
    assert sound.mean() > 0.999
    assert error[sound].max() < 1e-9
    assert np.median(error) < 1e-14
    # each component holds a fair share of the poses, so none was left out
    assert (np.unique(component @ [2, 1], return_counts=True)[1] > 5000).all()


def test_all_four_modes_have_the_leg_lengths_and_their_own_signs(pentapod: LinearPentapod, random_poses) -> None:
    p, i = random_poses(pentapod, 5000, seed=1)
    legs = pentapod.leg_lengths(p, i)
    positions, directions = pentapod.assembly_modes(legs)
    assert positions.shape == directions.shape == (5000, 4, 3)
    again = pentapod.leg_lengths(positions, directions)
    np.testing.assert_allclose(again, np.repeat(legs[:, None, :], 4, axis=1), rtol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=-1), 1.0, rtol=1e-14)
    for mode, component in enumerate(COMPONENTS):
        assert (pentapod.branch(positions[:, mode], directions[:, mode]) == component).all()
        position, direction = pentapod.pose(legs, component)
        np.testing.assert_allclose(position, positions[:, mode], atol=1e-13)
        np.testing.assert_allclose(direction, directions[:, mode], atol=1e-13)


def test_newton_from_nearby_finds_the_same_pose(pentapod: LinearPentapod, random_poses) -> None:
    p, i = random_poses(pentapod, 400, seed=2)
    w, s = np.abs(i[:, 2]), np.abs(p[:, 2])
    keep = (w > 0.3) & (s > 0.3 * np.abs(pentapod.base).max())
    legs = pentapod.leg_lengths(p, i)
    component = pentapod.branch(p, i)
    rng = np.random.default_rng(0)
    attachments, z = np.c_[pentapod.base, np.zeros(5)], pentapod.offsets
    tried = 0
    for q, j, length, signs in zip(p[keep][:60], i[keep], legs[keep], component[keep], strict=False):
        # unknowns: p and the direction as a free vector, whose length is the sixth equation
        def equations(x: np.ndarray, length: np.ndarray = length) -> np.ndarray:
            joints = x[:3] + np.outer(z, x[3:])
            return np.append(((joints - attachments) ** 2).sum(axis=1) - length**2, x[3:] @ x[3:] - 1.0)

        solution = root(equations, np.r_[q, j] + 1e-3 * rng.normal(size=6), method="hybr", tol=1e-14)
        if np.abs(equations(solution.x)).max() > 1e-12 or np.abs(solution.x - np.r_[q, j]).max() > 0.05:
            continue  # Newton went elsewhere: the closed form has nothing to answer for
        tried += 1
        position, direction = pentapod.pose(length, signs)
        np.testing.assert_allclose(np.r_[position, direction], solution.x, atol=1e-9)
    assert tried > 40


@given(
    st.tuples(numbers, numbers, numbers),
    st.tuples(numbers, numbers, numbers),
    st.sampled_from([0.3, -0.7, 1.0, 2.5]),
    st.tuples(numbers, numbers),
    numbers,
)
def test_round_trip_for_any_frame(p, i, delta: float, shift, start: float) -> None:
    base = np.array([(-0.4, 0.2), (-0.2, -0.4), (0.0, 0.0), (0.2, -0.4), (0.4, 0.4)]) + shift
    pentapod = LinearPentapod.from_offsets(base, start + delta * base[:, 0], delta)
    assume(np.linalg.norm(i) > 0.1)
    direction = np.array(i) / np.linalg.norm(i)
    signs = pentapod.branch(p, direction)
    w, s = singularity_values(pentapod, p, direction)
    assume(abs(w) > 0.05)
    assume(abs(s) > 0.05)
    position, found = pentapod.pose(pentapod.leg_lengths(p, direction), signs)
    np.testing.assert_allclose(position, p, atol=1e-9)
    np.testing.assert_allclose(found, direction, atol=1e-9)


@given(st.integers(0, 9000), st.sampled_from([(), (1,), (7, 3), (2, 1, 5)]))
def test_a_batch_is_its_elements(count: int, shape: tuple) -> None:
    pentapod = LinearPentapod.quadratic([(-0.4, 0.2), (-0.2, -0.4), (0.0, 0.0), (0.2, -0.4), (0.4, 0.4)], 0.5)
    n = int(np.prod(shape)) if shape else count
    rng = np.random.default_rng(count)
    p = rng.uniform(0.2, 0.9, size=(n, 3))
    i = np.c_[rng.uniform(-0.4, 0.4, size=(n, 2)), np.ones(n)]
    i /= np.linalg.norm(i, axis=1)[:, None]
    batch = shape or (n,)
    legs = pentapod.leg_lengths(p.reshape(*batch, 3), i.reshape(*batch, 3))
    assert legs.shape == (*batch, 5)
    signs = pentapod.branch(p.reshape(*batch, 3), i.reshape(*batch, 3))
    position, direction = pentapod.pose(legs, signs)
    modes, _ = pentapod.assembly_modes(legs)
    assert (position.shape, direction.shape, modes.shape) == ((*batch, 3), (*batch, 3), (*batch, 4, 3))
    for k in {0, n // 2, n - 1} if n else ():
        np.testing.assert_allclose(legs.reshape(-1, 5)[k], pentapod.leg_lengths(p[k], i[k]), rtol=1e-15)
        alone, _ = pentapod.pose(legs.reshape(-1, 5)[k], signs.reshape(-1, 2)[k])
        np.testing.assert_allclose(position.reshape(-1, 3)[k], alone, atol=1e-11)
        np.testing.assert_allclose(
            modes.reshape(-1, 4, 3)[k], pentapod.assembly_modes(legs.reshape(-1, 5)[k])[0], atol=1e-11
        )


def test_arguments_broadcast(paper: LinearPentapod) -> None:
    p, i = np.array([[0.5, 0.25, 3.0], [0.4, 0.2, 2.5]]), np.array([0.36, 0.48, 0.8])
    legs = paper.leg_lengths(p, i)
    np.testing.assert_allclose(legs[1], paper.leg_lengths(p[1], i))
    position, _ = paper.pose(legs[:, None, :], np.array(COMPONENTS))
    np.testing.assert_allclose(position, paper.assembly_modes(legs)[0], atol=1e-13)


def test_lengths_without_a_pose_give_nan_in_all_modes_and_only_there(paper: LinearPentapod) -> None:
    good = paper.leg_lengths([0.5, 0.25, 3.0], [0.36, 0.48, 0.8])
    legs = np.array([good, [1.0, 1.0, 9.0, 1.0, 1.0], [np.nan, 1.0, 1.0, 1.0, 1.0], good])
    legs = np.concatenate([legs, good * np.array([[-1.0], [np.inf]]), good * np.where(np.eye(5), -1.0, 1.0)])
    for values in (*paper.assembly_modes(legs), *paper.pose(legs, Component(1, -1))):
        assert np.isnan(values[[1, 2, *range(4, 11)]]).all()
        assert np.isfinite(values[[0, 3]]).all()


def test_a_sign_of_zero_names_no_pose_and_other_numbers_no_sign(paper: LinearPentapod) -> None:
    legs = paper.leg_lengths([0.5, 0.25, 3.0], [0.36, 0.48, 0.8])
    position, direction = paper.pose(np.stack([legs, legs]), [[1, 0], [1, 1]])
    assert np.isnan(position[0]).all()
    assert np.isnan(direction[0]).all()
    assert np.isfinite(position[1]).all()
    with pytest.raises(ArrayError, match=r"component is out of range \(got 2\.0\)"):
        paper.pose(legs, (2, 1))


def test_component_is_zero_on_each_singularity_and_without_a_pose(paper: LinearPentapod) -> None:
    p = np.array([[0.5, 0.25, 3.0], [0.0, 0.7, 0.0], [0.5, np.nan, 3.0], [0.5, 0.25, np.nan]])
    i = np.array([[0.6, 0.8, 0.0], [0.36, 0.48, 0.8], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]])
    np.testing.assert_array_equal(paper.branch(p, i), [[0, 1], [1, 0], [0, 0], [0, 0]])


def test_wrong_shapes_are_refused(paper: LinearPentapod) -> None:
    with pytest.raises(ArrayError, match="position has shape"):
        paper.leg_lengths([1.0, 2.0], [0.0, 0.0, 1.0])
    with pytest.raises(ArrayError, match="legs has shape"):
        paper.assembly_modes([1.0, 2.0, 3.0])
