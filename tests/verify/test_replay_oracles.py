"""Claims against brute force that shares no formula with them: scipy's spline, Newton's FK, dense sampling."""

import numpy as np
import pytest
import replay_cases as cases
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares

from pentapod.geometry.interpolant import Interpolant
from pentapod.machine import clearances
from pentapod.verify import verify


@pytest.fixture(params=["cubic", "linear"])
def good(request):
    return request.getfixturevalue(request.param)


@pytest.fixture
def found(good):
    verdict = verify(good.program, good.machine, good.toolpath, **cases.TOLERANCES)
    return {c.claim: c for c in verdict.certificates}


def interpolant(program):
    if program.interpolation == "cubic":
        return CubicSpline(program.times, program.legs, axis=0, bc_type="clamped")
    return lambda t: np.stack([np.interp(t, program.times, leg) for leg in program.legs.T], axis=1)


def dense_times(program, per_interval):
    return np.linspace(0.0, program.duration, (len(program.legs) - 1) * per_interval + 1)


def newton_pose(machine, legs, guess):
    """Position and direction by least squares on b_i − a_i, from a nearby pose."""
    base = np.column_stack([machine.robot.base, np.zeros(5)])

    def residual(x):
        joints = x[:3] + machine.robot.offsets[:, None] * x[3:]
        return np.append(np.linalg.norm(joints - base, axis=1) - legs, x[3:] @ x[3:] - 1.0)

    solved = least_squares(residual, guess, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    assert np.abs(solved.fun).max() < 1e-12
    return solved.x


def motion_of(program):
    return Interpolant.through(program.legs, program.period, program.interpolation)


def test_motion_is_the_interpolant(good):
    motion, spline = motion_of(good.program), interpolant(good.program)
    times = dense_times(good.program, 2)
    np.testing.assert_allclose(motion.halves, spline(times), atol=1e-13)
    # The polynomials, at a third of each interval.
    t = 1.0 / 3.0
    k = motion.degree
    weights = {1: [1 - t, t], 3: [(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t * t * (1 - t), t**3]}[k]
    thirds = good.program.times[:-1] + t * good.program.period
    np.testing.assert_allclose(motion.bernstein @ weights, spline(thirds), atol=1e-13)


def test_extrema_of_the_legs(good, found):
    dense = interpolant(good.program)(dense_times(good.program, 16))
    assert found["legs not too long"].value == pytest.approx(1e3 * dense.max(), abs=1e-6)
    assert found["legs not too short"].value == pytest.approx(1e3 * dense.min(), abs=1e-6)


def test_poses_and_deviation_by_newton(good, found):
    """Poses at 150 times between the rows, by Newton; distance to the whole toolpath, order ignored."""
    replay = cases.replay_of(good)
    random = np.random.default_rng(3)
    times = np.sort(random.uniform(0.0, good.program.duration, 150))
    legs = interpolant(good.program)(times)
    inverse = np.linalg.inv(good.program.placement.matrix)
    tilt_centres = []
    for t, lengths in zip(times, legs, strict=True):
        sample = int(t / good.program.period * 2)
        guess = np.concatenate([replay.pose[0][sample], replay.pose[1][sample]])
        x = newton_pose(good.machine, lengths, guess)
        axis = -x[3:]
        tilt_centre = x[:3] - good.machine.tool_length * axis + good.toolpath.tilt_centre * axis
        tilt_centres.append((inverse @ np.append(tilt_centre, 1.0))[:3])
        near = 0.5 * (replay.tilt_centres[sample] + replay.tilt_centres[sample + 1])
        assert np.linalg.norm(tilt_centres[-1] - near) < 1e-4
    tilt_centres, way = np.array(tilt_centres), good.toolpath.tilt_centres
    step = np.diff(way, axis=0)
    square = np.maximum(np.einsum("ij,ij->i", step, step), 1e-300)
    off = tilt_centres[:, None] - way[:-1]
    t = np.clip(np.einsum("nij,ij->ni", off, step) / square, 0.0, 1.0)
    distance = np.linalg.norm(off - t[..., None] * step, axis=2).min(axis=1)
    assert distance.max() <= 1e-3 * found["tip deviation"].value + 1e-12


def test_tip_deviation_is_tight(good, found):
    """At the rows, against the curve the program was made from: the toolpath's sagitta and little more."""
    fine = [part.pose(np.linspace(0, 1, 50 * (part.count - 1) + 1)) for part in cases.strokes()]
    sagitta = 0.0
    for part, (tips, axes) in zip(cases.strokes(), fine, strict=True):
        tilt_centres = tips + cases.BALL * axes
        chords = tilt_centres[::50]
        f = np.linspace(0, 1, 51)[None, :, None]
        lines = chords[:-1, None] * (1 - f) + chords[1:, None] * f
        for k in range(part.count - 1):
            sagitta = max(sagitta, np.linalg.norm(tilt_centres[50 * k : 50 * k + 51] - lines[k], axis=1).max())
    assert 1e-3 * found["tip deviation"].value <= sagitta + 3e-6


def test_axis_deviation_is_the_lean(found):
    assert found["axis deviation"].value == pytest.approx(np.degrees(0.5 * cases.TILT), abs=0.02)


def test_fastest_moment_by_finite_differences(good, found):
    """The proven speeds are no less than any momentary speed, and little more than the largest."""
    replay = cases.replay_of(good)
    bounds = replay.interval_bounds.speeds[:, 0]
    spline, step = interpolant(good.program), 1e-6
    moments = (np.arange(len(bounds)) + np.linspace(0.01, 0.99, 7)[:, None]) * 0.5 * good.program.period
    tips = []
    for shift in (-0.5 * step, 0.5 * step):
        position, direction = good.machine.robot.pose(spline(moments.ravel() + shift), good.program.component)
        tips.append(position + good.machine.tool_length * direction)
    speeds = (np.linalg.norm(tips[1] - tips[0], axis=1) / step).reshape(7, -1).max(axis=0)
    assert (bounds >= speeds - 2e-6).all()  # what rounding does to the differences
    assert (bounds <= speeds + 2e-3 * cases.RAPID).all()
    assert found["rapid rate"].value <= 6e4 * speeds.max() * 1.001


@pytest.mark.parametrize("kind", ["cut", "link", "rapid"])
def test_feeds_are_those_of_the_time_law(good, found, kind):
    claim = {"cut": "feed on cuts", "link": "feed on links", "rapid": "rapid rate"}[kind]
    assert found[claim].passed
    assert found[claim].value == pytest.approx(0.98 * found[claim].bound, rel=0.02)


def test_joints_and_bodies_by_dense_sampling(good, found):
    spline, machine = interpolant(good.program), good.machine
    position, direction = machine.robot.pose(spline(dense_times(good.program, 5)), good.program.component)
    base = np.column_stack([machine.robot.base, np.zeros(5)])
    joints = position[:, None] + machine.robot.offsets[:, None] * direction[:, None]
    unit = (joints - base) / np.linalg.norm(joints - base, axis=2, keepdims=True)
    cone = np.degrees(np.arccos((unit * machine.joints.base_axes).sum(axis=2))).max()
    platform = np.degrees(np.arccos((-unit * -direction[:, None]).sum(axis=2)))
    digits = 1e-9  # values in a verdict have twelve
    assert cone - digits <= found["base joint cones"].value <= cone + 1e-3
    assert platform.max() - digits <= found["platform joints not too open"].value <= platform.max() + 1e-3
    assert platform.min() + digits >= found["platform joints not too closed"].value >= platform.min() - 1e-3
    free = 1e3 * clearances(machine, position, direction).min()
    assert free + digits >= found["clearance between legs and shaft"].value >= free - 0.3


def test_component_bounds_by_dense_sampling(good, found):
    from pentapod.kinematics import position_distance

    legs = interpolant(good.program)(dense_times(good.program, 5))
    position, direction = good.machine.robot.pose(legs, good.program.component)
    upright = np.degrees(np.arcsin(np.abs(direction[:, 2]))).min()
    away = 1e3 * np.abs(position_distance(good.machine.robot, position, direction)).min()
    assert 0.98 * upright <= found["component kept, w"].value <= upright
    # The claim divides by 1 + δ, the largest that the norm of the plane's normal can be.
    assert 0.7 * away <= found["component kept, S"].value <= away


def test_places_are_in_the_program_and_on_the_toolpath(good, found):
    for certificate in found.values():
        where = certificate.where
        if where.row is not None:
            assert 0 <= where.row < len(good.program.legs)
            assert where.time_s is not None
            assert abs(where.time_s - where.row * good.program.period) <= good.program.period
            assert where.segment is not None
            assert 0 <= where.segment < len(good.toolpath.segments)


def test_accelerations_and_jerks_say_how_the_rows_are_joined(good, found):
    """Jerks are judged by the limit as stated: nothing is added for what rounding makes of them."""
    linear = good.program.interpolation == "linear"
    words = "difference of the rows" if linear else "derivative of the spline"
    assert words in found["leg accelerations"].method
    assert words in found["leg jerks"].method
    assert found["leg jerks"].method.endswith("; 0.1% more is tolerated")
