"""Forward and inverse kinematics, certificates and tubes: ns each, against copying arrays and against Newton.

Run ``make bench-kinematics``. *Copying* is `np.copyto` of the same input and output arrays, of as many poses, into
arrays that are there already; kinematics writes to given arrays, too (`out=`). The Newton solver is what one would
write in NumPy without the closed form: analytic Jacobian, all poses at once, warm-started within 1 mm of the answer.
Everything runs on one core, in one process; each figure is processor time, the best of several runs.
"""

from __future__ import annotations

import platform
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.kinematics import (
    AsBuiltPentapod,
    Component,
    LinearPentapod,
    as_built_pose,
    certify_component,
    certify_motion,
    prove_tip_tube,
)
from pentapod.numerics.bernstein import elevate
from pentapod.numerics.kernels import kernels_used

BASE = 0.2 * np.array([(-2.0, 1.0), (-1.0, -2.0), (0.0, 0.0), (1.0, -2.0), (2.0, 2.0)])


@dataclass(frozen=True)
class Row:
    """One line of the table: what was measured, ns each, how many copies that is, the worst error in metres."""

    name: str
    nanoseconds: float
    copies: float | None = None
    error: float | None = None


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
    """Return the shortest processor time in seconds of several runs, after one that does not count."""
    action()
    times: list[float] = []
    for _ in range(repeats):
        start = time.process_time()
        action()
        times.append(time.process_time() - start)
    return min(times)


def motion(count: int) -> tuple[Floats, Floats]:
    """Return positions and directions (count, 3) of a smooth motion in one component."""
    t = np.linspace(0.0, 1.0, count)
    position = np.c_[0.1 * np.cos(40 * t), 0.1 * np.sin(31 * t), 0.6 + 0.05 * np.sin(17 * t)]
    direction = np.c_[0.3 * np.sin(23 * t), 0.3 * np.cos(29 * t), np.ones(count)]
    return position, direction / np.linalg.norm(direction, axis=1)[:, None]


def closed_form(pentapod: LinearPentapod, component: Component, count: int) -> list[Row]:
    """Measure kinematics on `count` poses against copying their arrays, and against Newton on some of them."""
    position, direction = motion(count)
    legs, out = pentapod.leg_lengths(position, direction), (np.empty_like(position), np.empty_like(direction))
    targets = np.empty_like(legs), *out

    def copy() -> None:
        for source, target in zip((legs, position, direction), targets, strict=True):
            np.copyto(target, source)

    copying = best_of(copy)
    rows = [Row("copying legs, positions and directions", copying / count * 1e9, 1.0)]

    def row(name: str, seconds: float, error: float | None = None) -> None:
        rows.append(Row(name, seconds / count * 1e9, seconds / copying, error))

    for policy, name in (("never", "NumPy"), ("always", "compiled")):
        with kernels_used(policy):
            row(f"leg lengths, {name}", best_of(lambda: pentapod.leg_lengths(position, direction, out=targets[0])))
            seconds = best_of(lambda: pentapod.pose(legs, component, out=out))
            row(f"forward kinematics, {name}", seconds, float(np.abs(out[0] - position).max()))
    row("forward kinematics, compiled, into new arrays", best_of(lambda: pentapod.pose(legs, component)))
    row("forward kinematics, all four modes, NumPy", best_of(lambda: pentapod.assembly_modes(legs), repeats=2))

    rng, some = np.random.default_rng(0), slice(0, count, 10)
    near = position[some] + rng.uniform(-1e-3, 1e-3, position[some].shape) / np.sqrt(3)
    turned = direction[some] + rng.uniform(-1e-3, 1e-3, direction[some].shape)
    turned /= np.linalg.norm(turned, axis=1)[:, None]
    found, _, iterations = newton(pentapod, legs[some], near, turned)
    seconds = 10.0 * best_of(lambda: newton(pentapod, legs[some], near, turned), repeats=2)
    name = f"forward kinematics, Newton, {iterations} iterations from within 1 mm"
    row(name, seconds, float(np.abs(found - position[some]).max()))
    return rows


