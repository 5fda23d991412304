"""Shared by all floors: a small job that plans in a second or two."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import settings

from pentapod.cli.commands.new import dome_stl
from usual_job import job_text

if TYPE_CHECKING:
    from pentapod.job import Job, Outcome

# A busy machine is no failure. Every run looks at the same examples, so that a run can be repeated;
# HYPOTHESIS_PROFILE=search looks for new ones.
settings.register_profile("same", deadline=None, derandomize=True)
settings.register_profile("search", deadline=None, print_blob=True)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "same"))

# Whoever starts the tests in the background leaves them deaf to Ctrl-C, which some of them send.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def make_job(tmp_path: Path) -> Callable[..., Path]:
    """Write a job, with pieces of its text replaced, beside its mesh; return its path."""

    def make(*changes: tuple[str, str], mesh: bytes | None = None, name: str = "job.toml") -> Path:
        text = job_text()
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        (tmp_path / "part.stl").write_bytes(dome_stl(cells=12) if mesh is None else mesh)
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return make


@pytest.fixture(scope="session")
def usual_run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Job, Path, Outcome]:
    """The usual job, the folder of its run and the outcome, planned once for all tests that read or copy them."""
    from pentapod.job import Job, run

    folder = tmp_path_factory.mktemp("usual")
    (folder / "part.stl").write_bytes(dome_stl(cells=12))
    (folder / "job.toml").write_text(job_text(), encoding="utf-8")
    job = Job.load(folder / "job.toml")
    return job, folder / "out", run(job, folder / "out")


@pytest.fixture
def parts() -> Path:
    """The folder of real meshes by others; without it the test is skipped."""
    folder = os.environ.get("PENTAPOD_PARTS")
    if not folder or not Path(folder).is_dir():
        pytest.skip("PENTAPOD_PARTS does not name a folder of real meshes")
    return Path(folder).resolve()
