"""General linear pentapods: leg lengths back to poses, all modes, labels."""

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pentapod.base.errors import ArrayError, MachineError
from pentapod.kinematics import (
    COMPONENTS,
    MODES,
    GeneralPentapod,
    LinearPentapod,
    Mode,
    pose_jacobian,
)

PAPER = np.array([(-2.0, 1.0), (-1.0, -2.0), (0.0, 0.0), (1.0, -2.0), (2.0, 2.0)])
EPS = float(np.finfo(float).eps)


def random_design(rng: np.random.Generator) -> GeneralPentapod:
    return GeneralPentapod(rng.uniform(-1, 1, (5, 2)), rng.uniform(-1, 1, 5) * 10.0 ** rng.uniform(-1.5, 0.5))


def random_poses(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
    direction = rng.normal(size=(n, 3))
    return rng.uniform(-1, 1, (n, 3)), direction / np.linalg.norm(direction, axis=1)[:, None]


def inherent_error(pentapod, p: np.ndarray, i: np.ndarray) -> np.ndarray:
    """What the rounding of the leg lengths alone may move a pose by; lengths in units of the base."""
    size = np.linalg.norm(pentapod.base - pentapod.base[2], axis=1).max()
    scale = np.array([1.0, 1.0, 1.0, size, size, size])[:, None]
    legs = pentapod.leg_lengths(p, i)
    return (
        EPS * np.linalg.norm(legs, axis=-1) / size * np.linalg.norm(pose_jacobian(pentapod, p, i) * scale, axis=(1, 2))
    )


def distance(pentapod, a: tuple, b: tuple) -> np.ndarray:
    size = np.linalg.norm(pentapod.base - pentapod.base[2], axis=1).max()
    return np.linalg.norm(a[0] - b[0], axis=-1) / size + np.linalg.norm(a[1] - b[1], axis=-1)


def round_trip_ratio(designs: int, poses: int, seed: int) -> float:
    rng, worst = np.random.default_rng(seed), 0.0
    for _ in range(designs):
        pentapod = random_design(rng)
        p, i = random_poses(rng, poses)
        found = pentapod.pose(pentapod.leg_lengths(p, i), pentapod.branch(p, i))
        worst = max(worst, (distance(pentapod, found, (p, i)) / inherent_error(pentapod, p, i)).max())
    return float(worst)


def test_every_pose_is_found_again_in_its_mode_as_well_as_its_rounded_lengths_tell() -> None:
    assert round_trip_ratio(designs=60, poses=500, seed=0) < 10.0


@pytest.mark.slow
def test_a_million_poses_are_found_again_in_their_mode() -> None:
    assert round_trip_ratio(designs=2000, poses=500, seed=1) < 10.0


def modes_by_the_papers_quartic(pentapod, legs: np.ndarray) -> np.ndarray:
    """All real poses (k, 6) by equations (4) to (10) in 50 digits: t as the parameter, all roots at once."""
    x, y = ([mp.mpf(float(c)) for c in column] for column in pentapod.base.T)
    z, squared = [mp.mpf(float(c)) for c in pentapod.offsets], [mp.mpf(float(c)) ** 2 for c in legs]
    others = [0, 1, 3, 4]
    matrix = mp.matrix(
        [[x[k] - x[2], y[k] - y[2], x[k] * z[k] - x[2] * z[2], y[k] * z[k] - y[2] * z[2]] for k in others]
    )
    k2 = [(x[k] ** 2 + y[k] ** 2 + z[k] ** 2 - squared[k]) / 2 for k in range(5)]
    constant = mp.lu_solve(matrix, mp.matrix([k2[k] - k2[2] for k in others]))
    slope = mp.lu_solve(matrix, mp.matrix([z[k] - z[2] for k in others]))
    one, t = np.array([mp.mpf(1)]), np.array([mp.mpf(0), mp.mpf(1)])  # polynomials: coefficients, lowest first
    px, py, u, v = (np.array([constant[k], slope[k]]) for k in range(4))

    def add(*terms: np.ndarray) -> np.ndarray:
        size = max(len(term) for term in terms)
        return sum(np.array([*term, *([mp.mpf(0)] * (size - len(term)))]) for term in terms)

    w2 = add(one, -np.convolve(u, u), -np.convolve(v, v))
    # (3) for i = 3, solved for pz²
    linear = add(-z[2] * t, x[2] * px, y[2] * py, z[2] * x[2] * u, z[2] * y[2] * v, -k2[2] * one)
    pz2 = add(2 * linear, -np.convolve(px, px), -np.convolve(py, py))
    g = add(t, -np.convolve(px, u), -np.convolve(py, v))
    quartic = add(np.convolve(w2, pz2), -np.convolve(g, g))
    found = []
    companion = mp.zeros(4)
    for k in range(4):
        companion[k, 3] = -quartic[k] / quartic[4]
        companion[k, k - 1] += 1 if k else 0
    for root in mp.eig(companion, left=False, right=False):
        at = [sum(c * mp.re(root) ** k for k, c in enumerate(line)) for line in (px, py, u, v, w2, pz2, g)]
        if abs(mp.im(root)) < mp.mpf(10) ** -20 * (1 + abs(root)) and at[4] > 0 and at[5] > 0:
            w = mp.sqrt(at[4])
            found += [[at[0], at[1], s * at[6] / w, at[2], at[3], s * w] for s in (1, -1)]
    return np.array(found, dtype=float)


def test_the_modes_are_all_that_the_papers_quartic_has() -> None:
    rng = np.random.default_rng(2)
    with mp.workdps(50):
        for _ in range(30):
            pentapod = random_design(rng)
            p, i = random_poses(rng, 1)
            legs = pentapod.leg_lengths(p[0], i[0])
            oracle = modes_by_the_papers_quartic(pentapod, legs)
            positions, directions = pentapod.assembly_modes(legs)
            assert oracle.shape == (4, 6)
            for pose in oracle:
                error = distance(pentapod, (positions, directions), (pose[:3], pose[3:]))
                assert error.min() < 10 * inherent_error(pentapod, pose[None, :3], pose[None, 3:])[0]


def test_all_modes_have_the_leg_lengths_and_their_own_labels() -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        pentapod = random_design(rng)
        p, i = random_poses(rng, 200)
        legs = pentapod.leg_lengths(p, i)
        positions, directions = pentapod.assembly_modes(legs)
        assert positions.shape == directions.shape == (200, 4, 3)
        np.testing.assert_allclose(
            pentapod.leg_lengths(positions, directions), np.repeat(legs[:, None], 4, axis=1), rtol=1e-11
        )
        np.testing.assert_allclose(np.linalg.norm(directions, axis=-1), 1.0, rtol=1e-14)
        for k, mode in enumerate(MODES):
            assert (pentapod.branch(positions[:, k], directions[:, k]) == mode).all()
            position, direction = pentapod.pose(legs, mode)
            np.testing.assert_allclose(position, positions[:, k], atol=1e-12)
            np.testing.assert_allclose(direction, directions[:, k], atol=1e-12)


def count_real_modes(rng: np.random.Generator, designs: int) -> np.ndarray:
    """How many real modes each of many random designs has, by eigenvalues of companion matrices.

    The legs are arbitrary: those of a pose for half of them, random for the others.
    """
    x, y, z = rng.uniform(-1, 1, (3, designs, 5))
    p, i = random_poses(rng, designs)
    joints = p[:, None, :] + z[..., None] * i[:, None, :]
    legs = np.linalg.norm(joints - np.stack([x, y, np.zeros_like(x)], axis=-1), axis=-1)
    legs = np.where((np.arange(designs) % 2 == 0)[:, None], legs, rng.uniform(0.5, 2.0, (designs, 5)))
    x, y, z = x - x[:, 2:3], y - y[:, 2:3], z - z[:, 2:3]
    others = [0, 1, 3, 4]
    matrix = np.stack([z, -x, -y, -x * z, -y * z], axis=-1)[:, others]
    right = 0.5 * (legs**2 - legs[:, 2:3] ** 2 - x**2 - y**2 - z**2)[:, others]
    left, values, vh = np.linalg.svd(matrix)
    start = np.einsum("nk,nkj->nj", np.einsum("nij,ni->nj", left, right) / values, vh[:, :4])
    step = vh[:, 4]

    def f(tau: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        t, px, py, u, v = np.moveaxis(start[:, None] + tau[..., None] * step[:, None], -1, 0)
        w2, pz2 = 1 - u * u - v * v, legs[:, 2:3] ** 2 - px * px - py * py
        return w2 * pz2 - (t - px * u - py * v) ** 2, w2, pz2

    nodes = np.cos(np.pi * np.arange(5) / 4) * 2
    coefficients = np.linalg.solve(np.vander(nodes), f(np.broadcast_to(nodes, (designs, 5)))[0].T).T
    companion = np.zeros((designs, 4, 4))
    companion[:, 0] = -coefficients[:, 1:] / coefficients[:, :1]
    companion[:, [1, 2, 3], [0, 1, 2]] = 1.0
    roots = np.linalg.eigvals(companion)
    real = np.abs(roots.imag) < 1e-9 * (1 + np.abs(roots))
    _, w2, pz2 = f(roots.real)
    return 2 * (real & (w2 >= 0) & (pz2 >= 0)).sum(axis=1)


@pytest.mark.parametrize("designs", [20_000, pytest.param(1_000_000, marks=pytest.mark.slow)])
def test_no_design_has_more_than_four_real_modes(designs: int) -> None:
    rng, seen = np.random.default_rng(4), np.zeros(9, dtype=int)
    for _ in range(0, designs, 20_000):
        seen += np.bincount(count_real_modes(rng, 20_000), minlength=9)
    assert seen[5:].sum() == 0
    assert seen[4] > 0.45 * designs  # where the legs are those of a pose, both roots are there
    assert seen[0] > 0.02 * designs


def test_proportional_offsets_give_the_four_modes_of_the_closed_form() -> None:
    rng = np.random.default_rng(5)
    closed = LinearPentapod.from_offsets(0.2 * PAPER + (0.31, -0.17), 0.07 - 0.16 * PAPER[:, 0], -0.8)
    pentapod = GeneralPentapod(closed.base, closed.offsets)
    p, i = random_poses(rng, 2000)
    legs, mode, component = closed.leg_lengths(p, i), pentapod.branch(p, i), closed.branch(p, i)
    ours, theirs = pentapod.pose(legs, mode), closed.pose(legs, component)
    assert (distance(pentapod, ours, theirs) < 20 * inherent_error(pentapod, p, i)).all()
    # the order of the roots is the sign of w S, up to the sign of the geometry's F
    ratio = mode[:, 0] * component[:, 0] * component[:, 1]
    assert (ratio == ratio[0]).all()
    assert (mode[:, 1] == component[:, 0]).all()
    ours, theirs = (np.concatenate(m.assembly_modes(legs), axis=-1) for m in (pentapod, closed))
    to_closed = [COMPONENTS.index((image, order * image * int(ratio[0]))) for order, image in MODES]
    sound = inherent_error(pentapod, p, i) < 1e-13
    np.testing.assert_allclose(ours[sound], theirs[sound][:, to_closed], atol=1e-8)


def test_the_image_is_named_by_w_and_by_pz_where_w_vanishes() -> None:
    pentapod = random_design(np.random.default_rng(6))
    p = np.array([0.3, 0.2, 0.9 - pentapod.offsets[2] * 0.8])
    assert pentapod.branch(p, [0.6, 0.0, 0.8])[1] == 1
    assert pentapod.branch(p, [0.6, 0.0, -0.8])[1] == -1
    assert pentapod.branch(p, [0.6, 0.8, 0.0])[1] == np.sign(p[2])
    a, b = pentapod.mirror(p, [0.6, 0.0, 0.8])
    np.testing.assert_allclose(pentapod.leg_lengths(a, b), pentapod.leg_lengths(p, [0.6, 0.0, 0.8]), rtol=1e-15)
    assert pentapod.branch(a, b)[0] == pentapod.branch(p, [0.6, 0.0, 0.8])[0]


@pytest.mark.parametrize("height", [0.0, 1e-15, 1e-9, 1e-6, 1e-3])
@pytest.mark.parametrize("what", ["w", "pz"])
def test_poses_with_w_or_pz_near_zero_are_as_accurate_as_others(what: str, height: float) -> None:
    # f has its root at the end of the feasible interval there, and a square root would halve the digits
    rng = np.random.default_rng(7)
    pentapod = random_design(rng)
    p, i = random_poses(rng, 500)
    if what == "w":
        i[:, 2] = height * rng.uniform(-1, 1, 500)
        i /= np.linalg.norm(i, axis=1)[:, None]
    else:
        p[:, 2] = height * rng.uniform(-1, 1, 500) - pentapod.offsets[2] * i[:, 2]
    found = pentapod.pose(pentapod.leg_lengths(p, i), pentapod.branch(p, i))
    error = distance(pentapod, found, (p, i))
    if height < 1e-12:  # the sign that names the image is lost in rounding
        error = np.minimum(error, distance(pentapod, pentapod.mirror(*found), (p, i)))
    assert (error < 10 * inherent_error(pentapod, p, i)).all()


@settings(max_examples=30)
@given(st.integers(0, 9000), st.sampled_from([(), (1,), (7, 3), (2, 1, 5)]))
def test_a_batch_is_its_elements(count: int, shape: tuple) -> None:
    rng = np.random.default_rng(count)
    pentapod = GeneralPentapod(0.2 * PAPER, [0.31, -0.2, 0.05, 0.14, -0.1])
    n = int(np.prod(shape)) if shape else count
    batch = shape or (n,)
    p, i = random_poses(rng, n)
    legs, mode = pentapod.leg_lengths(p, i), pentapod.branch(p, i)
    position, direction = pentapod.pose(legs.reshape(*batch, 5), mode.reshape(*batch, 2))
    assert position.shape == direction.shape == (*batch, 3)
    for k in {0, n // 2, n - 1} if n else ():
        alone, _ = pentapod.pose(legs[k], mode[k])
        np.testing.assert_allclose(position.reshape(-1, 3)[k], alone, atol=1e-7)


def test_lengths_without_a_pose_and_labels_without_a_meaning_give_nan() -> None:
    pentapod = GeneralPentapod(0.2 * PAPER, [0.31, -0.2, 0.05, 0.14, -0.1])
    good = pentapod.leg_lengths([0.1, 0.05, 0.6], [0.36, 0.48, 0.8])
    legs = np.array(
        [good, [0.1, 0.1, 9.0, 0.1, 0.1], [np.nan, 1, 1, 1, 1], [-1.0, 1, 1, 1, 1], [np.inf, 1, 1, 1, 1], good]
    )
    for values in (*pentapod.assembly_modes(legs), *pentapod.pose(legs, Mode(1, -1))):
        assert np.isnan(values[1:5]).all()
        assert np.isfinite(values[[0, 5]]).all()
    position, _ = pentapod.pose(good, [[0, 1], [1, 0], [np.nan, 1], [1, 1]])
    np.testing.assert_array_equal(np.isnan(position[:, 0]), [True, True, True, False])
    np.testing.assert_array_equal(pentapod.branch([[0.1, np.nan, 0.6]], [0.0, 0.0, 1.0]), [[0, 0]])


def test_bad_input_is_refused_with_what_was_received() -> None:
    pentapod = GeneralPentapod(0.2 * PAPER, [0.31, -0.2, 0.05, 0.14, -0.1])
    legs = pentapod.leg_lengths([0.1, 0.05, 0.6], [0.36, 0.48, 0.8])
    with pytest.raises(ArrayError, match=r"legs has shape \(4,\)"):
        pentapod.pose(legs[:4], Mode(1, 1))
    with pytest.raises(ArrayError, match=r"mode has shape \(3,\)"):
        pentapod.pose(legs, [1, 1, 1])
    with pytest.raises(ArrayError, match="mode is out of range"):
        pentapod.pose(legs, (2, 1))
    with pytest.raises(ArrayError, match=r"position has shape \(2,\)"):
        pentapod.branch([0.0, 0.0], [0.0, 0.0, 1.0])
    with pytest.raises(MachineError, match="not finite at index"):
        GeneralPentapod(0.2 * PAPER, [0.31, np.nan, 0.05, 0.14, -0.1])
    with pytest.raises(MachineError, match=r"offsets has shape \(4,\)"):
        GeneralPentapod(0.2 * PAPER, np.ones(4))


@pytest.mark.parametrize(
    ("base", "offsets"),
    [
        (PAPER, np.zeros(5)),  # all platform joints in one point
        (np.zeros((5, 2)), np.arange(5.0)),  # all base joints in one point
        (np.c_[np.arange(5.0), np.zeros(5)], np.array([0.0, 1.0, 4.0, 9.0, 16.0])),  # base joints on a line
        (PAPER[[0, 1, 2, 3, 3]], np.array([1.0, 2.0, 3.0, 4.0, 4.0])),  # two legs are one
    ],
)
def test_architecturally_singular_geometries_are_refused(base: np.ndarray, offsets: np.ndarray) -> None:
    with pytest.raises(MachineError, match="architecturally singular"):
        GeneralPentapod(base, offsets)
