"""Forward kinematics of machines as built: continuation of the nominal closed form to the real geometry, with a proof.

Let the geometry change linearly from the nominal one (s = 0) to the real one (s = 1) while the leg readings stay. The
*intended* pose of the real machine is the end of the continuous curve of solutions that starts at the nominal pose of
the chosen component and meets no singularity. It is unique where it exists, and does not depend on any solver.
`as_built_pose` finds it by Newton's method and proves it with tubes (`continuation`). Where the nominal machine has no
closed form, its own pose is one that is continued from its home.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Bools, Floats, Ints, as_batch
from pentapod.base.errors import ArrayError
from pentapod.base.values import Value
from pentapod.kinematics.batches import broadcast
from pentapod.kinematics.families.general import GeneralPentapod
from pentapod.kinematics.families.quadratic import LinearPentapod
from pentapod.kinematics.families.ringed import RingedPentapod
from pentapod.kinematics.tubes.continuation import ContinuationOptions, Pose, continue_poses
from pentapod.kinematics.tubes.leg_equations import BuiltLegs, Legs, length_scale
from pentapod.kinematics.tubes.tube import LegFamily, Tube, determinant_sign
from pentapod.numerics.balls import Ball
from pentapod.numerics.blocks import blocks

Nominal: TypeAlias = LinearPentapod | GeneralPentapod | RingedPentapod
"""What a machine as built can have been designed as."""

STEPS = ContinuationOptions(shortest=2.0**-16)
"""Of the way from the nominal geometry to the real one."""


@dataclass(frozen=True, eq=False)
class ProvenPoses(Value):
    """Poses of a machine as built, and what is known of them.

    position, direction (..., 3): metres, machine frame; NaN where there is no nominal pose, a reading is no longer than
    its zero, or Newton's method did not settle. proven (...): the exact intended pose exists and is within the two
    bounds of the one given, in every coordinate. position_error, direction_error (...): these bounds, metres and none;
    NaN where not proven.
    """

    position: Floats
    direction: Floats
    proven: Bools
    position_error: Floats
    direction_error: Floats

    def __post_init__(self) -> None:
        for array in (getattr(self, field.name) for field in fields(self)):
            array.flags.writeable = False


def as_built_pose(machine: BuiltLegs, nominal: Nominal, legs: ArrayLike, component: ArrayLike) -> ProvenPoses:
    """Return the poses of leg readings (..., 5), metres, that belong to a branch of the nominal machine.

    component: as for the nominal `pose`, a `Component` or a `Mode`, or signs (..., 2). A pose that comes without proof
    may be right (near a singularity nothing can tell) or belong to another assembly mode: do not move on it. The proof
    holds for the machines whose numbers are exactly the given ones, nominal offsets of the quadratic family being
    z_3 + δ (x_i − x_3).
    Raises ArrayError for a wrong shape, legs that are infinite or not positive, wrong signs.
    """
    readings, signs = as_batch(legs, "legs", (5,)), as_batch(component, "component", (2,))
    if not (np.isnan(readings) | ((readings > 0.0) & np.isfinite(readings))).all():
        raise ArrayError("legs must be finite and positive", expected="metres, NaN where there is no reading")
    readings, signs = broadcast(readings, signs, ("legs", "component"))
    batch, readings, signs = readings.shape[:-1], readings.reshape(-1, 5), signs.reshape(-1, 2)
    readings = np.where((readings > machine.zeros).all(axis=-1, keepdims=True), readings, np.nan)
    position, direction = nominal.pose(readings, signs)
    out = np.full((len(readings), 8), np.nan)  # position, direction, two errors
    proven = np.zeros(len(readings), dtype=bool)
    with np.errstate(all="ignore"):
        for block in blocks(len(readings), 2048):
            way = _GeometryHomotopy(machine, nominal, readings[block].T)
            start = (position[block].T, direction[block].T)
            found = continue_poses(way, start, way.scale, admit=way.in_component, options=STEPS)
            errors = [found.error * way.scale, found.error]
            out[block], proven[block] = np.concatenate([found.position, found.direction, errors]).T, found.proven
    values = out.reshape(*batch, 8)
    return ProvenPoses(
        values[..., 0:3].copy(),
        values[..., 3:6].copy(),
        proven.reshape(batch),
        values[..., 6].copy(),
        values[..., 7].copy(),
    )


class _GeometryHomotopy:
    """The linear change of a nominal geometry into one as built, for leg readings (5, N)."""

    def __init__(self, machine: BuiltLegs, nominal: Nominal, readings: Floats) -> None:
        self.nominal, self.readings = nominal, readings
        self.scale = length_scale(machine)
        self.rings = ((machine.radii != 0.0) | (nominal.radii != 0.0))[:, None]
        offsets = Ball.exact(nominal.offsets)
        if isinstance(nominal, LinearPentapod):
            x = nominal.base[:, 0]
            offsets = (Ball.exact(x) - x[2]) * nominal.delta + nominal.offsets[2]
        self.start = (
            Ball.exact(nominal.base_joints.T[..., None]),
            offsets[:, None],
            Ball.exact(nominal.radii[:, None]),
        )
        end = (machine.base_joints.T[..., None], machine.offsets[:, None], machine.radii[:, None])
        self.end = tuple(Ball.exact(array) for array in end)
        self.shift = tuple(b - a for a, b in zip(self.start, self.end, strict=True))
        self.zeros = machine.zeros[:, None]

    def at(self, which: Ints, s: Floats) -> Legs[Ball]:
        """Return the geometry at s; where all s are 1, it is the given one."""
        if (s == 1.0).all():
            base, offsets, radii = self.end
        else:
            base, offsets, radii = (a + d * s for a, d in zip(self.start, self.shift, strict=True))
        return Legs(base, offsets, radii, Ball.exact(self.readings[:, which]) - self.zeros * s, self.rings)

    def over(self, which: Ints, s: Floats, h: Floats) -> LegFamily:
        """Return the legs from s to s + h."""
        first, middle, last = (self.at(which, s + share * h) for share in (0.0, 0.5, 1.0))
        hull = Legs(
            Ball.between(first.base, last.base),
            Ball.between(first.offsets, last.offsets),
            Ball.between(first.radii, last.radii),
            Ball.between(first.lengths, last.lengths),
            self.rings,
        )
        base, offsets, radii = (d * h for d in self.shift)
        slope = Legs(base, offsets, radii, Ball.exact(-self.zeros) * h, self.rings)
        return LegFamily(middle, hull, slope, np.zeros((5, 1)))

    def in_component(self, nominal_pose: Pose, tube: Tube) -> Bools:
        """Return where the exact nominal pose is of the branch (N,): all that is in the tube's ball is.

        w and S keep their signs there; of other families w and the Jacobian's determinant, whose sign is the order.
        """
        (x, _, z), (u, _, w) = (
            Ball(centre, np.broadcast_to(tube.radius * size * (1.0 + 2.0**-48), centre.shape))
            for centre, size in zip(nominal_pose, (self.scale, 1.0), strict=True)
        )
        same_image = np.abs(w.mid) > w.rad
        if not isinstance(self.nominal, LinearPentapod):
            computed = self.nominal.branch(nominal_pose[0].T, nominal_pose[1].T)[:, 0]
            return same_image & (determinant_sign(tube.inverse) == computed)  # det ∂G/∂(p, i) > 0 where the order is +1
        delta, x3 = self.nominal.delta, float(self.nominal.base[2, 0])
        lever = Ball.exact(self.nominal.offsets[2]) - Ball.exact(delta) * x3
        s = w * x * delta + (1.0 - delta * u) * z + lever * w
        return same_image & (np.abs(s.mid) > s.rad)
