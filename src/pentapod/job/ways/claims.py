"""Claims about the ways: that they join the park pose and the program, and keep all that a program must keep."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from pentapod.base.errors import InputError
from pentapod.base.files import sha256_of
from pentapod.job.ways.names import FILES, IN
from pentapod.job.ways.ways import park_row, specification_of_way
from pentapod.program import Program, read_csv
from pentapod.program.joined import SAME_ROW
from pentapod.verify import Claim, Place, Replay, Specification, judged
from pentapod.verify.replay.claim import MM, Finding, Idle

MISPLACED = 1e-9
"""Metres by which a leg may be off at the park pose."""


def with_ways(specification: Specification, folder: Path) -> tuple[Specification, tuple[Claim, ...]]:
    """Return a specification whose sources name the ways beside a program, and the claims about them.

    No claims where the machine has no park pose.
    """
    if specification.machine.park.pose is None:
        return specification, ()
    files = {name: folder / file for name, file in FILES.items()}
    found = {name.replace(" ", "_"): sha256_of(file) for name, file in files.items() if file.is_file()}
    claims = tuple(
        Claim(name, partial(_beside, file=file, inward=name == IN), needs_pose=False) for name, file in files.items()
    )
    return replace(specification, sources=replace(specification.sources, **found)), claims


def way_claims(made: Mapping[str, Program]) -> tuple[Claim, ...]:
    """Return the claims about ways that are in no file, by name."""
    return tuple(
        Claim(name, partial(judge_way, way=way, inward=name == IN), needs_pose=False) for name, way in made.items()
    )


def _beside(replay: Replay, *, file: Path, inward: bool) -> Finding | Idle:
    """Judge the way in a file beside the program."""
    if not file.is_file():
        return Idle(f"there is no {file.name} beside the program, though the machine has a park pose", unknown=True)
    try:
        way = read_csv(file)
    except InputError as error:
        return Finding.without_value(False, f"{file.name}: {error}")
    return judge_way(replay, way=way, inward=inward)


def judge_way(replay: Replay, *, way: Program, inward: bool) -> Finding:
    """Judge a way: its header, its two ends, and every claim about a program that is judged without a toolpath."""
    program, machine = replay.program, replay.machine
    if wrong := differs(way, program):
        return Finding.without_value(False, f"header: {wrong} is not that of the program")
    legs = way.legs if inward else way.legs[::-1]
    own, other = ("begins", "ends") if inward else ("ends", "begins")
    off = float(np.abs(legs[0] - park_row(machine)).max())
    row = 0 if inward else len(way.legs) - 1
    if not off <= MISPLACED:
        method = f"it {own} away from the park pose: the leg that is farthest off"
        return Finding(False, MM * off, MM * MISPLACED, "mm", _place(way, row), method)
    off = float(np.abs(legs[-1] - program.legs[0 if inward else -1]).max())
    if not off <= SAME_ROW:
        method = f"it {other} away from the program's {'first' if inward else 'last'} row: the leg that is farthest off"
        return Finding(False, MM * off, 0.0, "mm", _place(way, len(way.legs) - 1 - row), method)
    verdict = judged(way, specification_of_way(way, replay.specification))
    failed = [each for each in verdict.certificates if not each.passed]
    if failed:
        first = failed[0]
        names = ", ".join(each.claim for each in failed[:6]) + (", ..." if len(failed) > 6 else "")
        method = f"fails: {names}; {first.claim}: {first.method}"
        return Finding(False, first.value, first.bound, first.unit, first.where, method, at_least=first.at_least)
    unjudged = [each for each in verdict.not_judged if not each.waived]
    if unjudged:
        return Finding.without_value(False, f"{unjudged[0].claim} is not judged: {unjudged[0].why}")
    between = "from the park pose to the first row" if inward else "from the last row to the park pose"
    return Finding.without_value(
        True, f"{len(verdict.certificates)} claims hold on {len(way.legs)} rows {between}, {way.duration:.6g} s"
    )


def differs(way: Program, program: Program) -> str:
    """Return what of a way's header is not that of the program, in words; "" where all fits."""
    a, b = way.provenance, program.provenance
    same = {
        "the machine": (a.machine, a.machine_digest) == (b.machine, b.machine_digest) and a.commands == b.commands,
        "the job": a.job_digest == b.job_digest,
        "the period": way.period == program.period and way.interpolation == program.interpolation,
        "the component": way.component == program.component,
        "the placement": way.placement.matrix.tobytes() == program.placement.matrix.tobytes(),
        "the position of the guides": way.rail_positions == program.rail_positions,
    }
    return next((what for what, holds in same.items() if not holds), "")


def _place(way: Program, row: int) -> Place:
    return Place(row * way.period, row)
