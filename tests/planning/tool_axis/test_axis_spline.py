"""The spline of the tool axis: its cost against sums by hand, its cone, and the banded program against IPOPT."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planning_instances import instances
from scipy import sparse

from pentapod.numerics.convex.banded_qp import BandedQP, SoftRows
from pentapod.planning.placement.sampling import SamplingOptions, first_candidate, first_guesses
from pentapod.planning.problem.problem import PlacementProblem
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.planning.tool_axis.smoothing import smoothed
from pentapod.planning.tool_axis.spline import BANDS, OPTIONS, AxisSpline

CONE = 0.3


def spline_of(k):
    instance = instances(k + 1)[k]
    task = ToolpathSamples.of(instance.toolpath, 0.28)
    return task, AxisSpline.of(task, CONE)


def random_coefficients(spline, rng):
    c = rng.normal(size=(spline.hessian.shape[1] // 2, 2))
    return c / np.maximum(1.0, np.linalg.norm(c, axis=1, keepdims=True))


@given(st.integers(0, 11), st.integers(0, 1000))
@settings(max_examples=20)
def test_coefficients_in_the_disc_keep_the_cone(k, seed):
    task, spline = spline_of(k)
    leans = spline.leans(random_coefficients(spline, np.random.default_rng(seed)))
    assert np.linalg.norm(leans, axis=1).max() <= CONE * (1.0 + 1e-12)
    np.testing.assert_allclose((leans * task.nominal).sum(axis=1), 0.0, atol=1e-12)


@pytest.mark.parametrize("k", [0, 4, 8])
def test_a_smooth_field_of_leans_is_fitted(k):
    task, spline = spline_of(k)
    wave = 0.1 * np.sin(20.0 * task.tilt_centres)
    wanted = wave - (wave * task.nominal).sum(axis=1, keepdims=True) * task.nominal
    assert np.abs(spline.leans(spline.fitted(wanted)) - wanted).max() < 0.02 * np.abs(wanted).max()


def test_the_cost_is_the_mean_square_of_rates_and_bends():
    """On a straight path over a flat part, with a lean of one wavelength: against the integrals by hand."""
    length, wavelength = 0.4, 0.1
    x = np.linspace(0.0, length, 4001)
    task = ToolpathSamples(np.c_[x, 0.0 * x, 0.0 * x], np.tile([0.0, 0.0, 1.0], (len(x), 1)), 0.0, 0.28)
    spline = AxisSpline.of(task, CONE)
    frequency = 2.0 * np.pi / wavelength
    lean = np.zeros((len(x), 3))
    lean[:, 0] = 0.1 * np.sin(frequency * x)
    share = (OPTIONS.foresight * frequency) ** 2
    expected = 0.5 * 0.1**2 * (share**2 + share + OPTIONS.upright_weight)
    assert spline.cost_of(spline.fitted(lean)) == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("k", [2, 5])
def test_the_cost_is_a_quadratic_with_its_gradient(k):
    _, spline = spline_of(k)
    rng = np.random.default_rng(0)
    c, d = random_coefficients(spline, rng), random_coefficients(spline, rng)
    h = 1e-4
    slope = (spline.cost_of(c + h * d) - spline.cost_of(c - h * d)) / (2.0 * h)
    expected = (spline.whole_hessian() @ c.ravel() + spline.gradient) @ d.ravel()
    assert slope == pytest.approx(expected, rel=1e-6)
    assert spline.cost_of(c) >= 0.0


@pytest.mark.parametrize("seed", range(4))
def test_the_banded_program_is_solved_as_ipopt_solves_it(seed):
    rng = np.random.default_rng(seed)
    task, spline = spline_of(seed)
    point = np.sort(rng.integers(0, len(task.tilt_centres), 150))
    slopes, upper = rng.normal(size=(len(point), 2)), rng.uniform(0.05, 0.5, len(point))
    centre = np.zeros((spline.hessian.shape[1] // 2, 2))
    scale = spline.cost_of(centre)
    program = BandedQP(spline.hessian, spline.gradient, scale, spline.basis, point, slopes, upper, centre, 0.8)
    found = program.solved()
    assert ((slopes * (spline.basis @ found)[point]).sum(axis=1) <= upper + 1e-5).all()
    assert np.linalg.norm(found, axis=1).max() <= 0.8 + 1e-3

    c = ca.MX.sym("c", 2, len(centre))
    x, leans = ca.vec(c), ca.mtimes(c, ca.DM(spline.basis[point].T))
    problem = {
        "x": x,
        "f": (0.5 * ca.bilin(ca.DM(spline.whole_hessian()), x, x) + ca.dot(ca.DM(spline.gradient), x)) / scale,
        "g": ca.vertcat(upper - ca.sum1(slopes.T * leans).T, 0.64 - ca.sum1(c * c).T),
    }
    solver = ca.nlpsol("s", "ipopt", problem, {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes"})
    theirs = np.asarray(solver(x0=0.0, lbg=0.0)["x"]).reshape(-1, 2)
    assert spline.cost_of(found) == pytest.approx(spline.cost_of(theirs), rel=1e-4)


@pytest.mark.parametrize("seed", range(3))
def test_soft_rows_are_exceeded_where_it_pays(seed):
    """Against IPOPT, with excesses as unknowns of its own; cheap and dear rows, the last of them at the path's end."""
    rng = np.random.default_rng(seed)
    _, spline = spline_of(seed)
    centre = np.zeros((spline.hessian.shape[1] // 2, 2))
    starts = 2 * np.append(rng.integers(0, len(centre) - 5, 60), len(centre) - 4)
    windows = rng.normal(size=(61, BANDS))
    windows[-1, 8:] = 0.0
    soft = SoftRows(windows, starts, rng.uniform(-0.3, 0.1, 61), 10.0 ** rng.uniform(-4.0, 2.0, 61))
    none = np.zeros(0, dtype=np.intp)
    program = BandedQP(
        spline.hessian,
        spline.gradient,
        0.01,
        spline.basis[none],
        none,
        np.zeros((0, 2)),
        np.zeros(0),
        centre,
        2.0,
        soft,
    )
    found = program.solved()

    x, excess = ca.MX.sym("x", centre.size), ca.MX.sym("t", 61)
    matrix = np.zeros((61, centre.size + BANDS))
    for row, start, window in zip(matrix, starts, windows, strict=True):
        row[start : start + BANDS] = window
    matrix = matrix[:, : centre.size]
    c = ca.reshape(x, 2, len(centre))
    own = 0.5 * ca.bilin(ca.DM(spline.whole_hessian()), x, x) + ca.dot(ca.DM(spline.gradient), x)
    problem = {
        "x": ca.vertcat(x, excess),
        "f": own + ca.dot(soft.weight, excess**2),
        "g": ca.vertcat(soft.upper + excess - ca.mtimes(ca.DM(sparse.csc_matrix(matrix)), x), 1.0 - ca.sum1(c * c).T),
    }
    options = {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes", "ipopt.tol": 1e-10}
    theirs = ca.nlpsol("s", "ipopt", problem, options)(x0=0.0, lbg=0.0)
    assert program.cost_of(found) == pytest.approx(float(theirs["f"]), rel=1e-4)
    assert (matrix @ found.ravel() > soft.upper + 1e-3).sum() > 5  # some are exceeded


def test_a_program_without_interior_has_no_answer():
    _, spline = spline_of(0)
    centre = np.zeros((spline.hessian.shape[1] // 2, 2))
    point, slopes = np.array([3, 3]), np.array([[1.0, 0.0], [-1.0, 0.0]])
    program = BandedQP(
        spline.hessian, spline.gradient, 1.0, spline.basis, point, slopes, np.array([-0.2, -0.2]), centre, 2.0
    )
    assert program.solved() is None


@pytest.mark.parametrize(
    "moved", [[0.0, 0.0, 0.0], [0.0, 0.01], [0.0, 0.0, 0.01, 0.01], [0.0, 1e-12], [0.0, 0.01, 0.0]]
)
def test_short_paths_and_single_places_have_a_course(moved, desk):
    """Down to a tool that stands still: smooth axes at one place lean as little as the margin lets them."""
    tilt_centres = np.array(moved)[:, None] * [1.0, 0.0, 0.0]
    task = ToolpathSamples(tilt_centres, np.tile([0.0, 0.0, 1.0], (len(tilt_centres), 1)), 0.003, 0.2)
    problem = PlacementProblem.of(task, desk)
    guess = next(first_guesses(problem, options=SamplingOptions(tries=500)))
    start = first_candidate(problem, guess.margins, guess.transform)
    strict = problem.values_of(start.margins, start.transform, np.zeros_like(tilt_centres)).min()
    smooth = smoothed(problem, start, strict - 0.01)
    assert np.linalg.norm(AxisSpline.of(problem.samples, problem.cone).leans(smooth), axis=1).max() < 1e-3
