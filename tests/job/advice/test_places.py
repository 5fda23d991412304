"""Other placements: each is what the changes of the job allow, and the part stays on its table."""

from __future__ import annotations

import numpy as np
import pytest

from pentapod.geometry.rigid import RigidTransform
from pentapod.job import Job
from pentapod.job.advice.options import OPTIONS
from pentapod.job.advice.places import places
from pentapod.job.advice.sketch import Sketch
from pentapod.job.build.placement import job_constraints
from pentapod.job.build.tool import job_tool
from pentapod.job.build.values import job_machine, job_mesh
from refused_jobs import REFUSED


def found(folder, name):
    job = Job.load(REFUSED[name].write(folder))
    machine, mesh = job_machine(job), job_mesh(job)
    sketch = Sketch.of_region(job, mesh, job_tool(job, machine), 40)
    return job, machine, mesh, {place.words: place for place in places(job, machine, mesh, sketch, OPTIONS)}


@pytest.mark.parametrize("name", ["too far", "fixed, leaning", "table too low", "bottom of a block on a table"])
def test_the_changes_allow_what_was_estimated(name, tmp_path):
    job, machine, mesh, all_ = found(tmp_path, name)
    rng = np.random.default_rng(0)
    assert "the planner chooses the placement" in all_
    for words, place in all_.items():
        if not words or not place.constraints.upright.any():
            continue
        rotation, origin = place.constraints.nearest(np.eye(3)[None], rng.normal(scale=0.1, size=(1, 3)))
        at = RigidTransform(rotation[0], origin[0])
        allowed = job_constraints(job.with_(**place.changes(at)), machine, mesh)
        again = allowed.nearest_to(at)
        assert np.abs(again.matrix - at.matrix).max() < 1e-4, words  # the table's height is rounded to 0.1 mm


def test_a_fixed_part_is_turned_about_the_vertical_first(tmp_path):
    job, _, mesh, all_ = found(tmp_path, "too near")
    assert list(all_)[:2] == ["", "turned about the vertical"]
    place = all_["turned about the vertical"]
    own = job_constraints(job, job_machine(job), mesh).poses[0]
    stays = place.constraints.nearest_to(own)
    assert np.abs(stays.matrix - own.matrix).max() < 1e-6
    assert place.changes(own)["placement"]["mode"] == "table"


def test_the_side_that_is_machined_is_turned_upwards(tmp_path):
    *_, all_ = found(tmp_path, "bottom of a block on a table")
    assert "another height of the table" not in all_  # the tool would come through it
    assert all_["lying on another face"].constraints.upright.tolist() == [0.0, 0.0, -1.0]
