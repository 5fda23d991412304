"""The claim on the passive limb: below every moment of a dense replay, failing where one range is too narrow."""

import dataclasses

import numpy as np
import pytest
import replay_cases as cases

from pentapod.machine import Machine
from pentapod.verify import Replay, Specification
from pentapod.verify.claims.joints import within_ranges
from pentapod.verify.replay.claim import Idle
from short_motion import loop

PRPU = Machine.load("prpu")
PROGRAM = loop(PRPU, 2.0)
TOOLPATH = cases.toolpath_of(cases.strokes()[:1])


def judged(**ranges):
    """Finding and replay for a limb with other ranges."""
    machine = dataclasses.replace(PRPU, limb=dataclasses.replace(PRPU.limb, **ranges))
    source = dataclasses.replace(PROGRAM.provenance, machine_digest=machine.digest)
    program = dataclasses.replace(PROGRAM, provenance=source)
    replay = Replay(program, Specification(machine, TOOLPATH, **cases.ASKED))
    return within_ranges(replay), replay


@pytest.fixture(scope="module")
def measured():
    """Carriage, strut and angle (N, 3) at rows and halfway between."""
    _, replay = judged()
    return PRPU.limb.at(*replay.pose)


def test_what_is_left_is_proven_and_near_the_true_least(measured):
    found, replay = judged()
    assert found.passed
    room = PRPU.limb.room(*replay.pose)[:, [0, 1, 2, 3, 5]] * [1, 1, 1, 1, PRPU.limb.strut[0]]
    assert 0.6 * 1e3 * room.min() <= found.value <= 1e3 * room.min()


@pytest.mark.parametrize("name", ["carriage", "strut", "joint_range"])
@pytest.mark.parametrize("end", [0, 1])
def test_a_range_that_is_too_narrow_fails(name, end, measured):
    column = measured[:, ("carriage", "strut", "joint_range").index(name)]
    reached, inward = (column.min(), 1e-4) if end == 0 else (column.max(), -1e-4)
    for off, passed in ((inward, False), (-50.0 * inward, True)):
        limits = np.array([column.min() - 0.01, column.max() + 0.01])
        limits[end] = reached + off
        if name == "joint_range":
            limits = np.maximum(limits, 0.0)
        found, _ = judged(**{name: limits})
        assert found.passed is passed, found
        if not passed:
            least = ("carriage at the rail's lower", "strut's shortest", "strut's joint at its least")
            most = ("carriage at the rail's upper", "strut's longest", "strut's joint at its largest")
            words = (least, most)[end][("carriage", "strut", "joint_range").index(name)]
            assert found.method.startswith(words)


def test_robots_without_a_limb_are_not_judged():
    desk = Machine.load("desk")
    replay = Replay(loop(desk, 0.1), Specification(desk, TOOLPATH, **cases.ASKED))
    assert isinstance(within_ranges(replay), Idle)
