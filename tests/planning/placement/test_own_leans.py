"""Leans along the path alone, where no tilt field over the part keeps the limits."""

from __future__ import annotations

import importlib
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
import pytest

from pentapod.base.progress import silent
from pentapod.geometry.directions import angle_between
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.component import Component
from pentapod.planning import PlacedPath, PlacementConstraints, plan
from pentapod.planning.limits.limit import LimitKind
from pentapod.planning.placement import own_leans
from pentapod.planning.placement.lean_choice import LeanChoice
from pentapod.planning.placement.own_leans import OwnLeans, in_cones
from pentapod.planning.placement.placed_path import UnplacedPath
from pentapod.planning.placement.sampling import best_tilted_margins
from pentapod.planning.problem.common_axis import CommonAxis
from pentapod.planning.problem.problem import PlacementProblem
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.planning.problem.tilt_field import lean
from pentapod.planning.problem.weights import NEEDED_MARGIN
from pentapod.planning.tool_axis.axis_programs import AxisPrograms
from pentapod.planning.tool_axis.restoration import restored_everywhere
from pentapod.planning.tool_axis.smoothing import _Smoothing, smoothed
from pentapod.planning.tool_axis.smoothing_options import OPTIONS as SMOOTHING
from pentapod.planning.tool_axis.spline import AxisSpline, stations_of
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath

TILT = np.radians(20.0)


@dataclass(frozen=True)
class Sway:
    """The axis has to sway along y, from side to side within `wave` metres: at most `off` from a sine."""

    middle: float
    wave: float
    off: float
    height: float = 0.2
    name: str = "sway"
    unit: str = "1"
    group: str = "bodies"

    def margin(self, pose):
        turn = 2.0 * np.pi * (pose.tip[1] - self.middle) / self.wave
        wanted = self.height * (np.sin(turn) if isinstance(turn, np.ndarray) else ca.sin(turn))
        return 1.0 - (pose.axis[0] - wanted) ** 2 / self.off**2

    def shortfall(self, margin):
        return self.off * (np.sqrt(1.0 - margin) - 1.0)


def zigzag(passes: int = 9, width: float = 0.06) -> Toolpath:
    """Passes along x on a plane, between which the tool moves on along y."""
    across = np.linspace(-0.5 * width, 0.5 * width, 40)
    rows = [
        np.c_[across[:: 1 - 2 * (k % 2)], np.full(40, y), np.zeros(40)]
        for k, y in enumerate(np.linspace(-0.5 * width, 0.5 * width, passes))
    ]
    places = np.concatenate(rows)
    return Toolpath((Segment(SegmentKind.CUT, places, np.tile([0.0, 0.0, 1.0], (len(places), 1)), 0.02),), 0.003)


@pytest.fixture(scope="module")
def here(desk):
    return RigidTransform(np.diag([1.0, -1.0, -1.0]), desk.work.centre)


def options(desk, here, wave, off=0.08):
    sway = Sway(float(here.translation[1]), wave, off)
    return {"tilt": TILT, "constraints": PlacementConstraints.fixture([here]), "limits": (LimitKind(lambda _: [sway]),)}


def test_leans_follow_the_path_where_no_field_over_the_part_fits(desk, here):
    placed = plan(zigzag(), desk, **options(desk, here, 0.03))
    assert isinstance(placed, PlacedPath), str(placed)
    assert placed.margins.min() >= NEEDED_MARGIN
    wanted = 0.2 * np.sin(2.0 * np.pi * (placed.tips[:, 1] - here.translation[1]) / 0.03)
    assert np.abs(placed.axes[:, 0] - wanted).max() < 0.08
    assert np.ptp(wanted) > 0.38
    turned = np.linalg.norm(np.diff(placed.axes, axis=0), axis=1)
    assert turned.max() < 0.1  # of the 0.2 from pass to pass: the axis sets out before


def test_the_same_path_without_a_pass_keeps_placement_and_leans(desk, here):
    """Also where it may move: what was found for the whole path holds for a part of it."""
    path, asked = zigzag(), options(desk, here, 0.03)
    whole = plan(path, desk, **asked)
    cut = path.segments[0]
    rest = Toolpath((replace(cut, tips=cut.tips[40:], axes=cut.axes[40:]),), path.tilt_centre)
    near = PlacementConstraints.free(
        low=here.translation - 0.02, high=here.translation + 0.02, reference=here, largest_turn=0.1
    )
    again = plan(rest, desk, **{**asked, "constraints": near}, start=whole)
    assert isinstance(again, PlacedPath), str(again)
    assert again.smallest_margin >= NEEDED_MARGIN
    np.testing.assert_allclose(again.placement.transform.matrix, whole.placement.transform.matrix, atol=1e-12)
    # Smoothed again, above all where the pass was; elsewhere they hardly change.
    assert np.median(np.degrees(angle_between(again.axes, whole.axes[40:]))) < 3.0
    # Where that plan does not keep the limits, both are searched for.
    short = replace(whole, margins=whole.margins - 1.0)
    other = plan(rest, desk, **{**asked, "constraints": near}, start=short)
    assert np.abs(other.placement.transform.matrix - whole.placement.transform.matrix).max() > 1e-6


