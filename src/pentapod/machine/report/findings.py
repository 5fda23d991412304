"""Findings of a machine report: the worst value of a quantity over poses, beside its limit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.values import Value
from pentapod.geometry.directions import angle_between
from pentapod.machine.machine import Machine

LIMB_PARTS = ("carriage on its rail", "strut", "strut's joint")
"""What a passive limb is judged by."""


@dataclass(frozen=True)
class MachineFinding(Value):
    """The worst value of one quantity over the work volume.

    value and limit in `unit`; kind: "at most", "at least" or "more than". where: tip (mm) and tool axis of the worst
    pose, as text; empty where the value does not depend on the pose.
    """

    name: str
    value: float
    kind: str
    limit: float
    unit: str
    where: str = ""

    @property
    def passed(self) -> bool:
        """Whether the value keeps the limit."""
        if self.kind == "at most":
            return self.value <= self.limit
        return self.value >= self.limit if self.kind == "at least" else self.value > self.limit


def in_unit(margin: Floats, unit: str) -> Floats:
    """Return distances in millimetres or degrees."""
    return 1e3 * margin if unit == "mm" else np.degrees(margin)


def findings_of_legs(
    machine: Machine, lengths: Floats, base: Floats, platform: Floats, worst: Callable[..., MachineFinding]
) -> list[MachineFinding]:
    """Return the worst values of strokes and joints. lengths, metres, and angles in the joints, radians: (N, n)."""
    legs, joints, count, found = machine.legs, machine.joints, machine.robot.n_legs, list[MachineFinding]()
    for k in range(count):
        low, high = 1e3 * legs.min_length[k], 1e3 * legs.max_length[k]
        found += [
            worst(f"leg {k + 1} shortest", 1e3 * lengths[:, k], "at least", low, "mm"),
            worst(f"leg {k + 1} longest", 1e3 * lengths[:, k], "at most", high, "mm"),
        ]
    for k in range(count):
        cone, (least, most) = np.degrees(joints.base_cone[k]), np.degrees(joints.platform_range[k])
        seen = np.degrees(platform[:, k])
        found += [
            worst(f"leg {k + 1} base joint", np.degrees(base[:, k]), "at most", cone, "deg"),
            worst(f"leg {k + 1} platform joint, least", seen, "at least", least, "deg"),
            worst(f"leg {k + 1} platform joint, most", seen, "at most", most, "deg"),
        ]
    return found


def findings_of_park(machine: Machine) -> list[MachineFinding]:
    """Return the limits of strokes and joints that the park pose exceeds."""
    if machine.park.pose is None:
        return []
    tip, axis = machine.park.pose
    vectors = machine.robot.leg_vectors((tip + machine.tool_length * axis)[None], -axis[None])
    base, platform = angle_between(vectors, machine.joints.base_axes), angle_between(-vectors, axis)

    def parked(name: str, values: Floats, *limit: Any) -> MachineFinding:
        return MachineFinding(f"park pose, {name}", float(values[0]), *limit)

    found = findings_of_legs(machine, np.linalg.norm(vectors, axis=-1), base, platform, parked)
    return [finding for finding in found if not finding.passed]


def findings_of_limb(machine: Machine, at: Floats, worst: Callable[..., MachineFinding]) -> list[MachineFinding]:
    """Return the worst values of the passive limb, from what it measures in the poses (N, 3)."""
    limb, found = machine.limb, list[MachineFinding]()
    if limb is None:
        return found
    ranges = (limb.carriage, limb.strut, limb.joint_range)
    for k, (name, ends, unit) in enumerate(zip(LIMB_PARTS, ranges, ("mm", "mm", "deg"), strict=True)):
        values, (least, most) = in_unit(at[:, k], unit), in_unit(ends, unit)
        found += [
            worst(f"{name}, least", values, "at least", least, unit),
            worst(f"{name}, most", values, "at most", most, unit),
        ]
    return found


def findings_of_rails(machine: Machine) -> list[MachineFinding]:
    """Return whether F of the paper keeps its sign at all ends of the rails, as a share of its value in between.

    On rails along y F is affine in each position: then it keeps its sign everywhere between the ends, too.
    """
    guides = machine.guides
    if guides is None:
        return []
    ends = guides.determinant(np.array(list(product(*guides.travel))))
    home = float(guides.determinant(np.zeros(len(guides.travel))))
    return [MachineFinding("least F on the rails, by that at home", float((ends / home).min()), "more than", 0.0, "")]
