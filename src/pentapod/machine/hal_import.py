"""pentakins configurations of LinuxCNC as machines: base joints, rings and platform joints from a HAL file.

What HAL does not say (joints, bodies, controller) is taken from a machine like it, and the limits of the legs from the
ini file, where it is given. Frames: in pentakins z is along the upright tool and XYZ is the tip; in the machine's frame
z points the other way, and its zero is in the middle of the base joints. Home is pentakins' zero.
"""

from __future__ import annotations

import configparser
import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import MachineError
from pentapod.base.files import number_in
from pentapod.base.toml import read_toml
from pentapod.base.units import from_si, to_si
from pentapod.base.values import Value
from pentapod.geometry.directions import angle_between
from pentapod.kinematics.families.ringed import UPRIGHT, RingedPentapod
from pentapod.kinematics.five_legs import FiveLegs
from pentapod.machine.families import PENTAKINS

LEGS = FiveLegs.n_legs
_SETP = re.compile(r"\s*setp\s+pentakins\.(\S+)\s+(\S+)")
_LIMITS = {
    "min_length_mm": "MIN_LIMIT",
    "max_length_mm": "MAX_LIMIT",
    "max_velocity_mm_s": "MAX_VELOCITY",
    "max_acceleration_mm_s2": "MAX_ACCELERATION",
}
_NAMES = [
    *(f"base.{k}.{axis}" for k in range(LEGS) for axis in "xyz"),
    *(f"effector.{k}.{axis}" for k in range(LEGS) for axis in "rz"),
]


@dataclass(frozen=True, eq=False)
class PentakinsGeometry(Value):
    """What pentakins is told, metres, its frame. base (5, 3), radii and heights (5,): of the rings above the tip."""

    base: Floats
    radii: Floats
    heights: Floats


def read_pentakins(path: str | Path) -> PentakinsGeometry:
    """Return the geometry of a HAL file. Raises MachineError with file and line."""
    file = Path(path)
    text = read_toml(file, "HAL", MachineError)
    values = dict[str, float]()
    for line, row in enumerate(text.splitlines(), start=1):
        found = _SETP.match(row)
        if not found or found[1] not in (*_NAMES, "tool-offset", "screw-lead"):
            continue
        value = number_in(found[2])
        if value is None:
            raise MachineError("not a number", file=file, line=line, key=f"pentakins.{found[1]}", value=found[2])
        if found[1] in ("tool-offset", "screw-lead") and value != 0.0:
            raise MachineError(
                "this parameter is not read",
                file=file,
                line=line,
                key=f"pentakins.{found[1]}",
                value=value,
                expected="0",
            )
        values[found[1]] = value
    missing = [name for name in _NAMES if name not in values]
    if missing:
        raise MachineError(
            "not a configuration of pentakins" if len(missing) == len(_NAMES) else "a parameter is missing",
            file=file, key=f"pentakins.{missing[0]}", expected=f"setp pentakins.{missing[0]} NUMBER, in mm",
        )  # fmt: skip
    numbers = to_si(np.array([values[name] for name in _NAMES]), "mm")
    rings = numbers[3 * LEGS :].reshape(LEGS, 2)
    return PentakinsGeometry(numbers[: 3 * LEGS].reshape(LEGS, 3), rings[:, 0], rings[:, 1])


def read_limits(path: str | Path) -> dict[str, list[float]]:
    """Return the keys of [legs] that an ini file of LinuxCNC has, in mm. Raises MachineError."""
    file = Path(path)
    ini = configparser.ConfigParser(strict=False, interpolation=None)
    try:
        ini.read_string(read_toml(file, "ini", MachineError))
    except configparser.Error as error:
        raise MachineError("not an ini file", file=file, value=str(error).splitlines()[0]) from error
    found: dict[str, list[float]] = {}
    for key, word in _LIMITS.items():
        texts = [ini.get(f"JOINT_{k}", word, fallback="") for k in range(LEGS)]
        values = [number_in(text) for text in texts]
        for k, value in enumerate(values):
            if value is None:
                raise MachineError(
                    "no number", file=file, key=f"[JOINT_{k}] {word}", value=texts[k], expected="millimetres"
                )
        found[key] = [float(value) for value in values if value is not None]
    return found


def machine_text(geometry: PentakinsGeometry, name: str, like: dict[str, Any], limits: dict[str, list[float]]) -> str:
    """Return the text of a machine file. like: content of the machine file that fills the rest; limits: of [legs].

    The joints' cones are put around the legs at home, the platform joints' ranges around their angles there.
    """
    turned, middle = np.array([1.0, -1.0, -1.0]), np.array([0.0, 0.0, geometry.base[:, 2].mean()])
    base, work = (geometry.base - middle) * turned, -middle * turned
    length = to_si(float(like["tool"]["length_mm"]), "mm")
    home = work - length * UPRIGHT
    robot = RingedPentapod(base, length - geometry.heights, geometry.radii, home)
    vectors = robot.leg_vectors(home, UPRIGHT)
    angles = np.degrees(angle_between(-vectors, -UPRIGHT))
    low, high = (np.asarray(like["joints"][f"platform_{end}_deg"], dtype=np.float64) for end in ("min", "max"))
    tables = {
        key: value for key, value in like.items() if isinstance(value, dict) and key not in ("calibration", "guides")
    }
    tables["geometry"] = {
        "family": PENTAKINS,
        "base_mm": _rounded(from_si(base, "mm")),
        "platform_mm": _rounded(from_si(robot.offsets, "mm")),
        "ring_mm": _rounded(from_si(robot.radii, "mm")),
        "home_mm": _rounded(from_si(home, "mm")),
    }
    tables["legs"] = {**tables["legs"], **limits}
    tables["joints"] = {
        **tables["joints"],
        "base_axis": _rounded(vectors / np.linalg.norm(vectors, axis=1)[:, None]),
        "platform_min_deg": _rounded(np.maximum(angles - 0.5 * (high - low), 0.0)),
        "platform_max_deg": _rounded(np.minimum(angles + 0.5 * (high - low), 180.0)),
    }
    lowest = from_si(float(geometry.heights.min()), "mm")
    tables["bodies"] = {**tables["bodies"], "shaft_end_mm": min(float(tables["bodies"]["shaft_end_mm"]), lowest)}
    tables["work"] = {**tables["work"], "centre_mm": _rounded(from_si(work, "mm"))}
    lines = [
        f"name = {json.dumps(name)}",
        'description = "imported from pentakins; all but geometry and limits of the legs is of another machine"',
    ]
    for table, content in tables.items():
        lines += ["", f"[{table}]", *(f"{key} = {json.dumps(value)}" for key, value in content.items())]
    return "\n".join(lines) + "\n"


def _rounded(values: Floats) -> Any:
    return np.round(np.asarray(values, dtype=np.float64) + 0.0, 9).tolist()
