"""Proofs as tasks: a geometry goes to a worker, and its bounds come back as a row."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from pentapod.base.errors import PentapodError
from pentapod.batch.tasks.task import Row, Task
from pentapod.design.geometry import Geometry
from pentapod.design.proof import Proof, prove
from pentapod.machine.parts import Bodies

PROVEN = "proven"
"""Status of a proof that has ended, whatever it found."""


def proof_task(design: Geometry) -> Task:
    """Return the task of a design's proof."""
    content = {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in vars(design).items()}
    return Task.of("proof", prove_in, {"geometry": {**content, "bodies": dict(vars(design.bodies))}})


def prove_in(folder: Path, geometry: dict[str, Any]) -> Row:
    """Prove a design and return its row; numbers are texts, since bounds may be infinite."""
    arrays = {name: np.array(geometry[name]) for name in ("base", "offsets", "centre")}
    given: dict[str, Any] = {**geometry, **arrays, "bodies": Bodies(**geometry["bodies"])}
    design = Geometry(**given)
    with np.errstate(all="ignore"):
        proof = prove(design, design.base_axes())
    values = {name: {figure: repr(v) for figure, v in getattr(proof, name).items()} for name in ("proven", "found")}
    return {"status": PROVEN, **values, "boxes": proof.boxes, "settled": proof.settled}


def proof_of(row: Row) -> Proof:
    """Return the proof of a row. Raises PentapodError: the task crashed."""
    if row["status"] != PROVEN:
        raise PentapodError(f"a proof crashed: {row['cause']}")
    values = [{figure: float(text) for figure, text in row[name].items()} for name in ("proven", "found")]
    return Proof(values[0], values[1], row["boxes"], row["settled"])
