"""ServedRun: one run of the viewer, its page and the answers to its page's requests."""

from __future__ import annotations

import json
import threading
from pathlib import Path
from typing import Any

import numpy as np

from pentapod.base.errors import ArrayError, InputError
from pentapod.geometry.rigid import RigidTransform
from pentapod.job.clamped.placed_job import placement_in
from pentapod.report.words import job_title
from pentapod.view.opened_run import OpenedRun
from pentapod.view.replan import Replanned, Replanning
from pentapod.view.viewed import ViewedRun, numbers_of, placement_of
from pentapod.view.words import reach_words, result_words

MARGIN_STEP = 1e-3
"""Step of the margins that the page gets: it colours the path by them."""


class ServedRun:
    """Answers by name, each with the JSON that it was asked with. token, base: as in `ViewedRun.page`."""

    def __init__(self, run: OpenedRun, token: str, base: str) -> None:
        self._token, self._base, self._lock = token, base, threading.Lock()
        self._replanning = Replanning(self._planned)
        self._show(ViewedRun.of(run))

    def _show(self, viewed: ViewedRun) -> None:
        page = viewed.page(self._token, self._base).encode("utf-8")
        with self._lock:
            self.viewed, self.page = viewed, page

    def answer(self, name: str, given: dict[str, Any]) -> dict[str, Any] | None:
        """Return the answer to a request; None where there is no such name. Raises InputError."""
        answers = {
            "margins": self._margins, "joints": self._joints, "touch-off": self._touch_off,
            "placement": self._placement, "plan": self._plan, "cancel": self._cancel, "state": self._state,
        }  # fmt: skip
        return answers[name](given) if name in answers else None

    def stop(self) -> None:
        """Cancel a plan that is being made."""
        self._replanning.stop()

    def _margins(self, given: dict[str, Any]) -> dict[str, Any]:
        placement, thorough = _placement_of(given), given.get("thorough") is True
        with self._lock:
            study = self.viewed.study
            reach = study.at(placement, tilted=given.get("tilted") is True, thorough=thorough)
        margins = np.interp(study.shown, reach.rows, reach.margins)
        steps = np.clip(np.rint(margins / MARGIN_STEP), -30_000, 30_000).astype(int)
        return {"fits": reach.fits, "text": reach_words(reach), "step": MARGIN_STEP, "margins": steps.tolist()}

    def _joints(self, given: dict[str, Any]) -> dict[str, Any]:
        return {"joints": self.viewed.joints_mm(_placement_of(given))}

    def _touch_off(self, given: dict[str, Any]) -> dict[str, Any]:
        return {
            "name": f"{job_title(self.viewed.opened.job.path)}-touch-off.csv",
            "text": self.viewed.touch_off(_placement_of(given)),
        }

    def _placement(self, given: dict[str, Any]) -> dict[str, Any]:
        """Read a file with a table [placement]."""
        text, name = given.get("text"), given.get("name")
        if not isinstance(text, str) or not isinstance(name, str):
            raise InputError("not a placement file", expected="a text and its name")
        return {"placement": numbers_of(placement_in(text, Path(name)))}

    def _plan(self, given: dict[str, Any]) -> dict[str, Any]:
        self._replanning.start(self.viewed.opened, _placement_of(given))
        return self._replanning.state

    def _cancel(self, given: dict[str, Any]) -> dict[str, Any]:
        del given
        self._replanning.cancel()
        return self._replanning.state

    def _state(self, given: dict[str, Any]) -> dict[str, Any]:
        del given
        return self._replanning.state

    def _planned(self, done: Replanned) -> dict[str, Any]:
        """Show the run that was planned, and return what the page says of it."""
        refusal = done.outcome.refusal
        if done.run is not None:
            self._show(ViewedRun(done.outcome, done.run))
        toml = done.table if refusal is None else "\n\n".join(each.toml for each in refusal.advice)
        return {
            "text": result_words(done), "toml": toml, "passed": done.outcome.passed, "isNew": done.run is not None,
        }  # fmt: skip


def _placement_of(given: dict[str, Any]) -> RigidTransform:
    try:
        return placement_of(given["placement"])
    except (KeyError, TypeError, ValueError, ArrayError) as error:
        raise InputError(
            "not a placement", key="placement", expected="a rotation, row by row, and millimetres"
        ) from error


def read_json(body: bytes) -> dict[str, Any]:
    """Return what a request has as JSON. Raises InputError where it is none."""
    try:
        content = json.loads(body or b"{}")
    except (ValueError, RecursionError) as error:
        raise InputError("not JSON", expected="an object") from error
    if not isinstance(content, dict):
        raise InputError("not JSON", expected="an object")
    return content