def test_leans_that_keep_a_part_of_the_margin_are_not_searched_for_again(desk, here, monkeypatch):
    """They were found for all waypoints: another search does not know more."""
    searches: list[int] = []

    def counted(problem, *rest):
        searches.append(len(problem.samples.tilt_centres))
        return searched(problem, *rest)

    planner = importlib.import_module("pentapod.planning.plan")
    searched = planner._searched
    monkeypatch.setattr(planner, "_searched", counted)
    monkeypatch.setattr(own_leans, "ENOUGH", 0.3 * NEEDED_MARGIN)
    monkeypatch.setattr(ToolpathSamples, "shaping", lambda samples, _: np.arange(0, len(samples.tilt_centres), 3))
    placed = plan(zigzag(), desk, **options(desk, here, 0.03))
    assert isinstance(placed, PlacedPath), str(placed)
    assert 0.59 * NEEDED_MARGIN < placed.smallest_margin < NEEDED_MARGIN
    assert searches == [120]


def test_no_field_fits_there_but_every_waypoint_by_itself(desk, here):
    samples = ToolpathSamples.of(zigzag(), TILT)
    asked = options(desk, here, 0.03)
    problem = PlacementProblem.of(samples, desk, asked["constraints"], limits=asked["limits"])
    start = problem.candidate(problem.margins[0], here, problem.upright)
    own = OwnLeans.of(problem, start)
    assert 50 < len(own.rows) < len(samples.tilt_centres)
    assert own.fit
    leans = own.along_path()
    assert leans is not None
    assert problem.values_of(start.margins, here, leans).min() >= NEEDED_MARGIN
    mixed = problem.values_of(start.margins, here, own.mixed).min(axis=1)
    assert (mixed >= NEEDED_MARGIN).all()


@pytest.fixture
def swaying(desk, here):
    """A problem in which the axis sways, a candidate whose field falls short, and the waypoints' own leans."""
    asked = options(desk, here, 0.03)
    samples = ToolpathSamples.of(zigzag(), TILT)
    problem = PlacementProblem.of(samples, desk, asked["constraints"], limits=asked["limits"])
    start = problem.candidate(problem.margins[0], here, problem.upright)
    return problem, start, OwnLeans.of(problem, start).mixed


def smallest(problem, start, coefficients) -> float:
    leans = AxisSpline.of(problem.samples, problem.cone).leans(coefficients)
    return float(problem.values_of(start.margins, start.transform, leans).min())


@pytest.mark.parametrize(("keep", "at_least"), [(0.3, 0.3), (0.5, 0.25), (0.9, None)])
def test_a_part_of_the_margin_is_enough_where_no_spline_comes_up_to_it(keep, at_least, swaying):
    problem, start, leans = swaying
    found = smoothed(problem, start, keep, leans=leans)
    assert (found is None) == (at_least is None)
    if found is not None:
        kept = smallest(problem, start, found)
        assert kept >= at_least - SMOOTHING.slack
        assert kept <= keep + 1e-3


def test_leans_that_fall_short_at_some_places_go_back_to_those_that_do_not_there(swaying):
    problem, start, leans = swaying
    programs = AxisPrograms(problem, start, SMOOTHING)
    begun, margins = restored_everywhere(programs, programs.spline.fitted(leans), 0.1)
    run = _Smoothing(programs, 0.1, silent, begun, margins, own=True)
    smooth = run.smoothest()
    spoilt = smooth.copy()
    spoilt[20:24, 0] += 0.5
    run.begin_at(spoilt, run.rows)
    assert run.at.short > 0.1
    run.return_to(begun)
    assert run.at.short <= SMOOTHING.slack
    np.testing.assert_allclose(run.at.c[60:], smooth[60:], atol=1e-12)
    assert run.at.cost < run.trial(begun).cost


def test_where_no_smoother_leans_are_found_the_first_that_fit_count(swaying):
    """They are rougher, but keep the margin at all waypoints."""
    problem, start, leans = swaying
    smooth = smoothed(problem, start, 0.1, leans=leans)
    found = smoothed(problem, start, 0.1, replace(SMOOTHING, steps=0), leans=leans)
    spline = AxisSpline.of(problem.samples, problem.cone)
    assert smallest(problem, start, found) >= 0.1 - SMOOTHING.slack
    assert spline.cost_of(found) > 1.5 * spline.cost_of(smooth)


