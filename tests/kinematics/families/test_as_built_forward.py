"""Forward kinematics of machines as built: right where it is proven, proven where it should be, never falsely proven.

The oracles: machines that stay in the quadratic family all the way from the nominal to the real geometry, whose path
the closed form knows (floating point and fifty digits); and pentakins' struts, followed by scipy in small steps.
"""

import mpmath
import numpy as np
import pytest
from built_machines import with_errors
from scipy.optimize import fsolve

from pentapod.base.errors import ArrayError
from pentapod.kinematics import AsBuiltPentapod, Component, LinearPentapod, as_built_pose, singularity_values

BASE = 0.2 * np.array([(-2.0, 1.0), (-1.0, -2.0), (0.0, 0.0), (1.0, -2.0), (2.0, 2.0)])
DELTA = 0.5


@pytest.fixture
def nominal() -> LinearPentapod:
    return LinearPentapod.quadratic(BASE, DELTA)


def work_poses(n: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    p = rng.uniform((-0.2, -0.2, 0.4), (0.2, 0.2, 0.8), (n, 3))
    i = np.c_[rng.uniform(-0.5, 0.5, (n, 2)), np.ones(n)]
    return p, i / np.linalg.norm(i, axis=1)[:, None]


@pytest.mark.parametrize(("size", "share"), [(0.0, 1.0), (1e-5, 1.0), (3e-4, 1.0), (2e-3, 0.99), (1e-2, 0.8)])
def test_round_trip_with_proof(nominal, size, share):
    p, i = work_poses(1500, seed=1)
    machine = with_errors(nominal, size, seed=2)
    found = as_built_pose(machine, nominal, machine.leg_lengths(p, i), nominal.branch(p, i))
    assert found.proven.mean() >= share
    sure = found.proven
    assert (np.abs(found.position - p).max(axis=1)[sure] <= found.position_error[sure] + 1e-14).all()
    assert (np.abs(found.direction - i).max(axis=1)[sure] <= found.direction_error[sure] + 1e-14).all()
    assert np.nanmax(found.position_error) < 1e-11
    assert np.isnan(found.position_error[~sure]).all()


def test_each_component_has_its_own_pose(nominal):
    p, i = work_poses(50, seed=3)
    machine = with_errors(nominal, 2e-4, seed=4)
    legs = machine.leg_lengths(p, i)
    signs = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
    found = as_built_pose(machine, nominal, legs[:, None], signs)
    assert found.proven.shape == (50, 4)
    assert found.proven.mean() > 0.95
    sure = found.proven
    again = machine.leg_lengths(found.position, found.direction)
    assert np.abs(again - legs[:, None])[sure].max() < 1e-14
    assert (nominal.branch(found.position, found.direction) == signs)[sure].all()
    apart = np.abs(found.position[:, 0] - found.position[:, 1]).max(axis=1)
    assert (apart[sure[:, 0] & sure[:, 1]] > 1e-3).all()


def test_the_error_bound_holds_at_fifty_digits(nominal):
    machine = with_errors(nominal, 1e-3, seed=5)
    p, i = work_poses(12, seed=6)
    legs = machine.leg_lengths(p, i)
    found = as_built_pose(machine, nominal, legs, Component(1, 1))
    assert found.proven.all()
    with mpmath.workdps(50):
        for n in range(len(p)):
            exact = exact_pose(machine, legs[n], found.position[n], found.direction[n])
            assert max(abs(exact[c] - found.position[n, c]) for c in range(3)) <= found.position_error[n]
            assert max(abs(exact[3 + c] - found.direction[n, c]) for c in range(3)) <= found.direction_error[n]


def exact_pose(machine: AsBuiltPentapod, legs, position, direction):
    """The solution near a pose by mpmath's own Newton method on the struts of pentakins, unknowns p and i."""

    def equations(*x):
        p, i = mpmath.matrix(x[:3]), mpmath.matrix(x[3:])
        i_norm = mpmath.norm(i)
        out = [i_norm - 1]
        for k in range(5):
            d = mpmath.matrix([mpmath.mpf(c) for c in machine.base[k]]) - p
            height = (d.T * i)[0] / i_norm
            rho = mpmath.sqrt((d.T * d)[0] - height**2)
            strut = mpmath.sqrt(
                (height - mpmath.mpf(machine.offsets[k])) ** 2 + (rho - mpmath.mpf(machine.radii[k])) ** 2
            )
            out.append(strut + mpmath.mpf(machine.zeros[k]) - mpmath.mpf(legs[k]))
        return out

    return mpmath.findroot(equations, [*position, *direction], tol=1e-60)


def family_member(s: float, end_base, end_delta: float) -> LinearPentapod:
    """The geometry at s on the straight way between two machines of the quadratic family with the same x."""
    return LinearPentapod.quadratic(BASE + s * (end_base - BASE), DELTA + s * (end_delta - DELTA))


def near_singular_poses(machine: LinearPentapod, n: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Poses from 0.1 m to 1 µm away from w = 0 or S = 0."""
    rng = np.random.default_rng(seed)
    p, i = work_poses(n, seed)
    gap = 10.0 ** rng.uniform(-6, -1, n) * rng.choice([-1, 1], n)
    on_w = rng.random(n) < 0.5
    i[on_w, 2] = gap[on_w]
    i /= np.linalg.norm(i, axis=1)[:, None]
    u, w = i[:, 0], i[:, 2]
    p[~on_w, 2] = (gap - machine.delta * w * p[:, 0])[~on_w] / (1.0 - machine.delta * u[~on_w])
    return p, i


@pytest.mark.parametrize(
    ("n", "machines"), [(60, 1), *(pytest.param(*each, marks=pytest.mark.slow) for each in ((200, 3), (20000, 20)))]
)
def test_never_proven_where_the_closed_form_loses_the_path(nominal, n, machines):
    proven = lost = clear = 0
    for seed in range(machines):
        rng = np.random.default_rng(seed)
        size = 10.0 ** rng.uniform(-5, -2)
        end_base = BASE + np.c_[np.zeros(5), rng.normal(size=5) * size]
        end_delta = DELTA + size * rng.normal()
        zeros = rng.normal(size=5) * size
        machine = AsBuiltPentapod(np.c_[end_base, np.zeros(5)], end_delta * end_base[:, 0], np.zeros(5), zeros)
        start = near_singular_poses(nominal, n // machines, seed)
        legs, signs = nominal.leg_lengths(*start), nominal.branch(*start)
        connected = np.ones(len(legs), dtype=bool)
        pose, margin = start, np.full(len(legs), np.inf)
        for s in np.linspace(0.0, 1.0, 101):
            member = family_member(s, end_base, end_delta)
            pose = member.pose(legs - s * zeros, signs)
            connected &= np.isfinite(pose[0][:, 0])
            margin = np.minimum(margin, np.abs(singularity_values(member, *pose)).min(axis=0))
        found = as_built_pose(machine, nominal, legs, signs)
        assert not (found.proven & ~connected).any()
        sure = found.proven
        error = np.abs(found.position - pose[0]).max(axis=1)[sure]
        assert (error < 1e-7).all(), "the closed form itself loses half the digits 1 µm from a singularity"
        comfortable = margin > 0.1 + 2.0 * np.sqrt(size)  # a fold moves with the root of the error
        assert sure[comfortable].all()
        proven, lost, clear = proven + sure.sum(), lost + (~connected).sum(), clear + comfortable.sum()
    assert proven > clear > 0
    assert n / 10 < lost < 0.9 * n


def discriminants(base, delta, legs):
    """w² and S² from the leg lengths, to the working precision (kinematics notes, section 3)."""
    m, right = mpmath.zeros(4, 4), mpmath.zeros(4, 1)
    for row, k in enumerate((0, 1, 3, 4)):
        x, y = (c - c3 for c, c3 in zip(base[k], base[2], strict=True))
        m[row, 0], m[row, 1], m[row, 2], m[row, 3] = x, y, delta * x * x, delta * x * y
        right[row] = -(legs[k] ** 2 - legs[2] ** 2 - x * x - y * y - (delta * x) ** 2) / 2
    q, py, u, v = mpmath.lu_solve(m, right)
    d1 = 1 - u * u - v * v
    n = 1 - 2 * delta * u + delta**2 * (1 - v * v)
    return d1, (legs[2] ** 2 - py * py) * n - (q + delta * v * py) ** 2


@pytest.mark.parametrize("machines", [2, pytest.param(200, marks=pytest.mark.slow)])
def test_never_proven_across_a_grazed_singularity(nominal, machines):
    """The way's middle geometry has the pose on a singularity, to within 1e-4 ... 1e-13: on this side or beyond it."""
    rng = np.random.default_rng(0)
    beyond = proven = 0
    n = 25
    for _ in range(machines):
        size = 10.0 ** rng.uniform(-5, -2.5)
        end_base = BASE + np.c_[np.zeros(5), rng.normal(size=5) * size]
        end_delta = DELTA + size * rng.normal()
        middle = family_member(0.5, end_base, end_delta)
        p, i = work_poses(n, int(rng.integers(1 << 30)))
        on_w = rng.random(n) < 0.5
        i[on_w, 2] = 0.0
        i /= np.linalg.norm(i, axis=1)[:, None]
        p[~on_w, 2] = (-middle.delta * i[:, 2] * p[:, 0] / (1.0 - middle.delta * i[:, 0]))[~on_w]
        legs = middle.leg_lengths(p, i)
        legs[np.arange(n), rng.integers(5, size=n)] += rng.choice([-1, 1], n) * 10.0 ** rng.uniform(-13, -4, n)
        machine = AsBuiltPentapod(np.c_[end_base, np.zeros(5)], end_delta * end_base[:, 0], np.zeros(5), np.zeros(5))
        modes = as_built_pose(machine, nominal, legs[:, None], np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]]))
        with mpmath.workdps(60):
            exact_base = [
                [(mpmath.mpf(a) + mpmath.mpf(b)) / 2 for a, b in zip(*ends, strict=True)]
                for ends in zip(BASE, end_base, strict=True)
            ]
            exact_delta = (mpmath.mpf(DELTA) + mpmath.mpf(end_delta)) / 2
            for row, proofs in zip(legs, modes.proven, strict=True):
                lost = min(discriminants(exact_base, exact_delta, [mpmath.mpf(leg) for leg in row])) <= 0
                assert not (lost and proofs.any())
                beyond += lost
                proven += proofs.any()
    assert n * machines / 4 < beyond < n * machines
    assert proven > 0


