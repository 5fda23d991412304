"""Machines as built against the nominal one, in pairs in one run: the whole verdict, and planning of a shipped job.

The as-built machines have joints off by 0.2 mm and zeros of 0.5 mm; the second one has rings of 0 to 30 mm, too.
Printed are CPU seconds and their ratio to the nominal machine's.
"""

from __future__ import annotations

import argparse
import dataclasses
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from pentapod import Job, Machine, run
from pentapod.cutters.ball import BallCutter
from pentapod.geometry.solids import Cone
from pentapod.job.build.values import job_machine
from pentapod.kinematics import AsBuiltPentapod
from pentapod.machine.clearance.collision_world import CollisionWorld, Obstacle, mounted
from pentapod.mesh.query.distance import MeshDistance
from pentapod.planning.problem.constraints import FREE
from pentapod.program import quantised, write_csv
from pentapod.verify import Cutting, verify
from verify import BALL, case, hill

TOOLPATHS = Path(__file__).parents[1] / "toolpaths"


def machines(nominal: Machine) -> dict[str, Machine]:
    """Return the nominal machine and two as built, by name."""
    found = {"nominal": nominal}
    for name, ring in (("as built", 0.0), ("as built, rings", 0.03)):
        rng = np.random.default_rng(1)
        robot = AsBuiltPentapod.of(
            nominal.robot,
            base_errors=rng.uniform(-2e-4, 2e-4, (5, 3)),
            zeros=rng.uniform(-5e-4, 5e-4, 5),
            radii=rng.uniform(0.0, ring, 5) if ring else 0.0,
        )
        found[name] = dataclasses.replace(nominal, robot=robot)
    return found


def seconds(work: Callable[[], Any]) -> tuple[float, Any]:
    """Return CPU seconds of this process and what the work gave."""
    start = time.process_time()
    value = work()
    return time.process_time() - start, value


def verdicts(rows: int, folder: Path) -> None:
    """Judge one path of the tool as the program of each machine."""
    nominal, toolpath, program = case(rows, rows // 10)
    poses = nominal.robot.pose(program.legs, program.component)
    surface, tool = MeshDistance.of(hill(100)), BallCutter(BALL, shank=(Cone(0.03, 2e-3, 2e-3),))
    first = 0.0
    for name, machine in machines(nominal).items():
        around = CollisionWorld(
            (Obstacle("part", surface, clamped=True, allowance=5e-5),), mounted(tool.solids, machine)
        )
        asked = {
            "tilt": 0.0, "path_tolerance": 20e-6, "axis_tolerance": np.radians(0.5), "lowest_share": 0.0,
            "job_digest": "bench", "waived": ("surface left on the region",), "collision_world": around,
            "constraints": FREE, "cutting": Cutting(surface, tool.solids, 5e-5),
        }  # fmt: skip
        source = dataclasses.replace(program.provenance, machine_digest=machine.digest)
        own = dataclasses.replace(program, legs=quantised(machine.robot.leg_lengths(*poses)), provenance=source)
        short = dataclasses.replace(own, legs=own.legs[:3000])
        write_csv(short, folder / "short.csv")
        verify(folder / "short.csv", machine, toolpath, **asked)  # kernels compile once on a machine
        write_csv(own, folder / "program.csv")
        spent, verdict = seconds(lambda m=machine, a=asked: verify(folder / "program.csv", m, toolpath, **a))
        first = first or spent
        failed = [c.claim for c in verdict.certificates if not c.passed]
        print(f"verify, {name}: {spent:.1f} s, {spent / first:.2f} × nominal; failed: {failed or 'none'}", flush=True)


def plans(names: list[str], folder: Path) -> None:
    """Plan shipped jobs for each machine."""
    for job_name in names:
        job = Job.load(TOOLPATHS / f"{job_name}.toml")
        first = 0.0
        for name, machine in machines(job_machine(job)).items():
            out = folder / f"{job_name} {name}"
            spent, outcome = seconds(lambda m=machine, o=out, j=job: run(j, o, machine=m))
            first = first or spent
            said = "passed" if outcome.verdict is not None and outcome.verdict.passed else "FAILED or refused"
            print(f"{job_name}, {name}: {spent:.1f} s with verdict, {spent / first:.2f} × nominal; {said}", flush=True)


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rows", type=int, default=200_000)
    parser.add_argument("--jobs", nargs="*", default=["seam", "dome"])
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        verdicts(given.rows, Path(folder))
        plans(given.jobs, Path(folder))


if __name__ == "__main__":
    main()
