"""Members of the front: proven by bounds, written as machine files, and tried on the parts."""

from __future__ import annotations

import hashlib
import json
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import InputError
from pentapod.base.files import atomic_write
from pentapod.base.progress import Progress, silent
from pentapod.base.values import Value
from pentapod.base.version import __version__
from pentapod.design.design_file import DesignFile, Need
from pentapod.design.evaluation import Sample
from pentapod.design.figures import in_poses
from pentapod.design.machine_text import machine_text, outward
from pentapod.design.part_poses import PartPoses
from pentapod.design.proof import Proof, prove, worst_of
from pentapod.design.quantities import QUANTITIES, completed
from pentapod.design.search import Found, search, undominated
from pentapod.design.unknowns import Unknowns
from pentapod.job.pipeline import run
from pentapod.machine.machine import Machine, read_machine
from pentapod.machine.report.report import check

MACHINE = "machine.toml"
"""Name of a member's machine file."""
LIMITS = {"shortest_leg": -1, "longest_leg": 1, "base_cone": 1, "platform_least": -1, "platform_most": 1}
"""Figures that limits of a machine's legs and joints are for, with their senses."""


@dataclass(frozen=True, eq=False)
class Member(Value):
    """A proven design. proven, dense: its quantities by bounds, and on the dense sample, SI.

    machine: its machine file's text. missing: why it is not on the front; empty where it is. boxes: of the proof.
    parts: by job, whether the verdict of its program passed, and what there is to say.
    """

    vector: Floats
    proven: dict[str, float]
    dense: dict[str, float]
    boxes: int
    machine: str
    missing: tuple[str, ...]
    parts: tuple[tuple[str, bool, str], ...] = ()

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


def design_machines(file: DesignFile, folder: Path, pool: Executor | None = None, progress: Progress = silent) -> Front:
    """Search, prove, and try the parts; what is done is kept in `folder`, and taken from there when run again.

    Raises InputError: the folder holds another search, or pymoo is not installed.
    """
    _check_folder(file, folder)
    found = search(file, folder, pool, progress)
    proven = _proven(file, found, folder, pool, progress)
    kept = [member for member in proven if not member.missing]
    dropped = [member for member in proven if member.missing]
    tried: list[Member] = []
    for number, member in enumerate(kept):
        progress("parts", number / len(kept), f"design {number + 1} of {len(kept)}")
        done = _with_parts(file, member, folder)
        (dropped if done.missing else tried).append(done)
    goals = np.array([[sense * member.proven[name] for name, sense in file.objectives] for member in tried])
    best = undominated(goals.reshape(len(tried), len(file.objectives)))
    members = [member for member, is_best in zip(tried, best, strict=True) if is_best]
    return Front(file, tuple(members), tuple(dropped), found.designs, len(found.sample.unit))


def _check_folder(file: DesignFile, folder: Path) -> None:
    """Make the folder, or check that it holds the same search."""
    folder.mkdir(parents=True, exist_ok=True)
    asked = json.dumps([file.text, file.machine.digest, [job.digest for job in file.jobs]])
    digest, place = hashlib.sha256(asked.encode()).hexdigest(), folder / "search.json"
    if place.exists():
        if json.loads(place.read_text(encoding="utf-8"))["digest"] != digest:
            raise InputError(
                "the folder holds another search", file=folder, remedy="name another folder, or empty this one"
            )
        return
    with atomic_write(place) as temporary:
        temporary.write_text(json.dumps({"digest": digest, "pentapod": __version__}), encoding="utf-8")


def _proven(file: DesignFile, found: Found, folder: Path, pool: Executor | None, progress: Progress) -> list[Member]:
    """Return proofs of as many designs as are asked for, spread over what the search found."""
    count = len(found.vectors)
    rows = np.unique(np.linspace(0, count - 1, min(file.search.members, count)).astype(int)) if count else []
    work = partial(proven_design, file.unknowns, found.sample.parts, folder / "proofs")
    vectors = [found.vectors[row] for row in rows]
    proofs = map(work, vectors) if pool is None else pool.map(work, vectors)
    members: list[Member] = []
    for number, (vector, (proof, parts)) in enumerate(zip(vectors, proofs, strict=True)):
        progress("proof", (number + 1) / len(vectors), f"{proof.boxes:,} boxes of poses")
        members.append(_member(file, found.sample, vector, proof, parts))
    return members


def proven_design(unknowns: Unknowns, parts: PartPoses, folder: Path, vector: Floats) -> tuple[Proof, dict[str, float]]:
    """Return the proof of a design, and its worst figures in the poses of the parts; kept in `folder` by content."""
    design = unknowns.design(vector)
    axes = design.base_axes()
    place = folder / f"{hashlib.sha256(vector.tobytes()).hexdigest()[:16]}.json"
    in_parts = worst_of(in_poses(design, axes, *parts.at(design))) if len(parts.tips) else {}
    if place.exists():
        return Proof(**json.loads(place.read_text(encoding="utf-8"))), in_parts
    with np.errstate(all="ignore"):
        proof = prove(design, axes)
    folder.mkdir(exist_ok=True)
    with atomic_write(place) as temporary:
        temporary.write_text(json.dumps(vars(proof)), encoding="utf-8")
    return proof, in_parts


def _member(file: DesignFile, sample: Sample, vector: Floats, proof: Proof, parts: dict[str, float]) -> Member:
    """Return a design with its quantities, machine file, and what it misses."""
    design = file.unknowns.design(vector)
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


def _with_parts(file: DesignFile, member: Member, folder: Path) -> Member:
    """Return a member with each job planned on its machine; kept in `folder`."""
    machine = member.loaded()
    results: list[tuple[str, bool, str]] = []
    for job in file.jobs:
        place = folder / "parts" / f"{machine.digest}-{job.digest}"
        if (known := place / "outcome.json").exists():
            name, passed, said = json.loads(known.read_text(encoding="utf-8"))
            results.append((name, passed, said))
            continue
        place.mkdir(parents=True, exist_ok=True)
        try:
            outcome = run(job, place, machine=machine, advice=None)
            said = str(outcome.refusal) if outcome.refusal is not None else outcome.verdict.answer
            results.append((job.path.name, outcome.passed, said))
        except InputError as error:
            results.append((job.path.name, False, str(error)))
        with atomic_write(known) as temporary:
            temporary.write_text(json.dumps(results[-1]), encoding="utf-8")
    missing = tuple(f"{name}: {said}" for name, passed, said in results if not passed)
    return replace(member, parts=tuple(results), missing=(*member.missing, *missing))
