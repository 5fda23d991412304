"""A time law: speed along the path, its active limits, used shares of the legs' limits, and a feed override.

A short raster with sharp corners on the shipped machine `desk`, its axis leaning to and fro. Above: speed along the
path under the feed and the legs' velocity limits, coloured by the active limit. Middle: how much of the legs' limits
the interpolated setpoints use in time. Below: the same motion with the feed override set to 40 %, to a hold, and to
130 %.

    python examples/09_time_law.py --out docs/time_law.png
"""

from __future__ import annotations

import argparse
import itertools

import matplotlib.pyplot as plt
import numpy as np

from pentapod.geometry import RigidTransform
from pentapod.geometry.interpolant import Interpolant
from pentapod.kinematics import Component
from pentapod.machine import Machine
from pentapod.planning import LegPath, PlacedPath, Placement, leg_path
from pentapod.timing import Trajectory, certify, explain, override, retime
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath

FEED = 0.05  # m/s


def placed_raster(machine: Machine) -> PlacedPath:
    """Four passes of 30 mm, 4 mm apart, in the middle of the work volume."""
    x = np.tile([0.0, 0.03, 0.03, 0.0], 2)
    corners = np.column_stack([x, 0.004 * np.repeat(np.arange(4), 2), 0.0 * x])
    tips = np.concatenate(
        [a + np.linspace(0, 1, 8)[:-1, None] * (b - a) for a, b in itertools.pairwise(corners)] + [corners[-1:]]
    )
    lean = 0.15 * np.sin(np.linspace(0.0, 9.0, len(tips)))
    axes = np.column_stack([np.sin(lean), 0.0 * lean, np.cos(lean)])
    toolpath = Toolpath((Segment(SegmentKind.CUT, tips, axes, FEED),), tilt_centre=0.003)
    turn = RigidTransform(np.diag([1.0, -1.0, -1.0]), machine.work.centre)
    margins = np.ones((len(tips), 1))
    limits = ()
    return PlacedPath(
        toolpath, Placement(turn, "by hand"), Component(1, 1), turn.apply(tips), turn.rotate(axes), margins, limits
    )


def planned(machine: Machine) -> tuple[LegPath, Trajectory]:
    """Return the leg path and its time law."""
    path = leg_path(placed_raster(machine), machine, path_tolerance=20e-6, axis_tolerance=np.radians(0.2))
    if not isinstance(path, LegPath):
        raise SystemExit(str(path))
    return path, checked(retime(path, machine))


def checked(result: object) -> Trajectory:
    """Return a trajectory, or end with the reason why there is none."""
    if not isinstance(result, Trajectory):
        raise SystemExit(str(result))
    return result


def draw(out: str) -> None:
    """Plan, print the explanation, and draw."""
    machine = Machine.load("desk")
    path, trajectory = planned(machine)
    print(explain(trajectory, machine, certify(trajectory, machine)))
    figure, (along, shares, overridden) = plt.subplots(3, 1, figsize=(9.0, 10.5), layout="constrained")
    profile = trajectory.profile
    s = 1e3 * profile.stations
    ceiling = (machine.legs.max_velocity / np.abs(path(profile.stations, 1))).min(axis=1)
    along.plot(s, 1e3 * np.minimum(ceiling, 0.2), color="0.8", label="legs' velocities alone")
    along.axhline(1e3 * FEED, color="0.6", linestyle="--", linewidth=0.8, label="feed")
    for k in np.unique(profile.active):
        here = profile.active == k
        along.plot(s[here], 1e3 * profile.speeds[here], ".", markersize=3, label=profile.constraint_names[k])
    along.set(xlabel="along the path / mm", ylabel="speed / mm/s", ylim=(0, 1.5e3 * FEED))
    along.legend(fontsize=7, ncols=3)
    period = machine.controller.period
    t = np.arange(round(trajectory.duration / period) + 1) * period
    motion = Interpolant.through(trajectory(t), period, machine.controller.interpolation)
    shares.plot(t[:-1], (motion.rates / machine.legs.max_velocity).max(axis=1), linewidth=0.8, label="velocity")
    shares.plot(
        t, (motion.accelerations / machine.legs.max_acceleration).max(axis=1), linewidth=0.8, label="acceleration"
    )
    shares.plot(t[:-1], (motion.jerks / machine.legs.max_jerk).max(axis=1), linewidth=0.5, alpha=0.7, label="jerk")
    shares.set(xlabel="time / s", ylabel="largest share of a leg's limit", ylim=(0, 1.3))
    shares.legend(fontsize=7, ncols=3)
    slow = checked(override(trajectory, machine, 0.6, 0.4))
    held = checked(override(slow, machine, 1.2, 0.0))
    again = checked(override(held, machine, held.duration + 0.3, 1.3))
    fine = np.linspace(0.0, again.duration, 4000)
    overridden.plot(fine, 1e3 * trajectory.station(fine, 1), color="0.75", label="as planned")
    overridden.plot(fine, 1e3 * again.station(fine, 1), label="with overrides")
    for when, words in ((0.6, "40 %"), (1.2, "hold"), (held.duration + 0.3, "130 %")):
        overridden.axvline(when, color="0.5", linewidth=0.6, linestyle=":")
        overridden.text(when, 1.4e3 * FEED, f" {words}", fontsize=8, va="top")
    overridden.set(xlabel="time / s", ylabel="speed / mm/s", ylim=(0, 1.5e3 * FEED))
    overridden.legend(fontsize=7, loc="lower right")
    figure.savefig(out, dpi=90)
    plt.close(figure)


def main() -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", default="docs/time_law.png")
    draw(parser.parse_args().out)


if __name__ == "__main__":
    main()
