"""Motions proven free of singularities: never falsely (exact rational arithmetic), and where they should be."""

import math
from fractions import Fraction

import numpy as np
import pytest
from built_machines import with_errors
from rational_polynomials import add, times
from scipy.optimize import fsolve

from pentapod.base.errors import ArrayError
from pentapod.kinematics import AsBuiltPentapod, LinearPentapod, as_built_pose, certify_motion, singularity_values

BASE = 0.25 * np.array([(-2.0, 1.0), (-1.0, -2.0), (0.0, 0.0), (1.0, -2.0), (2.0, 2.0)])  # exact in binary
DELTA = 0.5
LOOKS = 60


@pytest.fixture
def nominal() -> LinearPentapod:
    return LinearPentapod.quadratic(BASE, DELTA)


def smooth_motion(n: int) -> tuple[np.ndarray, np.ndarray]:
    t = np.linspace(0.0, 1.0, n + 1)
    p = np.c_[0.1 * np.cos(10 * t), 0.1 * np.sin(7 * t), 0.6 + 0.05 * np.sin(5 * t)]
    i = np.c_[0.3 * np.sin(6 * t), 0.3 * np.cos(9 * t), np.ones(n + 1)]
    return p, i / np.linalg.norm(i, axis=1)[:, None]


def linear(legs: np.ndarray) -> np.ndarray:
    return np.stack([legs[:-1], legs[1:]], axis=-1)


# The discriminants w² and S² as polynomials in time, in exact rational arithmetic (kinematics notes, section 3).


def eliminate(rows):
    n = len(rows)
    for c in range(n):
        pivot = next(r for r in range(c, n) if rows[r][c] != 0)
        rows[c], rows[pivot] = rows[pivot], rows[c]
        rows[c] = [x / rows[c][c] for x in rows[c]]
        for r in range(n):
            if r != c:
                rows[r] = [x - rows[r][c] * y for x, y in zip(rows[r], rows[c], strict=True)]
    return [row[n:] for row in rows]


def inverse_map():
    rows = []
    for n, k in enumerate((0, 1, 3, 4)):
        x, y = map(Fraction, BASE[k])
        d = Fraction(DELTA)
        rows.append([x, y, d * x * x, d * x * y, *(Fraction(int(n == m)) for m in range(4))])
    return eliminate(rows)


INVERSE = inverse_map()


def discriminants(first: np.ndarray, middle: np.ndarray, last: np.ndarray):
    """w² and S², degrees 8 and 16, of legs with Bernstein coefficients first, middle, last."""
    legs = []
    for coefficients in zip(first, middle, last, strict=True):
        a, m, b = map(Fraction, coefficients)
        legs.append([a, 2 * (m - a), a - 2 * m + b])
    squares = [times(leg, leg) for leg in legs]
    d = Fraction(DELTA)
    right = []
    for k in (0, 1, 3, 4):
        x, y = map(Fraction, BASE[k])
        row = add(add(squares[k], squares[2], -1), [x * x + y * y + (d * x) ** 2], -1)
        right.append([-c / 2 for c in row])
    q, py, u, v = ([sum(m[j] * right[j][c] for j in range(4)) for c in range(5)] for m in INVERSE)
    one = [Fraction(1)]
    d1 = add(add(one, times(u, u), -1), times(v, v), -1)
    n2 = add(add(one, u, -2 * d), add(one, times(v, v), -1), d * d)
    c = add(q, times(v, py), d)
    return d1, add(times(add(squares[2], times(py, py), -1), n2), times(c, c), -1)


MOMENTS = sorted(
    {Fraction(k, 32) for k in range(33)} | {(1 + s * Fraction(1, 2**k)) / 2 for k in range(40) for s in (-1, 1)}
)


def lost(a) -> bool:
    """Whether a polynomial is somewhere not positive, looking at 33 moments and ever closer ones to the middle."""
    denominator = math.lcm(*(c.denominator for c in a))
    whole = [int(c * denominator) for c in a]
    for t in MOMENTS:
        up, down, out = t.numerator, t.denominator, 0
        for k, c in enumerate(reversed(whole)):
            out = out * up + c * down**k
        if out <= 0:
            return True
    return False


