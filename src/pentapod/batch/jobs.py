"""Jobs as tasks: everything that a job names goes with it, and its run becomes a row."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pentapod.base.errors import InputError
from pentapod.base.files import sha256_of
from pentapod.base.toml import toml_text
from pentapod.batch.changes import machine_content
from pentapod.batch.tasks.store import Input, Store
from pentapod.batch.tasks.task import Row, Task
from pentapod.job.artefacts import PROGRAM, REPORT, SHEET, WITHHELD
from pentapod.job.schema.job import Job

STATUSES = ("passed", "refused", "failed", "invalid", "crashed")
"""What may become of a job: its verdict passed; it cannot be done; its verdict failed; its values contradict each
other, the machine or the mesh; it took too much memory, or pentapod failed."""

RESULTS = (
    "status", "cause", "margin", "margin_limit", "cycle_time_s", "limiting_cause", "program_sha256", "job_digest",
    "machine_digest", "task",
)  # fmt: skip
"""Columns of every job, after its name and what was changed."""


def job_task(
    job: Job, store: Store, changes: Mapping[str, Any] | None = None, machine: Mapping[str, Any] | None = None
) -> Task:
    """Return the task of a job: it is planned and verified in the task's folder, from a job file in it.

    changes: what was changed of it, for the table; machine: tables of its machine's file, where they were changed.
    Raises InputError where a file that it names cannot be read.
    """
    content = job.tables.model_dump(mode="json", exclude_unset=True)
    inputs: list[Input] = []
    for table, key, path in job.named_files:
        if (table, key) != ("machine", "file"):
            inputs.append(store.keep(path))
            content[table][key] = inputs[-1].path
    if machine is not None or job.machine_file is not None:
        inputs += _machine_inputs(job, store, machine)
        content["machine"] = {"file": inputs[-1].path}
    name = f"{job.path.stem}.toml"
    known = {"job": job.path.stem, **(changes or {})}
    files = {name: toml_text(content)}
    return Task.of(job.path.stem, plan_in, {"job": name}, files=files, inputs=tuple(inputs), known=known)


def _machine_inputs(job: Job, store: Store, machine: Mapping[str, Any] | None) -> list[Input]:
    """Return a job's calibration file, if there is one, and its machine file, which names it."""
    content: dict[str, Any] = dict(machine or machine_content(job))
    calibration = dict(content.get("calibration", {}))
    if machine is None and job.machine_file is not None and "file" not in calibration:
        return [store.keep(job.machine_file)]
    found: list[Input] = []
    if "file" in calibration:
        found = [store.keep((job.machine_file or Path()).parent / str(calibration["file"]))]
        content["calibration"] = {**calibration, "file": found[0].name}
    stem = str(job.machine.name) if job.machine_file is None else job.machine_file.stem
    return [*found, store.keep_bytes(stem, ".toml", toml_text(content).encode())]


def plan_in(folder: Path, job: str) -> Row:
    """Plan and verify a job in its folder, with its report and set-up sheet, and return its row."""
    from pentapod.job.pipeline.run import run  # noqa: PLC0415  the driver of a batch plans nothing
    from pentapod.report import write_report  # noqa: PLC0415
    from pentapod.report.sheet import write_sheet  # noqa: PLC0415

    try:
        outcome = run(Job.load(folder / job), folder, writers={REPORT: write_report, SHEET: write_sheet}, advice=None)
    except InputError as error:
        place = {name: getattr(error, name) for name in ("key", "value", "expected", "remedy")}
        return {"status": "invalid", "cause": str(InputError(error.what, **place))}
    return outcome_row(outcome, folder)


def outcome_row(outcome: Any, folder: Path) -> Row:
    """Return the row of an `Outcome`, with the digest of its program file, or of one for each set-up."""
    from pentapod.job.outcome import SetUps  # noqa: PLC0415
    from pentapod.planning.placement.placed_path import PlacedPath, UnplacedPath  # noqa: PLC0415
    from pentapod.program.program import Program  # noqa: PLC0415
    from pentapod.timing import Explanation  # noqa: PLC0415

    setups, refusal = outcome.find(SetUps), outcome.refusal
    parts = [(outcome, folder)] if setups is None else [(part.outcome, folder / part.folder) for part in setups.parts]
    margins: dict[str, float] = {}
    seconds, costs, digests = 0.0, dict[str, float](), list[str]()
    for part, place in parts:
        unplaced, program, story = part.find(UnplacedPath), part.find(Program), part.find(Explanation)
        placed = part.find(PlacedPath) if unplaced is None else unplaced.attempt
        if placed is not None:
            for name, margin in zip(placed.margin_names, placed.margins.min(axis=0).tolist(), strict=True):
                margins[name] = min(margin, margins.get(name, margin))
        seconds += 0.0 if program is None else program.duration
        for cause in () if story is None else story.causes:
            costs[cause.name] = costs.get(cause.name, 0.0) + cause.cost
        digests += [sha256_of(place / name) for name in (PROGRAM, WITHHELD) if (place / name).is_file()]
    nearest = min(margins, key=lambda name: margins[name], default=None)
    failed = refusal is not None and refusal.stage == "verdict"
    return {
        "status": "passed" if outcome.passed else "refused" if refusal is not None and not failed else "failed",
        "cause": _cause(outcome),
        "margin": None if nearest is None else margins[nearest],
        "margin_limit": nearest,
        "margins": margins,
        "cycle_time_s": round(seconds, 6) or None,
        "limiting_cause": max(costs, key=lambda name: costs[name], default=None),
        "program_sha256": " ".join(digests) or None,
        "job_digest": outcome.job.digest,
        "machine_digest": outcome.machine.digest,
    }


def _cause(outcome: Any) -> str | None:
    """Return why a job did not pass, in a line; None where it did."""
    if outcome.refusal is not None:
        return str(outcome.refusal)
    if outcome.passed:
        return None
    failed = [claim.claim for claim in outcome.verdict.certificates if not claim.passed]
    open_ = [f"{entry.claim} (not judged)" for entry in outcome.verdict.not_judged if not entry.waived]
    return f"verdict: {'; '.join([*failed, *open_][:3])}"