@pytest.mark.slow
def test_rings_are_followed_to_the_pose_that_small_steps_lead_to(nominal):
    """Struts of pentakins with rings of 2 to 40 mm, followed by scipy's hybrid method in 200 steps."""
    rng = np.random.default_rng(7)
    proven = 0
    for _ in range(12):
        machine = AsBuiltPentapod.of(
            nominal, base_errors=rng.normal(size=(5, 3)) * 2e-3, radii=rng.uniform(0.002, 0.04, 5)
        )
        p, i = work_poses(1, int(rng.integers(1 << 30)))
        legs = nominal.leg_lengths(p, i)[0]
        found = as_built_pose(machine, nominal, legs, nominal.branch(p, i)[0])
        x = np.r_[p[0], np.arcsin(-i[0, 1]), np.arctan2(i[0, 0], i[0, 2])]
        flat = np.c_[nominal.base, np.zeros(5)]
        for s in np.linspace(0.0, 1.0, 201)[1:]:
            base, radii = flat + s * (machine.base - flat), s * machine.radii
            x = fsolve(lambda x, b=base, r=radii, want=legs: struts(x, b, nominal.offsets, r) - want, x, xtol=1e-13)
        direction = np.array([np.cos(x[3]) * np.sin(x[4]), -np.sin(x[3]), np.cos(x[3]) * np.cos(x[4])])
        if found.proven:
            proven += 1
            assert np.abs(found.position - x[:3]).max() < 1e-10
            assert np.abs(found.direction - direction).max() < 1e-10
    assert proven >= 10


