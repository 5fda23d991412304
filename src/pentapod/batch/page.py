"""The page on a batch: counts, and a row for each task with a link to its report; one self-contained HTML file."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pentapod.batch.jobs import STATUSES
from pentapod.batch.tasks.task import Row
from pentapod.job.artefacts import REPORT
from pentapod.report.template import write_page
from pentapod.report.words import duration, number

PAGE = "index.html"


def write_batch_page(rows: Sequence[Row], changed: Sequence[str], title: str, folder: Path) -> Path:
    """Write the page of a batch into its folder and return its path.

    rows: of the table; changed: columns of what was changed. Raises InputError where it cannot be written.
    """
    counts = Counter(str(row["status"]) for row in rows)
    ran = [row for row in rows if row.get("cycle_time_s") is not None and row["status"] == "passed"]
    facts = [(status, str(counts[status])) for status in STATUSES if counts[status]]
    if ran:
        quick = min(ran, key=lambda row: row["cycle_time_s"])
        roomy = max(ran, key=lambda row: row["margin"])
        facts += [("shortest cycle", duration(quick["cycle_time_s"])), ("largest margin", number(roomy["margin"]))]
    return write_page(
        folder / PAGE,
        "batch.html.j2",
        title=title,
        facts=facts,
        changed=changed,
        rows=[_shown(row, changed, folder) for row in rows],
        passed=counts["passed"] == len(rows),
    )


def _shown(row: Row, changed: Sequence[str], folder: Path) -> dict[str, Any]:
    """Return what the page shows of a row."""
    report = f"{row['task']}/{REPORT}"
    seconds, margin = row.get("cycle_time_s"), row.get("margin")
    return {
        "job": row["job"],
        "link": report if (folder / report).is_file() else None,
        "status": row["status"],
        "changes": [_text(row.get(key)) for key in changed],
        "time": "–" if seconds is None else duration(seconds),
        "margin": number(margin),
        "nearest": row.get("margin_limit") or "",
        "limiting": row.get("limiting_cause") or "",
        "cause": row.get("cause") or "",
    }


def _text(value: Any) -> str:
    return number(float(value)) if isinstance(value, float) else str(value)
