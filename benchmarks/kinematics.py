"""Forward and inverse kinematics and the component certificate, in ns per pose, against a batched Newton solver.

Run ``python benchmarks/kinematics.py``. The Newton solver is what one would write in NumPy without the closed
form: analytic Jacobian, all poses at once, warm-started within 1 mm of the answer.
"""

from __future__ import annotations

import platform
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pentapod.arrays import Floats
from pentapod.kinematics import (
    AsBuiltPentapod,
    Component,
    LinearPentapod,
    as_built_pose,
    certify_component,
    certify_motion,
)

BASE = 0.2 * np.array([(-2.0, 1.0), (-1.0, -2.0), (0.0, 0.0), (1.0, -2.0), (2.0, 2.0)])


@dataclass(frozen=True)
class Row:
    """One line of the table: what was measured, ns per pose, how many times the closed form's, the worst error."""

    name: str
    nanoseconds: float
    ratio: float
    error: float


def newton(
    pentapod: LinearPentapod, legs: Floats, position: Floats, direction: Floats, *, block: int = 2048
) -> tuple[Floats, Floats, int]:
    """Return positions and directions (N, 3) of leg lengths (N, 5) by Newton's method, and its iterations.

    Unknowns are p and the direction as a free vector of R³, whose length is the sixth equation. Starts (N, 3).
    """
    position, direction, most = position.copy(), direction.copy(), 0
    z = pentapod.offsets[:, None]
    attachments = np.c_[pentapod.base, np.zeros(5)]
    for start in range(0, len(legs), block):
        p, i = position[start : start + block], direction[start : start + block]
        squared = legs[start : start + block] ** 2
        jacobian, residual = np.empty((len(p), 6, 6)), np.empty((len(p), 6))
        jacobian[:, 5, :3] = 0.0
        for iteration in range(1, 20):
            d = p[:, None, :] + z * i[:, None, :] - attachments
            residual[:, :5] = 0.5 * (np.einsum("nij,nij->ni", d, d) - squared)
            residual[:, 5] = 0.5 * (np.einsum("nj,nj->n", i, i) - 1.0)
            jacobian[:, :5, :3], jacobian[:, :5, 3:], jacobian[:, 5, 3:] = d, z * d, i
            step = np.linalg.solve(jacobian, residual[..., None])[..., 0]
            p -= step[:, :3]
            i -= step[:, 3:]
            most = max(most, iteration)
            if np.abs(step).max() < 1e-9:
                break
    return position, direction, most


def best_of(action: Callable[[], object], repeats: int = 5) -> float:
    """Return the shortest time in seconds of several runs, after one that does not count."""
    action()
    times: list[float] = []
    for _ in range(repeats):
        start = time.perf_counter()
        action()
        times.append(time.perf_counter() - start)
    return min(times)


def run(count: int = 200_000) -> list[Row]:
    """Measure everything on `count` poses of a random smooth motion in one component; return the table's rows."""
    pentapod, component = LinearPentapod.quadratic(BASE, 0.5), Component(1, 1)
    t = np.linspace(0.0, 1.0, count)
    position = np.c_[0.1 * np.cos(40 * t), 0.1 * np.sin(31 * t), 0.6 + 0.05 * np.sin(17 * t)]
    direction = np.c_[0.3 * np.sin(23 * t), 0.3 * np.cos(29 * t), np.ones(count)]
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    legs = pentapod.leg_lengths(position, direction)

    rng = np.random.default_rng(0)
    near_position = position + rng.uniform(-1e-3, 1e-3, (count, 3)) / np.sqrt(3)
    near_direction = direction + rng.uniform(-1e-3, 1e-3, (count, 3))
    near_direction /= np.linalg.norm(near_direction, axis=1)[:, None]

    def error(found: Floats) -> float:
        return float(np.abs(found - position).max())

    closed = best_of(lambda: pentapod.pose(legs, component))
    found, _, iterations = newton(pentapod, legs, near_position, near_direction)
    iterative = best_of(lambda: newton(pentapod, legs, near_position, near_direction), repeats=2)
    modes = best_of(lambda: pentapod.assembly_modes(legs), repeats=3)
    inverse = best_of(lambda: pentapod.leg_lengths(position, direction))
    linear = np.stack([legs[:-1], legs[1:]], axis=-1)
    certificate = best_of(lambda: certify_component(pentapod, linear, component), repeats=3)

    built = AsBuiltPentapod.of(
        pentapod,
        base_errors=3e-4 * rng.normal(size=(5, 3)),
        offset_errors=3e-4 * rng.normal(size=5),
        radii=3e-4,
        zeros=3e-4 * rng.normal(size=5),
    )
    some = slice(0, count // 10)
    real_legs = built.leg_lengths(position[some], direction[some])
    real = as_built_pose(built, pentapod, real_legs, component)
    if not real.proven.all():
        raise RuntimeError("the benchmark's poses are meant to be proven")
    as_built = 10.0 * best_of(lambda: as_built_pose(built, pentapod, real_legs, component), repeats=2)
    real_linear = np.stack([real_legs[:-1], real_legs[1:]], axis=-1)
    motion = 10.0 * best_of(lambda: certify_motion(built, real_linear, real.position, real.direction), repeats=2)

    def row(name: str, seconds: float, worst: float = 0.0) -> Row:
        return Row(name, seconds / count * 1e9, seconds / closed, worst)

    return [
        row("inverse kinematics, five legs", inverse),
        row("forward kinematics, closed form, one component", closed, error(pentapod.pose(legs, component)[0])),
        row("forward kinematics, closed form, all four modes", modes, error(pentapod.assembly_modes(legs)[0][:, 0])),
        row(f"forward kinematics, Newton, {iterations} iterations from within 1 mm", iterative, error(found)),
        row("component certificate, per linear interval", certificate),
        row(
            "forward kinematics, as built (0.3 mm off), each pose proven",
            as_built,
            float(np.abs(real.position - position[some]).max()),
        ),
        row("motion as built free of singularities, per linear interval", motion),
    ]


def main() -> None:
    """Print the table."""
    rows = run()
    print(f"NumPy {np.__version__}, Python {platform.python_version()}, {platform.machine()}, one process")
    width = max(len(row.name) for row in rows)
    print(f"{'':{width}}  {'ns/pose':>9}  {'ratio':>7}  {'worst error':>11}")
    for row in rows:
        error = f"{row.error:.1e} m" if row.error else ""
        print(f"{row.name:{width}}  {row.nanoseconds:9.1f}  {row.ratio:6.1f}x  {error:>11}")


if __name__ == "__main__":
    main()
