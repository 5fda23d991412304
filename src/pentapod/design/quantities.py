"""Quantities: what a design is measured by, their names in files, and how they are found and proven."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.units import from_si
from pentapod.base.values import Value
from pentapod.design.figures import in_poses
from pentapod.design.geometry import Geometry
from pentapod.design.proof import worst_of
from pentapod.kinematics.forward.line_equations import line_condition
from pentapod.kinematics.forward.quadratic import reciprocal_condition

JOINT_ERROR = 1e-5
"""The error of a joint for which `sensitivity` is told, metres."""

BOUNDED = "bound over all poses of the work volume, by branch and bound"
EXACT = "from the geometry alone"
DERIVED = "from the bounds of "


@dataclass(frozen=True)
class Quantity(Value):
    """A quantity. better: -1 where less is better, 1 where more is. scale: a step that matters, SI.

    means: by what its value is proven.
    """

    name: str
    unit: str
    better: int
    scale: float
    meaning: str
    means: str

    @property
    def key(self) -> str:
        """Its name in files, with the unit."""
        return f"{self.name}_{self.unit}" if self.unit else self.name

    def shown(self, value: float) -> float:
        """Return a value in the unit of files."""
        return float(from_si(value, self.unit))


_ALL = (
    ("amplification", "", -1, 0.5, "norm of the leg forces by force at the tip, at most (N/N)", BOUNDED),
    (
        "stiffness",
        "n_um",
        1,
        1e6,
        "stiffness at the tip in the softest pose and direction, legs alone",
        "amplification",
    ),
    ("sensitivity", "um", -1, 1e-6, "shift of the tip by 10 µm of a base or platform joint, at most", BOUNDED),
    ("footprint", "mm", -1, 0.05, "radius about the origin of the circle that holds the base joints", EXACT),
    ("shortest_leg", "mm", 1, 0.05, "shortest length that a leg takes", BOUNDED),
    ("longest_leg", "mm", -1, 0.05, "longest length that a leg takes", BOUNDED),
    ("stroke", "mm", -1, 0.05, "longest less shortest length", "both lengths"),
    ("stroke_ratio", "", -1, 0.1, "longest by shortest length", "both lengths"),
    ("dead_length", "mm", 1, 0.05, "shortest length less stroke: what a leg has for motor and joints", "both lengths"),
    ("base_cone", "deg", -1, 0.2, "largest angle of a leg to its base joint's axis", BOUNDED),
    ("platform_least", "deg", 1, 0.2, "least angle between leg and tool axis", BOUNDED),
    ("platform_most", "deg", -1, 0.2, "largest angle between leg and tool axis", BOUNDED),
    ("clearance", "mm", 1, 0.01, "least distance between legs, and between legs and spindle", BOUNDED),
    ("singular_distance", "mm", 1, 0.1, "distance from the singular surface S = 0 (quadratic family)", BOUNDED),
    ("top", "mm", 1, 0.05, "distance of the spindle's upper joint from the base plane", EXACT),
    ("platform_gap", "mm", 1, 0.02, "least distance of joints along the platform line", EXACT),
    ("platform_length", "mm", -1, 0.1, "length of the platform line", EXACT),
    ("base_gap", "mm", 1, 0.05, "least distance of base joints", EXACT),
    ("conditioning", "", 1, 0.01, "architectural measure: 0 is singular in every pose", EXACT),
    ("tool_length", "mm", -1, 0.05, "from the platform line's origin to the tip", EXACT),
    ("tilt", "deg", 1, 0.1, "half angle of the cone of tool axes of the work volume", EXACT),
    ("diameter", "mm", 1, 0.05, "diameter of the work volume", EXACT),
    ("height", "mm", 1, 0.05, "height of the work volume", EXACT),
)
QUANTITIES = {row[0]: Quantity(*row[:5], row[5] if row[5] in (BOUNDED, EXACT) else DERIVED + row[5]) for row in _ALL}
"""By name."""

BY_KEY = {quantity.key: quantity for quantity in QUANTITIES.values()}
"""By the key in files."""


def of_geometry(design: Geometry) -> dict[str, float]:
    """Return the quantities that do not depend on poses, SI."""
    base, offsets = design.base, design.offsets
    apart = np.linalg.norm(base[:, None] - base, axis=-1)[np.triu_indices(len(base), 1)]
    general = design.delta is None
    condition = line_condition(base, offsets) if general else reciprocal_condition(base, design.delta or 0.0)
    return {
        "footprint": float(np.linalg.norm(base, axis=1).max()),
        "platform_gap": float(np.diff(np.sort(offsets)).min()),
        "platform_length": float(np.ptp(offsets)),
        "base_gap": float(apart.min()),
        "conditioning": condition,
        "tool_length": design.tool_length,
        "tilt": design.tilt,
        "diameter": design.diameter,
        "height": design.height,
        "top": float(design.centre[2] - 0.5 * design.height + design.levers.min()),
    }


def completed(design: Geometry, worst: dict[str, float], leg_stiffness: float | None) -> dict[str, float]:
    """Return all quantities from the worst figures of a design, SI. leg_stiffness: N/m, where it is given."""
    found = of_geometry(design) | {name: value for name, value in worst.items() if name in QUANTITIES}
    found["top"] = min(found["top"], worst["top"])
    shortest, longest = worst["shortest_leg"], worst["longest_leg"]
    found |= {
        "sensitivity": JOINT_ERROR * worst["sensitivity"],
        "stroke": longest - shortest,
        "stroke_ratio": longest / max(shortest, 1e-9),
        "dead_length": 2.0 * shortest - longest,
        "clearance": min(worst["leg_clearance"], worst["shaft_clearance"]),
    }
    if leg_stiffness is not None:
        found["stiffness"] = leg_stiffness / max(worst["amplification"], 1e-9) ** 2
    return found


def sampled(design: Geometry, tips: Floats, directions: Floats, leg_stiffness: float | None) -> dict[str, float]:
    """Return all quantities of a design, the worst over poses (N, 3)."""
    return completed(design, worst_of(in_poses(design, design.base_axes(), tips, directions)), leg_stiffness)