def proofs(pentapod: LinearPentapod, component: Component, count: int) -> list[Row]:
    """Measure the proofs on `count` intervals, fewer where they take longer."""
    position, direction = motion(count + 1)
    legs, rows = pentapod.leg_lengths(position, direction), list[Row]()
    linear = np.stack([legs[:-1], legs[1:]], axis=-1)
    for policy, name in (("never", "NumPy"), ("always", "compiled")):
        with kernels_used(policy):
            for degree, share in ((1, 1), (3, 4), (5, 10)):
                some = np.ascontiguousarray(elevate(linear[::share], degree - 1))
                if not certify_component(pentapod, some, component).holds:
                    raise RuntimeError("the benchmark's motion is meant to be proven")
                seconds = best_of(lambda some=some: certify_component(pentapod, some, component), repeats=3)
                rows.append(Row(f"component certified, legs of degree {degree}, {name}", seconds / len(some) * 1e9))
    few = linear[: count // 20]
    seconds = best_of(lambda: prove_tip_tube(pentapod, few, component), repeats=2)
    rows.append(Row("tube around the pose proven, legs of degree 1", seconds / len(few) * 1e9))
    return rows + as_built(pentapod, component, position[: count // 10], direction[: count // 10])


def as_built(pentapod: LinearPentapod, component: Component, position: Floats, direction: Floats) -> list[Row]:
    """Measure the proven forward kinematics and motion of a machine that is 0.3 mm off its design."""
    rng, count = np.random.default_rng(0), len(position)
    built = AsBuiltPentapod.of(
        pentapod,
        base_errors=3e-4 * rng.normal(size=(5, 3)),
        offset_errors=3e-4 * rng.normal(size=5),
        radii=3e-4,
        zeros=3e-4 * rng.normal(size=5),
    )
    legs = built.leg_lengths(position, direction)
    real = as_built_pose(built, pentapod, legs, component)
    if not real.proven.all():
        raise RuntimeError("the benchmark's poses are meant to be proven")
    poses = best_of(lambda: as_built_pose(built, pentapod, legs, component), repeats=2)
    linear = np.stack([legs[:-1], legs[1:]], axis=-1)
    moved = best_of(lambda: certify_motion(built, linear, real.position, real.direction), repeats=2)
    error = float(np.abs(real.position - position).max())
    return [
        Row("forward kinematics as built (0.3 mm off), each pose proven", poses / count * 1e9, error=error),
        Row("motion as built proven, legs of degree 1", moved / count * 1e9),
    ]


def main() -> None:
    """Print the table."""
    pentapod, component = LinearPentapod.quadratic(BASE, 0.5), Component(1, 1)
    kinematics = closed_form(pentapod, component, 1_000_000)
    rows = kinematics + proofs(pentapod, component, 200_000)
    print(f"NumPy {np.__version__}, Python {platform.python_version()}, {platform.machine()}, one process")
    width = max(len(row.name) for row in rows)
    print(f"{'':{width}}  {'ns each':>9}  {'x copying':>9}  {'worst error':>11}")
    for row in rows:
        copies = "" if row.copies is None else f"{row.copies:.2f}"
        error = "" if row.error is None else f"{row.error:.1e} m"
        print(f"{row.name:{width}}  {row.nanoseconds:9.1f}  {copies:>9}  {error:>11}")
    newton_time, closed = (row_named(kinematics, name) for name in ("Newton", "forward kinematics, compiled"))
    print(f"Newton's method takes {newton_time / closed:.0f} times as long as the compiled closed form")


def row_named(rows: list[Row], part: str) -> float:
    """Return the time in ns of the first row whose name contains a phrase."""
    return next(row.nanoseconds for row in rows if part in row.name)


if __name__ == "__main__":
    main()
