"""The cases of matrix.toml: leg paths of seven kinds as arrays at gridpoints, in any unit and at any scale."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pentapod.geometry.fillet import blended

MATRIX = tomllib.loads((Path(__file__).parent / "matrix.toml").read_text(encoding="utf-8"))


@dataclass(frozen=True)
class Case:
    kind: str
    unit: str
    scale: float
    seed: int

    def __str__(self):
        return f"{self.kind}-{self.unit}-{self.scale:g}-{self.seed}"


def cases():
    return [
        Case(kind, unit, scale, seed)
        for seed in range(MATRIX["seeds"])
        for kind in MATRIX["kinds"]
        for unit in MATRIX["units"]
        for scale in MATRIX["scales_m"]
    ]


def waypoints(kind, rng):
    """Polylines in the plane of tip and lean, about 1 in size: what the kinds are."""
    if kind == "raster":
        x = np.tile([0.0, 1.0, 1.0, 0.0], 4)[: rng.integers(6, 12)]
        return np.column_stack([x, np.repeat(np.arange(8), 2)[: len(x)] * 0.08, 0 * x])
    if kind == "spiral":
        turn = np.linspace(0.0, rng.uniform(6.0, 18.0), 60)
        return np.column_stack([(1.0 + turn) * np.cos(turn), (1.0 + turn) * np.sin(turn), turn]) / (1.0 + turn[-1])
    if kind == "reversal":
        there = np.cumsum(rng.uniform(0.2, 1.0, (3, 3)), axis=0)
        return np.concatenate([there, there[-2::-1]])
    if kind == "rotation":
        lean = np.cumsum(rng.uniform(0.1, 1.0, 6) * rng.choice([-1.0, 1.0], 6))
        return np.column_stack([0 * lean, 0 * lean, lean])
    corners = rng.uniform(0.0, 1.0, (int(rng.integers(4, 9)), 3))
    return np.repeat(corners, 2, axis=0) if kind == "duplicates" else corners


def legs_of(kind, rng, finer=1):
    """Return s (N,) and q', q'' (N, 5), for a path about 1 in size; s without unit."""
    mix = rng.normal(size=(3, 5))
    if kind == "sine":
        s = np.linspace(0.0, 1.0, 240 * finer + 1)
        wave, phase = rng.uniform(2.0, 30.0, 5), rng.uniform(0.0, 6.0, 5)
        return s, np.cos(wave * s[:, None] + phase), -wave * np.sin(wave * s[:, None] + phase)
    points = waypoints(kind, rng)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    u = np.concatenate([[0.0], np.cumsum(steps)])
    keep = np.concatenate([[True], steps > 0.0])
    curve = blended(u[keep], points[keep], lambda off, _: np.linalg.norm(off, axis=1).max(axis=1) > 1e-2)
    knots = np.unique(curve.t)
    fractions = np.arange(4 * finer) / (4 * finer)
    s = np.unique(np.append(knots[:-1, None] + fractions * np.diff(knots)[:, None], knots[-1]))
    if kind == "duplicates":  # gridpoints that come twice
        s = np.sort(np.concatenate([s, rng.choice(s[1:-1], 5)]))
    return s, curve(s, 1) @ mix, curve(s, 2) @ mix


def arrays(case, finer=1):
    """Return s, first, second and ceiling of a case in its own units, on a grid `finer` times as fine as usual.

    Leg lengths and limits in metres (millimetres for "millimetre"); the path parameter in the case's unit.
    """
    rng = np.random.default_rng([case.seed, MATRIX["kinds"].index(case.kind)])
    s, q1, q2 = legs_of(case.kind, rng, finer)
    velocity, acceleration, feed = (
        np.exp(rng.uniform(*np.log(MATRIX["limits"][name]))) for name in ("velocity", "acceleration", "feed")
    )
    # The path is `scale` metres large: legs q(s) = scale · q0(s / scale), s in metres.
    s, q2 = s * case.scale, q2 / case.scale
    per_metre = {
        "metre": 1.0,
        "millimetre": 1e3,
        "index": (len(s) - 1) / s[-1],
        "unit interval": 1.0 / s[-1],
    }[case.unit]
    lengths = 1e3 if case.unit == "millimetre" else 1.0
    first, second = q1 * lengths / per_metre, q2 * lengths / per_metre**2
    with np.errstate(divide="ignore"):
        by_legs = np.square(velocity * lengths / np.abs(first)).min(axis=1)
    ceiling = np.minimum(by_legs, (feed * per_metre) ** 2)
    return s * per_metre, first / (acceleration * lengths), second / (acceleration * lengths), ceiling
