"""Programs as they are posted: from the park pose and back, where the run has ways that its verdict judged."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pentapod.base.errors import ProgramError
from pentapod.base.files import sha256_of
from pentapod.job.ways.claims import differs
from pentapod.job.ways.names import FILES, IN, OUT
from pentapod.program import Program, read_csv
from pentapod.program.joined import joined


def from_park(program: Program, made: Mapping[str, Program]) -> Program:
    """Return a program with its ways, by name, as one; itself without any."""
    if IN in made:
        program = joined(made[IN], program)
    return joined(program, made[OUT]) if OUT in made else program


def ways_beside(file: Path, program: Program, verdict: Path | None) -> dict[str, Program]:
    """Return the ways beside a program file, by name; {} where there are none.

    verdict: the verdict.json that passed for the program; it must have judged these ways. None to take them as they
    are. Raises ProgramError where they are others, or one is missing.
    """
    content: Any = {} if verdict is None else json.loads(verdict.read_text(encoding="utf-8"))
    judged: Mapping[str, Any] = content.get("sha256", {})
    made: dict[str, Program] = {}
    for name, own in FILES.items():
        path, digest = file.with_name(own), judged.get(name.replace(" ", "_"))
        if not path.is_file() and digest is None:
            continue
        if verdict is not None and (not path.is_file() or sha256_of(path) != digest):
            raise ProgramError(
                f"this is not the {name} that the verdict judged" if path.is_file() else f"the {name} is missing",
                file=path, remedy="plan the job again, or post without the ways: --no-ways",
            )  # fmt: skip
        way = read_csv(path)
        if wrong := differs(way, program):
            raise ProgramError(f"{wrong} is not that of the program", file=path, remedy="plan the job again")
        made[name] = way
    return made
