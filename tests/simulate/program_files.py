"""A job whose toolpath is a file, and a program for it, made without the planner."""

from __future__ import annotations

import sys
from pathlib import Path

from pentapod.cli.commands.new import dome_stl
from pentapod.program import write_csv
from pentapod.toolpath.formats import write_toolpath

sys.path.append(str(Path(__file__).parents[1]))
from short_motion import motion, placed
from usual_job import job_text


def job_of_a_file() -> str:
    """The usual job, but with a toolpath from a file and a needle for a tool."""
    strategy = 'strategy = "file"\nfile = "path.npz"'
    text = job_text().replace("stepover_mm = 15\nspacing_mm = 4", strategy)
    return text.replace("diameter_mm = 10", "diameter_mm = 1e-6")


def write_job(folder: Path, duration: float) -> tuple[str, str]:
    """Write job.toml, part.stl, path.npz and program.csv; return the paths of job and program."""
    program, _ = motion(duration)
    (folder / "part.stl").write_bytes(dome_stl(cells=12))
    (folder / "job.toml").write_text(job_of_a_file(), encoding="utf-8")
    write_toolpath(placed().transformed(program.placement.inverse()), folder / "path.npz")
    write_csv(program, folder / "program.csv")
    return str(folder / "job.toml"), str(folder / "program.csv")
