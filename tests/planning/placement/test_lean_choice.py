"""The choice of leans that turn evenly: against all combinations, and between two sides on which a tool has room."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import pytest

from pentapod.geometry.polyline import arc_length
from pentapod.geometry.rigid import RigidTransform
from pentapod.planning import PlacementConstraints
from pentapod.planning.limits.limit import LimitKind
from pentapod.planning.placement.lean_choice import OPTIONS, LeanChoice
from pentapod.planning.placement.own_leans import OwnLeans
from pentapod.planning.problem.problem import PlacementProblem
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.planning.problem.tilt_field import lean
from pentapod.planning.problem.weights import NEEDED_MARGIN
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath


@dataclass(frozen=True)
class AsideAt:
    """Beyond a place, the axis has to lean along x, to either side; first a little more room is on one, then not."""

    middle: float
    name: str = "aside"
    unit: str = "1"
    group: str = "bodies"

    def margin(self, pose):
        better = 1.0 + 0.2 * (pose.tip[0] - self.middle) / 0.03 * pose.axis[0]
        return (pose.axis[0] ** 2 - 0.02) * 10.0 * better + (abs(pose.tip[0] - self.middle) > 0.02)

    def shortfall(self, margin):
        return -margin


def line(count: int = 60) -> Toolpath:
    places = np.c_[np.linspace(-0.03, 0.03, count), np.zeros((count, 2))]
    return Toolpath((Segment(SegmentKind.CUT, places, np.tile([0.0, 0.0, 1.0], (count, 1)), 0.02),), 0.003)


@pytest.fixture(scope="module")
def problem(desk):
    here = RigidTransform(np.diag([1.0, -1.0, -1.0]), desk.work.centre)
    limit = AsideAt(float(here.translation[0]))
    samples = ToolpathSamples.of(line(), np.radians(15.0))
    fixed = PlacementConstraints.fixture([here])
    return PlacementProblem.of(samples, desk, fixed, limits=(LimitKind(lambda _: [limit]),)), here


def test_the_leans_stay_on_one_side(problem):
    """The best lean of each waypoint by itself jumps from one side to the other."""
    problem, here = problem
    at = problem.candidate(problem.margins[0], here, problem.upright)
    own = OwnLeans.of(problem, at)
    assert own.fit
    assert 30 < len(own.rows) < 60
    assert np.ptp(np.sign(own.leans[:, 0])) == 2.0
    stations = arc_length(problem.samples.tilt_centres)
    choice = LeanChoice.of(problem, at, own.field, own.rows, stations)
    leans = choice.leans(np.full(60, 1.5 * NEEDED_MARGIN))
    assert np.ptp(np.sign(leans[own.rows, 0])) == 0.0
    values = problem.values_of(at.margins, here, leans).min(axis=1)
    assert values[own.rows].min() >= 1.5 * NEEDED_MARGIN
    # Before and after, the axis sets out and comes back; farther away it keeps to the field.
    far = np.abs(stations[:, None] - stations[own.rows]).min(axis=1) > OPTIONS.reach
    np.testing.assert_array_equal(leans[far], own.field[far])


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("chosen", [[1, 2, 3, 6, 7, 8], [0, 1, 2, 4, 5, 7]])
def test_no_combination_of_leans_costs_less(chosen, seed, problem):
    """Stretches in the middle of the path, and at its ends."""
    whole, _ = problem
    rng, rows = np.random.default_rng(seed), np.arange(0, 60, 7)
    short = replace(whole, samples=whole.samples.at(rows))
    stations, field = np.sort(rng.uniform(0.0, 0.05, len(rows))), np.zeros((len(rows), 3))
    chosen = np.array(chosen)
    grid = np.concatenate([field[None, chosen], np.dstack([rng.uniform(-0.3, 0.3, (2, 6, 2)), np.zeros((2, 6))])])
    smallest, wanted = rng.uniform(0.0, 0.06, (3, 6)), rng.uniform(0.01, 0.05, len(rows))
    choice = LeanChoice(short, field, chosen, grid, smallest, stations, replace(OPTIONS, short=2e3))

    def cost(picks: tuple[int, ...]) -> float:
        leans = field.copy()
        leans[chosen] = grid[picks, np.arange(6)]
        axes, there = lean(short.samples.nominal, leans), lean(short.samples.nominal, field)
        lengths = np.maximum(np.diff(stations), OPTIONS.shortest)
        total = sum(((axes[k + 1] - axes[k]) ** 2).sum() / lengths[k] for k in range(len(lengths)))
        for place, (row, pick) in enumerate(zip(chosen, picks, strict=True)):
            half = 0.5 * ((lengths[row - 1] if row else 0.0) + (lengths[row] if row < len(lengths) else 0.0))
            total += half / OPTIONS.back**2 * ((axes[row] - there[row]) ** 2).sum()
            total += 2e3 * max(wanted[row] - smallest[pick, place], 0.0)
        return total

    found = choice.leans(wanted)
    picks = tuple(int(np.abs(grid[:, k] - found[row]).sum(axis=1).argmin()) for k, row in enumerate(chosen))
    np.testing.assert_array_equal(found[chosen], grid[picks, np.arange(6)])
    assert cost(picks) <= min(map(cost, product(range(3), repeat=6))) + 1e-9
