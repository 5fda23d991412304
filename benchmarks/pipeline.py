"""Stage times of whole jobs against the last release, in pairs. Run ``make bench``.

    python benchmarks/pipeline.py [--against REVISION] [--pairs N]

Each job runs in a process of its own, so that its peak memory is its own; the two versions take turns, so that a
machine whose speed drifts is fair to both. REVISION is a tag, branch or commit of git: the newest tag when left out;
where there is none, this version is measured alone. Times of commands, asked and reached, follow, and the table of the
kinematics, with the Newton solver as its rival.
"""

# ruff: noqa: PLC0415 - the parent process stays light, so that a child's memory is its own

from __future__ import annotations

import argparse
import json
import os
import platform
import re
import resource
import statistics
import subprocess
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).resolve().parents[1]
sys.path.append(str(ROOT / "tests"))
DEMO = ROOT / "toolpaths" / "dome.toml"
WAYPOINTS = 50_000
ENTRY = "import sys; from pentapod.cli.main import main; sys.exit(main())"
"""What the command `pentapod` runs."""
SHIPPED = ("seam", "text", "dome", "wavy")
"""Jobs of `toolpaths/`: a short line, letters on a dome, the demo, a free form."""


def finer_dome(folder: Path, stepover: float, spacing: float) -> Path:
    """Write the demo with other distances between passes and waypoints, mm; return its path."""
    text = DEMO.read_text(encoding="utf-8")
    # The dome's demo has passes of 3 mm and waypoints each 2 mm at most.
    text = re.sub(r"(?m)^stepover_mm = \S+", f"stepover_mm = {stepover}", text)
    text = re.sub(r"(?m)^spacing_mm = \S+", f"spacing_mm = {spacing}", text)
    text = text.replace('"dome.stl"', json.dumps(str(DEMO.parent / "dome.stl")))
    path = folder / "large.toml"
    path.write_text(text, encoding="utf-8")
    return path


def measure(job: Path, folder: Path) -> dict[str, Any]:
    """Run one job in this process; return its stage times, counts, processor seconds and peak memory."""
    import time

    start = time.perf_counter()
    from pentapod import Job, Program, Toolpath, run, write_report

    stages = {"imports": time.perf_counter() - start}
    start = time.perf_counter()
    outcome = run(Job.load(job), folder)
    planned = time.perf_counter() - start
    start = time.perf_counter()
    write_report(outcome, folder / "report.html")
    reported = time.perf_counter() - start
    toolpath, program = outcome.find(Toolpath), outcome.find(Program)
    own = {stage.name: stage.seconds for stage in outcome.stages}
    stages |= own | {"arrays, verdict": planned - sum(own.values()), "report": reported}
    used = resource.getrusage(resource.RUSAGE_SELF)
    return {
        "stages": stages,
        "cpu": used.ru_utime + used.ru_stime,
        "waypoints": 0 if toolpath is None else len(toolpath),
        "rows": 0 if program is None else len(program.legs),
        "cycle": 0.0 if program is None else program.duration,
        "passed": outcome.passed,
        "peak_mib": peak_mib(),
    }


def peak_mib() -> float:
    """Return the largest memory of this process so far; on Linux without what its parent had before."""
    status = Path("/proc/self/status")
    if status.exists():
        (found,) = re.findall(r"(?m)^VmHWM:\s+(\d+) kB", status.read_text(encoding="utf-8"))
        return int(found) / 1024
    unit = 1.0 if sys.platform == "darwin" else 1024.0  # what ru_maxrss counts in
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 2**20


def in_child(job: Path, folder: Path, source: Path) -> dict[str, Any]:
    """Return `measure` of a new process that uses the version in a folder of sources.

    Ends the benchmark where that version cannot run the job: one of before may not know today's keys.
    """
    command = [sys.executable, __file__, "--measure", str(job), str(folder)]
    own = {**os.environ, "PYTHONPATH": str(source)}
    answer = subprocess.run(command, capture_output=True, text=True, check=False, env=own)
    if answer.returncode != 0:
        said = (answer.stderr.strip() or "nothing").splitlines()[-1]
        raise SystemExit(f"the version in {source} cannot run {job.name}; it says: {said}")
    return json.loads(answer.stdout.splitlines()[-1])


