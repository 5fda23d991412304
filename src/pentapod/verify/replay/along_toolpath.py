"""The motion of a tool exactly along a toolpath, for claims about the surface before there is a program."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.values import Value
from pentapod.geometry.polyline import arc_length
from pentapod.toolpath.toolpath import Toolpath
from pentapod.verify.replay.interval_bounds import IntervalBounds
from pentapod.verify.replay.replay import OfSamples, Replay
from pentapod.verify.verdict.specification import Specification


@dataclass(frozen=True, eq=False)
class AlongToolpath(Value):
    """The tool on the toolpath of a specification, with its axes: samples are waypoints, and nothing deviates.

    A ball about the tilt centre moves so whatever the axes of the program.
    """

    specification: Specification

    @property
    def toolpath(self) -> Toolpath:
        """The toolpath, workpiece frame."""
        return self.specification.toolpath

    @cached_property
    def kept(self) -> dict[Any, Any]:
        """As of a replay."""
        return {}

    @cached_property
    def tilt_centres(self) -> OfSamples:
        """Tilt centres (M, 3) at the waypoints, workpiece frame, metres."""
        centres = self.toolpath.tilt_centres
        return OfSamples(len(centres), lambda rows: centres[rows])

    @cached_property
    def axes(self) -> OfSamples:
        """Tool axes (M, 3) at the waypoints, tip → spindle, workpiece frame."""
        axes = self.toolpath.axes
        return OfSamples(len(axes), lambda rows: axes[rows])

    @cached_property
    def interval_bounds(self) -> IntervalBounds:
        """No deviation from the chords between waypoints."""
        nothing = np.zeros(len(self.toolpath) - 1)
        return IntervalBounds(
            self.toolpath.tilt_centres, self.toolpath.axes, nothing, nothing, np.zeros((len(nothing), 3))
        )

    @cached_property
    def arcs(self) -> Floats:
        """How far along the toolpath the waypoints (M,) are, metres."""
        return arc_length(self.toolpath.tilt_centres)


Motion = Replay | AlongToolpath
"""What a claim about the surface is judged on."""
