"""PlacementConstraints: what is allowed stays allowed, and what the solvers find keeps table, box, turn and fixture."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from pentapod.base.errors import ArrayError
from pentapod.geometry.rigid import RigidTransform
from pentapod.planning import PlacedPath, PlacementConstraints, plan
from pentapod.planning.plan import NEEDED_MARGIN
from pentapod.planning.problem.constraints import FREE
from pentapod.planning.problem.formulation import room_function, stepped

TILT = np.radians(15.0)
SOLVERS = ("sequential", pytest.param("ipopt", marks=pytest.mark.slow))


def turn_between(a: RigidTransform, b: RigidTransform) -> float:
    """The angle between two placements' rotations, by scipy's quaternions."""
    return float((Rotation.from_matrix(a.rotation).inv() * Rotation.from_matrix(b.rotation)).magnitude())


def freedoms(seed: int) -> list[PlacementConstraints]:
    rng = np.random.default_rng(seed)
    corner = rng.normal(size=3)
    reference = RigidTransform(Rotation.random(rng=rng).as_matrix(), np.zeros(3))
    return [
        FREE,
        PlacementConstraints.free(low=corner, high=corner + rng.uniform(0.0, 0.3, 3)),
        PlacementConstraints.free(reference=reference, largest_turn=float(rng.uniform(0.01, 3.0))),
        PlacementConstraints.table(0.6, x=(-0.1, 0.2), y=(0.0, 0.1), up=rng.normal(size=3)),
        PlacementConstraints.table(-0.6, up=(0.0, 1.0, 0.0), normal=(0.0, 0.0, 1.0)),
        PlacementConstraints.table(0.6, up=rng.normal(size=3), turn=(-0.3, float(rng.uniform(-0.29, 2.0)))),
        PlacementConstraints.table(0.6, x=(-0.1, 0.2), up=rng.normal(size=3), turn=(1.0, 1.0)),
    ]


def is_allowed(constraints: PlacementConstraints, rotation: np.ndarray, origin: np.ndarray) -> bool:
    """Said afresh, from the meaning of the fields."""
    inside = (origin >= constraints.low - 1e-12).all() and (origin <= constraints.high + 1e-12).all()
    turn = Rotation.from_matrix(constraints.reference.T @ rotation).magnitude() <= constraints.largest_turn + 1e-9
    upright = not constraints.upright.any() or np.abs(rotation @ constraints.upright - constraints.normal).max() < 1e-9
    return bool(inside and turn and upright)


@settings(max_examples=20)
@given(st.integers(0, 2**31))
def test_what_is_brought_within_is_allowed_and_stays(seed):
    rng = np.random.default_rng(seed)
    rotations, origins = Rotation.random(40, rng=rng).as_matrix(), rng.normal(size=(40, 3))
    for constraints in freedoms(seed):
        r, o = constraints.within(rotations, origins, np.random.default_rng(seed))
        assert all(is_allowed(constraints, a, b) for a, b in zip(r, o, strict=True))
        again_r, again_o = constraints.nearest(r, o)
        np.testing.assert_allclose(again_r, r, atol=1e-9)
        np.testing.assert_array_equal(again_o, o)
        if constraints is FREE:
            np.testing.assert_array_equal(r, rotations)
            np.testing.assert_array_equal(o, origins)


@settings(max_examples=20)
@given(st.integers(0, 2**31))
def test_allowed_motion_and_its_room(seed):
    """A step along the motion keeps what the motion holds; the room is negative just where a placement is not allowed;
    its derivative is that of differences."""
    rng = np.random.default_rng(seed)
    for constraints in freedoms(seed):
        r, o = constraints.within(Rotation.random(1, rng=rng).as_matrix(), rng.normal(size=(1, 3)), rng)
        here = RigidTransform(r[0], o[0])
        step = constraints.motion @ rng.normal(scale=0.05, size=constraints.motion.shape[1])
        there = stepped(here, step)
        np.testing.assert_allclose(there.rotation @ constraints.upright, constraints.normal, atol=1e-9)
        room = constraints.room(there.rotation, there.translation)
        assert all(x >= 0.0 for x in room) == is_allowed(constraints, there.rotation, there.translation)
        if room:
            values, slopes = room_function(constraints)(np.zeros(6), here.rotation, here.translation)
            np.testing.assert_allclose(
                np.asarray(values).ravel(), constraints.room(here.rotation, here.translation), atol=1e-12
            )
            for h in 1e-6 * constraints.motion.T:
                ahead, back = stepped(here, h), stepped(here, -h)
                change = np.subtract(
                    constraints.room(ahead.rotation, ahead.translation),
                    constraints.room(back.rotation, back.translation),
                )
                np.testing.assert_allclose(np.asarray(slopes) @ h * 2.0, change, atol=1e-13)


def test_a_half_turn_is_measured_and_undone():
    half = np.diag([1.0, -1.0, -1.0])
    constraints = PlacementConstraints.free(largest_turn=np.radians(20.0))
    r, _ = constraints.nearest(half[None], np.zeros((1, 3)))
    assert Rotation.from_matrix(r[0]).magnitude() == pytest.approx(np.radians(20.0))
    table = PlacementConstraints.table(0.5, up=(0.0, 0.0, 1.0))
    r, _ = table.nearest(np.eye(3)[None], np.zeros((1, 3)))
    np.testing.assert_allclose(r[0] @ [0.0, 0.0, 1.0], [0.0, 0.0, -1.0], atol=1e-12)


@pytest.mark.parametrize(("up", "axis"), [((0.0, 0.0, 1.0), 0), ((0.2, -0.9, 0.1), 0), ((1.0, 0.1, 0.0), 1)])
@pytest.mark.parametrize("normal", [(0.0, 0.0, -1.0), (0.0, 0.0, 1.0)])
def test_the_axis_of_a_part_points_where_the_table_allows(up, axis, normal):
    """Its x axis in plan, its y axis where x stands upright; whatever it was turned by before."""
    table = PlacementConstraints.table(0.5, up=up, normal=normal, turn=(np.radians(80.0), np.radians(100.0)))
    turned, _ = table.nearest(Rotation.random(50, rng=1).as_matrix(), np.zeros((50, 3)))
    points = np.degrees(np.arctan2(turned[:, 1, axis], turned[:, 0, axis]))
    assert 80.0 - 1e-6 <= points.min() <= points.max() <= 100.0 + 1e-6
    assert np.ptp(points) > 15.0
    kept = PlacementConstraints.table(0.5, up=up, normal=normal, turn=(-0.5, -0.5))
    turned, _ = kept.nearest(Rotation.random(5, rng=1).as_matrix(), np.zeros((5, 3)))
    np.testing.assert_allclose(np.arctan2(turned[:, 1, axis], turned[:, 0, axis]), -0.5, atol=1e-9)


def test_a_part_on_a_table_of_any_height_keeps_its_upper_side() -> None:
    wide = np.full(3, np.inf)
    table = replace(PlacementConstraints.table(0.5, up=(0.0, 1.0, 0.0)), low=-wide, high=wide)
    assert table.is_bounded
    turned = RigidTransform(Rotation.random(rng=0).as_matrix(), np.zeros(3))
    np.testing.assert_allclose(table.nearest_to(turned).rotate(np.array([0.0, 1.0, 0.0])), [0.0, 0.0, -1.0], atol=1e-12)


def test_impossible_freedoms_are_errors():
    for wrong in (
        lambda: PlacementConstraints.free(low=(1.0, 0.0, 0.0), high=(0.0, 1.0, 1.0)),
        lambda: PlacementConstraints.free(largest_turn=4.0),
        lambda: PlacementConstraints.table(0.5, normal=(0.1, 0.0, -1.0)),
        lambda: PlacementConstraints.fixture([]),
    ):
        with pytest.raises(ArrayError):
            wrong()


@pytest.fixture(scope="module")
def best(cap_placed):
    return cap_placed


@pytest.mark.slow
@pytest.mark.parametrize("solver", SOLVERS)
def test_a_table_is_kept_by_both_solvers(desk, cap, best, solver):
    height = best.placement.transform.translation[2]
    x = best.placement.transform.translation[0]
    constraints = PlacementConstraints.table(height, x=(x - 0.02, x + 0.02))
    answer = plan(cap, desk, tilt=TILT, constraints=constraints, component=best.component, solver=solver)
    assert isinstance(answer, PlacedPath), str(answer)
    found = answer.placement.transform
    assert found.translation[2] == height
    assert abs(found.translation[0] - x) <= 0.02 + 1e-12
    np.testing.assert_allclose(found.rotation[:, 2], [0.0, 0.0, -1.0], atol=1e-12)
    assert answer.smallest_margin >= NEEDED_MARGIN - 1e-3


@pytest.mark.parametrize("solver", SOLVERS)
def test_box_and_turn_are_kept_by_both_solvers(desk, cap, best, solver):
    """The bounds are drawn so that the free optimum lies outside: then they bind, and cost margin."""
    there = best.placement.transform
    reference = RigidTransform(there.rotation @ Rotation.from_euler("z", 12, degrees=True).as_matrix(), np.zeros(3))
    low = there.translation + np.array([0.005, -0.05, -0.05])
    bounds = PlacementConstraints.free(low=low, high=low + 0.1, reference=reference, largest_turn=np.radians(6.0))
    answer = plan(cap, desk, tilt=TILT, constraints=bounds, component=best.component, solver=solver)
    assert isinstance(answer, PlacedPath), str(answer)
    found = answer.placement.transform
    assert (found.translation >= low - 1e-12).all()
    assert (found.translation <= low + 0.1 + 1e-12).all()
    assert turn_between(reference, found) <= np.radians(6.0) + 1e-9
    assert answer.smallest_margin < best.smallest_margin


def test_the_best_pose_of_a_fixture_is_taken(desk, cap, best):
    there = best.placement.transform
    away = [RigidTransform(there.rotation, there.translation + np.array([d, 0.0, 0.0])) for d in (0.3, 0.02, -0.25)]
    poses = [away[0], away[1], there, away[2]]
    answer = plan(cap, desk, tilt=TILT, constraints=PlacementConstraints.fixture(poses), component=best.component)
    assert isinstance(answer, PlacedPath)
    assert answer.placement.transform is there
    assert "pose 3 of 4" in answer.placement.chosen_by
