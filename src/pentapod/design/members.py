"""Members of the front: proven by bounds, written as machine files, and tried on the parts."""

from __future__ import annotations

import hashlib
import json
import logging
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.display import load_extra
from pentapod.base.errors import InputError
from pentapod.base.files import atomic_write
from pentapod.base.progress import Progress, silent
from pentapod.base.values import Value
from pentapod.batch.jobs import job_task
from pentapod.batch.tasks.engine import Engine
from pentapod.batch.tasks.task import Row, Task, versions
from pentapod.design.design_file import DesignFile, Need
from pentapod.design.evaluation import Sample
from pentapod.design.figures import in_poses
from pentapod.design.geometry import Geometry
from pentapod.design.machine_text import machine_text, outward
from pentapod.design.proof import Proof, worst_of
from pentapod.design.proof_tasks import proof_of, proof_task
from pentapod.design.quantities import QUANTITIES, completed
from pentapod.design.search import DESIGNS, Found, search, undominated
from pentapod.job.schema.job import Job
from pentapod.machine.machine import Machine, read_machine
from pentapod.machine.report.report import check

_log = logging.getLogger("pentapod")

MACHINE = "machine.toml"
"""Name of a member's machine file."""
TASKS = "tasks"
"""Folder of the proofs and of the parts' programs."""
LIMITS = {"shortest_leg": -1, "longest_leg": 1, "base_cone": 1, "platform_least": -1, "platform_most": 1}
"""Figures that limits of a machine's legs and joints are for, with their senses."""


@dataclass(frozen=True)
class Part(Value):
    """A job that was planned on a member's machine. said: its verdict, or why there is none; folder: of its files."""

    job: str
    passed: bool
    said: str
    folder: str


@dataclass(frozen=True, eq=False)
class Member(Value):
    """A proven design. proven, dense: its quantities by bounds, and on the dense sample, SI.

    machine: its machine file's text. missing: why it is not on the front; empty where it is. boxes: of the proof.
    """

    vector: Floats
    proven: dict[str, float]
    dense: dict[str, float]
    boxes: int
    machine: str
    missing: tuple[str, ...]
    parts: tuple[Part, ...] = ()

    def loaded(self) -> Machine:
        """Return the machine of its file. Raises MachineError."""
        return read_machine(self.machine, MACHINE)


@dataclass(frozen=True, eq=False)
class Front(Value):
    """The result. members: proven, by the first objective; dropped: what the search found and does not hold."""

    file: DesignFile
    members: tuple[Member, ...]
    dropped: tuple[Member, ...]
    designs: int
    poses: int


def design_machines(file: DesignFile, folder: Path, workers: int | None = None, progress: Progress = silent) -> Front:
    """Search, prove, and try the parts; what is done is kept in `folder`, and taken from there when run again.

    The search is one process. Proofs and parts are tasks on Dask's workers: processes, one for each core if `workers`
    is None; the result is the same for any number. In a script of your own, call it below
    `if __name__ == "__main__":`. Raises InputError: the folder holds another search, or pymoo or Dask is not installed.
    """
    load_extra("distributed", "design", "proofs and parts need Dask, which is not installed")
    _check_folder(file, folder)
    found = search(file, folder, progress)
    with Engine(folder / TASKS, workers=workers) as engine:
        proven = _proven(file, found, engine, progress)
        kept = _with_parts(file, [member for member in proven if not member.missing], engine, progress)
    tried = [member for member in kept if not member.missing]
    goals = np.array([[sense * member.proven[name] for name, sense in file.objectives] for member in tried])
    best = undominated(goals.reshape(len(tried), len(file.objectives)))
    members = [member for member, is_best in zip(tried, best, strict=True) if is_best]
    dropped = [member for member in (*proven, *kept) if member.missing]
    return Front(file, tuple(members), tuple(dropped), found.designs, len(found.sample.unit))


def _check_folder(file: DesignFile, folder: Path) -> None:
    """Make the folder, or check that it holds the same search."""
    folder.mkdir(parents=True, exist_ok=True)
    asked = json.dumps([file.text, file.machine.digest, [job.digest for job in file.jobs]])
    digest, place = hashlib.sha256(asked.encode()).hexdigest(), folder / "search.json"
    if place.exists():
        before = json.loads(place.read_text(encoding="utf-8"))
        if before["digest"] != digest:
            raise InputError(
                "the folder holds another search", file=folder, remedy="name another folder, or empty this one"
            )
        if before.get("versions") == versions():
            return
        _log.warning(
            "the folder holds evaluations of another version of pentapod or of a library: the search begins anew"
        )
        (folder / DESIGNS).unlink(missing_ok=True)
    with atomic_write(place) as temporary:
        temporary.write_text(json.dumps({"digest": digest, "versions": versions()}), encoding="utf-8")


