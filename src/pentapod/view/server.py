"""Viewer: server of the live view: play the motion, drag the part, see its margins, plan again there."""

from __future__ import annotations

import io
import threading
import time
from contextlib import redirect_stdout
from types import TracebackType
from typing import TYPE_CHECKING

from pentapod.base.errors import PentapodError
from pentapod.geometry.rigid import RigidTransform
from pentapod.toolpath.linking.partition import Piece
from pentapod.view.access import Access, open_server
from pentapod.view.motion import ToolMotion
from pentapod.view.opened_run import OpenedRun
from pentapod.view.panel import Panel, machine_pose_words, place_words, reach_words
from pentapod.view.replan import Replanned, replanned
from pentapod.view.scene import ViewerScene
from pentapod.view.study import Reach, Study

if TYPE_CHECKING:
    import viser

FRAME_S = 1.0 / 30.0
"""Seconds between frames of the playback."""


class Viewer:
    """A server that shows one run, until it is stopped. Also a context manager.

    host, port: address; the next free port where that one is in use. Only requests with the token in `url` are answered
    (`access`). While the part is dragged, the margins of the latest placement are computed; those passed meanwhile are
    skipped. Raises InputError without viser, or with a version of it that was not tested.
    """

    def __init__(self, run: OpenedRun, *, host: str = "127.0.0.1", port: int = 8080) -> None:
        self._access = Access(host)
        self._server: viser.ViserServer = open_server(self._access, port)
        self._stopped, self._moved = threading.Event(), threading.Event()
        self._lock, self._planning = threading.RLock(), threading.Lock()  # of the scene; of planning again
        self._thorough = False
        self.reach: Reach
        self.replanned: Replanned | None = None
        self._show(run)
        self._threads = [threading.Thread(target=loop, daemon=True) for loop in (self._follow_drags, self._play)]
        for thread in self._threads:
            thread.start()

    @property
    def url(self) -> str:
        """The address for the browser, with the token."""
        return f"http://{self._server.get_host()}:{self._server.get_port()}/?token={self._access.token}"

    @property
    def placement(self) -> RigidTransform:
        """The present placement."""
        return self._scene.placement

    def move(self, placement: RigidTransform) -> None:
        """Move the part to a placement, as if it had been dragged there."""
        self._scene.set_placement(placement)
        self._moved_part(thorough=True)

    def stop(self) -> None:
        """End the server."""
        self._stopped.set()
        self._moved.set()
        for thread in self._threads:
            thread.join()
        with redirect_stdout(io.StringIO()):
            self._server.stop()

    def __enter__(self) -> Viewer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    def _show(self, run: OpenedRun) -> None:
        """Draw a run, and connect its controls."""
        study, motion = Study.of(run), ToolMotion.of(run)
        with self._lock, self._server.atomic():
            self.run, self._study, self._motion = run, study, motion
            self._server.scene.reset()
            self._server.gui.reset()
            self._scene = ViewerScene(self._server, run, study)
            self.panel = panel = Panel(self._server, run, motion)
        self._scene.part.on_update(lambda event: self._moved_part(thorough=event.phase == "end"))
        panel.time.on_update(lambda _: self._show_machine_pose())
        panel.tilted.on_update(lambda _: self._moved_part(thorough=True))
        panel.back.on_click(lambda _: self.move(run.placement))
        panel.replan.on_click(lambda _: self.plan_here())
        self._judge(thorough=True)

    def _moved_part(self, *, thorough: bool) -> None:
        """Note that the part was moved; its margins follow when those of the last placement are done."""
        self._thorough = thorough
        self._moved.set()

    def _follow_drags(self) -> None:
        while not self._stopped.is_set():
            self._moved.wait()
            self._moved.clear()
            if not self._stopped.is_set():
                self._judge(thorough=self._thorough)

    def _judge(self, *, thorough: bool) -> None:
        """Show the margins of the present placement."""
        with self._lock:
            placement, study, tilted = self._scene.placement, self._study, self.panel.tilted.value
        reach = study.at(placement, tilted=tilted, thorough=thorough)
        with self._lock, self._server.atomic():
            if study is not self._study:  # another run is shown meanwhile
                return
            self.reach = reach
            self._scene.show_reach(self.reach)
            self.panel.reach.content = reach_words(self.reach)
            self.panel.place.content = place_words(placement)
        self._show_machine_pose()

    def _show_machine_pose(self) -> None:
        """Show the machine at the slider's time."""
        with self._lock:
            seconds = self.panel.time.value
            machine_pose = self._motion.machine_pose(seconds, self.run.machine, self._scene.placement)
            self._scene.show_machine_pose(machine_pose)
            self.panel.machine_pose.content = machine_pose_words(seconds, machine_pose)

    def _play(self) -> None:
        """Move the slider while "play" is ticked; after the end it starts again."""
        last = time.perf_counter()
        while not self._stopped.wait(FRAME_S):
            now = time.perf_counter()
            with self._lock:
                if self.panel.play.value:
                    later = self.panel.time.value + (now - last) * self.panel.speed_factor
                    self.panel.time.value = later if later <= self._motion.duration else 0.0
            last = now

    def plan_here(self) -> None:
        """Plan the job with the part at the present placement, into a folder of its own, and show the result."""
        if not self._planning.acquire(blocking=False):
            return
        panel = self.panel
        try:
            panel.replan.disabled, panel.bar.visible = True, True
            self.replanned = done = replanned(self.run, self._scene.placement, self._show_progress)
            if done.run is not None:
                self._show(done.run)
            self.panel.news.content = _result_words(done)
        except PentapodError as error:
            self.panel.news.content = str(error)
        finally:
            self.panel.replan.disabled, self.panel.bar.visible = False, False
            self._planning.release()

    def _show_progress(self, stage: str, fraction: float, note: str = "") -> None:
        """Show the progress of planning."""
        self.panel.bar.value = 100.0 * fraction
        self.panel.news.content = f"{stage} {note}".strip()


def _result_words(done: Replanned) -> str:
    """Return the result of planning again, as text."""
    refusal = done.outcome.refusal
    if refusal is not None:
        return f"**Refused**: {refusal}"
    answer = f"Verdict: {done.outcome.verdict.answer}"
    answer = answer if done.outcome.passed else f"**{answer}**"
    where = "the job file" if done.outcome.find(Piece) is None else "a copy of the job file, for this set-up alone"
    return f"{answer}. Files: `{done.folder}`. For {where}:\n```toml\n{done.table}\n```"
