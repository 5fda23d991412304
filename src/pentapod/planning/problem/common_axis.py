"""CommonAxis: nominal axes between the surface's normals and one direction that the whole path shares."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats, frozen, set_frozen
from pentapod.base.values import Value
from pentapod.geometry.directions import angle_between, normalised, partway, tangent_frame
from pentapod.toolpath.axis.smoothing import moving_mean


@dataclass(frozen=True)
class CommonAxisOptions(Value):
    """How axes approach the common direction.

    sharpness: exponent of the transition from normals near the direction, which are kept, to those beyond the cone,
    which are turned onto it. width: of the moving mean of the axes along the path, metres. spare: angle in radians by
    which nominal axes stay within the limit, so that the tilt field has some room everywhere. fade: metres of path over
    which that room may fall from all to none.
    """

    sharpness: float = 4.0
    width: float = 20e-3
    spare: float = float(np.radians(0.25))
    fade: float = 10e-3


@dataclass(frozen=True, eq=False)
class CommonAxis(Value):
    """A common direction (3,) of the tool axes, workpiece frame, and the widest angle of a nominal axis from it.

    cone: that angle, radians; 0 makes all nominal axes the direction itself. limit: the largest angle of the tool from
    the toolpath's own axis (the surface's normal), radians; where it is smaller, it counts.
    """

    direction: Floats
    cone: float
    limit: float
    options: CommonAxisOptions = CommonAxisOptions()

    def __post_init__(self) -> None:
        set_frozen(self, direction=frozen(normalised(self.direction), "direction", (3,)))

    def __str__(self) -> str:
        x, y, z = (round(float(number), 2) + 0.0 for number in self.direction)
        around = f", and up to {np.degrees(self.cone):.0f} deg around it" if self.cone > 0.0 else ""
        return f"towards ({x:g}, {y:g}, {z:g}) of the part{around}"

    def axes(self, centres: Floats, own: Floats) -> Floats:
        """Return nominal axes (N, 3) for a path's tilt centres and own axes (N, 3), smooth along the path."""
        angle = angle_between(own, self.direction)
        most = max(self.limit - self.options.spare, 0.0)
        kept = np.maximum(self._within_cone(angle), angle - most)
        across = own - (own @ self.direction)[:, None] * self.direction
        length = np.linalg.norm(across, axis=1, keepdims=True)
        aside = np.where(length > 1e-9, across / np.maximum(length, 1e-9), tangent_frame(self.direction)[0])
        axes = np.cos(kept)[:, None] * self.direction + np.sin(kept)[:, None] * aside
        place = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(centres, axis=0), axis=1))])
        mean = moving_mean(place, axes, self.options.width) if place[-1] > 0.0 and self.cone > 0.0 else None
        axes = axes if mean is None else mean
        off = angle_between(axes, own)
        return partway(own, axes, np.where(off > most, most / np.maximum(off, 1e-300), 1.0))

    def shares(self, centres: Floats, own: Floats, nominal: Floats, tilt: float) -> Floats:
        """Return the share (N,) of a cone of half angle `tilt` around nominal axes that keeps the limit, above 0."""
        if tilt == 0.0:
            return np.ones(len(own))
        room = np.clip(self.limit - angle_between(own, nominal), self.options.spare, tilt)
        share = np.minimum(np.tan(room) / np.tan(tilt), 1.0)
        place = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(centres, axis=0), axis=1))])
        rise = place / self.options.fade
        before = np.minimum.accumulate(share - rise) + rise
        after = np.minimum.accumulate((share + rise)[::-1])[::-1] - rise
        return np.minimum(before, after)

    def _within_cone(self, angle: Floats) -> Floats:
        """Return angles (N,) from the direction: nearly as they are within the cone, its half angle far beyond it."""
        if self.cone == 0.0:
            return np.zeros_like(angle)
        power = self.options.sharpness
        return np.asarray(angle / (1.0 + (angle / self.cone) ** power) ** (1.0 / power), dtype=np.float64)
