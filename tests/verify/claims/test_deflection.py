"""Deflection of the tip in the verdict: by weight, acceleration and cutting force, with and without a bound."""

from dataclasses import replace

import numpy as np
import pytest
import replay_cases as cases

from pentapod.machine import Dynamics, Stiffness
from pentapod.program.commands import commanded
from pentapod.program.program import ProcessForce
from pentapod.verify import CLAIMS
from pentapod.verify.replay.claim import Idle


def claimed(replay):
    (claim,) = (claim for claim in CLAIMS if claim.name == "deflection")
    return claim(replay)


def elastic(case, cutting=0.0, bound=None, leg=20e6):
    """The replay of a program on its machine with legs that yield."""
    machine = replace(case.machine, stiffness=Stiffness(leg_stiffness=np.full(5, leg)), cutting_force=cutting)
    replay = cases.same_motion(cases.replay_of(case), machine=machine)
    return replace(replay, specification=replace(replay.specification, deflection=bound))


@pytest.fixture(scope="module", params=["linear", "cubic"])
def case(request):
    return request.getfixturevalue(request.param)


def test_the_deflection_at_rest_is_that_of_exact_forward_kinematics_of_legs_under_weight(case):
    replay = elastic(case)
    robot, tool = replay.machine.robot, replay.machine.tool_length
    p, i = (pose[:1] for pose in replay.pose)
    still = np.zeros((1, 5))
    weight = Dynamics.of(replay.machine).of_rows(p, i, still, still).weight
    at, along = robot.pose(robot.leg_lengths(p, i) - weight / 20e6, robot.branch(p, i))
    shift = at + tool * along - p - tool * i
    found = replay.yielding.shift[0]
    assert np.linalg.norm(shift) > 1e-6
    assert np.linalg.norm(found - shift) < 0.02 * np.linalg.norm(shift)  # the first row also begins to move


def test_the_bound_of_the_job_decides_and_without_one_it_is_told(case):
    told = claimed(elastic(case))
    assert told.passed
    assert told.bound is None
    assert 1e-3 < told.value < 0.1  # mm
    for share, holds in ((0.9e-3, True), (1.1e-3, False)):
        found = claimed(elastic(case, bound=1e-3 * told.value / (1.0 + share)))
        assert found.passed is holds
        assert found.where.row == told.where.row
    assert claimed(elastic(case, leg=40e6)).value == pytest.approx(0.5 * told.value)


def test_a_cutting_force_counts_on_cuts_in_the_softest_direction(case):
    plain, cut = elastic(case), elastic(case, cutting=10.0)
    found, masses = claimed(cut), np.linalg.norm(plain.yielding.shift, axis=1)
    expected = masses + 10.0 * plain.yielding.softest * cut.cuts()
    assert 0.2 < cut.cuts().mean() < 1.0
    assert 1e-3 * found.value == pytest.approx(expected.max())
    assert found.where.row == int(expected.argmax())
    assert "10 N in any direction" in found.method


def compensated(replay, force=None):
    """The replay of the same rows with a header that says what drives compensate for."""
    source = replace(replay.program.provenance, compensation="gravity")
    return replace(replay, program=replace(replay.program, provenance=source, process_force=force))


def test_what_drives_make_good_of_the_weight_is_not_counted(case):
    replay = elastic(case)
    machine = replace(replay.machine, masses=replace(replay.machine.masses, gravity=np.zeros(3)))
    weightless = claimed(cases.same_motion(replay, machine=machine))
    found = claimed(compensated(replay))
    assert found.value == pytest.approx(weightless.value, rel=1e-9)
    assert "weight and acceleration" not in found.method


def test_a_process_force_that_drives_make_good_counts_where_nothing_is_cut(case):
    """The drives push against it by the rows of the header, whatever the tool does there."""
    replay, last = elastic(case, cutting=10.0), len(case.program.legs) - 1
    cuts = np.flatnonzero(replay.cuts())
    right, everywhere = ProcessForce(10.0, ((int(cuts[0]), int(cuts[-1])),)), ProcessForce(200.0, ((0, last),))
    usual, found = claimed(compensated(replay, right)), claimed(compensated(replay, everywhere))
    assert "10 N against the motion on cuts" in usual.method
    assert "any direction" not in usual.method
    # Told to compensate for 200 N, the drives move the tip by twenty times as much as 10 N against its motion do.
    told = commanded(compensated(replay, everywhere).program, replay.machine).legs
    more = told - commanded(compensated(replay).program, replay.machine).legs
    (p, i), robot, tool = (each[::2] for each in replay.pose), replay.machine.robot, replay.machine.tool_length
    at, along = robot.pose(robot.leg_lengths(p, i) + more, case.program.component)
    moved = np.linalg.norm(at + tool * along - p - tool * i, axis=1)
    assert found.value > 0.9e3 * moved.max()
    assert found.value > 2.0 * usual.value
    assert not claimed(replace(compensated(replay, everywhere), specification=bounded(replay, usual.value))).passed


def bounded(replay, value_mm):
    return replace(replay.specification, deflection=1e-3 * value_mm * 1.01)


def test_machines_without_a_stiffness_are_not_judged(case):
    assert isinstance(claimed(cases.replay_of(case)), Idle)
