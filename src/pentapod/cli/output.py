"""Shared by the commands: options, progress bar on stderr, JSON on stdout."""

# ruff: noqa: PLC0415 - a verb loads what it needs when it runs, so that --help stays quick

from __future__ import annotations

import json
import logging
import math
import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from pathlib import Path

    from pentapod.base.progress import Progress
    from pentapod.verify.verdict.verdict import Certificate, NotJudged, Verdict

Command = TypeVar("Command", bound=Callable[..., Any])


def quiet_option(command: Command) -> Command:
    """Add --quiet: nothing but errors and what was asked for with --json."""
    return click.option("-q", "--quiet", is_flag=True, help="Say nothing but errors.")(command)


def json_option(command: Command) -> Command:
    """Add --json."""
    return click.option("--json", "as_json", is_flag=True, help="Print JSON on stdout, nothing else.")(command)


def echo_json(content: Any) -> None:
    """Print JSON on stdout; what is not finite becomes null."""
    click.echo(json.dumps(_finite(content), indent=2, allow_nan=False, ensure_ascii=False))


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(item) for item in value]
    if isinstance(value, float) and (not math.isfinite(value)):
        return None
    return value


@contextmanager
def progress_bar(*, quiet: bool) -> Generator[Progress]:
    """Yield a Progress that draws bars on stderr, one for each stage, with its rate; silent off terminals.

    What the log `pentapod` has to say (that kernels are compiled) stands above the bars.
    """
    from pentapod.base.progress import silent

    if quiet or not sys.stderr.isatty():
        yield silent
        return
    from rich.console import Console
    from rich.logging import RichHandler
    from rich.progress import BarColumn, TaskID, TextColumn, TimeElapsedColumn, TimeRemainingColumn
    from rich.progress import Progress as Bars

    tasks: dict[str, TaskID] = {}
    columns = (
        TextColumn("{task.description:<10}"),
        BarColumn(),
        TextColumn("{task.fields[rate]:>9}"),
        TimeElapsedColumn(),
        TimeRemainingColumn(compact=True),
        TextColumn("{task.fields[note]}"),
    )
    with Bars(*columns, console=Console(stderr=True), transient=True) as bars:

        def show(stage: str, fraction: float, note: str = "") -> None:
            if stage not in tasks:
                # A stage without a known length shows a pulsing bar.
                tasks[stage] = bars.add_task(stage, total=None, note=note, rate="")
            speed = bars.tasks[tasks[stage]].speed
            rate = f"{100.0 * speed:.3g} %/s" if speed and fraction < 1.0 else ""
            total = 1.0 if fraction > 0.0 else None
            bars.update(tasks[stage], total=total, completed=fraction, note=note, rate=rate)

        log = logging.getLogger("pentapod")
        handler, level = (
            RichHandler(console=bars.console, show_time=False, show_level=False, show_path=False),
            log.level,
        )
        log.addHandler(handler)
        log.setLevel(logging.INFO)
        try:
            yield show
        finally:
            log.removeHandler(handler)
            log.setLevel(level)


def note_changes(folder: Path) -> None:
    """Warn on stderr where the files of a folder belong to different runs."""
    from pentapod.base.errors import InputError
    from pentapod.job.run_folder import check_run

    try:
        check_run(folder)
    except InputError as error:
        click.echo(f"note: {error}", err=True)


def verdict_text(verdict: Verdict) -> str:
    """Return a verdict as lines of text: every claim with value and bound, what was not judged, and the answer."""
    lines = [_claim(certificate) for certificate in verdict.certificates]
    lines += [_unjudged(entry) for entry in verdict.not_judged]
    return "\n".join([*lines, f"verdict: {verdict.answer}"])


def _unjudged(entry: NotJudged) -> str:
    return f"  {'waived' if entry.waived else '??  '}  {entry.claim}: not judged: {entry.why}"


def _claim(certificate: Certificate) -> str:
    mark = "ok  " if certificate.passed else "FAIL"
    text = f"  {mark}  {certificate.claim}"
    if certificate.value is not None:
        text += f": {certificate.value:.6g} {certificate.unit}".rstrip()
    if certificate.bound is not None:
        allowed = f", {certificate.allowed:.6g} allowed" if certificate.is_lenient else ""
        text += f" (bound {certificate.bound:.6g}{allowed})"
    if not certificate.passed and certificate.where.time_s is not None:
        text += f" at {certificate.where.time_s:.3f} s"
    if not certificate.passed and certificate.value is None:
        text += f": {certificate.method}"
    return text
