"""Clearances between each leg and the bodies on its own platform line: spindle, shank and holder.

A leg that begins on the line, at its platform joint, lies with the line in a plane, and bodies of revolution about the
line are nearest to the leg in that plane. So the problem is two-dimensional and has a closed form: a leg crosses the
line only where it lies along it, that is where the line runs through its base joint.

With θ the angle between leg (seen from its platform joint) and tool axis, the leg runs from (0, h) along
(sin θ, cos θ) in coordinates (distance from the line, height over the tip). The formulas use element-wise
arithmetic only: they serve NumPy arrays and casadi symbols alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.geometry.solids import Solid
from pentapod.kinematics.arithmetic import NUMPY, Arithmetic
from pentapod.machine.clearance.leg_clearance import segment_distance
from pentapod.machine.machine import Machine

_TINY = 1e-18
"""m²: keeps the derivative of a root finite at 0."""


def leg_spindle_gap(machine: Machine, leg: int, cosine: Any, do: Arithmetic) -> Any:
    """Return the gap in metres of a bar that ends on the line from the spindle; cosine: of the angle θ.

    The leg counts from `joint_radius` on. Its distance from the line grows along it, so its nearest point is there.
    """
    bodies, bars = machine.bodies, machine.bars
    sine = _sine(cosine, do)
    height = machine.tool_length - float(bars.offsets[leg]) + bodies.joint_radius * cosine
    top = machine.tool_length - machine.line_top
    beyond = do.most(do.most(height - top, bodies.shaft_end - height), 0.0)
    aside = bodies.joint_radius * sine
    return do.sqrt(aside * aside + beyond * beyond + _TINY) - bodies.shaft_radius - float(bars.radii[leg])


def leg_tool_gap(machine: Machine, solids: Sequence[Solid], leg: int, cosine: Any, length: Any, do: Arithmetic) -> Any:
    """Return the gap in metres of a leg from the nearest of a tool's solids, negative where it runs through one.

    cosine: of θ; length: of the leg, metres. A negative gap is the depth of the leg below a rim of the solid, or of the
    platform joint below the solid's top.
    """
    joint = machine.tool_length - float(machine.bars.offsets[leg])
    sine = _sine(cosine, do)
    end_r, end_h = length * sine, joint + length * cosine
    gaps: list[Any] = []
    for solid in solids:
        low, high = solid.low, solid.high
        found: Any = joint - high
        for radius, height in ((solid.low_radius, low), (solid.high_radius, high)):
            found = do.least(found, _to_rim(radius, joint - height, sine, cosine, length, do))
            aside, off = do.most(end_r - radius, 0.0), end_h - height
            found = do.least(found, do.sqrt(aside * aside + off * off + _TINY))
        step_r, step_h = solid.high_radius - solid.low_radius, high - low
        share = ((end_r - solid.low_radius) * step_r + (end_h - low) * step_h) / (step_r * step_r + step_h * step_h)
        share = do.least(do.most(share, 0.0), 1.0)
        aside, off = end_r - solid.low_radius - share * step_r, end_h - low - share * step_h
        found = do.least(found, do.sqrt(aside * aside + off * off + _TINY)) - solid.rounding
        gaps.append(found)
    return reduce(do.least, gaps) - float(machine.bars.radii[leg])


def widest_stretch(solids: Sequence[Solid]) -> tuple[float, float, float]:
    """Return lowest and highest end, heights over the tip, and radius of a capsule that holds a tool's solids.

    Legs that end beside the line run out of the planes through it, where the exact distance from such solids has no
    simple form; they keep clear of this capsule.
    """
    return min(s.low for s in solids), max(s.high for s in solids), max(s.largest_radius for s in solids)


def leg_tool_gaps(machine: Machine, solids: Sequence[Solid], position: Floats, direction: Floats) -> Floats:
    """Return the gaps (N, bars) in metres of the legs and the passive limb from a tool's solids in poses (N, 3)."""
    bars = machine.bars
    starts, joints = bars.ends(position, direction)
    vectors = joints - starts
    lengths = np.linalg.norm(vectors, axis=-1)
    cosines = np.einsum("nji,ni->nj", vectors, direction) / lengths
    gaps = [leg_tool_gap(machine, solids, k, cosines[:, k], lengths[:, k], NUMPY) for k in range(len(lengths.T))]
    low, high, radius = widest_stretch(solids)
    for k in np.flatnonzero(bars.beside).tolist():
        ends = (position + (machine.tool_length - height) * direction for height in (low, high))
        gaps[k] = segment_distance(starts[:, k], joints[:, k], *ends) - radius - float(bars.radii[k])
    return np.stack(gaps, axis=1)


def _to_rim(radius: float, depth: float, sine: Any, cosine: Any, length: Any, do: Arithmetic) -> Any:
    """Return the distance of a leg from a rim that lies `depth` below its joint: negative where it runs below it."""
    along = radius * sine - depth * cosine
    across = radius * cosine + depth * sine
    over = do.most(along - length, 0.0)
    distance = do.sqrt(across * across + over * over + _TINY)
    before = float(np.hypot(radius, depth))
    return do.where(along < 0.0, before, do.where(across < 0.0, -distance, distance))


def _sine(cosine: Any, do: Arithmetic) -> Any:
    return do.sqrt(do.most(1.0 - cosine * cosine, 0.0) + _TINY)
