"""plan: what it returns holds at every waypoint, is not beaten nearby, is repeatable, and refuses with reasons."""

import importlib
from dataclasses import replace

import numpy as np
import pytest
from domes import dome

from pentapod.base.refusal import Refusal
from pentapod.geometry.directions import angle_between
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.component import Component
from pentapod.machine.clearance.collision_world import NOTHING
from pentapod.planning import PlacedPath, PlacementConstraints, plan
from pentapod.planning.limits.margins import Margins
from pentapod.planning.placement.placed_path import UnplacedPath
from pentapod.planning.placement.sampling import best_tilted_margins
from pentapod.planning.plan import FEW, NEEDED_MARGIN, fits
from pentapod.planning.problem.constraints import FREE
from pentapod.planning.problem.formulation import cayley
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.planning.problem.weights import EVEN
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath

TILT = np.radians(15.0)
PLUS = Component(1, 1)


@pytest.fixture(scope="module")
def placed(cap_placed):
    return cap_placed


def test_every_waypoint_keeps_every_limit(desk, placed):
    """Limits from the robot's own kinematics, not from the margins' formula."""
    p = placed.tips + desk.tool_length * placed.axes
    legs = desk.robot.leg_lengths(p, -placed.axes)
    assert (legs > desk.legs.min_length).all()
    assert (legs < desk.legs.max_length).all()
    np.testing.assert_array_equal(desk.robot.branch(p, -placed.axes), np.tile(placed.component, (len(p), 1)))
    back_p, back_i = desk.robot.pose(legs, placed.component)
    np.testing.assert_allclose(back_p, p, atol=1e-10)
    np.testing.assert_allclose(back_i, -placed.axes, atol=1e-10)
    assert placed.smallest_margin >= NEEDED_MARGIN - 1e-3


def test_axes_stay_in_the_cone_and_the_tilt_centre_on_the_part(cap, placed):
    nominal = placed.placement.transform.rotate(cap.axes)
    assert angle_between(placed.axes, nominal).max() <= TILT
    np.testing.assert_allclose(placed.tilt_centres, placed.placement.transform.apply(cap.tilt_centres), atol=1e-12)


def test_axis_is_smooth_along_the_path(cap, placed):
    """Along a pass the axis turns hardly faster than the nominal one anywhere."""
    step = np.linalg.norm(np.diff(cap.tilt_centres, axis=0), axis=1)
    rate = angle_between(placed.axes[1:], placed.axes[:-1]) / step
    nominal = angle_between(cap.axes[1:], cap.axes[:-1]) / step
    assert rate.max() <= 1.5 * nominal.max()


def test_nearly_the_same_path_is_placed_from_the_plan_before(desk, cap, placed):
    """Without a pass, no worse than before; there is no other search, so a start elsewhere leads elsewhere."""
    first = cap.segments[0]
    shorter = replace(cap, segments=(replace(first, tips=first.tips[:-20], axes=first.axes[:-20]), *cap.segments[1:]))
    again = plan(shorter, desk, tilt=TILT, start=placed)
    assert again.component == placed.component
    assert again.smallest_margin >= 0.9 * placed.smallest_margin - 1e-3
    centre = cap.tilt_centres.mean(axis=0)
    apart = again.placement.transform.apply(centre) - placed.placement.transform.apply(centre)
    assert np.linalg.norm(apart) < 0.02
    moved = RigidTransform(placed.placement.transform.rotation, placed.placement.transform.translation + 0.05)
    elsewhere = replace(placed, placement=replace(placed.placement, transform=moved))
    other = plan(shorter, desk, tilt=TILT, start=elsewhere)
    assert isinstance(other, Refusal) or other.smallest_margin <= again.smallest_margin + 1e-3


def test_placement_is_not_beaten_by_small_moves(desk, cap, placed):
    """Random small placement moves, each with the best tilt at each waypoint alone, gain little."""
    rng = np.random.default_rng(5)
    rows = np.arange(0, len(cap), 4)
    few = ToolpathSamples(cap.tilt_centres[rows], cap.axes[rows], cap.tilt_centre, TILT)
    margins = Margins.of(desk, placed.component)
    t = placed.placement.transform
    here = best_tilted_margins(few, margins, t)[0].min()
    others = []
    for _ in range(60):
        turn = t.rotation @ cayley(rng.normal(scale=0.01, size=3))
        shift = rng.normal(scale=0.003, size=3) + t.translation
        others.append(best_tilted_margins(few, margins, RigidTransform(turn, shift))[0].min())
    assert max(others) <= here + 0.03


