"""Run the sweep of the dome and draw its page: `python toolpaths/make_sweep_page.py` writes docs/sweep.md.

The results are kept in out/sweep, so that a second run plans only what has changed. The picture shows the smallest
margin and the cycle time over the length of the tool, a line for each largest tilt of its axis.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from matplotlib import pyplot as plt

from pentapod.batch import Sweep, batch

FOLDER = Path(__file__).parent
DOCS = FOLDER.parent / "docs"
SWEEP = FOLDER / "sweeps" / "dome.toml"
LENGTH, TILT = "tool.length_mm", "axis.tilt_deg"
PAGE = """# A sweep: tool length and tilt of the demo

Which tool length leaves the most room for the dome, and what does a leaning axis gain? The file
`toolpaths/sweeps/dome.toml`:

```toml
{sweep}```

```sh
pentapod sweep toolpaths/sweeps/dome.toml -o sweep/
```

{ending}

![Smallest margin and cycle time over the length of the tool](gallery/sweep.png)

{table}

{answer} [Plan many jobs](howto/many-jobs.md) tells more. `python toolpaths/make_sweep_page.py` draws this page.
"""

Row = dict[str, Any]


def passed(rows: list[Row]) -> list[Row]:
    """Return the rows of the jobs that passed."""
    return [row for row in rows if row["status"] == "passed"]


def draw(rows: list[Row], file: Path) -> None:
    """Draw margin and cycle time of the jobs that passed over the length of the tool."""
    figure, panels = plt.subplots(1, 2, figsize=(8.0, 3.0), dpi=100, layout="constrained")
    columns = (("margin", "smallest margin"), ("cycle_time_s", "cycle time, s"))
    for panel, (column, label) in zip(panels, columns, strict=True):
        for tilt in sorted({row[TILT] for row in rows}):
            points = sorted(
                (row[LENGTH], row[column]) for row in rows if row[TILT] == tilt and row["status"] == "passed"
            )
            panel.plot(*zip(*points, strict=True), "o-", label=f"tilt up to {tilt:g}°")
        panel.set_xlabel("length of the tool, mm")
        panel.set_ylabel(label)
        panel.grid(alpha=0.3)
    panels[0].legend()
    figure.savefig(file, metadata={"Software": None})
    plt.close(figure)


def table(rows: list[Row]) -> str:
    """Return the rows as a table in Markdown."""
    lines = [
        "| tool, mm | tilt, ° | status | smallest margin | of the limit | cycle time, s |",
        "|---|---|---|---|---|---|",
    ]
    for row in rows:
        figures = "– | – | –"
        if row["status"] == "passed":
            figures = f"{row['margin']:.3f} | {row['margin_limit']} | {row['cycle_time_s']:.2f}"
        lines.append(f"| {row[LENGTH]:g} | {row[TILT]:g} | {row['status']} | {figures} |")
    return "\n".join(lines)


def answer(rows: list[Row]) -> str:
    """Return in words which job keeps the most room, and what cycle times range over."""
    best = max(passed(rows), key=lambda row: row["margin"])
    times = [row["cycle_time_s"] for row in passed(rows)]
    return (
        f"The most room is left by a tool of {best[LENGTH]:g} mm with a tilt of up to {best[TILT]:g}°. The cycle time "
        f"hardly changes: it is {min(times):.1f} to {max(times):.1f} s."
    )


def ending(rows: list[Row]) -> str:
    """Return in words with which exit code the command ends."""
    others = len(rows) - len(passed(rows))
    if not others:
        return f"All {len(rows)} jobs pass. If one did not, the command would end with exit code 1."
    return f"The command ends with exit code 1, since {others} of the {len(rows)} jobs did not pass."


def main() -> None:
    """Run the sweep, and write its picture and its page."""
    done = batch(Sweep.load(SWEEP), FOLDER.parent / "out" / "sweep")
    rows = sorted(({**each.task.known, **each.row} for each in done), key=lambda row: (row[LENGTH], row[TILT]))
    draw(rows, DOCS / "gallery" / "sweep.png")
    text = SWEEP.read_text(encoding="utf-8")
    page = PAGE.format(sweep=text, ending=ending(rows), table=table(rows), answer=answer(rows))
    (DOCS / "sweep.md").write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
