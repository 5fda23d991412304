"""Entry point: errors and signals become one line and an exit code.

Few modules are imported at the top, so that signals are handled from the start.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

from pentapod.cli.signals import Terminated, signals_as_exceptions

EXIT_FAILED, EXIT_INPUT, EXIT_BUG, EXIT_INTERRUPTED, EXIT_TERMINATED = 1, 2, 3, 130, 143


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit with its code."""
    with signals_as_exceptions():
        code = run(sys.argv[1:] if arguments is None else arguments)
    sys.exit(code)


def run(arguments: Sequence[str]) -> int:
    """Run the command line and return its exit code. With --debug anywhere, errors show their traceback."""
    debug = "--debug" in arguments
    rest = [argument for argument in arguments if argument != "--debug"]
    try:
        from pentapod.cli.verbs import cli

        result: Any = cli.main(args=rest, prog_name="pentapod", standalone_mode=False)
    except (Exception, KeyboardInterrupt, Terminated) as error:
        import click

        if debug and not isinstance(error, (click.ClickException, Terminated)):
            raise
        code, message = _answer(error)
        click.echo(message, err=True)
        return code
    return result if isinstance(result, int) else 0


def _answer(error: BaseException) -> tuple[int, str]:
    """Return the exit code of an error, and its message: one line, and one for each further error of the file."""
    import click

    from pentapod.base.errors import InputError

    if isinstance(error, (KeyboardInterrupt, Terminated, click.exceptions.Abort)):
        ended = isinstance(error, Terminated)
        return (EXIT_TERMINATED, "terminated") if ended else (EXIT_INTERRUPTED, "interrupted")
    if isinstance(error, click.exceptions.NoArgsIsHelpError):
        return EXIT_INPUT, error.format_message()
    if isinstance(error, click.ClickException):
        context = error.ctx if isinstance(error, click.UsageError) else None
        remedy = "" if context is None else f" ({context.command_path} --help)"
        return EXIT_INPUT, _line(error.format_message() + remedy)
    if isinstance(error, OSError):
        place = f"{error.filename}: " if error.filename else ""
        return EXIT_INPUT, _line(f"{place}{error.strerror or error}")
    if isinstance(error, InputError):
        return EXIT_INPUT, "\n".join(_line(str(one)) for one in (error, *error.others))
    hint = "this is an error of pentapod; --debug shows where"
    return EXIT_BUG, _line(f"{type(error).__name__}: {error} ({hint})")


def _line(message: str) -> str:
    return "error: " + " ".join(message.split())