def test_leans_far_from_all_limits_are_smoothed(swaying):
    """No margin is near the one to keep: the program around them has no rows."""
    problem, start, leans = swaying
    found = smoothed(problem, start, -5.0, leans=leans)
    assert found is not None
    spline = AxisSpline.of(problem.samples, problem.cone)
    assert spline.cost_of(found) <= spline.cost_of(spline.fitted(leans)) + 1e-12


def leaning(path: Toolpath, degrees: float) -> Toolpath:
    """The path with own axes that lean along y, as on a wall."""
    axis = [0.0, np.sin(np.radians(degrees)), np.cos(np.radians(degrees))]
    segments = tuple(replace(each, axes=np.tile(axis, (len(each.tips), 1))) for each in path.segments)
    return replace(path, segments=segments)


@pytest.fixture
def walls(desk, here):
    """A path with own axes of 78 deg, and what `plan` is asked for: the axis has to sway by 24 deg."""
    sway = Sway(float(here.translation[1]), 0.03, 0.08, height=0.4)
    upright = replace(PlacementConstraints.fixture([here]), upright=np.eye(3)[2], normal=-np.eye(3)[2])
    asked = {"common_axis": True, "constraints": upright, "limits": (LimitKind(lambda _: [sway]),)}
    return leaning(zigzag(), 78.0), asked


def test_a_path_that_was_planned_with_wide_leans_keeps_them(desk, walls, monkeypatch):
    path, asked = walls
    whole = plan(path, desk, tilt=np.radians(90.0), **asked)
    monkeypatch.delattr(importlib.import_module("pentapod.planning.plan"), "improved_from")  # nothing is searched for
    cut = path.segments[0]
    rest = Toolpath((replace(cut, tips=cut.tips[40:], axes=cut.axes[40:]),), path.tilt_centre)
    again = plan(rest, desk, tilt=np.radians(90.0), start=whole, **asked)
    assert again.smallest_margin >= NEEDED_MARGIN
    assert np.ptp(again.axes[:, 0]) > 0.6


@pytest.fixture
def beyond(desk, here, walls):
    """A smoothing that begins with leans to one side alone, which are 79 deg from the own axes, where 78.5 may be.

    The tip stays where it is, so that leans along y gain nothing else.
    """
    (path, asked), limit = walls, np.radians(78.5)
    path = replace(path, tilt_centre=0.0)
    samples = ToolpathSamples.of(path, np.radians(15.0)).towards(CommonAxis(np.eye(3)[2], 0.0, limit))
    problem = PlacementProblem.of(samples, desk, asked["constraints"], limits=asked["limits"])
    wide = in_cones(problem, path.axes, limit)[-1]
    turn = 2.0 * np.pi * wide.samples.machine_poses(here, path.axes)[0][:, 1] / 0.03
    leans = np.c_[0.4 * np.sin(turn - 2.0 * np.pi * here.translation[1] / 0.03), np.zeros((len(turn), 2))]
    start = wide.candidate(wide.margins[0], here, wide.upright)
    return wide, start, leans


def test_leans_beyond_the_limit_of_the_axes_come_inside(beyond):
    problem, start, leans = beyond
    assert problem.samples.inside(lean(problem.samples.nominal, leans)).min() < -1e-3
    found = smoothed(problem, start, 0.1, leans=leans)
    assert found is not None
    axes = lean(problem.samples.nominal, AxisSpline.of(problem.samples, problem.cone).leans(found))
    assert problem.samples.inside(axes).min() >= -SMOOTHING.slack
    assert smallest(problem, start, found) >= 0.1 - SMOOTHING.slack


class Off:
    """A limit that keeps the axis on the side from which the limit of the axes wants it back."""

    name, unit, group = "off", "1", "bodies"

    def margin(self, pose):
        return 0.1 + pose.axis[1]

    def shortfall(self, margin):
        return -margin


@pytest.mark.parametrize("keep", [0.04, 0.08, 0.1])
def test_the_limit_of_the_axes_is_kept_where_a_margin_pulls_the_other_way(keep, beyond, walls, desk):
    """The margin may be kept in part alone; the limit of the axes may not."""
    problem, start, leans = beyond
    kinds = (*walls[1]["limits"], LimitKind(lambda _: [Off()]))
    problem = PlacementProblem.of(problem.samples, desk, problem.constraints, limits=kinds)
    start = problem.candidate(problem.margins[0], start.transform, problem.upright)
    found = smoothed(problem, start, keep, leans=leans)
    assert found is not None
    axes = lean(problem.samples.nominal, AxisSpline.of(problem.samples, problem.cone).leans(found))
    assert problem.samples.inside(axes).min() >= -2.0 * SMOOTHING.slack
    assert smallest(problem, start, found) >= SMOOTHING.enough * keep


