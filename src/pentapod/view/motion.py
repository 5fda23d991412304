"""Tool motion: tool poses over time in the workpiece frame, so that they move with the part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.values import Value
from pentapod.geometry.directions import normalised
from pentapod.geometry.rigid import RigidTransform
from pentapod.machine.leg_ends import leg_ends
from pentapod.machine.machine import Machine
from pentapod.program import Program
from pentapod.toolpath.toolpath import Toolpath
from pentapod.view.opened_run import OpenedRun

MOST_ROWS = 200_000
"""Rows of a program that are kept; longer ones are thinned."""


@dataclass(frozen=True, eq=False)
class MachinePose:
    """The machine at one pose of the tool, machine frame, metres.

    tip, axis (3,): axis unit, tip → spindle. legs (n_legs,): lengths. within: whether each leg is within its stroke.
    bases, joints (n_legs, 3): ends of the legs.
    """

    tip: Floats
    axis: Floats
    legs: Floats
    within: tuple[bool, ...]
    bases: Floats
    joints: Floats


@dataclass(frozen=True, eq=False)
class ToolMotion(Value):
    """Tool poses over time, workpiece frame: times (N,) in seconds, tips and axes (N, 3), tip → spindle."""

    times: Floats
    tips: Floats
    axes: Floats

    @classmethod
    def of(cls, run: OpenedRun) -> ToolMotion:
        """Return the motion of a run: of its program, else along its toolpath."""
        if run.program is None:
            return cls.of_toolpath(run.toolpath, run.machine)
        return cls.of_program(run.program, run.machine)

    @classmethod
    def of_program(cls, program: Program, machine: Machine) -> ToolMotion:
        """Return the motion of a program."""
        rows = np.unique(np.linspace(0, len(program.legs) - 1, min(len(program.legs), MOST_ROWS)).astype(np.intp))
        position, direction = machine.robot.pose(program.legs[rows], program.component)
        back = program.placement.inverse()
        tips = back.apply(position + machine.tool_length * direction)
        return cls(program.times[rows], tips, back.rotate(-direction))

    @classmethod
    def of_toolpath(cls, toolpath: Toolpath, machine: Machine) -> ToolMotion:
        """Return the motion along a toolpath at its feeds, without acceleration limits."""
        way = np.linalg.norm(np.diff(toolpath.tips, axis=0), axis=1)
        feeds = np.array([min(segment.feed, machine.rapid_velocity) for segment in toolpath.segments])
        seconds = np.maximum(way / feeds[toolpath.segment_of_interval], 1e-6)
        return cls(np.concatenate([[0.0], np.cumsum(seconds)]), toolpath.tips, toolpath.axes)

    @property
    def duration(self) -> float:
        """Seconds from the first to the last pose."""
        return float(self.times[-1])

    def pose(self, time: float) -> tuple[Floats, Floats]:
        """Return tip and axis (3,), workpiece frame, at a time in seconds, linear between rows."""
        tip, axis = (np.array([np.interp(time, self.times, c) for c in rows.T]) for rows in (self.tips, self.axes))
        return tip, normalised(axis)

    def machine_pose(self, time: float, machine: Machine, placement: RigidTransform) -> MachinePose:
        """Return the machine's pose at a time, with the part at a placement."""
        tip, axis = self.pose(time)
        tip, axis = placement.apply(tip), placement.rotate(axis)
        bases, joints = leg_ends(machine, tip, axis)
        legs = machine.robot.leg_lengths(tip + machine.tool_length * axis, -axis)
        within = (legs >= machine.legs.min_length) & (legs <= machine.legs.max_length)
        return MachinePose(tip, axis, legs, tuple(bool(k) for k in within), bases, joints)
