"""pentapod design: search for machines, prove what they keep, write their files."""

from __future__ import annotations

from pathlib import Path

import click

from pentapod.cli.output import echo_json, json_option, quiet_option
from pentapod.cli.progress import progress_bar


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("-o", "--out", type=click.Path(path_type=Path), default=Path("designs"), show_default=True,
              help="Folder for the files.")  # fmt: skip
@click.option("-j", "--workers", type=click.IntRange(1), metavar="N",
              help="Processes for proofs and parts; no file depends on it.  [default: one for each core]")  # fmt: skip
@json_option
@quiet_option
def design(file: Path, out: Path, workers: int | None, as_json: bool, quiet: bool) -> int:
    """Search for machines that DESIGN.toml describes: write front.csv, front.json, design.html and machine files.

    Every design on the front keeps every need in its whole work volume, proven by bounds over all poses, and makes the
    parts. Needs the extra `design` (pymoo and Dask). Ctrl-C and SIGTERM keep what is done: the same command goes on,
    and ends with the same files. Exit code 1 if no design keeps all needs.
    """
    from pentapod.design.design_file import DesignFile

    asked = DesignFile.load(file)

    from pentapod.design.members import design_machines
    from pentapod.design.output import TABLE, folder_of, headline, to_dict, write_front

    try:
        with progress_bar(quiet=quiet or as_json) as progress:
            front = design_machines(asked, out, workers, progress)
    except (KeyboardInterrupt, SystemExit):
        click.echo(f"what is done is in {out}: the same command goes on from there", err=True)
        raise
    page = write_front(front, out)
    if as_json:
        echo_json({**to_dict(front), "out": str(out)})
    elif not quiet:
        count = len(front.members)
        lines = [
            f"{front.designs:,} evaluations; of {count + len(front.dropped)} designs that were tried, {count} hold"
        ]
        for number, member in enumerate(front.members, start=1):
            lines.append(f"  {folder_of(number)}: {headline(front, member)}")
            lines += [f"    {part.job}: {part.said}" for part in member.parts]
        lines += [f"  not kept: {'; '.join(member.missing)}" for member in front.dropped]
        click.echo("\n".join([*lines, f"table: {out / TABLE}", f"page: {page}"]))
    if not front.members:
        click.echo("no design keeps all needs: try weaker needs, wider ranges, or more generations", err=True)
    return 0 if front.members else 1
