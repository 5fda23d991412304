"""The page that compares two runs: both scenes with one slider, and their figures and claims in two columns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pentapod.program.program import Program
from pentapod.report.page.claims import KINDS, grouped
from pentapod.report.template import page_text
from pentapod.report.words import duration, number, tool_sentence
from pentapod.toolpath.toolpath import Toolpath
from pentapod.verify.verdict.verdict import Certificate
from pentapod.view.viewed import ViewedRun


@dataclass(frozen=True)
class Cell:
    """What stands in a column. good: whether it is as it should be; None where that is no question."""

    text: str
    good: bool | None = None


@dataclass(frozen=True)
class Line:
    """A line of a table: what, and a cell for each run. differs: whether they are not the same."""

    what: str
    cells: tuple[Cell, ...]

    @property
    def differs(self) -> bool:
        """Whether the cells are not the same."""
        return len(set(self.cells)) > 1


def compare_page(runs: Sequence[ViewedRun], token: str) -> str:
    """Return the page that compares runs, which are shown under `/1` and `/2`."""
    names = [run.opened.folder.as_posix() for run in runs]
    return page_text(
        "compare.html.j2", {"compare": True}, live=True, runs=names, token=token, figures=_figures(runs),
        claims=_claims(runs),
    )  # fmt: skip


def _figures(runs: Sequence[ViewedRun]) -> list[Line]:
    columns = [_figures_of(run) for run in runs]
    return [Line(what, tuple(column[what] for column in columns)) for what in columns[0]]


def _figures_of(run: ViewedRun) -> dict[str, Cell]:
    """Return the figures of a run by name, the same names for all runs."""
    outcome, opened = run.outcome, run.opened
    program, toolpath = outcome.find(Program), outcome.find(Toolpath)
    answer = "refused" if outcome.refusal is not None else outcome.verdict.answer
    placed = run.placed
    place = ", ".join(f"{value:.1f}" for value in (1e3 * opened.placement.translation).tolist()).replace("-", "−")
    margin = Cell(f"{number(placed.smallest_margin)}, {placed.active_limit}", placed.smallest_margin >= 0.0)
    groups = {group.title: group for group in grouped(outcome.verdict.certificates, outcome.verdict.not_judged)}
    kinds = {title: Cell(group.nearest, group.passed) for title, group in groups.items()}
    return {
        "verdict": Cell(answer, outcome.passed),
        "cycle time": Cell("no program" if program is None else duration(program.duration)),
        "smallest margin, 0 at a limit": margin,
        **{
            what: Cell("–" if what not in kinds else kinds[what].text, kinds[what].good if what in kinds else None)
            for what in KINDS
        },
        "part at": Cell(f"({place}) mm"),
        "waypoints": Cell("–" if toolpath is None else f"{len(toolpath):,}"),
        "size of the part": Cell(
            " × ".join(f"{v:.1f}" for v in (1e3 * np.ptp(opened.mesh.bounds, axis=0)).tolist()) + " mm"
        ),
        "tool": Cell(tool_sentence(opened.job.tool)),
        "machine": Cell(opened.machine.name),
    }


def _claims(runs: Sequence[ViewedRun]) -> list[Line]:
    """Return the claims of all runs, those first that differ."""
    columns = [{c.claim: c for c in run.outcome.verdict.certificates} for run in runs]
    names = dict.fromkeys(name for column in columns for name in column)
    lines = [Line(name, tuple(_claim(column.get(name)) for column in columns)) for name in names]
    return sorted(lines, key=lambda line: not line.differs)


def _claim(claim: Certificate | None) -> Cell:
    if claim is None:
        return Cell("not a claim here")
    bound = "" if claim.bound is None else f", bound {number(claim.bound, claim.unit)}"
    return Cell(
        "holds" if claim.value is None and claim.passed else f"{number(claim.value, claim.unit)}{bound}", claim.passed
    )
