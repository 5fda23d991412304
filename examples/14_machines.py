"""The shipped machines side by side: geometry, work volume and design figures.

    python examples/14_machines.py --out docs/machines.png

Each column is a machine of `pentapod machine list`, drawn to one scale from above and from the side, with legs and
tool in the middle of the work volume (shaded), and in the pose of its boundary with the largest force in the legs
(dashed). Printed are the figures that a search for a machine weighs.
"""

from __future__ import annotations

import argparse
from typing import Any

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from pentapod.kinematics import tip_force_amplification
from pentapod.machine import Machine, check, sample_work_volume, shipped_machines


def worst_pose(machine: Machine) -> tuple[np.ndarray, np.ndarray]:
    """Return position and direction (3,) of the pose on the work volume's boundary with the largest leg forces."""
    tips, axes = sample_work_volume(machine.work, rings=1, around=12, levels=3)
    position, direction = tips + machine.tool_length * axes, -axes
    force = tip_force_amplification(machine.robot, position, direction, machine.tool_length)
    worst = int(np.argmax(force))
    return position[worst], direction[worst]


def draw(axis: Any, machine: Machine, first: int, second: int) -> None:
    """Draw base joints, legs, line with tool, and work volume in two of the coordinates, millimetres."""
    robot, work = machine.robot, machine.work
    i = np.array([0.0, 0.0, 1.0])
    for (p, line), style in (((work.centre - machine.tool_length * i, i), "-"), (worst_pose(machine), "--")):
        for leg, (foot, joint) in enumerate(zip(*machine.bars.ends(p, line), strict=True)):
            ends = 1e3 * np.stack([foot, joint])
            axis.plot(ends[:, first], ends[:, second], style, color=f"C{leg}", linewidth=1.2 if style == "-" else 0.7)
        tool = 1e3 * np.stack([p + machine.line_top * line, p + machine.tool_length * line])
        axis.plot(tool[:, first], tool[:, second], style, color="black", linewidth=2.0 if style == "-" else 1.0)
    feet, centre, r = 1e3 * robot.base_joints, 1e3 * work.centre, 500.0 * work.diameter
    axis.plot(feet[:, first], feet[:, second], "ks", markersize=4)
    if second == 1:
        axis.add_patch(plt.Circle(centre[:2], r, alpha=0.35))
    else:
        h = 1e3 * work.height
        axis.add_patch(plt.Rectangle((centre[0] - r, centre[2] - 0.5 * h), 2.0 * r, h, alpha=0.35))
    axis.set_aspect("equal")
    axis.set_xlabel("x / mm")
    axis.set_ylabel("y / mm" if second == 1 else "z / mm")


def figures(machine: Machine) -> str:
    """Return the figures of one machine, one to a line."""
    report = check(machine)
    legs, robot = machine.legs, machine.robot
    near = min(m for m, s in zip(report.margins, robot.singularities, strict=True) if s.unit == "mm")
    return "\n".join(
        [
            f"tool axes to {np.degrees(machine.work.tilt):.0f}°, tips in ⌀ {1e3 * machine.work.diameter:.0f} mm",
            f"base radius {1e3 * np.linalg.norm(robot.base_joints, axis=1).max():.0f} mm",
            f"legs {1e3 * legs.min_length.min():.0f} to {1e3 * legs.max_length.max():.0f} mm",
            f"platform {1e3 * np.ptp(robot.offsets):.0f} mm long",
            f"leg forces {report.amplification:.2f} N per N",
            f"clearance {1e3 * report.clearance:.1f} mm",
            f"singular surface {1e3 * near:.0f} mm away",
        ]
    )


def main() -> None:
    """Draw all shipped machines."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", default="machines.png", help="the picture")
    options = parser.parse_args()
    machines = [Machine.load(name) for name in shipped_machines()]
    figure, axes = plt.subplots(2, len(machines), figsize=(4.2 * len(machines), 8.6), sharex=True, sharey="row")
    for (above, aside), machine in zip(axes.T, machines, strict=True):
        text = figures(machine)
        print(f"{machine.name}\n  " + text.replace("\n", "\n  "))
        above.set_title(f"{machine.name}\n{text}", fontsize=9)
        draw(above, machine, 0, 1)
        draw(aside, machine, 0, 2)
    axes[1, 0].invert_yaxis()  # shared: +z points down to the work
    figure.tight_layout()
    figure.savefig(options.out, dpi=100)


if __name__ == "__main__":
    main()
