"""Random jobs: a strategy, a part, a tool and tool axes of each seed, as a user might put them together."""

from __future__ import annotations

import numpy as np

import concave_parts
from pentapod.job import Job
from pentapod.mesh.io.stl import write_stl

STRATEGIES = {
    "raster": lambda rng: {
        "direction_deg": float(rng.uniform(0.0, 180.0)),
        "steep_deg": float(rng.uniform(40.0, 75.0)),
    },
    "cross-hatch": lambda rng: {"angle_deg": float(rng.uniform(40.0, 90.0))},
    "waterline": lambda rng: {"shallowest_deg": float(rng.uniform(5.0, 30.0))},
    "offset": lambda rng: {},
    "spiral": lambda rng: {"form": str(rng.choice(["offset", "planar"]))},
    "pencil": lambda rng: {},
}
WIDTH_MM = 45.0


def random_job(seed: int, folder) -> tuple[Job, str]:
    """Write the part of a seed into a folder, and return its job and a line about it."""
    rng = np.random.default_rng(seed)
    name = str(rng.choice(list(concave_parts.GENERATED)))
    strategy = str(rng.choice(list(STRATEGIES)))
    mesh = concave_parts.mesh(name)
    scale = 1e-3 * WIDTH_MM / np.ptp(mesh.bounds, axis=0).max()
    (folder / "part.stl").write_bytes(write_stl(1e3 * scale * mesh.vertices[mesh.faces], name))
    ball = strategy == "pencil" or rng.random() < 0.7
    diameter = float(np.round(rng.uniform(3.0, 7.0), 1))
    tool = {"type": "ball" if ball else str(rng.choice(["bull", "flat"])), "diameter_mm": diameter}
    if tool["type"] == "bull":
        tool["corner_mm"] = float(np.round(0.25 * diameter, 2))
    if rng.random() < 0.5:
        tool["shank_mm"] = [[60.0, 0.8 * diameter, 0.8 * diameter]]
    lean, turn = np.radians(rng.uniform(0.0, 30.0)), rng.uniform(0.0, 2.0 * np.pi)
    direction = [np.sin(lean) * np.cos(turn), np.sin(lean) * np.sin(turn), np.cos(lean)]
    mode = str(rng.choice(["fixed", "fixed", "auto"]))
    axis = {"mode": mode} | ({"direction": [float(v) for v in direction]} if mode == "fixed" else {})
    if mode == "fixed" and not ball:
        axis["tilt_deg"] = 0.0
    stepover = {} if strategy == "pencil" else {"stepover_mm": float(np.round(rng.uniform(0.4, 0.7) * diameter, 2))}
    tables = {
        "part": {"mesh": "part.stl", "unit": "mm"},
        "machine": {"name": "desk"},
        "tool": tool,
        "toolpath": {"strategy": strategy, **stepover, **STRATEGIES[strategy](rng)},
        "axis": axis,
        "feed": {"cut_mm_min": 1500.0},
        "placement": {"mode": "table", "table_z_mm": 460.0},
    }
    line = f"{name}, {strategy}, {tool['type']} {diameter:g} mm, {mode}"
    return Job.from_dict(tables, folder), line
