"""Planning again with the part at the placement to which it was dragged, in a process that can be cancelled."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pentapod.base.errors import PentapodError
from pentapod.base.progress import Progress, silent
from pentapod.geometry.rigid import RigidTransform
from pentapod.job.artefacts import MANIFEST, REPORT, SHEET
from pentapod.job.build.placement import job_at, placement_toml
from pentapod.job.outcome import Outcome
from pentapod.job.pipeline.run import run as run_job
from pentapod.job.run_folder import tidied
from pentapod.report import write_report
from pentapod.report.sheet import write_sheet
from pentapod.view.apart import Apart, EndedError
from pentapod.view.opened_run import OpenedRun, run_of

FOLDER = "replanned"
"""Folder of the files, within the folder of the run."""

PATIENCE_S = 10.0
"""Seconds for which the end of a cancelled plan is waited for."""


@dataclass(frozen=True, eq=False)
class Replanned:
    """Result of planning again. run: None where it was refused.

    table: [placement] for the job file; for one of several set-ups it belongs into a copy of the job file.
    """

    outcome: Outcome
    run: OpenedRun | None
    folder: Path
    table: str


def folder_of(run: OpenedRun) -> Path:
    """Return the folder into which a run is planned again."""
    return run.folder if run.folder.name == FOLDER else run.folder / FOLDER


def replanned(run: OpenedRun, placement: RigidTransform, progress: Progress = silent) -> Replanned:
    """Plan the run's job, or its set-up's piece of it, with the part fixed at a placement, all artefacts included.

    With `table` as [placement] in the job file, `verify` accepts the program.
    """
    job, folder = job_at(run.job, placement), folder_of(run)
    outcome = run_job(job, folder, progress, piece=run.piece, writers={REPORT: write_report, SHEET: write_sheet})
    return Replanned(outcome, run_of(outcome, folder), folder, placement_toml(job.placement))


class Replanning:
    """At most one plan at a time. `state` is what the page shows of it."""

    def __init__(self, say: Callable[[Replanned], dict[str, Any]]) -> None:
        """Keep what to call with a result; it returns what the page says of it."""
        self._say, self._alone, self._ends = say, threading.Lock(), threading.Event()
        self._thread: threading.Thread | None = None
        self._process: Apart | None = None
        self._now: tuple[str, float, str] = ("", 0.0, "")
        self._news: dict[str, Any] = {}

    @property
    def state(self) -> dict[str, Any]:
        """Whether it plans, the stage with its share, and what came of the last plan."""
        plans, (stage, share, note) = self._alone.locked(), self._now
        ends = plans and self._ends.is_set()
        return {"plans": plans, "ends": ends, "stage": stage, "share": share, "note": note, "news": self._news}

    def start(self, run: OpenedRun, placement: RigidTransform) -> bool:
        """Begin to plan; return False where a plan is being made already."""
        if not self._alone.acquire(blocking=False):
            return False
        self._ends.clear()
        self._now, self._news = ("getting ready", 0.0, ""), {}
        self._thread = threading.Thread(target=self._plan, args=(run, placement), daemon=True)
        self._thread.start()
        return True

    def cancel(self) -> None:
        """End the plan; its folder stays as it was."""
        self._ends.set()
        if self._process is not None:
            self._process.end()

    def stop(self) -> None:
        """Cancel, and wait for the end."""
        self.cancel()
        if self._thread is not None:
            self._thread.join(PATIENCE_S)

    def _plan(self, run: OpenedRun, placement: RigidTransform) -> None:
        try:
            before, is_new = _manifest(run), not folder_of(run).exists()
            self._process = Apart()
            if self._ends.is_set():  # it came before there was a process
                self._process.end()
            try:
                self._news = self._say(self._process.result(replanned, run, placement, progress=self._progress))
            except EndedError:
                tidied(folder_of(run), is_new=is_new)
                ended = "Cancelled." if self._ends.is_set() else "The process that planned has died."
                same = (
                    "The files are as they were." if _manifest(run) == before else "The new files were there already."
                )
                self._news = {"text": f"{ended} {same}", "passed": self._ends.is_set()}
        except PentapodError as error:
            self._news = {"text": str(error), "passed": False}
        except Exception as error:
            self._news = {"text": f"An error of pentapod: {error!r}", "passed": False}
            raise
        finally:
            self._process = None
            self._alone.release()

    def _progress(self, stage: str, fraction: float, note: str = "") -> None:
        self._now = stage, fraction, note


def _manifest(run: OpenedRun) -> bytes:
    """Return the list of files of the run that was planned again before; empty where there is none."""
    file = folder_of(run) / MANIFEST
    return file.read_bytes() if file.is_file() else b""
