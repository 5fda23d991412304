"""Three parts, two tools, one table: a scripted pipeline in ten lines.

    python examples/18_three_parts_two_tools.py

Each job is the shipped dome job with another mesh and another ball. `run` plans and judges it and writes its files into
a folder; a job that cannot be done has no program. `pentapod sweep` does the same on all cores.
"""

import sys
from pathlib import Path

from pentapod import Job, PlacedPath, Program, run

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out/table")
shipped = Path(__file__).resolve().parents[1] / "toolpaths"
job = Job.load(shipped / "dome.toml")
print("part    ball mm  margin  time s  verdict")
for part in ("dome", "saddle", "wavy"):
    for ball in (6, 8):
        asked = job.with_(**{"part.mesh": str(shipped / f"{part}.stl"), "tool.diameter_mm": ball})
        outcome = run(asked, folder / f"{part}-{ball}", advice=None)
        placed, program = outcome.find(PlacedPath), outcome.find(Program)
        figures = f"{placed.smallest_margin:6.3f}  {program.duration:6.1f}" if placed and program else f"{'':14}"
        print(f"{part:7} {ball:7}  {figures}  {outcome.refusal or outcome.verdict.answer}")
