"""Jobs from Python: nested values and changes give the same job as the file, and the same errors."""

from __future__ import annotations

import pickle
import tomllib

import numpy as np
import pytest

from pentapod.base.errors import JobError
from pentapod.job import Job
from pentapod.job.build.toolpath import job_toolpath
from pentapod.job.build.values import job_mesh


def content_of(path):
    return tomllib.loads(path.read_text())


def test_values_give_the_same_job_as_their_file(make_job):
    path = make_job()
    job, made = Job.load(path), Job.from_dict(content_of(path), path.parent)
    assert (made.tables, made.digest, made.mesh_path) == (job.tables, job.digest, job.mesh_path)
    mesh = job_mesh(job)
    ours, theirs = job_toolpath(job, mesh)[0], job_toolpath(made, mesh)[0]
    assert ours.tips.tobytes() == theirs.tips.tobytes()
    assert ours.axes.tobytes() == theirs.axes.tobytes()


def test_paths_arrays_and_tuples_may_stand_for_texts_and_lists(make_job):
    path = make_job()
    content = content_of(path)
    content["part"] |= {"mesh": path.parent / content["part"]["mesh"], "region_direction": np.array([0, 0, 1.0])}
    content["placement"]["rotation_deg"] = tuple(content["placement"]["rotation_deg"])
    assert Job.from_dict(content).digest == Job.load(path).digest


def test_a_changed_job_is_that_of_the_changed_file(make_job):
    job = Job.load(make_job())
    wanted = Job.load(make_job(("stepover_mm = 15", "scallop_mm = 0.5"), ("cut_mm_min = 3000", "cut_mm_min = 1200")))
    nested = job.with_(toolpath={"stepover_mm": None, "scallop_mm": 0.5}, feed={"cut_mm_min": 1200})
    dotted = job.with_(**{"toolpath.stepover_mm": None, "toolpath.scallop_mm": 0.5, "feed.cut_mm_min": 1200})
    assert nested.digest == dotted.digest == wanted.digest != job.digest
    assert (
        nested.with_(toolpath={"scallop_mm": None, "stepover_mm": 15}, feed={"cut_mm_min": 3000}).digest == job.digest
    )
    assert job.with_(verify=None, output=None).digest == job.digest


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"toolpath": {"stepovr_mm": 2}}, 'toolpath.stepovr_mm: unknown key; did you mean "stepover_mm"?'),
        ({"feeds.cut_mm_min": 2}, 'feeds: unknown table; did you mean "feed"?'),
        ({"feed": {"link": 1200}}, 'feed.link: unknown key; did you mean "link_mm_min"?'),
        ({"cut_mm_min": 2}, 'cut_mm_min: unknown key; did you mean "feed.cut_mm_min"?'),
        ({"feed.cut_mm_min": -2}, "feed.cut_mm_min: out of range (got -2); expected greater than 0"),
        ({"toolpath.strategy": "edges"}, 'toolpath.stepover_mm: the strategy "edges" has no such key; take it out'),
        ({"part.mesh": "none.stl"}, "part.mesh: no such file (got 'none.stl')"),
        ({"verify.waive": ["nothing"]}, "verify.waive: no such claim"),
    ],
)
def test_mistakes_in_changes_are_one_clear_line(make_job, changes, message):
    with pytest.raises(JobError) as caught:
        Job.load(make_job()).with_(**changes)
    assert str(caught.value).startswith(message)


def test_a_job_pickles(make_job):
    job = Job.load(make_job())
    again = pickle.loads(pickle.dumps(job))
    assert (again, again.digest) == (job, job.digest)


@pytest.mark.parametrize(
    ("key", "old", "new"),
    [
        ("toolpath.stepover_mm", "stepover_mm = 15", "stepover_mm = 90000"),
        ("toolpath.clearance_mm", "stepover_mm = 15", "stepover_mm = 15\nclearance_mm = 90000"),
        ("axis.smoothing_reach_mm", "tilt_deg = 0", "tilt_deg = 0\nsmoothing_reach_mm = 90000"),
        ("gouge.highest_mm", "[feed]", "[gouge]\nhighest_mm = 90000\n[feed]"),
    ],
)
def test_a_length_larger_than_the_part_is_told_with_its_line(make_job, key, old, new):
    job = Job.load(make_job((old, new)))
    with pytest.raises(JobError, match=rf"job\.toml:\d+: {key}: too large for the part, .*expected at most"):
        job_mesh(job)
