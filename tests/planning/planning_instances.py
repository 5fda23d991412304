"""Random planning tasks with fixed seeds: parts, paths and tilt cones on three machines.

A part is a height field z(x, y) with known normals; a path visits it as a raster, a spiral or a curve. Nothing here is
known to the planner, and nothing depends on the mesh code.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pentapod.machine.machine import Machine
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath

PARTS = ("dome", "saddle", "hills", "cylinder")
MACHINES = ("desk", "figure3", "long_line")
"""The shipped one; the geometry of the paper's Fig. 3, scaled; and one with δ > 1."""
PATHS = ("raster", "spiral", "curve")
CONES_DEG = (0.0, 5.0, 10.0, 15.0, 20.0)
BALL_RADIUS = 0.003

Surface = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]
"""(x, y) → z, ∂z/∂x, ∂z/∂y."""


@dataclass(frozen=True)
class Instance:
    """One task: a toolpath in the workpiece frame, a tilt cone (half angle, radians), and the machine by its name."""

    name: str
    toolpath: Toolpath
    tilt: float
    machine: str


def machine(name: str) -> Machine:
    """Return one of MACHINES."""
    file = Path(__file__).parent / "machines" / f"{name}.toml"
    return Machine.load(file if file.exists() else name)


def instances(count: int, seed: int = 0) -> list[Instance]:
    """Return `count` instances; the first ones are the same for any count."""
    return [_instance(k, np.random.default_rng([seed, k])) for k in range(count)]


def _instance(k: int, rng: np.random.Generator) -> Instance:
    part, path = PARTS[k % len(PARTS)], PATHS[(k // len(PARTS)) % len(PATHS)]
    size, slope, cone = rng.uniform(0.06, 0.2), np.radians(rng.uniform(5.0, 55.0)), float(rng.choice(CONES_DEG))
    surface = _surface(part, size, slope, rng)
    x, y = _visit(path, 0.5 * size, rng)
    z, zx, zy = surface(x, y)
    normals = np.stack([-zx, -zy, np.ones_like(z)], axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    tips = np.stack([x, y, z], axis=1)  # the ball touches where the axis is the normal: contact and tip coincide
    on = MACHINES[k % len(MACHINES)]
    name = f"{k}: {part} {1e3 * size:.0f} mm, slopes to {np.degrees(slope):.0f}°, {path}, cone {cone:.0f}°, {on}"
    toolpath = Toolpath((Segment(SegmentKind.CUT, tips, normals, 0.02),), BALL_RADIUS)
    return Instance(name, toolpath, np.radians(cone), on)


def _surface(part: str, size: float, slope: float, rng: np.random.Generator) -> Surface:
    """Return a surface of this kind whose steepest slope over the square of `size` is about `slope`."""
    half, steep = 0.5 * size, np.tan(slope)
    if part == "dome":
        radius = np.sqrt(2.0) * half / np.sin(slope)

        def dome(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            z = np.sqrt(radius**2 - x * x - y * y)
            return z - radius, -x / z, -y / z

        return dome
    if part == "saddle":
        bend = steep / (np.sqrt(2.0) * half)
        return lambda x, y: (0.5 * bend * (x * x - y * y), bend * x, -bend * y)
    if part == "cylinder":
        turn, radius = rng.uniform(0.0, np.pi), np.sqrt(2.0) * half / np.sin(slope)
        c, s = np.cos(turn), np.sin(turn)

        def cylinder(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            across = c * x + s * y
            z = np.sqrt(radius**2 - across**2)
            return z - radius, -c * across / z, -s * across / z

        return cylinder
    waves = rng.normal(size=(4, 2)) * 2.0 / size
    phases, heights = rng.uniform(0.0, 2.0 * np.pi, 4), rng.uniform(0.3, 1.0, 4)
    heights *= steep / (heights * np.linalg.norm(waves, axis=1)).sum()

    def hills(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        angle = x[:, None] * waves[:, 0] + y[:, None] * waves[:, 1] + phases
        slopes = heights * np.cos(angle)
        return (heights * np.sin(angle)).sum(axis=1), slopes @ waves[:, 0], slopes @ waves[:, 1]

    return hills


def _visit(path: str, half: float, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    if path == "raster":
        x = np.linspace(-half, half, 40)
        rows = [np.stack([x if k % 2 == 0 else x[::-1], np.full(40, y)]) for k, y in enumerate(x[::3])]
        x, y = np.concatenate(rows, axis=1)
        return x, y
    if path == "spiral":
        turn = np.linspace(0.0, 12.0 * np.pi, 500)
        radius = half * turn / turn[-1]
        return radius * np.cos(turn), radius * np.sin(turn)
    t = np.linspace(0.0, 2.0 * np.pi, 400)
    a, b = rng.uniform(0.0, 2.0 * np.pi, 2)
    return half * np.sin(2.0 * t + a), half * np.sin(3.0 * t + b)
