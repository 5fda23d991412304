"""Viewer: a run in the browser, live: scrub and play, drag the part, see what that comes to, plan anew there."""

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
from pentapod.view.doors import Doors, open_server
from pentapod.view.motion import Motion
from pentapod.view.opened import Opened
from pentapod.view.panel import Panel, place_words, reach_words, stance_words
from pentapod.view.replan import Replanned, replanned
from pentapod.view.scene import Scene
from pentapod.view.study import Reach, Study

if TYPE_CHECKING:
    import viser

_FRAME_S = 1.0 / 30.0


class Viewer:
    """A server that shows one run, until it is stopped. Also a context manager.

    host, port: where it listens; the next port that is free where that one is taken. Only who knows the token in `url`
    is let in (`doors`). What is computed for a drag is always that of the latest place: places that were passed
    meanwhile are left out. Raises InputError without viser, or with another version of it than was tested.
    """

    def __init__(self, run: Opened, *, host: str = "127.0.0.1", port: int = 8080) -> None:
        self._doors = Doors(host)
        self._server: viser.ViserServer = open_server(self._doors, port)
        self._stopped, self._moved = threading.Event(), threading.Event()
        self._lock, self._planning = threading.RLock(), threading.Lock()  # of what is shown; of planning anew
        self._thorough = False
        self.reach: Reach
        self.replanned: Replanned | None = None
        self._show(run)
        self._threads = [threading.Thread(target=loop, daemon=True) for loop in (self._follow_drags, self._play)]
        for thread in self._threads:
            thread.start()

    @property
    def url(self) -> str:
        """Where to point a browser, with the token that lets it in."""
        return f"http://{self._server.get_host()}:{self._server.get_port()}/?token={self._doors.token}"

    @property
    def placement(self) -> RigidTransform:
        """Where the part stands now."""
        return self._scene.placement

    def move(self, placement: RigidTransform) -> None:
        """Put the part somewhere, as if it had been dragged there and let go."""
        self._scene.set_placement(placement)
        self._take(thorough=True)

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

    def _show(self, run: Opened) -> None:
        """Draw a run, and connect its controls."""
        study, motion = Study.of(run), Motion.of(run)
        with self._lock, self._server.atomic():
            self.run, self._study, self._motion = run, study, motion
            self._server.scene.reset()
            self._server.gui.reset()
            self._scene = Scene(self._server, run, study)
            self.panel = panel = Panel(self._server, run, motion)
        self._scene.part.on_update(lambda event: self._take(thorough=event.phase == "end"))
        panel.time.on_update(lambda _: self._show_stance())
        panel.tilted.on_update(lambda _: self._take(thorough=True))
        panel.back.on_click(lambda _: self.move(run.placement))
        panel.replan.on_click(lambda _: self.plan_here())
        self._judge(thorough=True)

    def _take(self, *, thorough: bool) -> None:
        """Note that the part was moved; it is judged as soon as the place before has been."""
        self._thorough = thorough
        self._moved.set()

    def _follow_drags(self) -> None:
        while not self._stopped.is_set():
            self._moved.wait()
            self._moved.clear()
            if not self._stopped.is_set():
                self._judge(thorough=self._thorough)

    def _judge(self, *, thorough: bool) -> None:
        """Show what the part's place comes to."""
        with self._lock:
            placement, study, tilted = self._scene.placement, self._study, self.panel.tilted.value
        reach = study.at(placement, tilted=tilted, thorough=thorough)
        with self._lock, self._server.atomic():
            if study is not self._study:  # another run is shown by now
                return
            self.reach = reach
            self._scene.show_reach(self.reach)
            self.panel.reach.content = reach_words(self.reach)
            self.panel.place.content = place_words(placement)
        self._show_stance()

    def _show_stance(self) -> None:
        """Show the machine at the slider's time, the part where it stands."""
        with self._lock:
            seconds = self.panel.time.value
            stance = self._motion.stance(seconds, self.run.machine, self._scene.placement)
            self._scene.show_stance(stance)
            self.panel.stance.content = stance_words(seconds, stance)

    def _play(self) -> None:
        """Move the slider on while "play" is ticked; from the end it begins again."""
        last = time.perf_counter()
        while not self._stopped.wait(_FRAME_S):
            now = time.perf_counter()
            with self._lock:
                if self.panel.play.value:
                    later = self.panel.time.value + (now - last) * self.panel.speed_factor
                    self.panel.time.value = later if later <= self._motion.duration else 0.0
            last = now

    def plan_here(self) -> None:
        """Plan the job with the part where it stands, into a folder of its own, and show what comes of it."""
        if not self._planning.acquire(blocking=False):
            return
        panel = self.panel
        try:
            panel.replan.disabled, panel.bar.visible = True, True
            self.replanned = done = replanned(self.run, self._scene.placement, self._tell)
            if done.run is not None:
                self._show(done.run)
            self.panel.news.content = _came_to(done)
        except PentapodError as error:
            self.panel.news.content = str(error)
        finally:
            self.panel.replan.disabled, self.panel.bar.visible = False, False
            self._planning.release()

    def _tell(self, stage: str, fraction: float, note: str = "") -> None:
        """Show how far planning is."""
        self.panel.bar.value = 100.0 * fraction
        self.panel.news.content = f"{stage} {note}".strip()


def _came_to(done: Replanned) -> str:
    """Return what planning anew came to."""
    refusal = done.outcome.refusal
    if refusal is not None:
        return f"**Refused**: {refusal}"
    answer = f"Verdict: {done.outcome.verdict.answer}"
    answer = answer if done.outcome.passed else f"**{answer}**"
    where = "the job file" if done.outcome.find(Piece) is None else "a copy of the job file, for this set-up alone"
    return f"{answer}. Files: `{done.folder}`. For {where}:\n```toml\n{done.table}\n```"