def middle(results: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the last of the results of one job, with the medians of all times."""
    stages = {
        name: statistics.median(each["stages"].get(name, 0.0) for each in results) for name in results[-1]["stages"]
    }
    return {**results[-1], "stages": stages, "cpu": statistics.median(each["cpu"] for each in results)}


def show(name: str, result: dict[str, Any], before: dict[str, Any] | None) -> None:
    """Print the table of one job, beside that of the version before."""
    verdict = "passed" if result["passed"] else "FAILED"
    print(f"\n{name}: {result['waypoints']:,} waypoints, {result['rows']:,} rows, verdict {verdict}")
    print(f"  {'stage':<18} {'seconds':>8} {'before':>8} {'ratio':>7} {'µs a row':>9}")
    rows = {**result["stages"], "together": sum(result["stages"].values()), "processor": result["cpu"]}
    old = {} if before is None else before["stages"]
    old = old and {**old, "together": sum(old.values()), "processor": before["cpu"] if before else 0.0}
    for stage, seconds in rows.items():
        known = stage in old and old[stage] > 0.0
        pair = f"{old[stage]:8.2f} {seconds / old[stage]:7.2f}" if known else f"{'':>8} {'':>7}"
        each = f"{seconds / result['rows'] * 1e6:9.1f}" if result["rows"] else ""
        print(f"  {stage:<18} {seconds:8.2f} {pair} {each}")
    memory = "" if before is None else f" ({before['peak_mib']:,.0f} before)"
    cycle = "" if before is None else f" ({before['cycle']:.3f} before)"
    print(f"  peak memory {result['peak_mib']:,.0f} MiB{memory}, cycle time {result['cycle']:.3f} s{cycle}")


def newest_tag() -> str | None:
    """Return the newest tag of the repository; None where there is none."""
    command = ["git", "-C", str(ROOT), "describe", "--tags", "--abbrev=0"]
    answer = subprocess.run(command, capture_output=True, text=True, check=False)
    return answer.stdout.strip() or None if answer.returncode == 0 else None


def compare(folder: Path, against: str | None, pairs: int) -> None:
    """Print the tables of all jobs, each run `pairs` times by this version and by the one before in turn."""
    sources = {"now": ROOT / "src"}
    if against is not None:
        git = ["git", "-C", str(ROOT)]
        subprocess.run([*git, "worktree", "add", "--quiet", "--detach", str(folder / "before"), against], check=True)
        sources["before"] = folder / "before" / "src"
    try:
        jobs = {f"{name} (toolpaths/{name}.toml)": ROOT / "toolpaths" / f"{name}.toml" for name in SHIPPED}
        jobs[f"large (the dome with about {WAYPOINTS:,} waypoints)"] = finer_dome(folder, 1.0, 0.378)
        for name, job in jobs.items():
            results: dict[str, list[dict[str, Any]]] = {version: [] for version in sources}
            for number in range(pairs):
                for known, source in sources.items():
                    results[known].append(in_child(job, folder / f"{job.stem}-{known}-{number}", source))
            show(name, middle(results["now"]), middle(results["before"]) if against is not None else None)
    finally:
        if against is not None:
            subprocess.run([*git, "worktree", "remove", "--force", str(folder / "before")], check=True)


class Used(NamedTuple):
    """What a command took, in seconds: of the processor, and on the clock."""

    cpu: float
    wall: float


def command(*arguments: str, on: int, runs: int) -> Used:
    """Return what `pentapod` takes with some arguments on a number of cores: the least of a few runs."""
    import time

    own = {**os.environ, "PYTHONPATH": str(ROOT / "src"), "PENTAPOD_CORES": str(on)}
    taken: list[Used] = []
    for _ in range(runs):
        before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
        subprocess.run([sys.executable, "-c", ENTRY, *arguments], check=True, capture_output=True, env=own)
        after, seconds = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter() - start
        taken.append(Used(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, seconds))
    return Used(*map(min, zip(*taken, strict=True)))


def small_job(folder: Path) -> Path:
    """Write a job of a few passes at a given placement, so that little but the floor of any job is left."""
    from pentapod.cli.commands.new import dome_stl
    from usual_job import job_text

    (folder / "part.stl").write_bytes(dome_stl(size_mm=24.0, height_mm=2.0, cells=6))
    (folder / "small.toml").write_text(job_text(), encoding="utf-8")
    return folder / "small.toml"


def asked_and_reached(folder: Path, runs: int) -> None:
    """Print what commands take, beside what was asked for on a machine of two cores."""
    planned = {
        name: {cores: command("plan", str(job), "-o", str(folder / "asked"), on=cores, runs=runs) for cores in (1, 2)}
        for name, job in {"demo": DEMO, "text": DEMO.with_name("text.toml"), "small": small_job(folder)}.items()
    }
    told = command("--help", on=1, runs=max(runs, 10))
    one, two = planned["demo"][1], planned["demo"][2]
    lines = (
        ("demo, one core: processor", "8 s", f"{one.cpu:.2f} s"),
        ("demo, two cores: clock", "5.5 s", f"{two.wall:.2f} s"),
        ("demo: one core against two, clock", "1.6", f"{one.wall / two.wall:.2f}"),
        ("text, one core: processor", "5 s", f"{planned['text'][1].cpu:.2f} s"),
        ("a small job, one core: processor", "3 s", f"{planned['small'][1].cpu:.2f} s"),
        ("--help: clock", "0.1 s", f"{told.wall:.3f} s"),
    )
    print(f"\n{'commands, least of ' + str(runs) + ' runs':<40} {'asked':>8} {'reached':>9}")
    for what, asked, reached in lines:
        print(f"{what:<40} {asked:>8} {reached:>9}")


def main() -> None:
    """Print all tables."""
    if sys.argv[1:2] == ["--measure"]:
        print(json.dumps(measure(Path(sys.argv[2]), Path(sys.argv[3]))))
        return
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--against", default=newest_tag(), help="revision of git to compare with")
    parser.add_argument("--pairs", type=int, default=3, help="runs of each job by each version")
    given = parser.parse_args()
    packages = ", ".join(f"{name} {version(name)}" for name in ("pentapod", "numpy", "scipy", "casadi", "toppra"))
    print(f"Python {platform.python_version()}, {platform.machine()}, {packages}; against {given.against or 'nothing'}")
    if given.against is None:
        print("there is no release yet; --against REVISION compares with a version before")
    with tempfile.TemporaryDirectory() as name:
        compare(Path(name), given.against, given.pairs)
        asked_and_reached(Path(name), given.pairs)
    print()
    import kinematics  # the script beside this one

    kinematics.main()


if __name__ == "__main__":
    main()
