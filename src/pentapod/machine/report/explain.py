"""A machine's report as plain text."""

from __future__ import annotations

import numpy as np

from pentapod.kinematics.families.quadratic import as_quadratic
from pentapod.machine.report.check import MachineReport


def explain(report: MachineReport) -> str:
    """Return the text of `pentapod machine check`: the machine, its legs, its worst places, the answer."""
    m = report.machine
    work, legs = m.work, m.legs
    centre = ", ".join(f"{1e3 * c:.0f}" for c in work.centre)
    lines = [
        f"machine {m.name} ({m.digest})",
        f"  work volume: tips in a cylinder of {1e3 * work.diameter:.0f} mm diameter and "
        f"{1e3 * work.height:.0f} mm height",
        f"    around ({centre}) mm; tool axes within {np.degrees(work.tilt):.3g}° of -z",
        f"  tool {1e3 * m.tool_length:.1f} mm from the line's origin, "
        f"{1e3 * (m.tool_length - m.robot.offsets.max()):.1f} mm beyond the lowest platform joint; "
        f"delta {as_quadratic(m.robot, 'this report').delta:.6g}",
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
    component = "several: a singularity runs through it" if report.component is None else str(report.component)
    lines += [
        "",
        f"  component                             {component}",
        f"  least |w|                             {report.least_w:.3f}",
        f"  distance to the plane S = 0           {1e3 * report.least_s:.0f} mm",
        f"  turn about the tip to a singularity   {np.degrees(report.least_turn):.1f}°",
        f"  tip force to leg forces               {report.amplification:.2f} N/N",
        f"  smallest clearance                    {1e3 * report.clearance:.1f} mm ({report.clearance_pair})",
        f"  architectural measure                 {m.architecture:.4f}",
        "",
    ]
    failed = [finding for finding in report.findings if not finding.passed]
    if not failed:
        return "\n".join([*lines, "The machine keeps its own limits everywhere in its work volume."])
    lines.append("The machine does not keep its own limits in its work volume:")
    for finding in failed:
        place = f" at {finding.where}" if finding.where else ""
        wanted = f"must be {finding.kind} {finding.limit:.4g}"
        lines.append(f"  {finding.name}: {finding.value:.4g} {finding.unit}, {wanted}{place}")
    return "\n".join(lines)
