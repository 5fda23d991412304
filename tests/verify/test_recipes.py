"""The recipes "a claim" and "a controller" of CONTRIBUTING, done as they say."""

from dataclasses import replace

import numpy as np
import pytest
import replay_cases as cases

from pentapod.machine.parts import ControllerSettings
from pentapod.program import Program, read_csv, write_csv
from pentapod.program.posts import Column, PostInput, Table, leg_columns, table_post
from pentapod.verify import Claim, Replay, verify
from pentapod.verify.replay.claim import Finding, Idle

SETTLING = 0.02


def settles(replay: Replay) -> Finding | Idle:
    """Judge that the robot is at rest for some time before the last row: brakes close then."""
    if replay.program.duration < SETTLING:
        return Idle("the program is shorter than that")
    moving = np.abs(np.diff(replay.program.legs, axis=0)).max(axis=1) > 0.0
    last = int(np.flatnonzero(moving)[-1])
    seconds = (len(moving) - 1 - last) * replay.program.period
    method = "time after the last row from which a leg moves"
    return Finding(seconds >= SETTLING - 1e-9, seconds, SETTLING, "s", replay.place(2 * last), method)


CLAIM = Claim("settles at the end", settles)


def failed(case, program, **changes):
    verdict = verify(program, case.machine, case.toolpath, claims=(CLAIM,), **{**cases.ASKED, **changes})
    return {c.claim for c in verdict.certificates if not c.passed}, verdict


def standing(case, rows):
    """The program with so many rows of standing at its end."""
    legs = np.concatenate([case.program.legs, np.repeat(case.program.legs[-1:], rows, axis=0)])
    return replace(case.program, legs=legs)


def test_a_claim_of_ones_own_finds_what_no_other_claim_does(cubic):
    assert failed(cubic, standing(cubic, 25))[0] == set()
    forged, verdict = failed(cubic, standing(cubic, 5))
    assert forged == {"settles at the end"}
    assert verdict.certificates[-1].value == pytest.approx(5 * cases.PERIOD, abs=3 * cases.PERIOD)
    assert verdict.certificates[-1].where.row == len(cubic.program.legs) - 2
    assert not verdict.passed


def test_a_controller_is_its_period_its_interpolation_and_a_post(linear, tmp_path):
    """Twice the period, and a table in micrometres: the program is judged, written and read back."""
    machine = replace(linear.machine, controller=ControllerSettings(2 * cases.PERIOD, "linear"))
    rows = linear.program.legs[: 2 * (len(linear.program.legs) // 2) + 1 : 2]
    source = replace(linear.program.provenance, machine_digest=machine.digest)
    program = replace(linear.program, legs=rows, period=2 * cases.PERIOD, provenance=source)
    path = write_csv(program, tmp_path / "program.csv")
    verdict = verify(path, machine, linear.toolpath, **cases.ASKED)
    assert {c.claim for c in verdict.certificates if not c.passed} == set()
    other = verify(path, linear.machine, linear.toolpath, **cases.ASKED)
    assert {c.claim for c in other.certificates if not c.passed} == {"controller", "machine"}
    columns = (Column("t", "time", "ms", 3), *leg_columns("L{leg}", "length", "um", 5))
    post = table_post("ticks", "the drives of this test", Table({"legs.txt": columns}))
    for name, content in post.write(PostInput(read_csv(path), machine)).items():
        (tmp_path / name).write_bytes(content)
    back = post.read(tmp_path)
    assert isinstance(back, Program)
    assert back.legs.tobytes() == program.legs.tobytes()
    assert (back.period, back.interpolation) == (program.period, "linear")
