"""From crate to first cut: calibrate a machine, find the clamped part, plan, and play the program on the true machine.

    python examples/15_from_crate_to_first_cut.py --out out/first-cut

The machine that was built is a `desk` with errors of a fixed seed, which no command knows: base joints off by 0.3 mm,
offsets by 0.2 mm, rings of up to 0.5 mm, zeros of the scales by 0.5 mm. The part is clamped 1 to 2 mm, and a degree,
from where it was planned. All else is done by commands, as a user would; the script only plays the world: the
instrument, the probe, and in the end MuJoCo as the true machine. It prints how far the ball is from the toolpath on the
true part, for the calibrated and registered program, and for the one of the machine as designed.
"""

from __future__ import annotations

import argparse
import dataclasses
import shutil
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from pentapod.cli.main import run
from pentapod.geometry import RigidTransform
from pentapod.job import Job
from pentapod.job.build.toolpath import job_toolpath
from pentapod.job.build.values import job_machine, job_mesh
from pentapod.kinematics import AsBuiltPentapod, Component
from pentapod.machine import Machine
from pentapod.mesh import Mesh
from pentapod.mesh.query.distance import MeshDistance
from pentapod.program import Program, read_csv
from pentapod.registration import Touches, read_touches, touches_text
from pentapod.simulate import Physics, Plant, Reference, plant, simulate_mujoco
from pentapod.toolpath import Toolpath

SHIPPED = Path(__file__).resolve().parents[1]
DESIGN, COMPONENT = "desk", Component(1, 1)
POSITION_SIGMA, DIRECTION_SIGMA, LEG_SIGMA, TOUCH_SIGMA = 10e-6, np.radians(0.001), 2e-6, 5e-6
JOB = """
[part]
mesh = "part.stl"
unit = "mm"
scale = 0.4

[machine]
MACHINE

[tool]
type = "ball"
diameter_mm = 6

[toolpath]
stepover_mm = 3

[axis]
tilt_deg = 15

[placement]
mode = "table"
table_z_mm = 490

[feed]
cut_mm_min = 1500

[tolerance]
path_mm = 0.01
"""


