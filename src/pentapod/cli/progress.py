"""Progress on stderr: stage, share and time left, as bars on a terminal, as lines where stderr is a file or a pipe."""

from __future__ import annotations

import logging
import sys
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import click

from pentapod.cli.silence import Silence

if TYPE_CHECKING:
    from pentapod.base.progress import Progress

LINE_EVERY_S = 5.0
"""Seconds between two lines; what takes less than that prints none."""

SILENT_S = 15.0
"""Seconds without a line after which one says that the stage goes on."""

INTERRUPTED = "interrupted"
"""How the note begins of a search that Ctrl-C ended with its best result so far; the command goes on, and says so."""

FIRST_SHARE = 0.02
"""Share of a stage from which the time that is left is told."""

GROWN = 1.2
"""Estimate of the time that is left, by the least one told before, from which it is not told any more."""


@contextmanager
def progress_bar(*, quiet: bool) -> Generator[Progress]:
    """Yield a Progress that draws a bar for each stage on a terminal, and prints lines elsewhere; silent if quiet.

    Messages of the log `pentapod` (kernels are compiled) are printed above the bars.
    """
    from pentapod.base.progress import silent
    from pentapod.cli.signals import raising_again

    if quiet:
        yield raising_again(silent)
    elif not sys.stderr.isatty():
        lines = Lines(lambda line: click.echo(line, err=True))
        with lines.silence:
            yield raising_again(lines)
    else:
        with _bars() as show:
            yield raising_again(show)


class TimeLeft:
    """The time that a stage takes yet, as text, from its share; an estimate that grows was wrong and is not told."""

    def __init__(self, began: float) -> None:
        self.began, self.least = began, float("inf")

    def text(self, now: float, fraction: float) -> str:
        """Return "about 5 s left"; empty where it is not known."""
        seconds = now - self.began
        known = FIRST_SHARE <= fraction < 1.0 and seconds > 0.0
        left = seconds * (1.0 - fraction) / fraction if known else float("inf")
        told = left < GROWN * self.least
        self.least = min(left, self.least)
        return f"about {left:.0f} s left" if told else ""


class Lines:
    """A Progress that prints a line every few seconds: stage, share, time left, note.

    silence: prints one while nothing is reported.
    """

    def __init__(self, echo: Callable[[str], None], clock: Callable[[], float] = time.monotonic) -> None:
        self.echo, self.clock = echo, clock
        self.stage, self.told, self.seen, self.left = "", clock(), clock(), TimeLeft(clock())
        self.last = "getting ready"
        self.silence = Silence(self._goes_on, SILENT_S, clock)

    def __call__(self, stage: str, fraction: float, note: str = "") -> None:
        """Print a line if it is time."""
        now = self.clock()
        if stage != self.stage:
            self.stage, self.left = stage, TimeLeft(self.seen)  # many stages report first when a part of them is done
        self.seen = now
        self.last = f"{stage} {100.0 * fraction:.0f} %" if fraction > 0.0 else stage
        if now - self.told < LINE_EVERY_S and not note.startswith(INTERRUPTED):
            return
        self.told = now
        self.silence.heard()
        more = self.left.text(now, fraction) or f"{now - self.left.began:.0f} s so far"
        self.echo(f"{self.last}, {more}{f': {note}' if note else ''}")

    def _goes_on(self) -> None:
        """Print that the stage goes on."""
        self.told = self.clock()
        self.echo(f"{self.last}, {self.told - self.left.began:.0f} s so far")


@contextmanager
def _bars() -> Generator[Progress]:
    """Yield a Progress that draws a bar for each stage; the clock of a stage stands still once the next one begins."""
    from rich.console import Console
    from rich.logging import RichHandler
    from rich.progress import BarColumn, TaskID, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bars

    tasks: dict[str, tuple[TaskID, TimeLeft]] = {}
    columns = (
        TextColumn("{task.description:<10}"),
        BarColumn(),
        TextColumn("{task.fields[share]:>5}"),
        TimeElapsedColumn(),
        TextColumn("{task.fields[left]:>16}"),
        TextColumn("{task.fields[note]}"),
    )
    with Bars(*columns, console=Console(stderr=True), transient=True) as bars:

        def show(stage: str, fraction: float, note: str = "") -> None:
            now = time.monotonic()
            if stage not in tasks:
                for other, _ in tasks.values():
                    bars.stop_task(other)
                # Without a total the bar pulses.
                tasks[stage] = bars.add_task(stage, total=None, note=note, left="", share=""), TimeLeft(now)
            task, left = tasks[stage]
            total, share = (1.0, f"{100.0 * fraction:.0f} %") if fraction > 0.0 else (None, "")
            told = left.text(now, fraction) if fraction < 1.0 else ""
            bars.update(task, total=total, completed=fraction, note=note, left=told, share=share)

        log = logging.getLogger("pentapod")
        level = log.level
        handler = RichHandler(console=bars.console, show_time=False, show_level=False, show_path=False)
        log.addHandler(handler)
        log.setLevel(logging.INFO)
        try:
            yield show
        finally:
            log.removeHandler(handler)
            log.setLevel(level)
