"""What to begin with where no toolpath can be made: each job that is offered has one."""

from __future__ import annotations

import pytest

from pentapod.base.errors import InputError
from pentapod.job import Job
from pentapod.job.advice.options import OPTIONS
from pentapod.job.advice.starts import starts
from pentapod.job.advise import can_help
from pentapod.job.build.toolpath import job_toolpath
from pentapod.job.build.values import job_machine, job_mesh
from refused_jobs import REFUSED

FIRST = {
    "sheet wound downwards": ("part", "flip", True),
    "waterlines on a plate": ("toolpath", "strategy", "raster"),
    "region of another side": ("part", "flip", True),
}


@pytest.mark.parametrize("name", FIRST)
def test_the_first_start_is_what_is_wrong(name, tmp_path):
    job = Job.load(REFUSED[name].write(tmp_path))
    machine, mesh = job_machine(job), job_mesh(job)
    with pytest.raises(InputError) as error:
        job_toolpath(job, mesh, machine=machine)
    assert can_help(error.value)
    first = next(starts(job, machine, mesh, OPTIONS, has_toolpath=False))
    table, key, value = FIRST[name]
    assert first.changes[table][key] == value
    assert first.words
    assert len(job_toolpath(first.job, first.mesh, machine=machine)[0]) > 2