def test_tilt_gains_over_strict_normals(desk, cap, placed):
    strict = plan(cap, desk, tilt=0.0)
    if isinstance(strict, PlacedPath):
        np.testing.assert_allclose(strict.axes, strict.placement.transform.rotate(cap.axes), atol=1e-12)
        assert placed.smallest_margin > strict.smallest_margin
    else:
        assert strict.stage == "placement"


@pytest.mark.slow  # in the fast lane: test_determinism.py
def test_same_task_same_plan(desk, cap, placed):
    again = plan(cap, desk, tilt=TILT)
    assert isinstance(again, PlacedPath)
    np.testing.assert_array_equal(again.axes, placed.axes)
    np.testing.assert_array_equal(again.placement.transform.matrix, placed.placement.transform.matrix)


def test_given_placement_and_component_are_honoured(desk, cap, placed):
    given = PlacementConstraints.fixture([placed.placement.transform])
    answer = plan(cap, desk, tilt=TILT, constraints=given, component=placed.component)
    assert isinstance(answer, PlacedPath)
    assert answer.placement.transform is placed.placement.transform
    assert answer.placement.chosen_by == "job"
    assert answer.component == placed.component
    assert answer.smallest_margin >= NEEDED_MARGIN - 1e-3


def test_wrong_component_is_refused(desk, cap, placed):
    given = PlacementConstraints.fixture([placed.placement.transform])
    answer = plan(cap, desk, tilt=TILT, constraints=given, component=Component(1, -1))
    assert isinstance(answer, Refusal)
    assert any("S = 0" in shortfall.constraint for shortfall in answer.diagnosis)


def test_a_margin_that_is_just_kept_is_kept_in_single_precision(placed):
    """0.02 is rounded down to 0.0199999996."""
    there = replace(placed, margins=np.full(placed.margins.shape, NEEDED_MARGIN))
    assert there.margins.dtype == np.float32
    assert NEEDED_MARGIN - 1e-8 < there.smallest_margin < NEEDED_MARGIN
    assert there.keeps(NEEDED_MARGIN)
    assert not there.keeps(NEEDED_MARGIN + 1e-6)


def test_placement_out_of_reach_is_refused_with_the_true_shortfall(desk, cap, placed):
    """Pushed away along the base normal until legs are too short: the millimetres named are those missing."""
    t = placed.placement.transform
    far = RigidTransform(t.rotation, t.translation + np.array([0.0, 0.0, 0.3]))
    answer = plan(cap, desk, constraints=PlacementConstraints.fixture([far]), component=placed.component)
    assert isinstance(answer, Refusal)
    tips, axes = far.apply(cap.tips), far.rotate(cap.axes)
    legs = desk.robot.leg_lengths(tips + desk.tool_length * axes, -axes)
    for shortfall in answer.diagnosis:
        if "too long" in shortfall.constraint:
            k = int(shortfall.constraint.split()[1]) - 1
            missing_mm = (legs[:, k].max() - desk.legs.max_length[k]) * 1e3
            margin_mm = NEEDED_MARGIN * 0.5 * desk.legs.stroke[k] * 1e3
            assert shortfall.unit == "mm"
            assert missing_mm <= shortfall.shortfall <= missing_mm + margin_mm + 1e-9
            covered = np.concatenate([np.arange(a, b + 1) for a, b in shortfall.waypoints])
            assert set(np.flatnonzero(legs[:, k] > desk.legs.max_length[k])) <= set(covered)
            break
    else:
        pytest.fail(f"no leg is named: {answer}")


def test_a_refusal_names_the_waypoints_that_no_tilt_makes_fit(desk, cap, placed):
    """Against the margins at all tilts of a grid at all waypoints; the axes found fit at some more."""
    t = placed.placement.transform
    aside = RigidTransform(t.rotation, t.translation + np.array([0.1, 0.0, 0.0]))
    given = PlacementConstraints.fixture([aside])
    answer = plan(cap, desk, tilt=TILT, constraints=given, component=placed.component)
    assert isinstance(answer, UnplacedPath)
    named = {k for each in answer.diagnosis for a, b in each.waypoints for k in range(a, b + 1)}
    samples = ToolpathSamples.of(cap, TILT)
    values, _ = best_tilted_margins(samples, Margins.of(desk, placed.component), aside)
    tried = set(np.flatnonzero(values.min(axis=1) < NEEDED_MARGIN).tolist())
    found = set(np.flatnonzero(answer.attempt.margins.min(axis=1) < NEEDED_MARGIN).tolist())
    assert 0 < len(named) < len(cap)
    assert named == found
    assert named <= tried
    assert len(tried - named) < 0.1 * len(tried)


