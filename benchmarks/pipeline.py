"""Stage times of whole jobs: the demo, and one of 50,000 waypoints. Run ``make bench``.

Each job runs in a process of its own, so that its peak memory is its own. The table of the kinematics, with the
Newton solver as its rival, follows.
"""

# ruff: noqa: PLC0415 - the parent process stays light, so that a child's memory is its own

from __future__ import annotations

import json
import platform
import re
import resource
import subprocess
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
DEMO = ROOT / "toolpaths" / "dome.toml"
WAYPOINTS = 50_000


def large_job(folder: Path) -> Path:
    """Write the demo with finer passes and closer waypoints, about 50,000 of them, and return its path."""
    text = DEMO.read_text(encoding="utf-8")
    # The dome's demo has passes of 3 mm and waypoints each 2 mm at most.
    text = re.sub(r"(?m)^stepover_mm = \S+", "stepover_mm = 1.0", text)
    text = re.sub(r"(?m)^spacing_mm = \S+", "spacing_mm = 0.378", text)
    text = text.replace('"dome.stl"', json.dumps(str(DEMO.parent / "dome.stl")))
    path = folder / "large.toml"
    path.write_text(text, encoding="utf-8")
    return path


def measure(job: Path, folder: Path) -> dict[str, Any]:
    """Run one job in this process; return its stage times, counts and peak memory."""
    import time

    from pentapod import Job, Program, Toolpath, run, write_report

    start = time.perf_counter()
    outcome = run(Job.load(job), folder)
    planned = time.perf_counter() - start
    start = time.perf_counter()
    write_report(outcome, folder / "report.html")
    reported = time.perf_counter() - start
    toolpath, program = outcome.find(Toolpath), outcome.find(Program)
    stages = {stage.name: stage.seconds for stage in outcome.stages}
    stages["arrays, verdict"] = planned - sum(stages.values())
    stages["report"] = reported
    unit = 1.0 if sys.platform == "darwin" else 1024.0  # what ru_maxrss counts in
    return {
        "stages": stages,
        "waypoints": 0 if toolpath is None else len(toolpath),
        "rows": 0 if program is None else len(program.legs),
        "passed": outcome.passed,
        "peak_mib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 2**20,
    }


def in_child(job: Path, folder: Path) -> dict[str, Any]:
    """Return `measure` of a new process."""
    command = [sys.executable, __file__, "--measure", str(job), str(folder)]
    answer = subprocess.run(command, capture_output=True, text=True, check=True)
    return json.loads(answer.stdout.splitlines()[-1])


def show(name: str, result: dict[str, Any]) -> None:
    """Print the table of one job."""
    total = sum(result["stages"].values())
    verdict = "passed" if result["passed"] else "FAILED"
    print(f"\n{name}: {result['waypoints']:,} waypoints, {result['rows']:,} rows, verdict {verdict}")
    print(f"  {'stage':<16} {'seconds':>8} {'share':>7} {'waypoints/s':>12}")
    for stage, seconds in result["stages"].items():
        rate = f"{result['waypoints'] / seconds:12,.0f}" if seconds > 0 else ""
        print(f"  {stage:<16} {seconds:8.2f} {seconds / total:7.1%} {rate}")
    print(f"  {'together':<16} {total:8.2f} {1:7.1%} {result['waypoints'] / total:12,.0f}")
    print(f"  peak memory {result['peak_mib']:,.0f} MiB")


def main() -> None:
    """Print all tables."""
    if sys.argv[1:2] == ["--measure"]:
        print(json.dumps(measure(Path(sys.argv[2]), Path(sys.argv[3]))))
        return
    packages = ", ".join(f"{name} {version(name)}" for name in ("pentapod", "numpy", "scipy", "casadi", "toppra"))
    print(f"Python {platform.python_version()}, {platform.machine()}, {packages}")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        show("demo (toolpaths/dome.toml)", in_child(DEMO, folder / "demo"))
        show(f"large (the dome with about {WAYPOINTS:,} waypoints)", in_child(large_job(folder), folder / "large"))
    print()
    import kinematics  # the script beside this one

    kinematics.main()


if __name__ == "__main__":
    main()
