"""pentapod machine: list, explain and check machines."""

from __future__ import annotations

import click

from pentapod.cli.output import echo_json, json_option, progress_bar, quiet_option


@click.group()
def machine() -> None:
    """Explain and check machines."""


@machine.command("list")
@json_option
@quiet_option
def list_machines(as_json: bool, quiet: bool) -> int:
    """List the machines that ship with pentapod."""
    from pentapod.machine import shipped_machines

    names = list(shipped_machines())
    if as_json:
        echo_json(names)
    elif not quiet:
        click.echo("\n".join(names))
    return 0


@machine.command()
@click.argument("name_or_file")
@json_option
@quiet_option
def check(name_or_file: str, as_json: bool, quiet: bool) -> int:
    """Explain a machine (a shipped NAME or a FILE.toml), and whether it keeps its limits in its work volume.

    Exit code 1 where it does not; 2 where the file describes a machine that cannot exist.
    """
    from pentapod.machine import Machine, explain
    from pentapod.machine import check as check_machine

    with progress_bar(quiet=quiet or as_json) as progress:
        progress("check", 0.0, name_or_file)
        report = check_machine(Machine.load(name_or_file))
    passed = all(finding.passed for finding in report.findings)
    if as_json:
        findings = [
            {"name": found.name, "passed": bool(found.passed), "value": float(found.value), "must_be": found.kind,
             "limit": float(found.limit), "unit": found.unit, "where": found.where}
            for found in report.findings
        ]  # fmt: skip
        described = {"machine": report.machine.name, "digest": report.machine.digest}
        echo_json({**described, "passed": passed, "findings": findings})
    elif not quiet:
        click.echo(explain(report))
    return 0 if passed else 1
