"""Fitting: a proposed job with changes so that, by an estimate, it fits its machine."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from pentapod.base.errors import InputError
from pentapod.job.advice.options import OPTIONS, AdviceOptions
from pentapod.job.advice.sketch import Sketch
from pentapod.job.advice.trials import FEWEST, Trial, Trials
from pentapod.job.build.toolpath import job_tool
from pentapod.job.build.values import job_mesh
from pentapod.job.proposal import Proposal
from pentapod.job.schema.job import Job
from pentapod.machine.machine import Machine

_DOES_NOT_FIT = "by an estimate, the part does not fit the machine"


def fitted(
    proposal: Proposal, mesh: dict[str, str], folder: Path, machine: Machine, options: AdviceOptions = OPTIONS
) -> Proposal:
    """Return a proposal whose job, as far as an estimate shows, fits its machine; a remark says what was changed.

    mesh: the key of [part] that names the mesh. folder: of the job. Where nothing fits, the proposal stays, and a
    remark says so.
    """
    tables = {**proposal.tables, "part": {**mesh, **proposal.tables["part"]}}
    trial = _estimated(Job.from_dict(tables, folder), machine, options)
    if trial is not None and not trial.changes:
        return proposal
    if trial is None:
        words = f"{_DOES_NOT_FIT} like this; `pentapod plan` says why, and looks for changes that work"
        return replace(proposal, remarks=(*proposal.remarks, words))
    changed, reasons = dict[str, dict[str, Any]](proposal.tables), dict(proposal.reasons)
    for name, keys in trial.changes.items():
        values = {**changed.get(name, {}), **keys}
        changed[name] = {key: value for key, value in values.items() if value is not None}
        reasons.update(
            {(name, key): f"{trial.words}: {_DOES_NOT_FIT}".replace("like this", "otherwise") for key in keys}
        )
    share = "" if trial.kept > options.most else f", which keeps {100.0 * trial.kept:.2g} % of the area"
    remark = f"{_DOES_NOT_FIT} like this; so: {trial.words}{share}"
    return Proposal(changed, reasons, (*proposal.remarks, remark))


def _estimated(job: Job, machine: Machine, options: AdviceOptions) -> Trial | None:
    """Return the first change of a job that fits by an estimate, without changes where it fits as it is."""
    mesh = job_mesh(job)
    sketch = Sketch.of_region(job, mesh, job_tool(job, machine), options.points)
    if sketch is None or len(sketch.contacts) < FEWEST:
        return None
    trials = Trials(job, machine, mesh, sketch, options, lambda _: None)
    try:
        return next((trial for trial in trials.all(own=True) if trial.whole), None)
    except InputError:  # the tool does not go with the machine: `plan` says so
        return None
