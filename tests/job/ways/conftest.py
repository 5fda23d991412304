"""A run with ways, shared by the tests of this folder."""

from __future__ import annotations

import shutil

import pytest

from parked_jobs import parked_job
from pentapod.job import run


@pytest.fixture(scope="session")
def parked(tmp_path_factory):
    """The usual job on a machine with a park pose, and the folder of its run, to be read or copied."""
    folder = tmp_path_factory.mktemp("parked")
    job = parked_job(folder)
    outcome = run(job, folder / "out", advice=None)
    assert outcome.passed, outcome.refusal
    return job, folder / "out"


@pytest.fixture
def copied(parked, tmp_path):
    """The job, and a copy of its run whose files may be changed."""
    job, out = parked
    shutil.copytree(out, tmp_path / "out")
    return job, tmp_path / "out"
