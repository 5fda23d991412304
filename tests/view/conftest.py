"""A small job, planned once for all tests of the viewer."""

from __future__ import annotations

import pytest

from pentapod.cli.commands.new import dome_stl
from pentapod.job import Job, run
from pentapod.view import open_run
from usual_job import job_text


@pytest.fixture(scope="session")
def planned(tmp_path_factory):
    """The folder of the job, with the run in `out`, and the run's outcome."""
    folder = tmp_path_factory.mktemp("viewed")
    (folder / "part.stl").write_bytes(dome_stl(cells=12))
    (folder / "job.toml").write_text(job_text().replace("tilt_deg = 0", "tilt_deg = 5"), encoding="utf-8")
    return folder, run(Job.load(folder / "job.toml"), folder / "out")


@pytest.fixture(scope="session")
def opened(planned):
    return open_run(planned[0] / "out")
