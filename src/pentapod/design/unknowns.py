"""Unknowns: the numbers that a search varies, and the geometry that they make."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.values import Value
from pentapod.design.geometry import Geometry
from pentapod.kinematics.families.quadratic import LinearPentapod
from pentapod.machine.machine import Machine

DIGITS = {"delta": 4, "tilt": 3}
"""Decimals to which numbers are rounded, SI; lengths to 0.1 mm."""
LENGTH_DIGITS = 4

_CENTRE = ("centre_x", "centre_y", "centre_z")


@dataclass(frozen=True, eq=False)
class Unknowns(Value):
    """Names and ranges of what varies, one for each number of a design's vector; the rest is of `start`.

    names (n,), low, high (n,): SI.
    """

    start: Geometry
    names: tuple[str, ...]
    low: Floats
    high: Floats

    @classmethod
    def of(cls, machine: Machine, ranges: dict[str, Floats]) -> Unknowns:
        """Return the unknowns of ranges (least, greatest) by their names in [unknowns], SI."""
        robot, work = machine.robot, machine.work
        delta = robot.delta if isinstance(robot, LinearPentapod) and "platform" not in ranges else None
        start = Geometry(
            robot.base_joints[:, :2], robot.offsets, delta,
            machine.tool_length, work.centre, work.diameter, work.height, work.tilt, machine.bodies,
        )  # fmt: skip
        if start.delta is not None:  # the line's origin where offsets are delta · x
            shift = float(start.offsets[0] - start.delta * start.base[0, 0])
            start = dataclasses.replace(
                start, offsets=start.delta * start.base[:, 0], tool_length=start.tool_length - shift
            )
        counts = {"base": start.base.size, "platform": len(start.offsets)}
        names = tuple(name for name in ranges for _ in range(counts.get(name, 1)))
        low, high = (np.array([ranges[name][end] for name in names]) for end in (0, 1))
        return cls(start, names, low, high)

    def vector(self) -> Floats:
        """Return the start as a vector (n,), within the ranges."""
        start = self.start
        values: dict[str, Any] = {
            "base": start.base.ravel(), "delta": [start.delta], "platform": start.offsets,
            "beyond": [start.tool_length - start.offsets.max()], "diameter": [start.diameter],
            "height": [start.height], "tilt": [start.tilt],
        } | {name: [value] for name, value in zip(_CENTRE, start.centre.tolist(), strict=True)}  # fmt: skip
        found = np.concatenate([values[name] for name in dict.fromkeys(self.names)]).astype(np.float64)
        return np.clip(found, self.low, self.high)

    def design(self, vector: Floats) -> Geometry:
        """Return the geometry of a vector (n,), rounded as in the machine's file."""
        start, parts = self.start, dict[str, Floats]()
        for name in dict.fromkeys(self.names):
            chosen = vector[np.array([other == name for other in self.names])]
            parts[name] = np.round(chosen, DIGITS.get(name, LENGTH_DIGITS))
        one = {name: float(values[0]) for name, values in parts.items()}
        base = parts["base"].reshape(-1, 2) if "base" in parts else start.base
        delta = None if start.delta is None else one.get("delta", start.delta)
        offsets = parts.get("platform", start.offsets) if delta is None else delta * base[:, 0]
        beyond = one.get("beyond", start.tool_length - float(start.offsets.max()))
        return Geometry(
            base, offsets, delta, round(float(offsets.max()) + beyond, LENGTH_DIGITS),
            np.array([one.get(name, old) for name, old in zip(_CENTRE, start.centre.tolist(), strict=True)]),
            one.get("diameter", start.diameter), one.get("height", start.height), one.get("tilt", start.tilt),
            start.bodies,
        )  # fmt: skip
