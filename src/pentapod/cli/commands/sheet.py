"""pentapod sheet: write the set-up sheet of a run."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import click

from pentapod.cli.output import HtmlFile, echo_json, json_option, quiet_option
from pentapod.cli.progress import progress_bar

if TYPE_CHECKING:
    from pentapod.base.progress import Progress
    from pentapod.report.sheet.page import SheetPage
    from pentapod.view import OpenedRun


@click.command()
@click.argument("folder", type=click.Path(path_type=Path), metavar="DIR")
@click.option("--job", type=click.Path(path_type=Path), help="The job file of the run, if it was moved.")
@click.option("-o", "--out", type=HtmlFile(), help="The file to write.  [default: DIR/sheet.html]")
@json_option
@quiet_option
def sheet(folder: Path, job: Path | None, out: Path | None, as_json: bool, quiet: bool) -> int:
    """Write the set-up sheet of the run in DIR: one HTML file that prints on one A4 page, or one for each set-up.

    It has what the operator needs at the machine: drawings of the part in the machine with dimensions, datum, table or
    wedge, tool and stick-out, three touch-off points with the leg lengths there, first and last pose, cycle time, and a
    list to tick. The file needs no script and no network. `pentapod plan` writes it, too. Refused are a run without a
    program, and a job, part or machine that was changed since.
    """
    from pentapod.job.artefacts import SHEET
    from pentapod.job.run_folder import locked, write_manifest
    from pentapod.report.sheet.page import write_pages

    with progress_bar(quiet=quiet or as_json) as progress:
        pages = sheet_pages(folder, job, progress)
        progress("sheet", 0.8, "drawings")
        if out is None:
            with locked(folder):  # the sheet is one of the run's files, which its manifest lists
                file = write_pages(pages, folder / SHEET)
                write_manifest(folder)
        else:
            file = write_pages(pages, out)
    if as_json:
        echo_json({"file": str(file), "pages": len(pages)})
    elif not quiet:
        click.echo(f"set-up sheet: {file}")
    return 0


def sheet_pages(folder: Path, job: Path | None, progress: Progress) -> list[SheetPage]:
    """Return the pages of the run in a folder, one for each set-up. Raises InputError as `open_run`, and `_page`."""
    from pentapod.job.outcome import SetUp
    from pentapod.report.sheet.page import setup_name
    from pentapod.view import open_run

    parts: list[Path] = []
    while (part := folder / SetUp.folder_of(len(parts) + 1)).is_dir():
        parts.append(part)
    pages: list[SheetPage] = []
    for part in parts or [folder]:
        run = open_run(part, job, progress)
        pages.append(_page(part, "" if run.piece is None else setup_name(part), run))
    return pages


def _page(folder: Path, name: str, run: OpenedRun) -> SheetPage:
    """Return the page of an opened run. Raises InputError where it has no program, or is not of the job as it is."""
    from pentapod.base.archives import read_arrays
    from pentapod.base.errors import InputError
    from pentapod.base.files import sha256_of
    from pentapod.job.artefacts import ARRAYS, PROGRAM, VERDICT, WITHHELD
    from pentapod.report.drawings.planned_run import PlannedRun
    from pentapod.report.sheet.page import SheetPage

    program = run.program
    if program is None:
        withheld = (folder / WITHHELD).is_file()
        what = "the program fails its own verdict and was withheld" if withheld else "the job was refused"
        raise InputError(
            f"no set-up sheet: {what}", file=folder, remedy="report.html says why; change the job, plan again"
        )
    made_for, remedy = program.provenance, "plan the job again"
    if not run.same_job:
        raise InputError(
            "the job, its part or its machine was changed since this run", file=run.job.path, remedy=remedy
        )
    if made_for.machine_digest != run.machine.digest:
        what = "the machine is not the one that the program was made for"
        raise InputError(
            what, file=run.job.path, value=run.machine.digest, expected=made_for.machine_digest, remedy=remedy
        )
    names = ("trajectory.time_s", "trajectory.station_mm", "placed.tips_mm", "placed.axes", "placed.margins")
    arrays = read_arrays(folder / ARRAYS, names, InputError)
    clock = arrays["trajectory.time_s"], 1e-3 * arrays["trajectory.station_mm"]
    planned = PlannedRun(
        run.job, run.machine, run.mesh, run.tool, run.toolpath, run.placement, 1e-3 * arrays["placed.tips_mm"],
        arrays["placed.axes"], program, clock, float(arrays["placed.margins"].min()),
    )  # fmt: skip
    return SheetPage(planned, name, sha256_of(folder / PROGRAM), _passed(folder / VERDICT))


def _passed(file: Path) -> bool:
    """Return whether the verdict of a run passed; no, where it cannot be read."""
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return False
    return isinstance(content, dict) and cast("dict[str, Any]", content).get("passed") is True
