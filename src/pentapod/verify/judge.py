"""verify: read a program, replay it, judge every claim."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from pentapod.errors import ArrayError, InputError, MachineError, ProgramError
from pentapod.files import atomic_write
from pentapod.machine.machine import Machine
from pentapod.machine.surroundings import Surroundings
from pentapod.program.csv import read_csv
from pentapod.program.program import Program
from pentapod.progress import Progress, silent
from pentapod.toolpath.toolpath import Toolpath
from pentapod.verify import bodies, collisions, component, gouge, joints, legs, origin, speed, standing, tool, tracking
from pentapod.verify.claim import Claim
from pentapod.verify.cutting import Cutting
from pentapod.verify.replay import SURVEY_SHARE, Replay
from pentapod.verify.verdict import Certificate, Place, Verdict

READABLE = "readable"
CLAIMS: tuple[Claim, ...] = (
    *origin.CLAIMS,
    *component.CLAIMS,
    *legs.CLAIMS,
    *joints.CLAIMS,
    *bodies.CLAIMS,
    *gouge.CLAIMS,
    *tracking.CLAIMS,
    *speed.CLAIMS,
    *standing.CLAIMS,
    *tool.CLAIMS,
)
"""Every claim that a verdict makes, in its order; "readable" comes before them where a file is judged.

After them come those about the surroundings, where there are any (`collisions`). A file of its own for each subject,
with its claims in CLAIMS: a new one is added here and nowhere else.
"""


def verify(
    program: Program | str | Path,
    machine: Machine,
    toolpath: Toolpath,
    *,
    tilt: float,
    path_tolerance: float,
    axis_tolerance: float,
    job_digest: str | None = None,
    surroundings: Surroundings | None = None,
    cutting: Cutting | None = None,
    strict: bool = False,
    progress: Progress = silent,
) -> Verdict:
    """Return the verdict on a program, or on a program file, from its rows alone.

    toolpath: in the workpiece frame, as the job asks for it. tilt: half angle in radians of the cone about
    the nominal axis in which the tool may stand; axis_tolerance: radians beyond that; path_tolerance: metres.
    job_digest: of the job that the header must name, None to leave that out. surroundings: what must not be touched.
    cutting: what cuts, and into which part; without it gouges are unknown.
    strict: every claim stands in the verdict, also those that do not apply, with the reason; it fails where a claim
    could not be judged for want of something.
    A malformed file gives a failed verdict with the one claim "readable". Raises ProgramError where there is
    no such file, ArrayError where a tolerance is not a sensible number.
    """
    for name, value in (
        ("tilt", tilt),
        ("path_tolerance", path_tolerance),
        ("axis_tolerance", axis_tolerance),
    ):
        if not (np.isfinite(value) and (value >= 0.0 if name != "path_tolerance" else value > 0.0)):
            raise ArrayError("must be a positive number", key=name, value=value)
    read: list[Certificate] = []
    if not isinstance(program, Program):
        path = Path(program)
        if not path.is_file():
            raise ProgramError("there is no such file", file=path, expected="a program file")
        progress("verify", 0.0, "reading")
        try:
            program = read_csv(path)
        except InputError as error:
            return Verdict((Certificate(READABLE, False, None, None, "", Place(), str(error)),))
        method = f"{len(program.legs)} rows, {program.duration:.6g} s, {program.interpolation} between rows"
        read = [Certificate(READABLE, True, None, None, "", Place(), method)]
    try:
        machine = program.machine(machine)
    except MachineError as error:
        return Verdict((*read, Certificate(origin.GUIDES, False, None, None, "", Place(), str(error))))
    replay = Replay(program, machine, toolpath, tilt, path_tolerance, axis_tolerance, job_digest, progress, cutting)
    _ = replay.survey
    claims = (*CLAIMS, *collisions.claims(surroundings or Surroundings()))
    for k, claim in enumerate(claims):
        progress("verify", SURVEY_SHARE + (1.0 - SURVEY_SHARE) * k / len(claims), claim.name)
        answer = claim(replay)
        if isinstance(answer, Certificate):
            read.append(answer)
        elif strict:
            read.append(claim.unjudged(answer))
    progress("verify", 1.0)
    return Verdict(tuple(read))


def write_verdict(verdict: Verdict, path: str | Path) -> Path:
    """Write verdict.json and return its path; an interruption leaves no half file. Raises InputError."""
    with atomic_write(path) as temporary:
        text = json.dumps(verdict.to_dict(), indent=2, ensure_ascii=False, allow_nan=False)
        temporary.write_text(text + "\n", encoding="utf-8")
    return Path(path)