def test_no_lean_of_a_grid_beyond_the_limit_of_the_axes_is_chosen(beyond):
    problem, start, leans = beyond
    samples, rows = problem.samples, np.arange(0, 360, 30)
    choice = LeanChoice.of(problem, start, np.zeros_like(leans), rows, stations_of(samples))
    outside = samples.inside(lean(samples.nominal[choice.chosen], choice.grid), choice.chosen) < 0.0
    assert 0.2 < outside.mean() < 0.8
    np.testing.assert_array_equal(np.isneginf(choice.smallest), outside)
    _, best = best_tilted_margins(samples, start.margins, start.transform)
    assert samples.inside(lean(samples.nominal, best)).min() >= 0.0


@pytest.mark.parametrize(("degrees", "limit"), [(0.0, 90.0), (78.0, 90.0), (78.0, 78.5)])
def test_leans_that_no_cone_of_the_field_holds_are_found_within_the_limit(degrees, limit, desk, walls):
    """The axis has to lean by 24 deg, and a field holds 15; own axes of 78 deg leave it 12 of the limit of 90.

    To one side alone it would be 79 deg from these: with the last limit it has to lean towards them, too.
    """
    path, (_, asked) = leaning(zigzag(), degrees), walls
    placed = plan(path, desk, tilt=np.radians(limit), **asked)
    assert isinstance(placed, PlacedPath), str(placed)
    assert placed.margins.min() >= NEEDED_MARGIN
    assert np.ptp(placed.axes[:, 0]) > 0.6
    leant = angle_between(placed.placement.transform.inverse().rotate(placed.axes), path.axes)
    assert leant.max() < np.radians(limit) + SMOOTHING.slack
    # Beyond the limit nothing is tried.
    refused = plan(path, desk, tilt=np.radians(18.0), **asked)
    assert isinstance(refused, UnplacedPath)


def test_what_does_not_fit_by_itself_is_refused_by_name(desk, here):
    """The sine is higher than the cone lets the axis lean."""
    asked = {**options(desk, here, 0.03, off=0.02), "tilt": np.radians(8.0)}
    answer = plan(zigzag(), desk, **asked)
    assert isinstance(answer, UnplacedPath)
    assert {each.constraint for each in answer.diagnosis} == {"sway"}
    samples = ToolpathSamples.of(zigzag(), asked["tilt"])
    problem = PlacementProblem.of(samples, desk, asked["constraints"], limits=asked["limits"])
    own = OwnLeans.of(problem, problem.candidate(problem.margins[0], here, problem.upright))
    assert not own.fit
    assert own.along_path() is None


@dataclass(frozen=True)
class Flip(Sway):
    """The axis has to lean to one side on a pass, and to the other on the next one; `wave`: metres between them."""

    def margin(self, pose):
        turn = np.pi * (pose.tip[1] - self.middle) / self.wave
        wanted = np.sign(np.sin(turn)) if isinstance(turn, np.ndarray) else ca.sign(ca.sin(turn))
        return 1.0 - (pose.axis[0] - self.height * wanted) ** 2 / self.off**2


def test_a_refusal_names_the_places_where_leans_that_turn_evenly_do_not_fit(desk, here):
    """On every other pass the field leans to the wrong side; the axis cannot turn at once at the ends alone."""
    passes, along, apart = 6, 100, 1e-4
    x = np.linspace(-0.015, 0.015, along)
    rows = [np.c_[x[:: 1 - 2 * (k % 2)], np.full(along, (k + 0.5) * apart), np.zeros(along)] for k in range(passes)]
    tips = np.concatenate(rows)
    path = Toolpath((Segment(SegmentKind.CUT, tips, np.tile([0.0, 0.0, 1.0], (len(tips), 1)), 0.02),), 0.003)
    flip = Flip(float(here.translation[1]), apart, 0.03, height=0.15)
    asked = {**options(desk, here, 0.03), "limits": (LimitKind(lambda _: [flip]),), "component": Component(1, 1)}
    answer = plan(path, desk, **asked)
    assert isinstance(answer, UnplacedPath)
    (only,) = answer.diagnosis
    short = np.concatenate([np.arange(first, last + 1) for first, last in only.waypoints])
    assert 0 < len(short) < 60
    assert np.abs(tips[short, 0]).min() > 0.01
    assert (answer.attempt.margins.min(axis=1) < NEEDED_MARGIN).sum() == len(short)
