"""The set-up sheet as one HTML file without script: a printed page for each set-up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from pentapod.base.files import atomic_write, sha256_of
from pentapod.base.version import __version__
from pentapod.job.artefacts import PROGRAM
from pentapod.job.outcome import Outcome, SetUps
from pentapod.report.drawings.planned_run import PlannedRun
from pentapod.report.drawings.touch_off import touch_off_points
from pentapod.report.drawings.views import setup_drawings
from pentapod.report.sheet import facts
from pentapod.report.words import job_title
from pentapod.toolpath.linking.partition import Piece


@dataclass(frozen=True, eq=False)
class SheetPage:
    """A page of a set-up sheet. name: of the set-up, empty where there is one. digest: SHA-256 of the program's file.

    passed: whether the verdict passed.
    """

    run: PlannedRun
    name: str
    digest: str
    passed: bool


def sheet_html(pages: Sequence[SheetPage]) -> str:
    """Return the HTML of a set-up sheet."""
    import jinja2  # noqa: PLC0415 - heavy, and only needed here

    folder = resources.files("pentapod.report.sheet")
    template, style = ((folder / name).read_text(encoding="utf-8") for name in ("sheet.html.j2", "sheet.css"))
    environment = jinja2.Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    shown = [_shown(page, number, len(pages)) for number, page in enumerate(pages, start=1)]
    title = f"{job_title(pages[0].run.job.path)}: set-up sheet"
    return environment.from_string(template).render(style=style, pages=shown, title=title, version=__version__)


def write_pages(pages: Sequence[SheetPage], path: str | Path) -> Path:
    """Write a set-up sheet and return its path. Raises InputError where it cannot be written."""
    text = sheet_html(pages)
    with atomic_write(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return Path(path)


def write_sheet(outcome: Outcome, path: str | Path) -> Path | None:
    """Write the set-up sheet of an outcome, a page for each set-up, and return its path.

    The files of the run are beside it. Nothing is written, and None returned, where a program is missing. Raises
    InputError where it cannot be written.
    """
    pages = _pages(outcome, Path(path).parent)
    return write_pages(pages, path) if pages else None


def setup_name(folder: Path) -> str:
    """Return what the page of a set-up that has a folder of its own is called."""
    return folder.name.replace("-", " ").replace("setup", "set-up")


def _pages(outcome: Outcome, folder: Path) -> list[SheetPage]:
    """Return the pages of an outcome whose files are in a folder; none where a program is missing."""
    setups = outcome.find(SetUps)
    if setups is None:
        parts = [(setup_name(folder) if outcome.find(Piece) else "", outcome, folder)]
    else:
        parts = [(setup_name(folder / part.folder), part.outcome, folder / part.folder) for part in setups.parts]
    pages: list[SheetPage] = []
    for name, part, where in parts:
        run, file = PlannedRun.of(part), where / PROGRAM
        if run is None or not file.is_file():
            return []
        pages.append(SheetPage(run, name, sha256_of(file), part.passed))
    return pages


def _shown(page: SheetPage, number: int, count: int) -> dict[str, object]:
    """Return the variables of a page."""
    run = page.run
    points = touch_off_points(run)
    return {
        "job": job_title(run.job.path),
        "name": page.name,
        "number": number,
        "count": count,
        "passed": page.passed,
        "drawings": setup_drawings(run, points),
        "facts": [
            ("Tool", facts.tool_facts(run)),
            ("Part", facts.stand_facts(run)),
        ],
        "machine": facts.machine_sentence(run),
        "poses": facts.poses(run, points),
        "cycle": facts.cycle(run),
        "checks": facts.checks(run, page.digest),
    }
