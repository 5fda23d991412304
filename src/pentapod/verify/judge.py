"""verify: read a program, replay it, judge every claim."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import Unpack

import numpy as np

from pentapod.base.errors import InputError, MachineError, ProgramError, nearest
from pentapod.base.files import atomic_write, sha256_of
from pentapod.base.progress import Progress, silent
from pentapod.base.refusal import stage
from pentapod.machine.machine import Machine
from pentapod.numerics.threads import in_threads
from pentapod.program.commands import read_back, springs_digest
from pentapod.program.csv import read_csv
from pentapod.program.program import Program
from pentapod.toolpath.toolpath import Toolpath
from pentapod.verify.claims import (
    bodies,
    collisions,
    component,
    gouge,
    joints,
    legs,
    loads,
    path_deviation,
    provenance,
    set_up,
    slowness,
    speed,
    stops_and_dwells,
    tool_motion,
)
from pentapod.verify.replay.claim import Claim, Idle
from pentapod.verify.replay.replay import REPLAY_SHARE, Replay
from pentapod.verify.surface import surface_left
from pentapod.verify.surface.left_map import material_left
from pentapod.verify.verdict.specification import Asked, Specification
from pentapod.verify.verdict.verdict import Certificate, NotJudged, Place, Verdict

READABLE = "readable"
MACHINE = "machine"
UNDONE = "the rows are what drives are told: judged are the lengths that the legs then have"
"""What is said of a program with commands."""
CLAIMS: tuple[Claim, ...] = (
    *provenance.CLAIMS,
    *set_up.CLAIMS,
    *component.CLAIMS,
    *legs.CLAIMS,
    *loads.CLAIMS,
    *joints.CLAIMS,
    *bodies.CLAIMS,
    *gouge.CLAIMS,
    *surface_left.CLAIMS,
    *path_deviation.CLAIMS,
    *speed.CLAIMS,
    *stops_and_dwells.CLAIMS,
    *slowness.CLAIMS,
    *tool_motion.CLAIMS,
    *collisions.CLAIMS,
)
"""All claims of a verdict in their order; "readable" comes before them where a file is judged.

After them come those about the obstacles of the collision world (`collisions`). Each subject has a file with its own
CLAIMS; a new one is added here and nowhere else.
"""

CLAIM_NAMES = tuple(claim.name for claim in CLAIMS)
"""Names of the claims that may be waived."""


@stage
def verify(
    program: Program | str | Path,
    machine: Machine,
    toolpath: Toolpath,
    *,
    strict: bool = False,
    claims: Sequence[Claim] = (),
    progress: Progress = silent,
    **asked: Unpack[Asked],
) -> Verdict:
    """Return the verdict on a program, or on a program file, from its rows alone.

    asked: the other fields of `Specification`: tilt, path_tolerance and axis_tolerance, and what else the program is
    judged against. A claim that needs a field that is not given is listed as "not judged"; then the verdict fails,
    unless the claim's name is among `waived`. strict: claims that do not apply are listed too, with the reason. claims:
    additional ones, judged after all others. A malformed file gives a failed verdict with the single claim "readable".
    Raises ProgramError where there is no such file, ArrayError where a tolerance is not a positive number, InputError
    where a waived claim is not known.
    """
    return judged(program, Specification(machine, toolpath, **asked), strict=strict, claims=claims, progress=progress)


def judged(
    program: Program | str | Path,
    specification: Specification,
    *,
    strict: bool = False,
    claims: Sequence[Claim] = (),
    progress: Progress = silent,
    in_memory: Program | None = None,
) -> Verdict:
    """Return the verdict on a program, or on a program file, against a specification, as `verify`.

    in_memory: a program; where a file holds the same legs, these are held once.
    """
    known = (*CLAIM_NAMES, *(claim.name for claim in claims))
    for name in specification.waived:
        if name not in known:
            raise InputError("no such claim", key="waived", value=name, remedy=nearest(name, known))
    read, sources = list[Certificate](), specification.sources
    if not isinstance(program, Program):
        path = Path(program)
        if not path.is_file():
            raise ProgramError("there is no such file", file=path, expected="a program file")
        progress("verify", 0.0, "reading")
        sources = replace(sources, program=sha256_of(path))
        try:
            program = _held_once(read_csv(path), in_memory)
        except InputError as error:
            return Verdict((_certificate(READABLE, False, str(error)),), sources=sources)
        method = f"{len(program.legs)} rows, {program.duration:.6g} s, {program.interpolation} interpolation"
        read = [_certificate(READABLE, True, method)]
    try:
        specification = replace(specification, machine=program.machine(specification.machine))
    except MachineError as error:
        fits = specification.machine.robot.n_legs == program.legs.shape[1]
        return Verdict(
            (*read, _certificate(provenance.GUIDES if fits else MACHINE, False, str(error))), sources=sources
        )
    if program.provenance.commands:
        with suppress(InputError):  # by another machine: the claim on the machine fails
            program = read_back(program, specification.machine)
            read = [replace(each, method=f"{each.method}; {UNDONE}") for each in read]
    replay, unjudged = Replay(program, specification, progress), list[NotJudged]()
    _ = replay.interval_bounds  # first, because its progress is the first share
    around = collisions.claims(specification.collision_world, len(specification.machine.bars.names))
    own = (*reversed(around), *CLAIMS)  # those that take longest are begun first
    answers, found = chain(_answers(replay, own), (claim(replay) for claim in claims)), list[Certificate | Idle]()
    for k, (claim, answer) in enumerate(zip((*own, *claims), answers, strict=True)):
        progress("verify", REPLAY_SHARE + (1.0 - REPLAY_SHARE) * k / (len(own) + len(claims)), claim.name)
        found.append(answer)
    first, last = len(around), len(own)
    found = [*found[first:last], *reversed(found[:first]), *found[last:]]
    for claim, answer in zip((*CLAIMS, *around, *claims), found, strict=True):
        if isinstance(answer, Certificate):
            read.append(answer)
        elif answer.unknown:
            unjudged.append(NotJudged(claim.name, answer.why, claim.name in specification.waived))
        elif strict:
            read.append(claim.inapplicable(answer))
    left = None if len(replay.unposed) or len(replay.interval_bounds.unproven) else material_left(replay)
    progress("verify", 1.0)
    return Verdict(tuple(read), tuple(unjudged), sources, springs_digest(program, specification.machine), left)


def _held_once(program: Program, other: Program | None) -> Program:
    """Return a program with the legs of one in memory, where they are the same."""
    if other is None or not np.array_equal(program.legs, other.legs):
        return program
    return replace(program, legs=other.legs)


def _answers(replay: Replay, claims: Sequence[Claim]) -> Iterator[Certificate | Idle]:
    """Yield the answers of claims in their order, on all cores, the matching with the toolpath beside the first.

    Nearly all claims name their places by it, so that they would wait for each other.
    """

    def answer(claim: Claim | None) -> Certificate | Idle | None:
        if claim is not None:
            return claim(replay)
        _ = replay.match if not len(replay.unposed) else None
        return None

    return (found for found in in_threads(answer, (None, *claims), ahead=len(claims)) if found is not None)


def _certificate(claim: str, passed: bool, method: str) -> Certificate:
    return Certificate(claim, passed, None, None, "", Place(), method)


def write_verdict(verdict: Verdict, path: str | Path) -> Path:
    """Write verdict.json atomically and return its path. Raises InputError."""
    with atomic_write(path) as temporary:
        text = json.dumps(verdict.to_dict(), indent=2, ensure_ascii=False, allow_nan=False)
        temporary.write_text(text + "\n", encoding="utf-8")
    return Path(path)
