"""A machine with errors of a fixed seed, and what instruments see of it, by formulas of its own (pentakins' struts)."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from pentapod.kinematics import Component
from pentapod.machine import Machine, Measurements
from pentapod.machine.calibration.record import geometry_digest

MACHINE = Machine.load("desk")
TOOL = MACHINE.tool_length


def true_numbers(seed: int, ring: float = 0.0) -> np.ndarray:
    """The thirty numbers of a machine as built: base x y z, offset, ring, zero of each leg; metres."""
    rng, robot = np.random.default_rng(seed), MACHINE.robot
    base = np.c_[robot.base, np.zeros(5)] + rng.normal(size=(5, 3)) * 0.3e-3
    errors = rng.normal(size=5) * 0.2e-3, ring + rng.uniform(0.2, 1.0, 5) * 0.5e-3, rng.normal(size=5) * 0.5e-3
    return np.c_[base, robot.offsets + errors[0], errors[1], errors[2]].ravel()


def readings(numbers: np.ndarray, tips: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """What the scales read (N, 5), by the struts' formula in frames built from cross products."""
    rows, i = numbers.reshape(5, 6), -axes
    p = tips - TOOL * i
    e1 = np.cross(i, [0.0, 1.0, 0.0])
    e1 /= np.linalg.norm(e1, axis=1)[:, None]
    e2 = np.cross(i, e1)
    d = rows[:, :3] - p[:, None]
    x, y, z = (np.einsum("nkc,nc->nk", d, e) for e in (e1, e2, i))
    return np.sqrt((z - rows[:, 3]) ** 2 + (np.sqrt(x * x + y * y) - rows[:, 4]) ** 2) + rows[:, 5]


def poses(n: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Tips and tool axes (N, 3) in the work volume."""
    rng, work = np.random.default_rng(seed), MACHINE.work
    turn, side = rng.uniform(0.0, 2.0 * np.pi, (2, n))
    radius, lean = 0.5 * work.diameter * np.sqrt(rng.random(n)), work.tilt * np.sqrt(rng.random(n))
    tips = work.centre + np.c_[radius * np.cos(turn), radius * np.sin(turn), work.height * (rng.random(n) - 0.5)]
    return tips, np.c_[np.sin(lean) * np.cos(side), np.sin(lean) * np.sin(side), -np.cos(lean)]


def measured(instrument: str, n: int, seed: int, *, noise: float = 1.0, given: bool = True, own_frame: bool = False,
             setups: int = 1, ring: float = 0.0, where: tuple[np.ndarray, np.ndarray] | None = None,
             rng: np.random.Generator | None = None) -> Measurements:  # fmt: skip
    """What an instrument sees of the machine of a seed: readings to 2 um, positions to 10 um, axes to 20 urad."""
    rng = rng or np.random.default_rng(seed + 1000)
    tips, axes = poses(n, seed + 2000) if where is None else where
    legs = readings(true_numbers(seed, ring), tips, axes) + 2e-6 * noise * rng.normal(size=(n, 5))
    places, stations = np.arange(n) % setups, np.random.default_rng(5).normal(size=(setups, 6))
    if instrument == "ballbar":
        balls = MACHINE.work.centre + [0.0, 0.0, 0.15] + 0.2 * stations[:, :3] * (np.arange(setups) > 0)[:, None]
        seen = np.linalg.norm(tips - balls[places], axis=1)[:, None] + 10e-6 * noise * rng.normal(size=(n, 1))
    else:
        seen = tips + 10e-6 * noise * rng.normal(size=(n, 3))
        if instrument in ("pose", "dock"):
            turned = axes + 20e-6 * noise * np.cross(rng.normal(size=axes.shape), axes)
            seen = np.hstack([seen, turned / np.linalg.norm(turned, axis=1)[:, None]])
        for k in range(setups):
            if k or own_frame:
                turn, rows = Rotation.from_rotvec(stations[k, 3:]), places == k
                seen[rows, :3] = turn.apply(seen[rows, :3]) + stations[k, :3]
                seen[rows, 3:] = turn.apply(seen[rows, 3:]) if seen.shape[1] > 3 else seen[rows, 3:]
    return Measurements(
        instrument, legs, seen, TOOL, Component(1, 1), "instrument" if own_frame else "machine", places,
        MACHINE.name, geometry_digest(MACHINE.robot), 2e-6 if given else None, 10e-6,
        20e-6 if instrument in ("pose", "dock") else 0.0,
    )  # fmt: skip


def reached(numbers: np.ndarray, legs: np.ndarray, near: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Tips (N, 3) of a machine whose legs read `legs`, by SciPy from nearby tips and axes."""
    found = []
    for reading, tip, axis in zip(legs, *near, strict=True):
        across = np.linalg.svd(axis[None])[2][1:]

        def off(x, reading=reading, tip=tip, axis=axis, across=across):
            turned = axis + x[3:] @ across
            pose = (tip + x[:3])[None], (turned / np.linalg.norm(turned))[None]
            return readings(numbers, *pose)[0] - reading

        found.append(tip + least_squares(off, np.zeros(5), xtol=1e-15, ftol=1e-15, gtol=1e-15).x[:3])
    return np.array(found)


def frame_free(points: np.ndarray, onto: np.ndarray) -> np.ndarray:
    """The differences (N, 3) that are left when points are laid on others by a rigid motion."""
    turn, _ = Rotation.align_vectors(onto - onto.mean(axis=0), points - points.mean(axis=0))
    return turn.apply(points - points.mean(axis=0)) + onto.mean(axis=0) - onto
