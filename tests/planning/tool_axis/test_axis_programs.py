"""Programs of the smoothing: parts of a step, and what shapes what."""

import numpy as np
import pytest

from pentapod.geometry.rigid import RigidTransform
from pentapod.planning.limits.limit import LimitKind
from pentapod.planning.problem.constraints import PlacementConstraints
from pentapod.planning.problem.problem import PlacementProblem
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.planning.tool_axis.axis_programs import AxisPrograms, shaped_by, shapes
from pentapod.planning.tool_axis.smoothing_options import OPTIONS


class Upright:
    """A limit that is nearer the more the axis leans along y."""

    name, unit, group = "upright", "1", "bodies"

    def margin(self, pose):
        return 0.2 - 3.0 * pose.axis[1]

    def shortfall(self, margin):
        return -margin


UPRIGHT = Upright()


@pytest.fixture(scope="module")
def programs(desk):
    here = RigidTransform(np.diag([1.0, -1.0, -1.0]), desk.work.centre)
    centres = np.c_[np.linspace(-0.04, 0.04, 200), np.zeros((200, 2))]
    samples = ToolpathSamples(centres, np.tile([0.0, 0.0, 1.0], (200, 1)), 3e-3, np.radians(20.0))
    limits = (LimitKind(lambda _: [UPRIGHT]),)
    problem = PlacementProblem.of(samples, desk, PlacementConstraints.fixture([here]), limits=limits)
    start = problem.candidate(problem.margins[0], here, problem.upright)
    return AxisPrograms(problem, start, OPTIONS)


def some(programs, seed):
    rng = np.random.default_rng(seed)
    return 0.3 * rng.normal(size=(programs.spline.basis.shape[1], 2)).clip(-1.0, 1.0)


def test_a_part_of_a_step_has_the_margins_of_its_coefficients(programs):
    """They are computed only where neither end has them."""
    rows = np.arange(0, 200, 3)
    now, trial = (programs.trial(some(programs, seed), rows, 0.1) for seed in (1, 2))
    shares = np.clip((np.arange(len(now.c)) - 10.0) / 8.0, 0.0, 1.0)
    asked, values = [], programs.values
    programs.values = lambda c, rows, keep: asked.append(len(rows)) or values(c, rows, keep)
    part = programs.between(now, trial, shares, rows)
    del programs.values
    again = programs.trial(part.c, rows, 0.1)
    np.testing.assert_allclose(part.margins, again.margins, atol=1e-12)
    assert part.cost == again.cost
    assert 0 < asked[0] < 0.6 * len(rows)


def test_rows_and_the_coefficients_that_shape_them(programs):
    basis = programs.spline.basis
    dense = basis.toarray() != 0.0
    of = np.zeros(basis.shape[1], dtype=np.bool_)
    of[[3, 17]] = True
    np.testing.assert_array_equal(shapes(basis, of), dense[:, of].any(axis=1))
    rows = np.arange(200) % 50 == 7
    np.testing.assert_array_equal(shaped_by(basis, rows), dense[rows].any(axis=0))
