"""What a machine can do where it is advertised to work: its work volume sampled, its worst poses named."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.arrays import Floats
from pentapod.geometry.directions import angle_between
from pentapod.kinematics.component import Component
from pentapod.kinematics.forces import tip_force_amplification
from pentapod.kinematics.singularities import orientation_distance, position_distance, singularity_values
from pentapod.machine.clearance import clearances, pair_names
from pentapod.machine.machine import ARCHITECTURAL_LIMIT, Machine
from pentapod.machine.work_volume import sample_work_volume

AMPLIFICATION_LIMIT = 10.0
"""Tip force → leg forces beyond which `check` calls a machine weak: 100 N of cutting become 1 kN of leg."""


@dataclass(frozen=True)
class Finding:
    """One worst value over the work volume.

    value and limit in `unit`; `kind` says how they compare: "at most", "at least", or "more than". where: tip
    (mm) and tool axis of the worst pose, as text; empty where it does not depend on the pose.
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


@dataclass(frozen=True, eq=False)
class MachineReport:
    """What `check` found: the worst over all sampled poses.

    length_range (5, 2) metres; base_angle (5,) largest angle to the base joint's axis, radians;
    platform_range (5, 2) radians; least_w; least_s and least_turn: distance to S = 0 in metres, and to any
    singularity in radians of turning about the tip; amplification; clearance (m) and its pair. component: the
    one all poses lie in, or None.
    """

    machine: Machine
    poses: int
    length_range: Floats
    base_angle: Floats
    platform_range: Floats
    least_w: float
    least_s: float
    least_turn: float
    amplification: float
    clearance: float
    clearance_pair: str
    component: Component | None
    findings: tuple[Finding, ...]

    @property
    def passed(self) -> bool:
        """Whether the machine keeps its own limits everywhere in its work volume."""
        return all(finding.passed for finding in self.findings)


def check(machine: Machine, *, rings: int = 2, around: int = 16, levels: int = 5) -> MachineReport:
    """Sample the work volume and return the worst of everything.

    rings, around, levels: density of the sample, see `sample_work_volume`. Never raises for a weak machine:
    that is a finding.
    """
    tips, axes = sample_work_volume(machine.work, rings=rings, around=around, levels=levels)
    position, direction = tips + machine.tool_length * axes, -axes
    robot, joints = machine.pentapod, machine.joints
    vectors = robot.leg_vectors(position, direction)
    lengths = np.linalg.norm(vectors, axis=-1)
    base = angle_between(vectors, joints.base_axes)
    platform = angle_between(-vectors, axes[:, None, :])
    w, s = singularity_values(robot, position, direction)
    s_distance = position_distance(robot, position, direction)
    turn = orientation_distance(robot, position, direction, about=machine.tool_length)
    force = tip_force_amplification(robot, position, direction, machine.tool_length)
    gaps = clearances(machine, position, direction)
    names = pair_names(machine)

    def where(values: Floats) -> str:
        tip, axis = tips[np.argmin(values)] * 1e3, axes[np.argmin(values)]
        at, along = ", ".join(f"{x:.0f}" for x in tip), ", ".join(f"{x:+.2f}" for x in axis)
        return f"tip ({at}) mm, axis ({along})"

    signs = {(int(a), int(b)) for a, b in zip(np.sign(w), np.sign(s), strict=True)}
    one = next(iter(signs)) if len(signs) == 1 else (0, 0)
    component = Component(*one) if 0 not in one else None
    pair = int(np.argmin(gaps.min(axis=0)))
    limits = machine.legs
    short, long = lengths - limits.min_length, limits.max_length - lengths
    findings: list[Finding] = []
    for k in range(5):
        low, high = 1e3 * limits.min_length[k], 1e3 * limits.max_length[k]
        findings += [
            Finding(f"leg {k + 1} shortest", 1e3 * lengths[:, k].min(), "at least", low, "mm", where(short[:, k])),
            Finding(f"leg {k + 1} longest", 1e3 * lengths[:, k].max(), "at most", high, "mm", where(long[:, k])),
        ]
    for k in range(5):
        cone, (least, most) = np.degrees(joints.base_cone[k]), np.degrees(joints.platform_range[k])
        seen = np.degrees(platform[:, k])
        findings += [
            Finding(
                f"leg {k + 1} base joint",
                np.degrees(base[:, k].max()),
                "at most",
                cone,
                "deg",
                where(-base[:, k]),
            ),
            Finding(f"leg {k + 1} platform joint, least", seen.min(), "at least", least, "deg", where(seen)),
            Finding(f"leg {k + 1} platform joint, most", seen.max(), "at most", most, "deg", where(-seen)),
        ]
    findings += [
        Finding("components met", len(signs), "at most", 1, "", where(np.minimum(np.abs(w), np.abs(s_distance)))),
        Finding("|w|", np.abs(w).min(), "more than", 0.0, "", where(np.abs(w))),
        Finding("distance to S = 0", 1e3 * s_distance.min(), "more than", 0.0, "mm", where(s_distance)),
        Finding(
            "turn about the tip to a singularity",
            np.degrees(turn.min()),
            "more than",
            0.0,
            "deg",
            where(turn),
        ),
        Finding("tip force to leg forces", force.max(), "at most", AMPLIFICATION_LIMIT, "N/N", where(-force)),
        Finding(f"clearance, {names[pair]}", 1e3 * gaps.min(), "more than", 0.0, "mm", where(gaps.min(axis=1))),
        Finding("architectural measure", machine.architecture, "at least", ARCHITECTURAL_LIMIT, ""),
    ]
    return MachineReport(
        machine=machine,
        poses=len(tips),
        length_range=np.stack([lengths.min(axis=0), lengths.max(axis=0)], axis=1),
        base_angle=base.max(axis=0),
        platform_range=np.stack([platform.min(axis=0), platform.max(axis=0)], axis=1),
        least_w=float(np.abs(w).min()),
        least_s=float(s_distance.min()),
        least_turn=float(turn.min()),
        amplification=float(force.max()),
        clearance=float(gaps.min()),
        clearance_pair=names[pair],
        component=component,
        findings=tuple(findings),
    )