def struts(x, base, offsets, radii):
    a, b = x[3:]
    rx = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    ry = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    local = (base - x[:3]) @ (ry @ rx)
    return np.hypot(local[:, 2] - offsets, np.hypot(local[:, 0], local[:, 1]) - radii)


def test_where_there_is_no_nominal_pose_there_is_none(nominal):
    machine = with_errors(nominal, 1e-4, seed=8)
    found = as_built_pose(machine, nominal, [[0.1, 5.0, 0.1, 5.0, 0.1], [np.nan] * 5], Component(1, 1))
    assert np.isnan(found.position).all()
    assert not found.proven.any()


def test_readings_shorter_than_their_zero_are_no_pose(nominal):
    machine = AsBuiltPentapod.of(nominal, zeros=[0.0, 0.0, 0.0, 2.0, 0.0])
    p, i = work_poses(5, seed=9)
    found = as_built_pose(machine, nominal, nominal.leg_lengths(p, i), Component(1, 1))
    assert np.isnan(found.position).all()
    assert not found.proven.any()


def test_bad_input(nominal):
    machine = with_errors(nominal, 1e-4, seed=8)
    with pytest.raises(ArrayError, match=r"legs has shape \(4,\)"):
        as_built_pose(machine, nominal, np.ones(4), (1, 1))
    with pytest.raises(ArrayError, match="legs must be finite and positive"):
        as_built_pose(machine, nominal, [1.0, 1.0, -1.0, 1.0, 1.0], (1, 1))
    with pytest.raises(ArrayError, match="component is out of range"):
        as_built_pose(machine, nominal, np.ones(5), (2, 1))
    found = as_built_pose(machine, nominal, np.empty((0, 5)), (1, 1))
    assert found.position.shape == (0, 3)
    with pytest.raises(ValueError, match="read-only"):
        found.proven[...] = True
