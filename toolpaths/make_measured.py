"""Write measured.csv and measured-later.csv: what an instrument saw of a `desk` that was not built exactly.

The machine's errors are of a fixed seed, as a workshop's would be: base joints off by 0.3 mm, offsets by 0.2 mm, rings
of up to 0.5 mm, zeros of the scales by 0.5 mm. In measured.csv one reading is wrong by half a millimetre; before
measured-later.csv the scale of leg 4 has slipped by 0.15 mm. Run it anew if `pentapod calibrate plan` changes.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from pentapod.job.measuring.candidates import Instruments, candidates, measurements_in
from pentapod.kinematics import AsBuiltPentapod, Component
from pentapod.machine import Machine, write_measurements
from pentapod.machine.identification.pose_choice import choose_poses

HERE = Path(__file__).parent
COMPONENT, POSES = Component(1, 1), 20
STATION = Rotation.from_rotvec([0.2, -0.1, 1.3]), np.array([1.2, -2.3, 0.4])
"""How the machine stands to the instrument."""


def main() -> None:
    """Write both files."""
    machine, rng = Machine.load("desk"), np.random.default_rng(117)
    errors = {"base_errors": 0.3e-3 * rng.normal(size=(5, 3)), "offset_errors": 0.2e-3 * rng.normal(size=5)}
    built = AsBuiltPentapod.of(machine.robot, **errors, radii=0.5e-3 * rng.random(5), zeros=0.5e-3 * rng.normal(size=5))
    used = Instruments()
    every = candidates(machine, COMPONENT, used)
    chosen = choose_poses(every.columns, every.tips_move, POSES).chosen
    tips, axes = every.tips[chosen], every.axes[chosen]
    plan = measurements_in(machine, COMPONENT, used, tips, axes)
    turn, shift = STATION
    for name, slip, blunder in (("measured", 0.0, 0.5e-3), ("measured-later", 0.15e-3, 0.0)):
        real = dataclasses.replace(built, zeros=built.zeros + slip * (np.arange(5) == 3))
        legs = real.leg_lengths(tips + machine.tool_length * axes, -axes) + used.leg_sigma * rng.normal(size=(POSES, 5))
        legs[11, 1] += blunder
        positions = turn.apply(tips) + shift + used.position_sigma * rng.normal(size=tips.shape)
        seen = turn.apply(axes + used.direction_sigma * np.cross(rng.normal(size=axes.shape), axes))
        seen = np.hstack([positions, seen / np.linalg.norm(seen, axis=1)[:, None]])
        write_measurements(dataclasses.replace(plan, legs=legs, seen=seen), HERE / f"{name}.csv")


if __name__ == "__main__":
    main()