def test_the_oracle_sees_narrow_gaps():
    square = times([Fraction(-1, 2), Fraction(1)], [Fraction(-1, 2), Fraction(1)])
    assert lost(square)
    assert lost(add(square, [Fraction(-1, 10**15)]))
    assert not lost(add(square, [Fraction(1, 10**15)]))
    assert lost([Fraction(1, 3), Fraction(-1)])
    assert not lost([Fraction(4, 3), Fraction(-1)])


def grazing_intervals(nominal: LinearPentapod, n: int, seed: int):
    """Legs (n, 5, 3) that go to and fro between two near poses, by way of the singularity next to them or farther out.

    In the middle of each interval the legs are those of a singular pose, moved inwards or outwards by a share of
    1e-12 to 1 of the way there.
    """
    rng = np.random.default_rng(seed)
    p = rng.uniform((-0.2, -0.2, 0.4), (0.2, 0.2, 0.8), (2, 3))
    i = np.c_[rng.uniform(-0.5, 0.5, (2, 2)), [1.0, 1.0]]
    far = 10.0 ** rng.uniform(-3, -0.5)
    p[1], i[1] = p[0] + 0.1 * far * rng.normal(size=3), i[0] + 0.1 * far * rng.normal(size=3)
    on_w = seed % 2 == 0
    if on_w:
        i[:, 2] = far * rng.uniform(0.8, 1.2, 2)
    i /= np.linalg.norm(i, axis=1)[:, None]
    edge_p, edge_i = p[0].copy(), i[0].copy()
    if on_w:
        edge_i[2] = 0.0
        edge_i /= np.linalg.norm(edge_i)
    else:
        p[:, 2] = (far * rng.uniform(0.8, 1.2, 2) - DELTA * i[:, 2] * p[:, 0]) / (1 - DELTA * i[:, 0])
        edge_p = p[0].copy()
        edge_p[2] = -DELTA * i[0, 2] * p[0, 0] / (1 - DELTA * i[0, 0])
    legs, edge = nominal.leg_lengths(p, i), nominal.leg_lengths(edge_p, edge_i)
    share = rng.choice([-1, -1, -1, 1], n) * 10.0 ** np.where(
        rng.random(n) < 0.5, rng.uniform(-12, 0, n), rng.uniform(-1, 0, n)
    )
    vertex = edge + share[:, None] * (edge - legs[0])
    turns = np.arange(n + 1) % 2
    ends = legs[turns]
    return np.stack([ends[:-1], 2.0 * vertex - 0.5 * (ends[:-1] + ends[1:]), ends[1:]], axis=-1), p[turns], i[turns]


