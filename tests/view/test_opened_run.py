"""A run's folder is opened with the job that it was made from, or it is said what is missing."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

from pentapod.base.errors import InputError
from pentapod.job import Job, run
from pentapod.planning import PlacedPath
from pentapod.program import Program
from pentapod.view import Study, open_run

TOO_FAR = ("position_mm = [", "position_mm = [1000.0, 0, 700] # [")


def test_a_run_is_what_was_planned(planned, opened):
    folder, outcome = planned
    placed, program = outcome.find(PlacedPath), outcome.find(Program)
    assert opened.job.path.samefile(folder / "job.toml")
    assert opened.same_job
    assert opened.component == placed.component
    assert np.abs(opened.placement.matrix - placed.placement.transform.matrix).max() < 1e-12
    assert np.abs(opened.placement.rotate(opened.axes) - placed.axes).max() < 1e-12
    assert np.abs(opened.placement.apply(opened.toolpath.tilt_centres) - placed.tilt_centres).max() < 1e-9
    assert np.array_equal(opened.program.legs, program.legs)


def test_folders_may_move_together(planned, tmp_path):
    shutil.copytree(planned[0], tmp_path / "elsewhere")
    moved = open_run(tmp_path / "elsewhere" / "out")
    assert moved.job.path.samefile(tmp_path / "elsewhere" / "job.toml")
    assert moved.same_job


def test_a_changed_job_is_noticed(planned, tmp_path):
    shutil.copytree(planned[0], tmp_path / "copy")
    job = tmp_path / "copy" / "job.toml"
    job.write_text(job.read_text().replace("cut_mm_min = 3000", "cut_mm_min = 2000"))
    assert not open_run(tmp_path / "copy" / "out").same_job


def test_what_is_missing_is_named(planned, tmp_path):
    with pytest.raises(InputError, match="no such folder"):
        open_run(tmp_path / "none")
    with pytest.raises(InputError, match=r"no run in this folder.*pentapod plan"):
        open_run(tmp_path)
    shutil.copytree(planned[0] / "out", tmp_path / "alone")
    with pytest.raises(InputError, match=r"the job file of this run is gone.*--job"):
        open_run(tmp_path / "alone")
    assert open_run(tmp_path / "alone", planned[0] / "job.toml").same_job
    with np.load(tmp_path / "alone" / "plan.npz") as archive:
        arrays = {name: archive[name] for name in archive if name != "job.file"}
    np.savez(tmp_path / "alone" / "plan.npz", **arrays)
    (tmp_path / "alone" / "manifest.json").unlink()
    with pytest.raises(InputError, match=r"does not name its job.*--job"):
        open_run(tmp_path / "alone")


def test_a_refused_job_is_shown_in_the_middle_of_the_work(make_job, tmp_path):
    """So that it can be dragged to where it fits."""
    outcome = run(Job.load(make_job(TOO_FAR)), tmp_path / "out", advice=None)
    assert outcome.refusal is not None
    opened = open_run(tmp_path / "out")
    assert opened.program is None
    centre = opened.placement.apply(opened.toolpath.tips.mean(axis=0))
    assert centre == pytest.approx(outcome.machine.work.centre, abs=1e-9)
    mean = opened.placement.rotate(opened.axes.mean(axis=0))
    assert mean[:2] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert mean[2] * outcome.machine.work.centre[2] < 0.0, "the spindle is on the side of the base"
    assert Study.of(opened).at(opened.placement).fits
