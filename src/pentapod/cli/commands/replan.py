"""pentapod replan: the program of a run for its part where it was found."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from pentapod.cli.commands.plan import shown
from pentapod.cli.output import echo_json, json_option, quiet_option
from pentapod.cli.progress import progress_bar

if TYPE_CHECKING:
    from pentapod.job.pipeline.attempt import Writer


@click.command()
@click.argument("folder", type=click.Path(path_type=Path), metavar="DIR")
@click.option("--placement", required=True, type=click.Path(path_type=Path), metavar="FILE",
              help="Where the part was found: a file of `pentapod register`.")  # fmt: skip
@click.option("-o", "--out", type=click.Path(path_type=Path), help="Folder for the files; DIR/replanned when left out.")
@click.option("--explain", is_flag=True, help="Print what limits the speed and the pose: where, and by how much.")
@json_option
@quiet_option
def replan(folder: Path, placement: Path, out: Path | None, explain: bool, as_json: bool, quiet: bool) -> int:
    """Plan the run in DIR again for its part where it was found, without a search.

    Keeps the tool's leans, and the time law wherever the legs' limits allow it; the program is verified as always. If a
    margin is too small at the new placement, all is planned anew. Writes the files of `plan`, and the job of the run,
    placed-job.toml, against which `verify` judges it.
    """
    from pentapod.job.artefacts import REPORT, SHEET
    from pentapod.job.clamped.replan import FOLDER
    from pentapod.job.clamped.replan import replan as planned_again
    from pentapod.report import write_report
    from pentapod.report.sheet import write_sheet

    writers: dict[str, Writer] = {REPORT: write_report, SHEET: write_sheet}
    target = folder / FOLDER if out is None else out
    with progress_bar(quiet=quiet or as_json) as progress:
        outcome = planned_again(folder, placement, target, progress, writers=writers)
    code, content = shown(outcome, target, explain=explain, as_json=as_json, quiet=quiet)
    if content is not None:
        echo_json(content)
    return code
