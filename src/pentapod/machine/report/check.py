"""What a machine can do where it is advertised to work: its work volume sampled, its worst poses named."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.values import Value
from pentapod.geometry.directions import angle_between
from pentapod.kinematics.component import Component
from pentapod.kinematics.families.quadratic import as_quadratic
from pentapod.kinematics.families.singularities import orientation_distance, position_distance, singularity_values
from pentapod.kinematics.forces import tip_force_amplification
from pentapod.machine.clearance.leg_clearance import clearances, pair_names
from pentapod.machine.machine import ARCHITECTURAL_LIMIT, Machine
from pentapod.machine.report.work_volume import sample_work_volume

LEVELS = 5
"""Heights at which the work volume is sampled."""

AMPLIFICATION_LIMIT = 10.0
"""Tip force → leg forces beyond which `check` calls a machine weak: 100 N of cutting become 1 kN of leg."""


@dataclass(frozen=True)
class Finding(Value):
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
class MachineReport(Value):
    """What `check` found: the worst over all sampled poses.

    length_range (n_legs, 2) metres; base_angle (n_legs,) largest angle to the base joint's axis, radians;
    platform_range (n_legs, 2) radians; least_w; least_s and least_turn: distance to S = 0 in metres, and to any
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


def check(machine: Machine, *, rings: int = 2, around: int = 16, levels: int = LEVELS) -> MachineReport:
    """Sample the work volume and return the worst of everything.

    rings, around, levels: density of the sample, see `sample_work_volume`. Never raises for a weak machine:
    that is a finding.
    """
    met = _Met.at(machine, *sample_work_volume(machine.work, rings=rings, around=around, levels=levels))
    signs = met.signs
    one = next(iter(signs)) if len(signs) == 1 else (0, 0)
    return MachineReport(
        machine=machine,
        poses=len(met.tips),
        length_range=np.stack([met.lengths.min(axis=0), met.lengths.max(axis=0)], axis=1),
        base_angle=met.base.max(axis=0),
        platform_range=np.stack([met.platform.min(axis=0), met.platform.max(axis=0)], axis=1),
        least_w=float(np.abs(met.w).min()),
        least_s=float(met.s_distance.min()),
        least_turn=float(met.turn.min()),
        amplification=float(met.force.max()),
        clearance=float(met.gaps.min()),
        clearance_pair=met.nearest_pair,
        component=Component(*one) if 0 not in one else None,
        findings=tuple(_of_strokes(met) + _of_joints(met) + _of_the_whole(met)),
    )


@dataclass(frozen=True, eq=False)
class _Met:
    """What a machine meets at N poses: tips, axes (N, 3); SI units.

    lengths (N, n) of the legs; base, platform (N, n): angles in the joints; w, s, s_distance, turn (N,): how near
    singularities are; force (N,): N of the legs for each at the tip; gaps (N, pairs) between bodies.
    """

    machine: Machine
    tips: Floats
    axes: Floats
    lengths: Floats
    base: Floats
    platform: Floats
    w: Floats
    s: Floats
    s_distance: Floats
    turn: Floats
    force: Floats
    gaps: Floats

    @classmethod
    def at(cls, machine: Machine, tips: Floats, axes: Floats) -> _Met:
        position, direction = tips + machine.tool_length * axes, -axes
        robot = as_quadratic(machine.robot, "the report of a work volume")
        vectors = robot.leg_vectors(position, direction)
        w, s = singularity_values(robot, position, direction)
        return cls(
            machine,
            tips,
            axes,
            np.linalg.norm(vectors, axis=-1),
            angle_between(vectors, machine.joints.base_axes),
            angle_between(-vectors, axes[:, None, :]),
            w,
            s,
            position_distance(robot, position, direction),
            orientation_distance(robot, position, direction, about=machine.tool_length),
            tip_force_amplification(robot, position, direction, machine.tool_length),
            clearances(machine, position, direction),
        )

    @property
    def signs(self) -> set[tuple[int, int]]:
        """The signs of w and S that occur; 0 on a singularity."""
        return {(int(a), int(b)) for a, b in zip(np.sign(self.w), np.sign(self.s), strict=True)}

    @property
    def nearest_pair(self) -> str:
        """The bodies that come nearest to each other, by name."""
        return pair_names(self.machine)[int(np.argmin(self.gaps.min(axis=0)))]

    def where(self, values: Floats) -> str:
        """Return in words at which pose values (N,) are least."""
        tip, axis = self.tips[np.argmin(values)] * 1e3, self.axes[np.argmin(values)]
        at, along = ", ".join(f"{x:.0f}" for x in tip), ", ".join(f"{x:+.2f}" for x in axis)
        return f"tip ({at}) mm, axis ({along})"


def _of_strokes(met: _Met) -> list[Finding]:
    limits, found = met.machine.legs, list[Finding]()
    for k in range(met.machine.robot.n_legs):
        lengths, low, high = 1e3 * met.lengths[:, k], 1e3 * limits.min_length[k], 1e3 * limits.max_length[k]
        found += [
            Finding(f"leg {k + 1} shortest", lengths.min(), "at least", low, "mm", met.where(lengths)),
            Finding(f"leg {k + 1} longest", lengths.max(), "at most", high, "mm", met.where(-lengths)),
        ]
    return found


def _of_joints(met: _Met) -> list[Finding]:
    joints, found = met.machine.joints, list[Finding]()
    for k in range(met.machine.robot.n_legs):
        cone, (least, most) = np.degrees(joints.base_cone[k]), np.degrees(joints.platform_range[k])
        base, seen = np.degrees(met.base[:, k]), np.degrees(met.platform[:, k])
        found += [
            Finding(f"leg {k + 1} base joint", base.max(), "at most", cone, "deg", met.where(-base)),
            Finding(f"leg {k + 1} platform joint, least", seen.min(), "at least", least, "deg", met.where(seen)),
            Finding(f"leg {k + 1} platform joint, most", seen.max(), "at most", most, "deg", met.where(-seen)),
        ]
    return found


def _of_the_whole(met: _Met) -> list[Finding]:
    w, distance, turn, gaps = np.abs(met.w), 1e3 * met.s_distance, np.degrees(met.turn), 1e3 * met.gaps.min(axis=1)
    either, where = np.minimum(w, np.abs(met.s_distance)), met.where
    force, pair, measure = met.force, met.nearest_pair, met.machine.architecture
    return [
        Finding("components met", len(met.signs), "at most", 1, "", where(either)),
        Finding("|w|", w.min(), "more than", 0.0, "", where(w)),
        Finding("distance to S = 0", distance.min(), "more than", 0.0, "mm", where(distance)),
        Finding("turn about the tip to a singularity", turn.min(), "more than", 0.0, "deg", where(turn)),
        Finding("tip force to leg forces", force.max(), "at most", AMPLIFICATION_LIMIT, "N/N", where(-force)),
        Finding(f"clearance, {pair}", gaps.min(), "more than", 0.0, "mm", where(gaps)),
        Finding("architectural measure", measure, "at least", ARCHITECTURAL_LIMIT, ""),
    ]