@dataclasses.dataclass(frozen=True)
class World:
    """What no command knows: the machine as built, and where the part is (part to machine as built)."""

    machine: AsBuiltPentapod
    part: RigidTransform
    rng: np.random.Generator

    def measured(self, file: Path) -> None:
        """Fill in a list of measurements: an instrument sees tip and axis, in a frame of its own."""
        lines = file.read_text(encoding="utf-8").splitlines()
        first = next(k for k, line in enumerate(lines) if not line.startswith("#")) + 1
        cells = [line.split(",")[:6] for line in lines[first:]]
        legs = 1e-3 * np.array([[float(cell) for cell in row[1:]] for row in cells])
        legs = legs + LEG_SIGMA * self.rng.normal(size=legs.shape)
        positions, directions = self.machine.pose(legs, COMPONENT)
        turn, shift = Rotation.from_rotvec([0.2, -0.1, 1.3]), np.array([1.2, -2.3, 0.4])
        tips = turn.apply(positions + Machine.load(DESIGN).tool_length * directions) + shift
        tips = 1e3 * (tips + POSITION_SIGMA * self.rng.normal(size=tips.shape))
        axes = turn.apply(-directions) + DIRECTION_SIGMA * self.rng.normal(size=tips.shape)
        axes /= np.linalg.norm(axes, axis=1)[:, None]
        seen = [",".join(f"{v:.9f}" for v in row) for row in np.hstack([tips, axes])]
        rows = [",".join(row) + "," + more for row, more in zip(cells, seen, strict=True)]
        file.write_text("\n".join([*lines[:first], *rows]) + "\n", encoding="utf-8")

    def touched(self, expected: Touches, believed: Machine, planned: RigidTransform, mesh: Mesh) -> Touches:
        """Return the legs at which the probe trips on the true part, each way along the surface's normal as planned."""
        surface, reach = MeshDistance.of(mesh), expected.probe_length - expected.tip_radius
        positions, directions = believed.robot.pose(expected.legs, COMPONENT)
        centres = positions + reach * directions
        feet = planned.apply(surface.feet(planned.inverse().apply(centres)).points)
        normals = (centres - feet) / np.linalg.norm(centres - feet, axis=1)[:, None]

        def legs_at(way: np.ndarray) -> np.ndarray:
            return believed.robot.leg_lengths(positions + way[:, None] * normals, directions)

        inner, outer = np.full(len(centres), -8e-3), np.full(len(centres), 8e-3)
        for _ in range(40):
            middle = 0.5 * (inner + outer)
            p, d = self.machine.pose(legs_at(middle), COMPONENT)
            balls = self.part.inverse().apply(p + reach * d)
            found = surface.feet(balls)
            touching = found.sides * np.linalg.norm(balls - found.points, axis=1) < expected.tip_radius
            inner, outer = np.where(touching, middle, inner), np.where(touching, outer, middle)
        return dataclasses.replace(expected, legs=legs_at(outer + TOUCH_SIGMA * self.rng.normal(size=len(outer))))

    def tip_error(self, program: Program, machine: Machine, toolpath: Toolpath) -> float:
        """Return the largest distance of the ball from the toolpath on the true part, metres, as MuJoCo plays it.

        The ball's centre counts: the tip moves on the ball as the tool leans.
        """
        reference = Reference(program, machine)
        modelled = plant(reference, true=self.machine)
        assert isinstance(modelled, Plant), modelled
        physics = simulate_mujoco(reference, modelled)
        assert isinstance(physics, Physics), physics
        played = physics.played
        centres = self.part.inverse().apply(played.tips - toolpath.tilt_centre * played.directions)
        starts, ways = toolpath.tilt_centres[:-1], np.diff(toolpath.tilt_centres, axis=0)
        square = np.maximum((ways**2).sum(axis=1), 1e-30)
        largest = 0.0
        for block in np.array_split(centres, 1 + len(centres) // 1000):
            offset = block[:, None] - starts
            along = np.clip((offset * ways).sum(axis=2) / square, 0.0, 1.0)
            gaps = np.linalg.norm(offset - along[..., None] * ways, axis=2)
            largest = max(largest, float(gaps.min(axis=1).max()))
        return largest


def command(*words: object) -> None:
    """Run a command of pentapod; stop where it fails."""
    print("$ pentapod", *words)
    if run([str(word) for word in words]) != 0:
        raise SystemExit(f"failed: {words[0]}")


def built(seed: int) -> tuple[AsBuiltPentapod, np.random.Generator]:
    """Return the machine that a workshop built."""
    rng = np.random.default_rng(seed)
    robot = Machine.load(DESIGN).robot
    errors = {"base_errors": 0.3e-3 * rng.normal(size=(5, 3)), "offset_errors": 0.2e-3 * rng.normal(size=5)}
    return AsBuiltPentapod.of(robot, **errors, radii=0.5e-3 * rng.random(5), zeros=0.5e-3 * rng.normal(size=5)), rng


def first_cut(out: Path, seed: int) -> tuple[float, float]:
    """Go from crate to first cut in a folder; return the ball's errors as designed and as calibrated, metres."""
    machine, rng = built(seed)
    world = World(machine, RigidTransform.identity(), rng)
    out.mkdir(parents=True, exist_ok=True)
    # The machine: poses are chosen and measured, its calibration goes into its file.
    command("calibrate", "plan", DESIGN, "-n", 20, "-o", out / "calibration", "-q")
    world.measured(out / "calibration" / "measurements.csv")
    command("calibrate", "fit", out / "calibration" / "measurements.csv", "-o", out / "desk-0001.toml")
    design = (SHIPPED / "src/pentapod/machine/library/desk.toml").read_text(encoding="utf-8")
    (out / "machine.toml").write_text(design + '\n[calibration]\nfile = "desk-0001.toml"\n', encoding="utf-8")
    # The part: planned where it should stand, found where it stands, planned again.
    shutil.copy(SHIPPED / "toolpaths/wavy.stl", out / "part.stl")
    (out / "job.toml").write_text(JOB.replace("MACHINE", 'file = "machine.toml"'), encoding="utf-8")
    command("plan", out / "job.toml", "-o", out / "planned", "-q")
    command("register", "plan", out / "planned", "-o", out / "probing", "-q")
    job = Job.load(out / "job.toml")
    believed, mesh = job_machine(job), job_mesh(job)
    planned = read_csv(out / "planned" / "program.csv").placement
    off = RigidTransform(
        Rotation.from_euler("xyz", [0.4, -0.3, 1.1], degrees=True).as_matrix(), np.array([1e-3, -2e-3, 5e-4])
    )
    world = dataclasses.replace(
        world, part=RigidTransform(off.rotation @ planned.rotation, planned.translation + off.translation)
    )
    touches = world.touched(read_touches(out / "probing" / "expected.csv"), believed, planned, mesh)
    (out / "probing" / "touches.csv").write_text(touches_text(touches), encoding="utf-8")
    found = out / "found.toml"
    command("register", out / "probing" / "touches.csv", "--job", out / "job.toml", "-o", found)
    command("replan", out / "planned", "--placement", found, "-o", out / "replanned", "-q")
    command("post", out / "replanned" / "program.csv", "--to", "linuxcnc", "-o", out / "linuxcnc", "-q")
    toolpath = job_toolpath(job, mesh, machine=believed)[0]
    calibrated = world.tip_error(read_csv(out / "replanned" / "program.csv"), believed, toolpath)
    # The same as designed, though it is told where the part is.
    (out / "designed.toml").write_text(JOB.replace("MACHINE", f'name = "{DESIGN}"'), encoding="utf-8")
    command("plan", out / "designed.toml", "--placement", found, "-o", out / "designed", "-q")
    designed = world.tip_error(read_csv(out / "designed" / "program.csv"), Machine.load(DESIGN), toolpath)
    return designed, calibrated


def main() -> None:
    """Print both errors."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out/first-cut"))
    parser.add_argument("--seed", type=int, default=117)
    given = parser.parse_args()
    designed, calibrated = first_cut(given.out, given.seed)
    print(f"ball from the toolpath on the true part, as MuJoCo plays it: {1e6 * calibrated:.1f} um")
    print(f"without calibration: {1e3 * designed:.2f} mm")


if __name__ == "__main__":
    main()
