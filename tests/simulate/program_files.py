"""A job whose toolpath is a file, and a program for it, made without the planner."""

from __future__ import annotations

import sys
from pathlib import Path

from pentapod.cli.new import dome_stl
from pentapod.program import write_csv
from pentapod.toolpath.formats import write_toolpath

sys.path.append(str(Path(__file__).parents[1] / "program"))
from short_motion import motion, placed

JOB = """\
[part]
mesh = "part.stl"
unit = "mm"

[machine]
name = "desk"

[tool]
type = "ball"
diameter_mm = 1e-6

[toolpath]
strategy = "file"
file = "path.npz"

[feed]
cut_mm_min = 3000

[tolerance]
path_mm = 0.05
"""


def write_job(folder: Path, duration: float) -> tuple[str, str]:
    """Write job.toml, part.stl, path.npz and program.csv; return the paths of job and program."""
    program, _ = motion(duration)
    (folder / "part.stl").write_bytes(dome_stl(cells=12))
    (folder / "job.toml").write_text(JOB, encoding="utf-8")
    write_toolpath(placed().transformed(program.placement.inverse()), folder / "path.npz")
    write_csv(program, folder / "program.csv")
    return str(folder / "job.toml"), str(folder / "program.csv")
