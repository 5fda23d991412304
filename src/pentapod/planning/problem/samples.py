"""ToolpathSamples: the waypoints of a toolpath as arrays, and a farthest-point sampling of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats, Ints, frozen, set_frozen
from pentapod.geometry.rigid import RigidTransform
from pentapod.toolpath.toolpath import Toolpath

AXIS_LEVER_M = 0.1
"""Tip movement that one radian of axis counts for in the choice of representatives, metres."""

MOST_SAMPLED = 20_000
"""Waypoints of which representatives are chosen; longer paths are thinned first: the choice costs count × N."""


@dataclass(frozen=True, eq=False)
class ToolpathSamples:
    """Tilt centres and nominal axes (N, 3), workpiece frame.

    tilt_centre: metres from the tip along the axis. tilt: half angle of the cone of axes, radians.
    """

    tilt_centres: Floats
    nominal: Floats
    tilt_centre: float
    tilt: float

    def __post_init__(self) -> None:
        set_frozen(
            self,
            tilt_centres=frozen(self.tilt_centres, "tilt_centres", (None, 3)),
            nominal=frozen(self.nominal, "nominal", (None, 3)),
        )

    @classmethod
    def of(cls, toolpath: Toolpath, tilt: float) -> ToolpathSamples:
        """Return the samples of a toolpath with a tilt cone (half angle, radians)."""
        return cls(toolpath.tilt_centres, toolpath.axes, toolpath.tilt_centre, tilt)

    def at(self, rows: Ints) -> ToolpathSamples:
        """Return the samples of the waypoints `rows` only."""
        return ToolpathSamples(self.tilt_centres[rows], self.nominal[rows], self.tilt_centre, self.tilt)

    def machine_poses(
        self, placement: RigidTransform, axes: Floats, rows: Ints | slice = slice(None)
    ) -> tuple[Floats, Floats]:
        """Return tips and axes (..., 3) in the machine frame for axes of the workpiece frame at waypoints `rows`."""
        turned = placement.rotate(axes)
        return placement.apply(self.tilt_centres[rows]) - self.tilt_centre * turned, turned

    def representatives(self, count: int) -> Ints:
        """Return indices of `count` waypoints spread evenly over places and axes (farthest-point sampling)."""
        features = np.hstack([self.tilt_centres, AXIS_LEVER_M * self.nominal])
        stride = np.linspace(0, len(features) - 1, min(len(features), MOST_SAMPLED)).astype(np.intp)
        features = features[stride]
        count = min(count, len(features))
        first = int(np.square(features - features.mean(axis=0)).sum(axis=1).argmax())
        chosen, nearest = [first], np.square(features - features[first]).sum(axis=1)
        while len(chosen) < count:
            chosen.append(int(nearest.argmax()))
            nearest = np.minimum(nearest, np.square(features - features[chosen[-1]]).sum(axis=1))
        return stride[np.array(chosen, dtype=np.intp)]