def test_oversize_part_is_refused(desk):
    size = 0.6
    x = np.linspace(-0.5 * size, 0.5 * size, 40)
    passes = [np.c_[x if k % 2 == 0 else x[::-1], np.full(40, y), np.zeros(40)] for k, y in enumerate(x[::4])]
    tips = np.concatenate(passes)
    flat = Toolpath((Segment(SegmentKind.CUT, tips, np.tile([0.0, 0.0, 1.0], (len(tips), 1)), 0.02),), 0.003)
    answer = plan(flat, desk, tilt=TILT)
    assert isinstance(answer, Refusal)
    assert answer.diagnosis
    assert answer.diagnosis[0].shortfall > 1.0
    assert all(0 <= a <= b < len(tips) for shortfall in answer.diagnosis for a, b in shortfall.waypoints)


@pytest.mark.slow
def test_a_common_axis_fits_what_normals_do_not_and_is_no_worse_than_a_fixed_axis(desk):
    steep = dome(0.06, 80.0)
    upright = tuple(replace(s, axes=np.tile([0.0, 0.0, 1.0], (len(s.axes), 1))) for s in steep.segments)
    # A fixed axis keeps the ball's centre where it is.
    tips = tuple(
        replace(u, tips=s.tips + steep.tilt_centre * (s.axes - u.axes))
        for u, s in zip(upright, steep.segments, strict=True)
    )
    fixed = plan(Toolpath(tips, steep.tilt_centre), desk, tilt=TILT, component=PLUS)
    assert isinstance(plan(steep, desk, tilt=TILT, component=PLUS), Refusal)
    auto = plan(steep, desk, tilt=np.radians(90.0), common_axis=True, component=PLUS)
    assert isinstance(fixed, PlacedPath)
    assert isinstance(auto, PlacedPath)
    assert auto.smallest_margin > 0.98 * fixed.smallest_margin
    np.testing.assert_allclose(auto.tilt_centres, auto.placement.transform.apply(steep.tilt_centres), atol=1e-12)
    assert "of the part" in str(auto.common_axis)


def test_a_common_axis_keeps_the_largest_lean_at_a_given_placement(desk, cap):
    middle = RigidTransform(np.diag([1.0, -1.0, -1.0]), desk.work.centre)
    pose = PlacementConstraints.fixture([middle])
    answer = plan(cap, desk, tilt=np.radians(25.0), common_axis=True, component=PLUS, constraints=pose)
    assert isinstance(answer, PlacedPath)
    own = middle.rotate(cap.axes)
    lean = np.degrees(angle_between(answer.axes, own))
    assert 15.0 < lean.max() < 25.0
    alone = plan(cap, desk, tilt=0.0, component=PLUS, constraints=pose)
    smallest = alone.smallest_margin if isinstance(alone, PlacedPath) else alone.attempt.smallest_margin
    assert answer.smallest_margin > smallest


def test_a_small_lean_is_a_tilt_cone(desk):
    cap = dome(0.06, 15.0, 100)
    middle = PlacementConstraints.fixture([RigidTransform(np.diag([1.0, -1.0, -1.0]), desk.work.centre)])
    auto = plan(cap, desk, tilt=0.1, common_axis=True, component=PLUS, constraints=middle)
    cone = plan(cap, desk, tilt=0.1, component=PLUS, constraints=middle)
    np.testing.assert_array_equal(auto.unwrap().axes, cone.unwrap().axes)
    assert auto.unwrap().common_axis is None


@pytest.mark.parametrize(("steep", "waypoints", "looks"), [(35.0, 3000, 2), (85.0, 3000, 1), (35.0, 700, 1)])
def test_what_does_not_fit_at_a_few_waypoints_is_not_looked_at_on_all(steep, waypoints, looks, desk, monkeypatch):
    """A part that is too steep is not searched for a place at all its waypoints; a short path has few."""
    planner = importlib.import_module("pentapod.planning.plan")
    path, searched, seen = dome(0.03, steep, waypoints), planner._searched, []
    monkeypatch.setattr(
        planner, "_searched", lambda problem, *given: seen.append(len(problem.basis)) or searched(problem, *given)
    )
    options = planner.PlacementOptions(
        tilt=0.0, common_axis=False, component=PLUS, constraints=FREE, weights=EVEN, collision_world=NOTHING,
        limits=(), solver="sequential",
    )  # fmt: skip
    assert fits(path, desk, **options) == (steep < 40.0)
    assert (seen[0] == FEW) == (waypoints > 2 * FEW)
    assert len(seen) == looks
