"""machine.toml of a design: the start's file with another geometry, and limits that hold everything that was proven."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import MachineError
from pentapod.base.toml import parsed
from pentapod.base.units import from_si
from pentapod.design.design_file import DesignFile
from pentapod.design.geometry import Geometry
from pentapod.machine.reader import machine_bytes

TENTHS = 10.0
"""Limits are rounded outwards to a tenth of a millimetre or degree."""


def outward(worst: dict[str, float]) -> dict[str, float]:
    """Return the worst figures with those that become limits of the machine rounded outwards."""
    rounded = dict(worst)
    for name, unit, way in (
        ("shortest_leg", "mm", math.floor), ("longest_leg", "mm", math.ceil), ("base_cone", "deg", math.ceil),
        ("platform_least", "deg", math.floor), ("platform_most", "deg", math.ceil),
    ):  # fmt: skip
        value = way(float(from_si(worst[name], unit)) * TENTHS) / TENTHS
        rounded[name] = value / 1e3 if unit == "mm" else math.radians(value)
    return rounded


def machine_text(file: DesignFile, design: Geometry, worst: dict[str, float], name: str) -> str:
    """Return the text of a design's machine file. worst: its figures, as `outward` rounds them, SI."""
    content = parsed(machine_bytes(file.machine_name).decode("utf-8-sig"), file.machine_name, MachineError)
    tables: dict[str, Any] = {key: value for key, value in content.items() if isinstance(value, dict)}
    geometry: dict[str, Any] = {"base_mm": _mm(design.base)}
    if design.delta is None:
        geometry = {"family": "general", **geometry, "platform_mm": _mm(design.offsets)}
    else:
        geometry["delta"] = design.delta
    own: dict[str, dict[str, Any]] = {
        "legs": {"min_length_mm": _mm(worst["shortest_leg"]), "max_length_mm": _mm(worst["longest_leg"])},
        "joints": {
            "base_axis": np.round(design.base_axes(), 6).tolist(), "base_cone_deg": _deg(worst["base_cone"]),
            "platform_min_deg": _deg(worst["platform_least"]), "platform_max_deg": _deg(worst["platform_most"]),
        },
        "tool": {"length_mm": _mm(design.tool_length)},
        "work": {
            "centre_mm": _mm(design.centre), "diameter_mm": _mm(design.diameter), "height_mm": _mm(design.height),
            "tilt_deg": _deg(design.tilt),
        },
    }  # fmt: skip
    kept = {key: value for key, value in tables.items() if key not in ("geometry", "calibration")}
    tables = {"geometry": geometry} | kept
    about = f"found by pentapod design from {file.path.name}, search {file.search.seed}"
    lines = [f"name = {json.dumps(name)}", f"description = {json.dumps(about)}"]
    for table, values in tables.items():
        written = values | own.get(table, {})
        lines += ["", f"[{table}]", *(f"{key} = {json.dumps(value)}" for key, value in written.items())]
    return "\n".join(lines) + "\n"


def _mm(values: Floats | float) -> Any:
    return np.round(from_si(np.asarray(values, dtype=np.float64), "mm"), 6).tolist()


def _deg(value: float) -> float:
    return round(float(from_si(value, "deg")), 9)
