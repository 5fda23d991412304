"""pentakins configurations of LinuxCNC as machines: base joints, rings and platform joints from a HAL file.

The geometry becomes a machine file of the general family, base joints moved into their mean plane, and a calibration
file with the joints where they are, off that plane and on rings. What HAL does not say (joints, bodies, controller) is
taken from a machine like it. Frames: in pentakins z is along the upright tool and XYZ is the tip; in the machine's
frame z points the other way, and its zero is the mean plane.
"""

from __future__ import annotations

import datetime
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
from pentapod.kinematics.families.general import GeneralPentapod
from pentapod.kinematics.five_legs import FiveLegs
from pentapod.machine.calibration.record import (
    LARGEST_ERROR,
    CalibrationRecord,
    MeasuredGeometry,
    geometry_digest,
)

LEGS = FiveLegs.n_legs
_SETP = re.compile(r"\s*setp\s+pentakins\.(\S+)\s+(\S+)")
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


def machine_files(
    geometry: PentakinsGeometry, name: str, like: dict[str, Any], calibration: str, date: datetime.date
) -> tuple[str, CalibrationRecord]:
    """Return the text of a machine file and its calibration. like: content of the machine file that fills the rest.

    calibration: name of the calibration's file. Raises MachineError where the base joints are not across the tool.
    """
    mean = float(geometry.base[:, 2].mean())
    base = (geometry.base - [0.0, 0.0, mean]) * [1.0, -1.0, -1.0]
    size = float(np.ptp(base[:, :2], axis=0).max())
    off = float(np.abs(base[:, 2]).max())
    if off > LARGEST_ERROR * size:
        raise MachineError(
            f"the base joints are up to {from_si(off, 'mm'):.4g} mm off a plane across the tool",
            key="pentakins.base.0.z",
            expected=f"at most {LARGEST_ERROR:g} of the base's width: poses are named by the side of that plane",
            remedy="pentapod has no machines whose base lies along the tool",
        )  # fmt: skip
    offsets = to_si(float(like["tool"]["length_mm"]), "mm") - geometry.heights
    designed = GeneralPentapod(base[:, :2].copy(), offsets)
    work = np.array([0.0, 0.0, mean])
    axes = work - base
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    tables = {key: value for key, value in like.items() if isinstance(value, dict)}
    tables["geometry"] = {
        "family": "general",
        "base_mm": _rounded(from_si(designed.base, "mm")),
        "platform_mm": _rounded(from_si(designed.offsets, "mm")),
    }
    tables["joints"] = {**tables["joints"], "base_axis": _rounded(axes)}
    tables["work"] = {**tables["work"], "centre_mm": _rounded(from_si(work, "mm"))}
    tables["calibration"] = {"file": calibration}
    lines = [
        f"name = {json.dumps(name)}",
        'description = "imported from pentakins; all but the geometry is of another machine"',
    ]
    for table, content in tables.items():
        lines += ["", f"[{table}]", *(f"{key} = {json.dumps(value)}" for key, value in content.items())]
    zeros = np.zeros(LEGS)
    # The digest is of the geometry that the file gives back.
    table = tables["geometry"]
    read_back = GeneralPentapod(to_si(table["base_mm"], "mm"), to_si(table["platform_mm"], "mm"))
    record = CalibrationRecord(
        name, geometry_digest(read_back), date, MeasuredGeometry(base, offsets, geometry.radii, zeros)
    )
    return "\n".join(lines) + "\n", record


def _rounded(values: Floats) -> Any:
    return np.round(np.asarray(values, dtype=np.float64) + 0.0, 9).tolist()
