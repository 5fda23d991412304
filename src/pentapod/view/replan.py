"""Planning again with the part at the placement to which it was dragged, in a thread that can be cancelled."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pentapod.base.errors import PentapodError
from pentapod.base.progress import Progress, silent
from pentapod.geometry.rigid import RigidTransform
from pentapod.job.artefacts import REPORT, SHEET
from pentapod.job.build.placement import job_at, placement_toml
from pentapod.job.outcome import Outcome
from pentapod.job.pipeline import run as run_job
from pentapod.report import write_report
from pentapod.report.sheet import write_sheet
from pentapod.view.opened_run import OpenedRun, run_of

FOLDER = "replanned"
"""Folder of the files, within the folder of the run."""

PATIENCE_S = 10.0
"""Seconds for which the end of a cancelled plan is waited for."""


class Cancelled(SystemExit):
    """Planning was cancelled; as SIGTERM does, it ends a search without its best result so far."""


@dataclass(frozen=True, eq=False)
class Replanned:
    """Result of planning again. run: None where it was refused.

    table: [placement] for the job file; for one of several set-ups it belongs into a copy of the job file.
    """

    outcome: Outcome
    run: OpenedRun | None
    folder: Path
    table: str


def replanned(run: OpenedRun, placement: RigidTransform, progress: Progress = silent) -> Replanned:
    """Plan the run's job, or its set-up's piece of it, with the part fixed at a placement, all artefacts included.

    With `table` as [placement] in the job file, `verify` accepts the program.
    """
    job = job_at(run.job, placement)
    folder = run.folder if run.folder.name == FOLDER else run.folder / FOLDER
    outcome = run_job(job, folder, progress, piece=run.piece, writers={REPORT: write_report, SHEET: write_sheet})
    return Replanned(outcome, run_of(outcome, folder), folder, placement_toml(job.placement))


class Replanning:
    """At most one plan at a time. `state` is what the page shows of it."""

    def __init__(self, say: Callable[[Replanned], dict[str, Any]]) -> None:
        """Keep what to call with a result; it returns what the page says of it."""
        self._say, self._alone, self._ends = say, threading.Lock(), threading.Event()
        self._thread: threading.Thread | None = None
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
        self._now, self._news = ("mesh", 0.0, ""), {}
        self._thread = threading.Thread(target=self._plan, args=(run, placement), daemon=True)
        self._thread.start()
        return True

    def cancel(self) -> None:
        """End the plan at its next report of progress; its folder stays as it was."""
        self._ends.set()

    def stop(self) -> None:
        """Cancel, and wait for the end."""
        self.cancel()
        if self._thread is not None:
            self._thread.join(PATIENCE_S)

    def _plan(self, run: OpenedRun, placement: RigidTransform) -> None:
        try:
            self._news = self._say(replanned(run, placement, self._progress))
        except Cancelled:
            self._news = {"text": "Cancelled. The files are as they were.", "passed": True}
        except PentapodError as error:
            self._news = {"text": str(error), "passed": False}
        except Exception as error:
            self._news = {"text": f"An error of pentapod: {error!r}", "passed": False}
            raise
        finally:
            self._alone.release()

    def _progress(self, stage: str, fraction: float, note: str = "") -> None:
        if self._ends.is_set():  # raised at each report: a library may drop one
            raise Cancelled
        self._now = stage, fraction, note
