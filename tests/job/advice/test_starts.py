"""What to begin with where no toolpath can be made: each job that is offered has one."""

from __future__ import annotations

from dataclasses import replace

import pytest

from pentapod.base.errors import InputError, JobError
from pentapod.job import Job
from pentapod.job.advice.options import OPTIONS
from pentapod.job.advice.starts import starts
from pentapod.job.advice.wide_parts import check_wide_part
from pentapod.job.build.toolpath import job_toolpath
from pentapod.job.build.values import job_machine, job_mesh
from pentapod.job.pipeline.advice_on_errors import can_help
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


@pytest.mark.parametrize(("share", "begun"), [(0.001, [3.0, 10.0]), (1.0, [10.0])])
def test_passes_further_apart_than_the_cutter_is_wide_are_begun_with_beside_each_other(share, begun, tmp_path):
    """Not where all of the region may be left."""
    tables = {"tolerance": {"left_share": share}}
    job = Job.load(replace(REFUSED["dome of 60 deg, no cone"], tables=tables).write(tmp_path))
    found = list(starts(job, job_machine(job), job_mesh(job), OPTIONS))
    assert [each.job.toolpath.stepover_mm for each in found] == begun
    assert found[-1].words == ""


def test_a_part_beyond_the_reach_is_begun_with_as_it_is(tmp_path):
    """All of its toolpath is not made for that: it would be too fine, or take minutes."""
    job = Job.load(REFUSED["plate of 3 x 2 m"].write(tmp_path))
    (own,) = starts(job, job_machine(job), job_mesh(job), OPTIONS, has_toolpath=False)
    assert own.changes == {}


@pytest.mark.slow
@pytest.mark.parts
def test_a_wide_part_out_of_reach_with_its_tool_axes_is_refused_before_it_has_a_drive_surface(tmp_path, parts):
    """The drive surface of this teapot, 758 mm wide, takes minutes; along its normals no machine comes near it."""
    job = Job.load(REFUSED["teapot"].write(tmp_path, parts))
    machine, mesh = job_machine(job), job_mesh(job)
    with pytest.raises(JobError, match="758 mm wide") as error:
        check_wide_part(job, machine, mesh)
    assert can_help(error.value)
    (own,) = starts(job, machine, mesh, OPTIONS, has_toolpath=False)
    assert own.changes == {}
    check_wide_part(job.with_(axis={"mode": "fixed", "direction": [0, 0, 1]}), machine, mesh)
    check_wide_part(job.with_(part={"region_box_mm": [[-66.0, 208.0, 73.0], [-45.0, 229.0, 371.0]]}), machine, mesh)


def test_wide_parts_that_a_plan_may_place_are_left_to_it(tmp_path):
    """What is steep may be left out of a plan, and an estimate that is short by little may be wrong."""
    for name in ("plate of 600 x 600", "plate of 450 x 450, bent"):
        job = Job.load(REFUSED[name].write(tmp_path))
        check_wide_part(job, job_machine(job), job_mesh(job))


def test_cuts_of_a_file_that_gouge_are_lifted_before_anything_else_is_tried(tmp_path):
    job = Job.load(REFUSED["toolpath from a file, leaning"].write(tmp_path))
    machine, mesh = job_machine(job), job_mesh(job)
    (start,) = starts(job, machine, mesh, OPTIONS)
    assert start.changes == {"gouge": {"remedy": ["lift"]}}
    own, lifted = job_toolpath(job, mesh, machine=machine)[0], start.toolpath
    raised = ((lifted.tips - own.tips) * own.axes).sum(axis=1)
    assert raised.max() > 1e-4
    assert raised.min() >= 0.0
    (start,) = starts(start.job, machine, mesh, OPTIONS)  # they are clear now
    assert not start.changes