def _proven(file: DesignFile, found: Found, engine: Engine, progress: Progress) -> list[Member]:
    """Return proofs of as many designs as are asked for, spread over what the search found."""
    count = len(found.vectors)
    rows = np.unique(np.linspace(0, count - 1, min(file.search.members, count)).astype(int)) if count else []
    vectors = [found.vectors[row] for row in rows]
    designs = [file.unknowns.design(vector) for vector in vectors]
    proofs = [proof_of(row) for row in _done(engine, [proof_task(design) for design in designs], "proof", progress)]
    return [_member(file, found.sample, *each) for each in zip(vectors, designs, proofs, strict=True)]


def _done(engine: Engine, tasks: list[Task], stage: str, progress: Progress) -> list[Row]:
    """Return the rows of tasks, in their order."""
    rows: dict[str, Row] = {}
    progress(stage, 0.0, f"0 of {len(tasks)} done")
    for done in engine.run(tasks):
        rows[done.task.name] = {**done.row, "folder": done.task.name}
        progress(stage, len(rows) / len(tasks), f"{len(rows)} of {len(tasks)} done")
    return [rows[task.name] for task in tasks]


def _member(file: DesignFile, sample: Sample, vector: Floats, design: Geometry, proof: Proof) -> Member:
    """Return a design with its quantities, machine file, and what it misses."""
    poses = sample.parts
    parts = worst_of(in_poses(design, design.base_axes(), *poses.at(design))) if len(poses.tips) else {}
    limits = outward({name: _worse(name, value, parts) for name, value in proof.proven.items()})
    proven = completed(design, limits, sample.leg_stiffness)
    known = {name: _worse(name, value, parts) for name, value in proof.found.items()}
    dense = completed(design, known, sample.leg_stiffness)
    missing = [_missed(need, proven) for need in file.needs if need.sense * (proven[need.quantity] - need.bound) > 0.0]
    name = f"{file.path.stem}-{hashlib.sha256(vector.tobytes()).hexdigest()[:6]}"
    text = machine_text(file, design, limits | _asked(file), name)
    try:
        report = check(read_machine(text, MACHINE))
        missing += [f"{finding.name}: machine check" for finding in report.findings if not finding.passed]
    except InputError as error:
        missing.append(str(error))
    return Member(vector, proven, dense, proof.boxes, text, tuple(missing))


def _asked(file: DesignFile) -> dict[str, float]:
    """Return the limits of legs and joints that the file gives as needs: so far can they move."""
    return {need.quantity: need.bound for need in file.needs if LIMITS.get(need.quantity) == need.sense}


def _worse(name: str, value: float, parts: dict[str, float]) -> float:
    if name not in parts:
        return value
    least = LIMITS.get(name) == -1 or name.endswith(("clearance", "distance")) or name == "top"
    return min(value, parts[name]) if least else max(value, parts[name])


def _missed(need: Need, proven: dict[str, float]) -> str:
    quantity = QUANTITIES[need.quantity]
    kind = "at most" if need.sense > 0 else "at least"
    got, bound = (quantity.shown(value) for value in (proven[need.quantity], need.bound))
    return f"{quantity.key}: proven {got:.5g}, must be {kind} {bound:.5g}"


def _with_parts(file: DesignFile, members: list[Member], engine: Engine, progress: Progress) -> list[Member]:
    """Return members with each job planned on their machines."""
    machines = [tomllib.loads(member.machine) for member in members]
    tasks = [
        job_task(job_on_design(job, file, now), engine.store, machine=now) for now in machines for job in file.jobs
    ]
    rows, count = _done(engine, tasks, "parts", progress) if tasks else [], len(file.jobs)
    found: list[Member] = []
    for number, member in enumerate(members):
        parts = tuple(
            Part(job.path.name, row["status"] == "passed", str(row["cause"] or "passed"), f"{TASKS}/{row['folder']}")
            for job, row in zip(file.jobs, rows[number * count : (number + 1) * count], strict=True)
        )
        found.append(replace(member, parts=parts, missing=tuple(f"{p.job}: {p.said}" for p in parts if not p.passed)))
    return found


def job_on_design(job: Job, file: DesignFile, machine: Mapping[str, Any]) -> Job:
    """Return a job on a designed machine: its table keeps its height in the work volume."""
    if job.placement.table_z_mm is None:
        return job
    rise_mm = machine["work"]["centre_mm"][2] - 1e3 * float(file.unknowns.start.centre[2])
    return job.with_(**{"placement.table_z_mm": job.placement.table_z_mm + rise_mm})
