"""Large jobs: many waypoints, and scans of many facets; seconds and peak memory, asked and reached: `make bench-large`.

    python benchmarks/large_jobs.py [--only NAME...]

Each job is planned and verified in a process of its own. The paths are the demo's dome with finer passes. The scans are
sheets of irregular facets, 100 mm wide, with waves of 4 mm and of 0.5 mm and noise of 20 µm on every vertex.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from drop_cutter import jittered_sheet
from parts_by_others import PLAIN
from pipeline import ROOT, finer_dome, in_child

from pentapod.toolpath import write_stl

PLACED = """
[placement]
mode = "table"
table_z_mm = 450
"""


def scan(folder: Path, facets: int) -> Path:
    """Write a scan and its job; return the job."""
    sheet = jittered_sheet(round((facets / 2) ** 0.5))
    noise = np.random.default_rng(1).normal(0.0, 20e-6, len(sheet.vertices))
    vertices = sheet.vertices + noise[:, None] * [0.0, 0.0, 1.0]
    (folder / "scan.stl").write_bytes(write_stl(1e3 * vertices[sheet.faces], "scan"))
    (folder / "scan.toml").write_text(PLAIN.format(mesh="scan.stl") + PLACED, encoding="utf-8")
    return folder / "scan.toml"


@dataclass(frozen=True)
class Case:
    """A job, and what was asked for: seconds on the clock, and gigabytes at most."""

    job: Callable[[Path], Path]
    seconds: float
    memory: float | None = None


CASES = {
    "312,000 waypoints": Case(lambda folder: finer_dome(folder, 0.5, 0.136), 90.0),
    "1,000,000 waypoints": Case(lambda folder: finer_dome(folder, 0.25, 0.085), 360.0, 2.5),
    "1,000,000 facets": Case(lambda folder: scan(folder, 1_000_000), 60.0),
    "5,000,000 facets": Case(lambda folder: scan(folder, 5_000_000), 180.0),
}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", choices=CASES, default=list(CASES))
    given = parser.parse_args()
    print(
        f"{'job':<20} {'verdict':>8} {'waypoints':>10} {'rows':>10} {'asked s':>8} {'s':>7} {'asked GB':>9} {'GB':>5}"
    )
    for name in given.only:
        case = CASES[name]
        with tempfile.TemporaryDirectory() as made:
            folder = Path(made)
            found = in_child(case.job(folder), folder / "out", ROOT / "src")
        seconds, memory = sum(found["stages"].values()), found["peak_mib"] / 1024 * 1.073741824
        print(
            f"{name:<20} {'passed' if found['passed'] else 'FAILED':>8} {found['waypoints']:>10,} {found['rows']:>10,} "
            f"{case.seconds:>8.0f} {seconds:>7.1f} {case.memory or '–':>9} {memory:>5.2f}",
            flush=True,
        )
        print("   " + ", ".join(f"{stage} {taken:.1f}" for stage, taken in found["stages"].items()), flush=True)


if __name__ == "__main__":
    main()
