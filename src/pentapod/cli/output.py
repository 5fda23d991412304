"""Options, progress bar on stderr, JSON on stdout, and the text of a verdict, shared by the commands."""

from __future__ import annotations

import json
import logging
import math
import sys
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from pathlib import Path

    from pentapod.base.progress import Progress
    from pentapod.base.refusal import Advice
    from pentapod.verify.verdict.verdict import Certificate, NotJudged, Verdict

Command = TypeVar("Command", bound=Callable[..., Any])


def quiet_option(command: Command) -> Command:
    """Add --quiet: print errors only, and JSON with --json."""
    return click.option("-q", "--quiet", is_flag=True, help="Print errors only.")(command)


def json_option(command: Command) -> Command:
    """Add --json."""
    return click.option("--json", "as_json", is_flag=True, help="Print only JSON on stdout.")(command)


def echo_json(content: Any) -> None:
    """Print JSON on stdout; NaN and infinity become null."""
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
    """Yield a Progress that draws a bar for each stage on stderr; silent where that is no terminal.

    Messages of the log `pentapod` (kernels are compiled) are printed above the bars.
    """
    from pentapod.base.progress import silent
    from pentapod.cli.signals import raising_again

    if quiet or not sys.stderr.isatty():
        yield raising_again(silent)
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
                # Without a total the bar pulses.
                tasks[stage] = bars.add_task(stage, total=None, note=note, rate="")
            speed = bars.tasks[tasks[stage]].speed
            rate = f"{100.0 * speed:.3g} %/s" if speed and fraction < 1.0 else ""
            total = 1.0 if fraction > 0.0 else None
            bars.update(tasks[stage], total=total, completed=fraction, note=note, rate=rate)

        log = logging.getLogger("pentapod")
        level = log.level
        handler = RichHandler(console=bars.console, show_time=False, show_level=False, show_path=False)
        log.addHandler(handler)
        log.setLevel(logging.INFO)
        try:
            yield raising_again(show)
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


def advice_text(advice: Sequence[Advice]) -> str:
    """Return advice as TOML for the job file, each with what it does and what it keeps."""
    return "\n\n".join(f"# {each}\n{each.toml}" for each in advice)


def verdict_text(verdict: Verdict) -> str:
    """Return a verdict as text: every claim with value and bound, the claims not judged, and the answer."""
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