@pytest.mark.parametrize(("n", "each"), [(50, 25), pytest.param(10000, 250, marks=pytest.mark.slow)])
def test_never_falsely_proven_in_exact_arithmetic(nominal, n, each):
    machine = AsBuiltPentapod.of(nominal)
    singular = proven = 0
    for seed in range(n // each):
        coefficients, p, i = grazing_intervals(nominal, each, seed)
        coefficients = np.maximum(coefficients, 1e-3)  # where the way out would ask for legs that are none
        found = certify_motion(machine, coefficients, p, i)
        for row, sure in zip(coefficients, found.proven, strict=True):
            bad = any(lost(d) for d in discriminants(*row.T))
            assert not (bad and sure)
            singular, proven = singular + bad, proven + sure
    assert singular > n / 4
    assert proven > n / 40


@pytest.mark.parametrize("closeness", [1e-4, 1e-6, 1e-9, 1e-12, 0.0, -1e-12, -1e-9, -1e-4])
def test_grazing_motions(nominal, closeness):
    """One leg draws the pose to within `closeness` of where w = 0 begins to be lost, and back again: a parabola."""
    machine = AsBuiltPentapod.of(nominal)
    i = np.array([0.6, 0.0, 0.8])
    p = np.array([0.05, 0.03, 0.6])
    legs = nominal.leg_lengths(p, i)
    edge = nominal.leg_lengths(p, [1.0, 0.0, 0.0])  # w = 0
    middle = 2.0 * edge - legs + closeness * (legs - edge)  # the parabola's vertex is at edge + closeness / 2 ...
    coefficients = np.stack([legs, middle, legs], axis=-1)[None]
    found = certify_motion(machine, coefficients, [p, p], [i, i])
    if closeness <= 1e-6:
        assert not found.holds
        assert 0.3 < found.reached[0] < found.stop[0] <= 0.501
    again = certify_motion(machine, np.stack([legs, 0.5 * (legs + edge), legs], axis=-1)[None], [p, p], [i, i])
    assert again.holds, "half the way to the edge and back is proven"


@pytest.mark.parametrize("size", [0.0, 1e-3, 1e-2])
@pytest.mark.parametrize("intervals", [7, 200])
def test_a_working_motion_is_proven(nominal, size, intervals):
    machine = with_errors(nominal, size, seed=1)
    p, i = smooth_motion(intervals)
    legs = machine.leg_lengths(p, i)
    found = certify_motion(machine, linear(legs), p, i)
    if intervals == 200:
        assert found.holds
        assert np.abs(found.position - p).max() < 1e-13
        assert (found.stop == 1.0).all()
    assert found.proven.mean() > 0.7


def test_general_pentapods_are_proven_too():
    rng = np.random.default_rng(3)
    base = np.c_[BASE + rng.normal(size=(5, 2)) * 0.1, np.zeros(5)]
    machine = AsBuiltPentapod(base, rng.uniform(-0.3, 0.3, 5), np.zeros(5), np.zeros(5))
    p, i = smooth_motion(400)
    found = certify_motion(machine, linear(machine.leg_lengths(p, i)), p, i)
    signs = np.sign([np.linalg.det(tangent_jacobian(machine, *pose)) for pose in zip(p, i, strict=True)])
    crossed = signs[1:] != signs[:-1]
    assert not (found.proven & crossed).any()
    assert (found.proven | crossed).mean() > 0.9


def tangent_jacobian(machine: AsBuiltPentapod, p: np.ndarray, i: np.ndarray) -> np.ndarray:
    """∂legs/∂(x, y, z, A, B) by central differences of pentakins' struts: a numerical oracle with other unknowns."""
    x = np.r_[p, np.arcsin(-i[1]), np.arctan2(i[0], i[2])]
    steps = 1e-6 * np.eye(5)
    return np.stack([(struts(x + h, machine) - struts(x - h, machine)) / 2e-6 for h in steps], axis=1)


def struts(x: np.ndarray, machine: AsBuiltPentapod) -> np.ndarray:
    a, b = x[3:]
    rx = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    ry = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    local = (machine.base - x[:3]) @ (ry @ rx)
    return np.hypot(local[:, 2] - machine.offsets, np.hypot(local[:, 0], local[:, 1]) - machine.radii) + machine.zeros


@pytest.mark.parametrize("degree", [1, 3, 5])
def test_the_proven_end_is_where_small_steps_lead(nominal, degree):
    machine = with_errors(nominal, 5e-3, seed=2)
    rng = np.random.default_rng(degree)
    p, i = smooth_motion(40)
    legs = machine.leg_lengths(p, i)
    inner = np.linspace(0, 1, degree + 1)[1:-1]
    controls = [legs[:-1] + s * (legs[1:] - legs[:-1]) + 1e-3 * rng.normal(size=(40, 5)) for s in inner]
    coefficients = np.stack([legs[:-1], *controls, legs[1:]], axis=-1)
    found = certify_motion(machine, coefficients, p, i)
    assert found.proven.mean() > 0.9
    for n in np.flatnonzero(found.proven)[::9]:
        x = np.r_[p[n], np.arcsin(-i[n, 1]), np.arctan2(i[n, 0], i[n, 2])]
        for t in np.linspace(0, 1, LOOKS)[1:]:
            row = coefficients[n]
            while row.shape[-1] > 1:
                row = (1 - t) * row[:, :-1] + t * row[:, 1:]
            x = fsolve(lambda x, want=row[:, 0]: struts(x, machine) - want, x, xtol=1e-12)
        assert np.abs(x[:3] - found.position[n + 1]).max() < 1e-9


def test_leg_errors_and_sensitivity(nominal):
    machine = with_errors(nominal, 1e-3, seed=4)
    p, i = smooth_motion(1500)
    coefficients = linear(machine.leg_lengths(p, i))
    exact = certify_motion(machine, coefficients, p, i)
    loose = certify_motion(machine, coefficients, p, i, leg_error=1e-5)
    assert exact.holds
    assert loose.holds
    assert not certify_motion(machine, coefficients, p, i, leg_error=0.05).holds
    jumping = coefficients + np.random.default_rng(0).uniform(-1e-5, 1e-5, (1500, 5, 1))
    assert certify_motion(machine, jumping, p, i, leg_error=1e-5).holds
    inverse = np.linalg.inv([tangent_jacobian(machine, *pose) for pose in zip(p, i, strict=True)])
    moved = np.abs(inverse[:, :3]).sum(axis=2).max(axis=1)
    assert (np.maximum(moved[:-1], moved[1:]) <= exact.position_sensitivity).all()
    assert np.median(exact.position_sensitivity / moved[:-1]) < 2.0
    h = 1e-7
    for n, leg in [(0, 0), (100, 3), (1499, 4)]:
        turned = as_built_pose(machine, nominal, machine.leg_lengths(p[n], i[n]) + h * np.eye(5)[leg], (1, 1))
        assert np.abs(turned.direction - i[n]).max() <= h * exact.direction_sensitivity[n] * 1.0001
    assert exact.direction_sensitivity.max() < 100.0


def test_a_crossing_is_refuted_where_it_is(nominal):
    tilt = np.linspace(-0.2, 0.2, 42)
    i = np.c_[np.cos(tilt), 0 * tilt, np.sin(tilt)]
    p = np.tile([0.0, 0.05, 0.6], (42, 1))
    machine = AsBuiltPentapod.of(nominal)
    found = certify_motion(machine, linear(machine.leg_lengths(p, i)), p, i)
    assert not found.holds
    assert set(np.flatnonzero(~found.proven)) <= {19, 20, 21}
    assert np.flatnonzero(found.refuted).tolist() == [20], "w changes its sign in the middle of interval 20"
    assert (found.undecided == ~(found.proven | found.refuted)).all()
    assert not found.proven[20]
    assert (found.stop[found.proven] == 1.0).all()
    w, s = singularity_values(nominal, p, i)
    assert w[20] < 0.0 < w[21]
    assert (s != 0).all()


def test_bad_input(nominal):
    machine = AsBuiltPentapod.of(nominal)
    p, i = smooth_motion(3)
    c = linear(machine.leg_lengths(p, i))
    with pytest.raises(ArrayError, match=r"leg_coefficients has shape \(3, 4, 2\)"):
        certify_motion(machine, c[:, :4], p, i)
    with pytest.raises(ArrayError, match=r"position has shape \(3, 3\); expected shape \(4, 3\)"):
        certify_motion(machine, c, p[:3], i)
    with pytest.raises(ArrayError, match="leg_coefficients is not finite"):
        certify_motion(machine, np.where(c == c[0, 0, 0], np.nan, c), p, i)
    with pytest.raises(ArrayError, match="positive lengths"):
        certify_motion(machine, -c, p, i)
    with pytest.raises(ArrayError, match="jump between interval 1 and the next"):
        certify_motion(machine, c + np.array([0, 0, 1e-9])[:, None, None], p, i)
    with pytest.raises(ArrayError, match="leg_error"):
        certify_motion(machine, c, p, i, leg_error=-1.0)
    assert certify_motion(machine, np.empty((0, 5, 2)), p[:1], i[:1]).holds
    lost = certify_motion(machine, c, np.where(p == p[1], np.nan, p), i)
    assert lost.proven.tolist() == [False, False, True]
