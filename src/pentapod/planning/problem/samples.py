"""ToolpathSamples: the waypoints of a toolpath as arrays, and a farthest-point sampling of them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pentapod.base.arrays import Floats, Ints, frozen, row_lengths, set_frozen
from pentapod.geometry.polyline import arc_length
from pentapod.geometry.rigid import RigidTransform
from pentapod.planning.problem.common_axis import CommonAxis
from pentapod.toolpath.toolpath import Toolpath

AXIS_LEVER_M = 0.1
"""Tip movement that one radian of axis counts for in the choice of representatives, metres."""

MOST_SAMPLED = 20_000
"""Waypoints of which representatives are chosen; longer paths are thinned first: the choice costs count × N."""

DENSE_M = 1e-3
"""Path length between the waypoints of a dense path that `shaping` keeps, metres; less on small parts."""

DENSE_PER_EXTENT = 100
"""How many of these lengths the extent of a part has at least."""

STRAIGHT_M = 1e-5
"""Distance from the straight way between neighbours up to which a waypoint does not shape a path, metres."""

STRAIGHT_LEVER_M = 1e-2
"""Path length of one radian of the nominal axis for both, metres."""


@dataclass(frozen=True, eq=False)
class ToolpathSamples:
    """Tilt centres and nominal axes (N, 3), workpiece frame.

    tilt_centre: metres from the tip along the axis. tilt: half angle of the cone of axes, radians. shares (N,): of that
    cone (of the tangent of its angle) that may be used at each waypoint; all of it by default. common_axis: towards
    which the nominal axes lean, None for those of the toolpath. own (N, 3), limit: axes of the toolpath, and the
    largest angle from them, radians, where the cone exceeds it; None where it does not.
    """

    tilt_centres: Floats
    nominal: Floats
    tilt_centre: float
    tilt: float
    shares: Floats | None = None
    common_axis: CommonAxis | None = None
    own: Floats | None = None
    limit: float = np.pi

    def __post_init__(self) -> None:
        set_frozen(
            self,
            tilt_centres=frozen(self.tilt_centres, "tilt_centres", (None, 3)),
            nominal=frozen(self.nominal, "nominal", (None, 3)),
            shares=None if self.shares is None else frozen(self.shares, "shares", (None,)),
            own=None if self.own is None else frozen(self.own, "own", (None, 3)),
        )

    @classmethod
    def of(cls, toolpath: Toolpath, tilt: float) -> ToolpathSamples:
        """Return the samples of a toolpath with a tilt cone (half angle, radians)."""
        return cls(toolpath.tilt_centres, toolpath.axes, toolpath.tilt_centre, tilt)

    def towards(self, common_axis: CommonAxis) -> ToolpathSamples:
        """Return samples whose nominal axes lean from these ones towards a common direction."""
        nominal = common_axis.axes(self.tilt_centres, self.nominal)
        shares = common_axis.shares(self.tilt_centres, self.nominal, nominal, self.tilt)
        return replace(self, nominal=nominal, shares=shares, common_axis=common_axis)

    def widened(self, own: Floats, cone: float, limit: float) -> ToolpathSamples:
        """Return samples with a wider cone, radians, all of which may be used within the limit.

        own (N, 3): axes of the toolpath. limit: largest angle of the tool from these, radians.
        """
        if self.common_axis is None:  # the cone is around these axes
            return replace(self, tilt=cone)
        return replace(self, tilt=cone, shares=None, own=own, limit=limit)

    def inside(self, axes: Floats, rows: Ints | slice = slice(None)) -> Floats | None:
        """Return by how much unit axes (..., 3) at waypoints `rows` keep the limit: a difference of cosines.

        Not negative within it. None where the cone keeps it.
        """
        if self.own is None:
            return None
        return np.asarray((axes * self.own[rows]).sum(axis=-1) - np.cos(self.limit), dtype=np.float64)

    def inside_by_lean(self, frames: Floats, leans: Floats, rows: Ints) -> Floats:
        """Return the derivatives (n, 2) of `inside` by leans (n, 2) in frames (n, 2, 3) across the nominal axes."""
        own = self.nominal[rows] if self.own is None else self.own[rows]
        length = np.sqrt(1.0 + np.square(leans).sum(axis=1, keepdims=True))
        axes = (self.nominal[rows] + np.einsum("na,nak->nk", leans, frames)) / length
        cosine = (own * axes).sum(axis=1, keepdims=True)
        slopes = np.einsum("nk,nak->na", own, frames) / length - cosine * leans / length**2
        return np.asarray(slopes, dtype=np.float64)

    def at(self, rows: Ints) -> ToolpathSamples:
        """Return the samples of the waypoints `rows` only."""
        shares, own = (None if each is None else each[rows] for each in (self.shares, self.own))
        centres, nominal = self.tilt_centres[rows], self.nominal[rows]
        return replace(self, tilt_centres=centres, nominal=nominal, shares=shares, own=own)

    def room(self, rows: Ints | slice = slice(None)) -> Floats:
        """Return the longest lean (n,) at waypoints `rows`, as a share of the cone's."""
        return np.ones(len(self.nominal[rows])) if self.shares is None else self.shares[rows]

    def machine_poses(
        self, placement: RigidTransform, axes: Floats, rows: Ints | slice = slice(None)
    ) -> tuple[Floats, Floats]:
        """Return tips and axes (..., 3) in the machine frame for axes of the workpiece frame at waypoints `rows`."""
        turned = placement.rotate(axes)
        return placement.apply(self.tilt_centres[rows]) - self.tilt_centre * turned, turned

    def shaping(self, kept: Ints) -> Ints:
        """Return indices (n,) of waypoints that shape the path, those in `kept` among them.

        On dense paths the others are about on straight ways between neighbours that are close to each other.
        """
        features = np.hstack([self.tilt_centres, STRAIGHT_LEVER_M * self.nominal])
        stations = arc_length(features)
        extent = float(np.linalg.norm(np.ptp(self.tilt_centres, axis=0)))
        cells = np.floor(stations / max(min(DENSE_M, extent / DENSE_PER_EXTENT), 1e-9))
        keep = np.concatenate([[True], cells[1:] > cells[:-1]])
        keep[kept] = keep[-1] = True
        rows = np.flatnonzero(keep)
        off = np.linalg.norm(features - _between(stations, stations[rows], features[rows]), axis=1)
        bent = np.maximum.reduceat(off, rows) > STRAIGHT_M
        return np.flatnonzero(keep | np.repeat(bent, np.diff(rows, append=len(keep))))

    def spread(self, leans: Floats, rows: Ints) -> Floats:
        """Return leans (N, 3) at all waypoints, linear along the path between those (n, 3) at waypoints `rows`."""
        stations = arc_length(np.hstack([self.tilt_centres, STRAIGHT_LEVER_M * self.nominal]))
        return _between(stations, stations[rows], leans)

    def representatives(self, count: int) -> Ints:
        """Return indices of `count` waypoints spread evenly over places and axes (farthest-point sampling)."""
        features = np.hstack([self.tilt_centres, AXIS_LEVER_M * self.nominal])
        stride = np.linspace(0, len(features) - 1, min(len(features), MOST_SAMPLED)).astype(np.intp)
        features = features[stride]
        count = min(count, len(features))
        first = int(row_lengths(features - features.mean(axis=0)).argmax())
        chosen, nearest = [first], row_lengths(features - features[first])
        while len(chosen) < count:
            chosen.append(int(nearest.argmax()))
            nearest = np.minimum(nearest, row_lengths(features - features[chosen[-1]]))
        return stride[np.array(chosen, dtype=np.intp)]


def _between(at: Floats, known: Floats, values: Floats) -> Floats:
    """Return values (N, d) at ascending stations (N,), linear between known ones (n, d)."""
    return np.stack([np.interp(at, known, column) for column in values.T], axis=1)
