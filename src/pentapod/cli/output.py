"""Options, JSON on stdout, and the text of a verdict, shared by the commands."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from pentapod.base.refusal import Advice
    from pentapod.verify.verdict.verdict import Certificate, NotJudged, Verdict

Command = TypeVar("Command", bound=Callable[..., Any])


class HtmlFile(click.Path):
    """A page to write: a name that browsers open."""

    def __init__(self) -> None:
        super().__init__(path_type=Path)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the path of a text."""
        if Path(str(value)).suffix.lower() not in (".html", ".htm"):
            self.fail(f"{str(value)!r} is no page: its name must end with .html.", param, ctx)
        return super().convert(value, param, ctx)


def quiet_option(command: Command) -> Command:
    """Add --quiet: print errors only, and JSON with --json."""
    return click.option("-q", "--quiet", is_flag=True, help="Print errors only.")(command)


def cores_option(command: Command) -> Command:
    """Add -j: how many cores the command uses; threads below ask for that where they are begun."""

    def use(_context: click.Context, _parameter: click.Parameter, count: int | None) -> None:
        from pentapod.numerics.threads import CORES

        if count is not None:
            os.environ[CORES] = str(count)

    text = "How many cores to use; all when left out. The result is the same, bit for bit."
    option = click.option(
        "-j", "--cores", type=click.IntRange(1), expose_value=False, callback=use, metavar="N", help=text
    )
    return option(command)


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


_DIGITS = 12
"""Digits after the decimal point: nobody wants to read a rounding error of 1e-159 degrees."""


def _unjudged(entry: NotJudged) -> str:
    return f"  {'waived' if entry.waived else '??  '}  {entry.claim}: not judged: {entry.why}"


def _claim(certificate: Certificate) -> str:
    mark = "ok  " if certificate.passed else "FAIL"
    text = f"  {mark}  {certificate.claim}"
    if certificate.value is not None:
        text += f": {round(certificate.value, _DIGITS) + 0.0:.6g} {certificate.unit}".rstrip()
    if certificate.bound is not None:
        allowed = f", {certificate.allowed:.6g} allowed" if certificate.is_lenient else ""
        text += f" ({certificate.sense} {certificate.bound:.6g}{allowed})"
    if not certificate.passed and certificate.where.time_s is not None:
        text += f" at {certificate.where.time_s:.3f} s"
    if not certificate.passed and certificate.value is None:
        text += f": {certificate.method}"
    return text
