"""How often a second the viewer judges a placement while the part is dragged, against judging pose by pose.

Run ``make bench-view`` after ``make demo``, or name the folder of another run. Each update judges every limit at the
waypoints that are judged while it is dragged, at places a few millimetres and degrees about the plan's. The peer asks
the same margins of one waypoint after the other, as a loop in Python would; of some waypoints, for it takes long.
A second figure is the look at all waypoints when the part is let go; a third that with the best lean at each by itself.
CPU seconds of one process.
"""

from __future__ import annotations

import argparse
import platform
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from pentapod.geometry.rigid import RigidTransform
from pentapod.view.opened_run import open_run
from pentapod.view.study import Study

PLACES, LOOPED = 20, 100


def seconds(work: Callable[[RigidTransform], object], places: list[RigidTransform]) -> float:
    """Return the mean CPU seconds of a piece of work at these placements, the first time not counted."""
    work(places[0])
    start = time.process_time()
    for place in places:
        work(place)
    return (time.process_time() - start) / len(places)


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", nargs="?", type=Path, default=Path("out"))
    run = open_run(parser.parse_args().run)
    study, rng = Study.of(run), np.random.default_rng(1)
    places: list[RigidTransform] = []
    for _ in range(PLACES):
        turn = Rotation.from_rotvec(rng.normal(0.0, np.radians(2.0), 3)).as_matrix()
        about = run.placement.apply(study.samples.tilt_centres.mean(axis=0))
        moved = RigidTransform(turn, about - turn @ about + rng.normal(0.0, 3e-3, 3))
        places.append(moved @ run.placement)

    def drawn(place: RigidTransform) -> object:
        return study.at(place).margins

    count = len(study.at(run.placement).rows)
    some = study.shown[:: max(1, len(study.shown) // LOOPED)]

    def looped(place: RigidTransform) -> list[float]:
        found: list[float] = []
        for row in some:
            only = np.array([row])
            poses = study.samples.machine_poses(place, study.axes[only], only)
            found.append(float(study.margins(*poses, place).min()))
        return found

    update = seconds(drawn, places)
    one = seconds(looped, places[:4]) / len(some)
    let_go = seconds(lambda place: study.at(place, thorough=True), places[:4])
    tilted = seconds(lambda place: study.at(place, tilted=True), places[:4])
    total = len(study.samples.tilt_centres)
    print(f"{platform.machine()}, Python {platform.python_version()}, NumPy {np.__version__}")
    print(f"{run.folder}: {count:,} waypoints judged of {total:,}, {len(study.margins.limits)} limits at each")
    print(
        f"dragged: {1e3 * update:.1f} ms, {1.0 / update:.0f} updates a second, {1e6 * update / count:.1f} µs a waypoint"
    )
    print(f"pose by pose: {1e6 * one:.0f} µs a waypoint, {one * count / update:.0f} × as long for the same picture")
    print(f"let go, all waypoints: {1e3 * let_go:.0f} ms; leaning as best: {1e3 * tilted:.0f} ms")


if __name__ == "__main__":
    main()
