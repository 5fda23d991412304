"""What the tip can reach in one component, given leg limits and a cone of directions, none of which are sampled.

With the tip t fixed, a squared leg length |t − a_i + (z_i − h) i|², S and w are affine in the direction i
*(derived)*. So their extremes over a cone of directions are known: g·i over the cone about c of half-angle α lies
between |g| cos(θ ± α), θ the angle between g and c, cut off at 0 and π. A tip is reachable when every direction of the
cone is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_batch, as_floats, frozen, set_frozen
from pentapod.base.errors import ArrayError
from pentapod.base.values import Value
from pentapod.geometry.directions import normalised
from pentapod.kinematics.component import Component, as_component
from pentapod.kinematics.families.quadratic import LinearPentapod


@dataclass(frozen=True, eq=False)
class Workspace(Value):
    """The tips that can be reached with every direction of a cone, in one component, within leg limits.

    direction (3,): the middle of the cone of platform directions i (platform → tip); half_angle: of the cone, radians,
    in [0, π/2). shortest, longest (5,): leg lengths in metres. tool_length: from p to the tip, metres. Machine frame.
    Joint angles and collisions are a machine's matter, not of this.

    Raises ArrayError for leg limits that exclude each other, a half-angle out of range, a component that is none.
    """

    pentapod: LinearPentapod
    component: Component
    direction: Floats
    half_angle: float
    shortest: Floats
    longest: Floats
    tool_length: float

    def __post_init__(self) -> None:
        set_frozen(
            self,
            direction=frozen(normalised(self.direction), "direction", (3,)),
            shortest=frozen(self.shortest, "shortest", (5,)),
            longest=frozen(self.longest, "longest", (5,)),
            component=as_component(self.component),
            tool_length=float(as_floats(self.tool_length, "tool_length")),
        )
        if not ((self.shortest >= 0.0) & (self.shortest < self.longest)).all():
            raise ArrayError("leg limits exclude each other", expected="0 ≤ shortest < longest for each leg")
        if not 0.0 <= self.half_angle < 0.5 * np.pi:
            raise ArrayError("half_angle is out of range", value=self.half_angle, expected="radians in [0, π/2)")

    def slack(self, tips: ArrayLike) -> Floats:
        """Return by how much (..., metres) tips (..., 3) are inside: 0 on the boundary, negative outside.

        It is the smallest over legs and directions of what is left to a leg limit, and of the way to the plane S = 0,
        taken shorter than it may be. So it changes by at most a metre a metre: a ball of this radius about the tip is
        reachable, and about a tip outside nothing within −slack is. Where the legs decide, it is the distance itself.
        −∞ everywhere when the cone of directions crosses w = 0.
        """
        t = as_batch(tips, "tips", (3,))
        robot, delta, reach = self.pentapod, self.pentapod.delta, self.pentapod.offsets - self.tool_length
        flat = np.zeros((5, 3))
        flat[:, :2] = robot.base
        to_tip = t[..., None, :] - flat
        low, high = self._range(2.0 * reach[:, None] * to_tip)
        squared = np.square(to_tip).sum(axis=-1) + reach**2
        least, most = np.sqrt(np.maximum(squared + low, 0.0)), np.sqrt(np.maximum(squared + high, 0.0))
        legs = np.minimum(self.longest - most, least - self.shortest).min(axis=-1)

        # S = tz + (−δ tz, 0, δ tx + lever − h) · i, a plane for each i: distance S / √(1 − 2δu + δ²(u² + w²)).
        x, z = t[..., 0], t[..., 2]
        lever = robot.lever - self.tool_length
        across = np.stack([-delta * z, np.zeros_like(z), delta * x + lever], axis=-1)
        low, high = self._range(across)
        height = z + low if self.component.s > 0 else -(z + high)
        tilt = self._range(np.array([-2.0 * delta, 0.0, 0.0]))[1]
        steepest = float(np.sqrt(max(1.0 + tilt + delta * delta, 0.0)))
        low, high = self._range(np.array([0.0, 0.0, 1.0]))
        turned = low if self.component.w > 0 else -high
        return np.where(turned > 0.0, np.minimum(legs, height / max(steepest, 1e-300)), -np.inf)

    def bounds(self) -> tuple[Floats, Floats]:
        """Return the lowest and the highest corner (3,) of a box that holds all tips that can be reached."""
        reach = self.longest + np.abs(self.pentapod.offsets - self.tool_length)
        flat = np.zeros((5, 3))
        flat[:, :2] = self.pentapod.base
        return (flat - reach[:, None]).max(axis=0), (flat + reach[:, None]).min(axis=0)

    def _range(self, vectors: Floats) -> tuple[Floats, Floats]:
        """Return the least and greatest g · i (...) over the cone for vectors g (..., 3)."""
        along = vectors @ self.direction
        across = np.linalg.norm(np.cross(vectors, self.direction), axis=-1)
        size, angle = np.hypot(along, across), np.arctan2(across, along)
        least = size * np.cos(np.minimum(angle + self.half_angle, np.pi))
        return least, size * np.cos(np.maximum(angle - self.half_angle, 0.0))
