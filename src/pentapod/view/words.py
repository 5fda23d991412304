"""What the viewer says of a run, of a placement, and of a plan that was made there, as text."""

from __future__ import annotations

from pentapod.report.words import number
from pentapod.toolpath.linking.partition import Piece
from pentapod.view.opened_run import OpenedRun
from pentapod.view.replan import Replanned
from pentapod.view.study import Reach


def run_words(run: OpenedRun) -> str:
    """Return what is not as usual about a run, as text; empty where all is."""
    found = [] if run.piece is None else [f"One of several set-ups, {run.piece}."]
    if run.program is None:
        found.append("There is no program. Drag the part to where it fits.")
    elif not run.same_job:
        found.append("The job was changed after this program was made.")
    return " ".join(found)


def reach_words(reach: Reach) -> str:
    """Return the margins of a placement, as text."""
    worst = reach.worst
    room = (
        f", {number(abs(worst.room), worst.unit)} {'beyond' if worst.room < 0.0 else 'to spare'}" if worst.unit else ""
    )
    answer = "Fits." if reach.fits else f"Does not fit at {100.0 * reach.beyond:.1f} % of the path."
    return (
        f"{answer} Smallest margin {number(worst.margin)}: {worst.limit}{room}, at waypoint {worst.waypoint:,} "
        f"({len(reach.rows):,} judged)."
    )


def result_words(done: Replanned) -> str:
    """Return the result of planning again, as text; the table for the job file, or advice, comes after it."""
    refusal = done.outcome.refusal
    if refusal is not None:
        advice = " This change of the job was planned, and passed:" if refusal.advice else ""
        return f"Refused. {refusal}{advice}"
    where = "the job file" if done.outcome.find(Piece) is None else "a copy of the job file, for this set-up alone"
    return f"Verdict: {done.outcome.verdict.answer}. Files: {done.folder}. For {where}:"
