"""Where the part stands, in which component, for which controller: headers that agree with themselves are refused."""

from dataclasses import replace

import numpy as np
import pytest
import replay_cases as cases

from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics import Component
from pentapod.planning.problem.constraints import PlacementConstraints
from pentapod.program.program import ProcessForce
from pentapod.toolpath.linking.partition import Piece
from pentapod.verify import verify
from pentapod.verify.claims.provenance import compensation, component, controller
from pentapod.verify.claims.set_up import placement, whole

PLACED = RigidTransform(np.diag([1.0, -1.0, -1.0]), np.array([0.01, -0.02, 0.3]))


def turned(angle, axis=2):
    c, s = np.cos(angle), np.sin(angle)
    rotation = np.eye(3)
    k = [k for k in range(3) if k != axis]
    rotation[np.ix_(k, k)] = [[c, -s], [s, c]]
    return rotation


def moved(shift=(0.0, 0.0, 0.0), angle=0.0, axis=2):
    return RigidTransform(turned(angle, axis) @ PLACED.rotation, PLACED.translation + np.array(shift))


def at(case, placed, constraints):
    program = replace(case.program, placement=placed)
    return placement(cases.replay_of(case, program, constraints=constraints))


@pytest.mark.parametrize(
    ("placed", "passed"),
    [
        (PLACED, True),
        (moved((0.9e-6, 0.0, 0.0)), True),
        (moved((1.1e-6, 0.0, 0.0)), False),
        (moved((1e-4, 0.0, 0.0)), False),
        (moved((0.0, 0.0, -1e-2)), False),
        (moved(angle=0.9e-6, axis=0), True),
        (moved(angle=1.1e-6, axis=1), False),
        (moved(angle=np.radians(5.0)), False),
        (moved(angle=np.pi), False),
    ],
)
def test_fixed_placement_is_kept_to_a_micrometre_and_a_microradian(cubic, placed, passed):
    far = moved((0.5, 0.0, 0.0), angle=1.0)
    for constraints in (PlacementConstraints.fixture([PLACED]), PlacementConstraints.fixture([far, PLACED])):
        assert at(cubic, placed, constraints).passed == passed


def test_what_is_off_is_told_in_its_unit(cubic):
    found = at(cubic, moved((0.01, 0.0, 0.0)), PlacementConstraints.fixture([PLACED]))
    assert (found.value, found.bound, found.unit) == (pytest.approx(10.0), pytest.approx(1e-3), "mm")
    found = at(cubic, moved(angle=np.radians(5.0)), PlacementConstraints.fixture([PLACED]))
    assert (found.value, found.unit) == (pytest.approx(5.0), "deg")


@pytest.mark.parametrize(
    ("shift", "passed"),
    [((1e-3, 0, 0), True), ((0, -1e-3, 1e-3), True), ((1.002e-3, 0, 0), False), ((0, 0, 1e-2), False)],
)
def test_box_of_the_origin(cubic, shift, passed):
    low, high = PLACED.translation - 1e-3, PLACED.translation + 1e-3
    assert at(cubic, moved(shift, angle=1.0), PlacementConstraints.free(low=low, high=high)).passed == passed


@pytest.mark.parametrize(("angle", "passed"), [(0.0, True), (0.3, True), (0.3001, False), (3.0, False), (-0.2, True)])
@pytest.mark.parametrize("axis", range(3))
def test_largest_turn(cubic, angle, passed, axis):
    constraints = PlacementConstraints.free(reference=PLACED, largest_turn=0.3)
    assert at(cubic, moved((1.0, 0.0, 0.0), angle, axis), constraints).passed == passed


@pytest.mark.parametrize(
    ("placed", "passed"),
    [
        (moved((0.05, -0.05, 0.0), angle=2.0), True),
        (moved((0.0, 0.0, 2e-6)), False),
        (moved(angle=2e-6, axis=0), False),
        (moved((0.21, 0.0, 0.0)), False),
        (moved(angle=np.pi, axis=0), False),
    ],
)
def test_table(cubic, placed, passed):
    constraints = PlacementConstraints.table(PLACED.translation[2], x=(-0.2, 0.2), y=(-0.2, 0.2))
    assert at(cubic, placed, constraints).passed == passed


@pytest.mark.parametrize("name", ["++", "+-", "-+", "--"])
def test_component_is_the_one_asked_for(cubic, name):
    asked = Component.parse(name)
    assert component(cases.replay_of(cubic, component=asked)).passed == (name == "++")


@pytest.mark.parametrize(
    "change",
    [
        {"period": 0.002},
        {"period": 0.01},
        {"period": 0.0011},
        {"interpolation": "linear"},
        {"period": 0.002, "interpolation": "linear"},
    ],
)
def test_rows_for_another_controller_fail(cubic, change):
    assert controller(cases.replay_of(cubic)).passed
    program = replace(cubic.program, **change)
    assert not controller(cases.replay_of(cubic, program)).passed
    verdict = verify(program, cubic.machine, cubic.toolpath, **cases.ASKED)
    assert "controller" in {c.claim for c in verdict.certificates if not c.passed}


def test_pieces_only_where_the_job_allows_them(cubic):
    half = replace(cubic.program, provenance=replace(cubic.program.provenance, piece=Piece(0, 50)))
    assert not whole(cases.replay_of(cubic)).unknown
    assert not whole(cases.replay_of(cubic, half)).passed
    assert whole(cases.replay_of(cubic, half, setups=2)).unknown
    assert whole(cases.replay_of(cubic, half, setups=2, missed=0)).passed
    assert not whole(cases.replay_of(cubic, half, setups=2, missed=1)).passed


def cuts_of(replay):
    """First and last row of each run of rows that are on a cut for certain."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], replay.cuts(), [False]]).astype(int)))
    return tuple((int(first), int(end) - 1) for first, end in edges.reshape(-1, 2))


@pytest.mark.parametrize(
    ("asked", "own", "newtons", "shift", "passed"),
    [
        ("", "gravity", 0.0, 0, False),
        ("gravity", "", 0.0, 0, False),
        ("gravity", "gravity", 0.0, 0, True),
        ("gravity", "gravity", 30.0, 0, False),
        ("process", "", 0.0, 0, False),
        ("process", "gravity", 0.0, 0, False),
        ("process", "gravity", 30.0, 0, True),
        ("process", "gravity", 31.0, 0, False),
        ("process", "gravity", 30.0, 150, False),
        ("process", "gravity", 30.0, -150, False),
    ],
)
def test_drives_make_good_what_the_job_asks_for_on_its_cuts(cubic, asked, own, newtons, shift, passed):
    plain = cases.replay_of(cubic)
    cuts = cuts_of(plain)
    assert len(cuts) == 2
    force = ProcessForce(newtons, tuple((a + shift, b + shift) for a, b in cuts)) if newtons else None
    source = replace(plain.program.provenance, compensation=own)
    program = replace(plain.program, provenance=source, process_force=force)
    machine = replace(plain.machine, cutting_force=30.0)
    replay = cases.same_motion(plain, machine=machine, compensation=asked)
    found = compensation(replace(replay, program=program))
    assert found.passed is passed, found.method


def test_compensation_that_nobody_asks_for_or_about_is_idle(cubic):
    for asked in (None, ""):
        assert not hasattr(compensation(cases.replay_of(cubic, compensation=asked)), "passed")
