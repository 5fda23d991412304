"""What a run says of its placement and its time law."""

from __future__ import annotations

from pentapod.base.refusal import Refusal
from pentapod.machine.machine import Machine
from pentapod.planning import LegPath, PlacedPath
from pentapod.program import Program
from pentapod.timing import Explanation, Trajectory, certify, explain, slow_cuts
from pentapod.toolpath import Toolpath

UPRIGHT = "the tool does not lean, as it would touch the part"
"""What is said of a placement with the toolpath's axes."""

STRAIGHT = "the tool keeps one direction, as it would touch the part"
"""What is said of a placement with one axis everywhere."""


def explanation(
    path: LegPath, trajectory: Trajectory, program: Program, machine: Machine, toolpath: Toolpath
) -> Explanation:
    """Return which limits hold a program's motion, and where a beam is slower than its feed."""
    position, direction = machine.robot.pose(program.legs, program.component)
    tips = position + machine.tool_length * direction
    # A beam or a spray needs constant speed on the surface; a cutter only has an upper bound.
    beam, period = toolpath.tilt_centre < 0.0, machine.controller.period
    slow = slow_cuts(trajectory, period, path.surface_rate) if beam else ()
    spot = toolpath.tilt_centre if beam else 0.0
    uses = certify(trajectory, machine, legs=program.legs, tips=tips, axes=-direction, spot=spot)
    return explain(trajectory, machine, uses, slow)


def placement_remarks(placed: PlacedPath | Refusal) -> str:
    """Return the positions of guides, a common direction of the tool, and what the choice of placement has to tell."""
    if isinstance(placed, Refusal):
        return ""
    chosen = placed.placement
    lines = [f"guides 1 to 5 at {chosen.guides}"] if chosen.guides else []
    lines += [f"tool axis: {placed.common_axis}; {placed.lean}"] if placed.common_axis is not None else []
    if any(word in chosen.chosen_by for word in ("interrupted", UPRIGHT, STRAIGHT)):
        lines.append(f"placement: {chosen.chosen_by}; smallest margin {placed.smallest_margin:.3f}")
    return "\n".join(lines)
