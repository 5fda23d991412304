"""Ways: the programs from the machine's park pose to a program's first row, and from its last row back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ProgramError
from pentapod.base.progress import Progress, silent
from pentapod.base.refusal import Refusal
from pentapod.job.ways.names import FILES, IN, OUT
from pentapod.job.ways.route import Pose, route, with_cutter
from pentapod.machine.machine import Machine
from pentapod.planning import PlacedPath, leg_path
from pentapod.planning.limits.limit import LimitKind
from pentapod.program import Program, sample, write_csv
from pentapod.program.joined import SAME_ROW
from pentapod.timing import Limit, Trajectory, retime
from pentapod.toolpath import Segment, SegmentKind, Toolpath
from pentapod.verify import Coverage, Specification

APART = 5e-6
"""Metres, or radians times the tool's length, between the poses of a way that count as its toolpath."""


def ways(
    program: Program,
    specification: Specification,
    *,
    limits: Sequence[Limit] = (),
    kinds: tuple[LimitKind, ...] = (),
    progress: Progress = silent,
) -> dict[str, Program] | Refusal:
    """Return the way in and the way out of a program, by name; {} where the machine has no park pose.

    specification: that of the program, on the machine with its guides where they stand. limits: further ones on the
    time law; kinds: of limits on poses. Returns the refusal of the first way that is not found.
    """
    machine = specification.machine
    park = machine.park.pose
    if park is None:
        return {}
    made: dict[str, Program] = {}
    for name, row in ((IN, 0), (OUT, -1)):
        placed = route(name, pose_of_row(program, machine, row), park, program, specification, kinds)
        if isinstance(placed, Refusal):
            return placed
        trajectory = _timed(reversed_(placed) if name == IN else placed, specification, limits, progress)
        if isinstance(trajectory, Refusal):
            return replace(trajectory, stage=name)
        made[name] = _way(name, trajectory, program, machine)
    return made


def write_ways(made: dict[str, Program], folder: Path) -> None:
    """Write the ways beside the program."""
    for name, way in made.items():
        write_csv(way, folder / FILES[name])


def remove_ways(folder: Path) -> None:
    """Remove the ways of a folder."""
    for file in FILES.values():
        (folder / file).unlink(missing_ok=True)


def pose_of_row(program: Program, machine: Machine, row: int) -> Pose:
    """Return tip and tool axis (3,) at a row of a program, machine frame."""
    (position,), (direction,) = machine.robot.pose(program.legs[row][None], program.component)
    return position + machine.tool_length * direction, -direction


def park_row(machine: Machine) -> Floats:
    """Return the leg lengths (n,) of the park pose. Raises ProgramError where the machine has none."""
    park = machine.park.pose
    if park is None:
        raise ProgramError("the machine has no park pose", key="park.tip_mm", remedy="write [park] in the machine file")
    tip, axis = park
    return machine.robot.leg_lengths(tip + machine.tool_length * axis, -axis)


def specification_of_way(way: Program, specification: Specification) -> Specification:
    """Return what a way is judged against: all limits and clearances; of the toolpath only that it is a rapid.

    Its toolpath is where it goes. Where it must begin and end is for `claims`.
    """
    cutting = specification.cutting
    return replace(
        specification,
        toolpath=_toolpath(way, specification.machine),
        tilt=0.0,
        collision_world=None if specification.collision_world is None else with_cutter(specification),
        cutting=None if cutting is None else replace(cutting, coverage=Coverage.nothing("a way cuts nothing")),
        lowest_share=0.0,
        setups=1,
        missed=None,
    )


def _toolpath(way: Program, machine: Machine) -> Toolpath:
    """Return where a way goes, workpiece frame; rows that are hardly apart count once."""
    position, direction = machine.robot.pose(way.legs, way.component)
    tips = way.placement.inverse().apply(position + machine.tool_length * direction)
    axes = way.placement.inverse().rotate(-direction)
    steps = np.diff(np.hstack([tips, machine.tool_length * axes]), axis=0)
    travelled = np.concatenate([[0.0], np.cumsum(np.linalg.norm(steps, axis=1))])
    kept = np.unique(np.searchsorted(travelled, np.arange(0.0, travelled[-1], APART)))
    kept = np.unique(np.append(kept, len(tips) - 1))
    return Toolpath((Segment(SegmentKind.RAPID, tips[kept], axes[kept], np.inf),))


def reversed_(placed: PlacedPath) -> PlacedPath:
    """Return a route in the other direction."""
    segments = tuple(
        replace(each, tips=each.tips[::-1], axes=each.axes[::-1]) for each in reversed(placed.toolpath.segments)
    )
    toolpath = replace(placed.toolpath, segments=segments)
    return replace(
        placed, toolpath=toolpath, tips=placed.tips[::-1], axes=placed.axes[::-1], margins=placed.margins[::-1]
    )


def _timed(
    placed: PlacedPath, specification: Specification, limits: Sequence[Limit], progress: Progress
) -> Trajectory | Refusal:
    tolerances = {
        "path_tolerance": 0.5 * specification.path_tolerance,
        "axis_tolerance": max(0.5 * specification.axis_tolerance, 1e-4),
    }
    path = leg_path(placed, specification.machine, **tolerances)
    if isinstance(path, Refusal):
        return path
    return retime(path, specification.machine, limits=limits, progress=progress)


def _way(name: str, trajectory: Trajectory, program: Program, machine: Machine) -> Program:
    """Return the rows of a way, with the program's header; the end where it meets the program is that row itself."""
    source = replace(program.provenance, piece=None, left_out=(), upright=False, stepover_share=1.0)
    way = sample(trajectory, machine, program.placement, program.component, source)
    end, row = (-1, program.legs[0]) if name == IN else (0, program.legs[-1])
    legs = way.legs.copy()
    if np.abs(legs[end] - row).max() <= SAME_ROW:
        legs[end] = row
    return replace(way, legs=legs)
