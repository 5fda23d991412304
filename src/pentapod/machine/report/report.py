"""Machine report: the work volume sampled, the worst pose by each limit, and the text of `pentapod machine check`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.values import Value
from pentapod.geometry.directions import angle_between
from pentapod.kinematics.arithmetic import NUMPY
from pentapod.kinematics.families.quadratic import LinearPentapod
from pentapod.kinematics.families.singularities import orientation_distance
from pentapod.kinematics.forces import tip_force_amplification
from pentapod.kinematics.robot import Branch
from pentapod.machine.clearance.leg_clearance import clearances, pair_names
from pentapod.machine.machine import ARCHITECTURAL_LIMIT, Machine
from pentapod.machine.report.drives import DriveReport
from pentapod.machine.report.findings import (
    LIMB_PARTS,
    MachineFinding,
    findings_of_legs,
    findings_of_limb,
    findings_of_park,
    findings_of_rails,
    in_unit,
)
from pentapod.machine.report.softness import Softness
from pentapod.machine.work_volume import sample_work_volume

AMPLIFICATION_LIMIT = 10.0
"""Tip force → leg forces beyond which `check` calls a machine weak: 100 N of cutting become 1 kN of leg."""
LEVELS = 5
"""Heights at which `check` samples the work volume."""


@dataclass(frozen=True, eq=False)
class MachineReport(Value):
    """The worst values over all sampled poses.

    length_range (n_legs, 2) metres; base_angle (n_legs,) largest angle to the base joint's axis, radians;
    platform_range (n_legs, 2) radians; margins: least distance from each of the robot's `singularities`, metres or
    radians by its unit; least_turn: radians of turning about the tip to any singularity, None where no closed form
    gives it; amplification: force of the legs by force at the tip; clearance, metres, and its pair of bodies. branch:
    the one in which all poses lie, or None. drives: what they can do, where the machine limits their forces.
    softness: where the tip yields most, where the machine gives the stiffness of its legs.
    """

    machine: Machine
    poses: int
    length_range: Floats
    base_angle: Floats
    platform_range: Floats
    margins: tuple[float, ...]
    least_turn: float | None
    amplification: float
    clearance: float
    clearance_pair: str
    branch: Branch | None
    findings: tuple[MachineFinding, ...]
    drives: DriveReport | None = None
    softness: Softness | None = None

    @property
    def passed(self) -> bool:
        """Whether the machine keeps its own limits everywhere in its work volume."""
        return all(finding.passed for finding in self.findings)


def check(machine: Machine, *, rings: int = 2, around: int = 16, levels: int = LEVELS) -> MachineReport:
    """Sample the work volume and return the worst value of each quantity.

    rings, around, levels: density of the sample, see `sample_work_volume`. Never raises for a weak machine:
    that is a finding.
    """
    tips, axes = sample_work_volume(machine.work, rings=rings, around=around, levels=levels)
    position, direction = tips + machine.tool_length * axes, -axes
    robot = machine.robot
    vectors = robot.leg_vectors(position, direction)
    lengths = np.linalg.norm(vectors, axis=-1)
    base = angle_between(vectors, machine.joints.base_axes)
    platform = angle_between(-vectors, axes[:, None, :])
    margins = robot.singularity_margins(list(position.T), list(direction.T), robot.branches[0], NUMPY)
    units = [surface.unit for surface in robot.singularities]
    margins = [
        np.abs(m) if unit == "mm" else np.arcsin(np.minimum(np.abs(m), 1.0))
        for m, unit in zip(margins, units, strict=True)
    ]
    turn = None
    if isinstance(robot, LinearPentapod):
        turn = orientation_distance(robot, position, direction, about=machine.tool_length)
    force = tip_force_amplification(robot, position, direction, machine.tool_length)
    gaps = clearances(machine, position, direction)
    limb = np.zeros((len(tips), 0)) if machine.limb is None else machine.limb.at(position, direction)
    met = {tuple(signs) for signs in robot.branch(position, direction).tolist()}  # 0 on a singularity
    one = next((branch for branch in robot.branches if met == {tuple(branch)}), None)
    pair = pair_names(machine)[int(np.argmin(gaps.min(axis=0)))]

    def where(pose: int) -> str:
        at, along = ", ".join(f"{x:.0f}" for x in 1e3 * tips[pose]), ", ".join(f"{x:+.2f}" for x in axes[pose])
        return f"tip ({at}) mm, axis ({along})"

    def worst(name: str, values: Floats, kind: str, limit: float, unit: str) -> MachineFinding:
        pose = int(np.argmax(values) if kind == "at most" else np.argmin(values))
        return MachineFinding(name, values[pose], kind, limit, unit, where(pose))

    nearest = int(np.argmin(np.minimum.reduce(margins)))
    limits = [
        worst(f"distance to {surface.name}", in_unit(values, surface.unit), "more than", 0.0, surface.unit)
        for surface, values in zip(robot.singularities, margins, strict=True)
    ]
    if turn is not None:
        limits.append(worst("turn about the tip to a singularity", np.degrees(turn), "more than", 0.0, "deg"))
    return MachineReport(
        machine=machine,
        poses=len(tips),
        length_range=np.stack([lengths.min(axis=0), lengths.max(axis=0)], axis=1),
        base_angle=base.max(axis=0),
        platform_range=np.stack([platform.min(axis=0), platform.max(axis=0)], axis=1),
        margins=tuple(float(values.min()) for values in margins),
        least_turn=None if turn is None else float(turn.min()),
        amplification=float(force.max()),
        clearance=float(gaps.min()),
        clearance_pair=pair,
        branch=one,
        findings=(
            *findings_of_legs(machine, lengths, base, platform, worst),
            *findings_of_limb(machine, limb, worst),
            MachineFinding("components met", len(met), "at most", 1, "", where(nearest)),
            *limits,
            worst("tip force to leg forces", force, "at most", AMPLIFICATION_LIMIT, "N/N"),
            worst(f"clearance, {pair}", 1e3 * gaps.min(axis=1), "more than", 0.0, "mm"),
            MachineFinding("architectural measure", machine.architecture, "at least", ARCHITECTURAL_LIMIT, ""),
            *findings_of_rails(machine),
            *findings_of_park(machine),
        ),
        drives=DriveReport.of(machine, position, direction, where) if machine.drive_forces.limited else None,
        softness=Softness.of(machine, position, direction, where) if machine.stiffness.given else None,
    )


def _limb_lines(report: MachineReport) -> list[str]:
    """Return the lines about the passive limb: used, and how far it can go."""
    found = [finding for finding in report.findings if finding.name.split(", ")[0] in LIMB_PARTS]
    lines: list[str] = []
    for least, most in zip(found[::2], found[1::2], strict=True):
        unit, name = "°" if least.unit == "deg" else " mm", least.name.removesuffix(", least")
        used = f"{least.value:.1f} to {most.value:.1f}{unit} of {least.limit:.0f} to {most.limit:.0f}{unit}"
        lines.append(f"  {name:<35}   {used}")
    return ["", *lines] if lines else []


def explain(report: MachineReport) -> str:
    """Return the text of `pentapod machine check`: the machine, its legs, its worst poses, the result."""
    m = report.machine
    work, legs = m.work, m.legs
    centre = ", ".join(f"{1e3 * c:.0f}" for c in work.centre)
    lines = [
        f"machine {m.name} ({m.digest})",
        *([f"  as measured: calibration {m.calibration_name}"] if m.calibration_name else []),
        f"  work volume: tips in a cylinder of {1e3 * work.diameter:.0f} mm diameter and "
        f"{1e3 * work.height:.0f} mm height",
        f"    around ({centre}) mm; tool axes within {np.degrees(work.tilt):.3g}° of -z",
        f"  tool {1e3 * m.tool_length:.1f} mm from the line's origin, "
        f"{1e3 * (m.tool_length - m.robot.offsets.max()):.1f} mm beyond the lowest platform joint",
        f"  {_family(m)}",
        f"  rapids {6e4 * m.rapid_velocity:.0f} mm/min; a setpoint every {1e3 * m.controller.period:g} ms, "
        f"{m.controller.interpolation} between them",
        "",
        f"  over {report.poses} poses of the work volume:",
        "  leg   length used (mm)    of stroke (mm)     stroke used   base joint     platform joint",
    ]
    for k in range(m.robot.n_legs):
        low, high = report.length_range[k]
        used = (high - low) / legs.stroke[k]
        least, most = np.degrees(report.platform_range[k])
        lines.append(
            f"  {k + 1}     {1e3 * low:6.1f} to {1e3 * high:6.1f}    "
            f"{1e3 * legs.min_length[k]:5.0f} to {1e3 * legs.max_length[k]:5.0f}     {used:8.0%}    "
            f"{np.degrees(report.base_angle[k]):5.1f}° of {np.degrees(m.joints.base_cone[k]):.0f}°   "
            f"{least:5.1f}° to {most:5.1f}°"
        )
    lines += _limb_lines(report)
    component = "several: a singularity runs through it" if report.branch is None else str(report.branch)
    lines += ["", f"  component                             {component}"]
    for surface, margin in zip(m.robot.singularities, report.margins, strict=True):
        far = f"{1e3 * margin:.0f} mm" if surface.unit == "mm" else f"{np.degrees(margin):.1f}°"
        lines.append(f"  {surface.name:<35}   {far} away")
    if report.least_turn is not None:
        lines.append(f"  turn about the tip to a singularity   {np.degrees(report.least_turn):.1f}°")
    lines += [
        f"  tip force to leg forces               {report.amplification:.2f} N/N",
        f"  smallest clearance                    {1e3 * report.clearance:.1f} mm ({report.clearance_pair})",
        f"  architectural measure                 {m.architecture:.4f}",
        *(f"  {found.name:<35}   {found.value:.2f}" for found in findings_of_rails(m)),
        *([] if report.softness is None else report.softness.lines()),
        *([] if report.drives is None else report.drives.lines(m)),
        "",
    ]
    failed = [finding for finding in report.findings if not finding.passed]
    if not failed:
        return "\n".join([*lines, "The machine keeps its own limits everywhere in its work volume."])
    lines.append("The machine does not keep its own limits:")
    for finding in failed:
        place = f" at {finding.where}" if finding.where else ""
        wanted = f"must be {finding.kind} {finding.limit:.4g}"
        lines.append(f"  {finding.name}: {finding.value:.4g} {finding.unit}, {wanted}{place}")
    return "\n".join(lines)


def _family(machine: Machine) -> str:
    """Return the line of the text that tells the robot's family, and the guides."""
    robot = machine.robot
    if isinstance(robot, LinearPentapod):
        text = f"quadratic family, delta {robot.delta:.6g}"
    else:
        joints = ", ".join(f"{1e3 * z:.4g}" for z in robot.offsets)
        text = f"{robot.numbers.get('family', 'a')} family, platform joints at {joints} mm along the line"
    if machine.guides is None:
        return text
    travel = ", ".join(f"{1e3 * low:.4g} to {1e3 * high:.4g}" for low, high in machine.guides.travel)
    return f"{text}; base joints on guides, positions {travel} mm"
