"""The verbs of the command line by name, imported when used."""

from __future__ import annotations

from importlib import import_module

import click

from pentapod.base.errors import nearest

VERBS = {
    "plan": "pentapod.cli.commands.plan:plan",
    "verify": "pentapod.cli.commands.verify:verify",
    "simulate": "pentapod.cli.commands.simulate:simulate",
    "override": "pentapod.cli.running.override:override",
    "monitor": "pentapod.cli.running.monitor:monitor",
    "view": "pentapod.cli.commands.view:view",
    "sheet": "pentapod.cli.commands.sheet:sheet",
    "post": "pentapod.cli.commands.post:post",
    "toolpath": "pentapod.cli.commands.toolpath:toolpath",
    "batch": "pentapod.cli.many.batch:batch",
    "sweep": "pentapod.cli.many.batch:sweep",
    "replan": "pentapod.cli.commands.replan:replan",
    "register": "pentapod.cli.commands.register:register",
    "machine": "pentapod.cli.commands.machine:machine",
    "calibrate": "pentapod.cli.commands.calibrate:calibrate",
    "ik": "pentapod.cli.commands.kinematics:ik",
    "fk": "pentapod.cli.commands.kinematics:fk",
    "design": "pentapod.cli.studies.design:design",
    "modes": "pentapod.cli.commands.modes:modes",
    "new": "pentapod.cli.commands.new:new",
    "warm-up": "pentapod.cli.install.warm_up:warm_up",
    "doctor": "pentapod.cli.install.doctor:doctor",
}
"""In the order of `pentapod --help`: name → module:command."""


class LazyGroup(click.Group):
    """A group whose commands are imported when they are used."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the verbs in the order of `VERBS`."""
        del ctx
        return list(VERBS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return the command of a verb, None where there is none of that name."""
        del ctx
        if cmd_name not in VERBS:
            return None
        module, name = VERBS[cmd_name].split(":")
        command: click.Command = getattr(import_module(module), name)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command that the first argument names. Raises UsageError with the nearest verb."""
        if args[0] not in VERBS:
            raise click.UsageError(f'no such verb: "{args[0]}"; {nearest(args[0], VERBS)}', ctx)
        return super().resolve_command(ctx, args)


def _print_version(ctx: click.Context, _: click.Parameter, value: bool) -> None:
    if value:
        from pentapod.base.version import __version__

        click.echo(f"pentapod {__version__}")
        ctx.exit()


def _print_completion(ctx: click.Context, _: click.Parameter, value: str | None) -> None:
    if value is not None:
        from click.shell_completion import get_completion_class

        kind = get_completion_class(value)
        if kind is not None:
            click.echo(kind(cli, {}, "pentapod", "_PENTAPOD_COMPLETE").source())
        ctx.exit()


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--version", is_flag=True, expose_value=False, is_eager=True, callback=_print_version,
              help="Show the version and exit.")  # fmt: skip
@click.option("--completion", type=click.Choice(["bash", "zsh", "fish"]), expose_value=False, is_eager=True,
              callback=_print_completion, help="Print the completion script of a shell and exit.")  # fmt: skip
@click.option("--debug", is_flag=True, expose_value=False, help="With any verb: show the traceback of errors.")
def cli() -> None:
    """From a surface mesh to a checked leg-length program for a five-legged parallel robot.

    Lengths are in millimetres, angles in degrees, feeds in mm/min.

    Exit code 0: done, and the verdict passed. 1: the job cannot be done, or the verdict failed; the message
    says why. 2: bad input; one line says what and where. 3: an error of pentapod itself. 130: interrupted (Ctrl-C).
    143: terminated (SIGTERM).
    """
