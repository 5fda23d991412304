"""Provenance: the SHA-256 of the files that a job was read from."""

from __future__ import annotations

from hashlib import sha256

from pentapod.base.errors import InputError
from pentapod.base.files import sha256_of
from pentapod.job.schema.job import Job
from pentapod.machine.reader import machine_bytes
from pentapod.verify.verdict.sources import Sources


def job_sources(job: Job) -> Sources:
    """Return the SHA-256 of a job's files. Raises MachineError where the machine's file is gone."""
    return Sources(
        job=_job_file(job),
        machine=sha256(machine_bytes(job.machine_file or str(job.machine.name))).hexdigest(),
        mesh=sha256_of(job.mesh_path),
        fixture=None if job.fixture_mesh is None else sha256_of(job.fixture_mesh),
        **{f"toolpath_{key}": sha256_of(file) for key, file in job.files.items()},
    )


def _job_file(job: Job) -> str | None:
    """Return the SHA-256 of a job's file; None where the job is another than the file's."""
    try:
        return sha256_of(job.path) if Job.load(job.path).tables == job.tables else None
    except (InputError, OSError):
        return None
