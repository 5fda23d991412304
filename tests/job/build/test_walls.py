"""Upright walls that the passes of a raster leave: found before a plan, since waterlines are the remedy."""

from __future__ import annotations

import pytest

from pentapod.job import Job, run
from pentapod.job.build.left import may_leave_walls
from pentapod.job.build.specification import job_collision_world, job_cutting
from pentapod.job.build.values import job_machine, job_mesh
from pentapod.planning import PlacedPath
from refused_jobs import FINISHED, Refused, block, cap


def finished(folder, shape, **toolpath):
    tables = {**FINISHED, "axis": {"mode": "auto"}, "toolpath": {**FINISHED["toolpath"], **toolpath}}
    return Job.load(Refused(shape, tables).write(folder))


@pytest.mark.parametrize(
    ("shape", "toolpath", "leaves"),
    [
        (block(30.0, 20.0, 8.0), {}, True),
        (block(30.0, 20.0, 8.0), {"steep_deg": 60.0}, False),
        (block(30.0, 20.0, 8.0), {"strategy": "offset"}, False),
        (cap(20.0, 70.0), {}, False),
    ],
)
def test_only_rasters_leave_walls(shape, toolpath, leaves, tmp_path):
    job = finished(tmp_path, shape, **toolpath)
    machine, mesh = job_machine(job), job_mesh(job)
    cutting = job_cutting(job, job_collision_world(job, machine, mesh), machine)
    assert may_leave_walls(job, cutting) == leaves


def test_a_raster_that_leaves_walls_is_not_planned(tmp_path):
    outcome = run(finished(tmp_path, block(30.0, 20.0, 20.0)), tmp_path / "out", advice=None)
    assert outcome.find(PlacedPath) is None
    assert [each.claim for each in outcome.verdict.certificates if not each.passed] == ["surface left on the region"]
