"""LegPath: the leg lengths along the placed path, untimed; C3 pieces between exact stops."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BSpline

from pentapod.base.arrays import Bools, Floats, Ints, frozen, set_frozen
from pentapod.base.errors import ToolpathError
from pentapod.base.refusal import Refusal, Shortfall, stage
from pentapod.base.values import Result, Value
from pentapod.geometry.fillet import BULGE, blended, knots_between
from pentapod.kinematics.robot import Robot
from pentapod.machine.machine import Machine
from pentapod.planning.leg_path.stops import with_corners
from pentapod.planning.leg_path.tool_curve import ToolCurve, TooSharpError
from pentapod.planning.placement.placed_path import PlacedPath
from pentapod.toolpath.toolpath import SegmentKind

STOP_ANGLE = float(np.radians(135.0))
"""Turn of the path above which the motion stops at a corner; blending it would need a very low speed."""

TOLERANCE_SHARE = 0.8
"""Share of the tolerances for blending corners; the rest is for setpoints and interpolation."""

STRAIGHT_SHARE = 0.1
"""Share of the tolerances within which the path between two waypoints is straight; those between are left out."""

LINEAR_SHARE = 0.1
"""Share of a tolerance by which it may differ from what is linear between the waypoints that are not left out."""

NEARLY = 0.97
"""Share of the tolerances that blends at corners aim at: their bounds are a little above what they bound."""

AXIS_LEVER_M = 0.01
"""Metres of spline parameter per radian, so that the parameter is regular where only the axis turns."""


@dataclass(frozen=True, eq=False)
class LegPiece(Value):
    """A C3 piece of the leg path between two exact stops, parametrised by s in metres (`ToolCurve`).

    section_ends (M,): s at which the toolpath's segments end, the last is `length`; section_feeds (M,): m/s, infinite
    on rapids; section_kinds, section_segments (M,): kind and index of the segment. waypoint_stations (W,): s about at
    each waypoint; waypoints (W,): its index in the toolpath.
    """

    summary = ("length",)

    curve: ToolCurve
    robot: Robot
    tool_length: float
    section_ends: Floats
    section_feeds: Floats
    section_kinds: tuple[SegmentKind, ...]
    section_segments: Ints
    waypoint_stations: Floats
    waypoints: Ints

    @property
    def length(self) -> float:
        """Length in s, metres."""
        return self.curve.length

    @property
    def knots(self) -> Floats:
        """Stations (K,) where the fourth derivative may jump, with both ends."""
        return self.curve.knots

    def pose(self, s: ArrayLike, order: int = 0) -> tuple[Floats, Floats]:
        """Return tips and tool axes (n, 3), machine frame, or their derivatives of order 1 to 3 in s."""
        return self.curve(np.asarray(s, dtype=np.float64), order)

    def tip_length(self, s: ArrayLike) -> Floats:
        """Return the path length (n,) of the tip itself at stations s (n,), metres."""
        return self.curve.tip_length(np.asarray(s, dtype=np.float64))

    def surface_rate(self, s: ArrayLike) -> Floats:
        """Return the speed (n,) of the tilt centre (a beam's spot) per unit of ds/dt, at stations s (n,)."""
        tip, axis = self.pose(s, 1)
        return np.linalg.norm(tip + self.curve.tilt_centre * axis, axis=1)

    def feed_rate(self, s: ArrayLike) -> Floats:
        """Return the speed (n,) of the point to which the feed refers, per unit of ds/dt, at stations s (n,).

        With a stand-off (a beam, a spray) it is the spot on the surface. Otherwise, and on rapids, it is the tip, whose
        speed is taken as ds/dt, an upper bound.
        """
        spot = self.curve.tilt_centre < 0.0 and bool(np.isfinite(self.section_feeds).all())
        return self.surface_rate(s) if spot else np.ones(np.shape(s))

    def __call__(self, s: ArrayLike, order: int = 0) -> Floats:
        """Return leg lengths (n, n_legs) in metres at stations s (n,), or their derivatives of order 1 to 3 in s."""
        return self.derivatives(s, order)[-1]

    def derivatives(self, s: ArrayLike, order: int) -> list[Floats]:
        """Return leg lengths and their derivatives (n, n_legs) up to `order` ≤ 3, faster than one by one."""
        poses = self.curve.derivatives(np.asarray(s, dtype=np.float64), order)
        return self.robot.leg_derivatives(poses, self.tool_length)


@dataclass(frozen=True, eq=False)
class LegPath(Result):
    """Pieces in order; the machine rests between them.

    starts (P + 1,): station where each begins, and the end. dwells (P + 1,): seconds of rest there.

    >>> len(path.pieces)
    3
    """

    summary = ("length",)

    pieces: tuple[LegPiece, ...]
    starts: Floats
    dwells: Floats

    def __post_init__(self) -> None:
        set_frozen(self, pieces=tuple(self.pieces))
        set_frozen(self, **{name: frozen(getattr(self, name), name, (None,)) for name in ("starts", "dwells")})

    @property
    def length(self) -> float:
        """Total length in s, metres."""
        return float(self.starts[-1])

    def __call__(self, s: ArrayLike, order: int = 0) -> Floats:
        """Return leg lengths (n, n_legs), or derivatives of order 1 to 3, at stations s (n,) of the whole path."""
        return self._each(s, lambda piece, local: piece(local, order), self.pieces[0].robot.n_legs)

    def pose(self, s: ArrayLike) -> tuple[Floats, Floats]:
        """Return tips and tool axes (n, 3), machine frame, at stations s (n,) of the whole path."""
        both = self._each(s, lambda piece, local: np.hstack(piece.pose(local)), 6)
        return both[:, :3], both[:, 3:]

    def surface_rate(self, s: ArrayLike) -> Floats:
        """Return the speed (n,) of the tilt centre (a beam's spot) per unit of ds/dt, at stations s (n,)."""
        return self._each(s, lambda piece, local: piece.surface_rate(local)[:, None], 1)[:, 0]

    def piece_at(self, s: ArrayLike) -> Ints:
        """Return the index (n,) of the piece at each station s (n,)."""
        k = np.searchsorted(self.starts, np.asarray(s, dtype=np.float64), side="right") - 1
        return np.clip(k, 0, len(self.pieces) - 1)

    def _each(self, s: ArrayLike, evaluate: Callable[[LegPiece, Floats], Floats], columns: int) -> Floats:
        s = np.atleast_1d(np.asarray(s, dtype=np.float64))
        which = self.piece_at(s)
        out = np.empty((len(s), columns))
        for k in np.unique(which):
            rows = which == k
            out[rows] = evaluate(self.pieces[k], s[rows] - self.starts[k])
        return out


@stage
def leg_path(
    placed: PlacedPath,
    machine: Machine,
    *,
    path_tolerance: ArrayLike,
    axis_tolerance: ArrayLike,
    stop_angle: float = STOP_ANGLE,
) -> LegPath | Refusal:
    """Return the smooth leg path through the placed tool poses.

    path_tolerance: largest deviation of the tilt centre (the cutter's ball centre, the beam's spot) from the toolpath,
    metres; axis_tolerance: of the axis from the planned one, radians; both one for all or one for each waypoint (N,),
    linear between them (`tolerances_beside`). Corners are blended within both; waypoints on a straight way between
    others do not shape the path. The machine stops where a rapid meets another kind of motion, where the toolpath has a
    stop, and at corners that turn by more than `stop_angle` radians. Raises ToolpathError for numbers that are not
    positive. Returns a Refusal for a path without motion, or one that bends too sharply.

    >>> path = leg_path(placed, machine, path_tolerance=20e-6, axis_tolerance=np.radians(0.5)).unwrap()
    """
    given = {"path_tolerance": path_tolerance, "axis_tolerance": axis_tolerance, "stop_angle": stop_angle}
    for name, value in given.items():
        if not (np.asarray(value) > 0.0).all():
            raise ToolpathError("must be positive", key=name, value=value)
    toolpath = placed.toolpath
    points = np.hstack([placed.tilt_centres, placed.axes])
    steps = np.sqrt(
        np.square(np.diff(points[:, :3], axis=0)).sum(axis=1)
        + np.square(AXIS_LEVER_M * np.diff(points[:, 3:], axis=0)).sum(axis=1)
    )
    moving = steps > 1e-12
    keep = np.concatenate([[True], moving])
    if keep.sum() < 2:
        everywhere = Shortfall("motion", ((0, len(toolpath) - 1),), 0.0, "mm")
        return Refusal("leg path", "the toolpath does not move", (everywhere,))
    tolerances = [np.broadcast_to(each, len(points))[keep] for each in (path_tolerance, axis_tolerance)]
    allowed = TOLERANCE_SHARE * np.stack(tolerances, axis=1)
    points, u = points[keep], np.concatenate([[0.0], np.cumsum(steps[moving])])
    segment = toolpath.segment_of_interval[moving]
    stops = np.zeros(len(points), dtype=np.bool_)
    rapid = np.array([each.kind is SegmentKind.RAPID for each in toolpath.segments])[segment]
    changes, near = rapid[1:] != rapid[:-1], STRAIGHT_SHARE * tolerances[0]
    stops[1:-1] = with_corners(changes, u, points, toolpath.tilt_centre, stop_angle, near)
    dwells = np.zeros(len(points))
    for waypoint, seconds in zip(toolpath.starts, toolpath.dwells, strict=True):
        if seconds is not None:
            stood = int(keep[: waypoint + 1].sum()) - 1
            stops[stood], dwells[stood] = True, dwells[stood] + seconds
    stops[[0, -1]] = True
    bounds, kept = np.flatnonzero(stops), np.flatnonzero(keep)
    shaping = _shaping(u, points, allowed, stops, segment)
    pieces = []
    for a, b in pairwise(bounds.tolist()):
        rows = a + np.flatnonzero(shaping[a : b + 1])
        try:
            curve = _curve(u, points, allowed, rows, toolpath.tilt_centre)
        except TooSharpError:
            try:  # where it turns back beside a stop, the stop is the corner
                beside = (u[rows] < u[a] + near[a]) | (u[rows] > u[b] - near[b])
                beside[[0, -1]] = False
                curve = _curve(u, points, allowed, rows[~beside], toolpath.tilt_centre)
            except TooSharpError:
                first, last = kept[[a, b]]
                cause = f"the path bends too sharply to measure its length, between waypoints {first} and {last}"
                return Refusal("leg path", cause, remedy="A larger tolerance.path_mm may help")
        ends = np.flatnonzero(np.diff(segment[a:b], append=-1)) + 1
        which = segment[a:b][ends - 1]
        pieces.append(
            LegPiece(
                curve,
                machine.robot,
                machine.tool_length,
                section_ends=curve.arc_length(u[a + ends] - u[a]),
                section_feeds=np.array([toolpath.segments[k].feed for k in which]),
                section_kinds=tuple(toolpath.segments[k].kind for k in which),
                section_segments=which,
                waypoint_stations=curve.arc_length(u[a : b + 1] - u[a]),
                waypoints=kept[a : b + 1],
            )
        )
    starts = np.concatenate([[0.0], np.cumsum([piece.length for piece in pieces])])
    return LegPath(tuple(pieces), starts, dwells[bounds])


def _curve(u: Floats, points: Floats, allowed: Floats, rows: Ints, tilt_centre: float) -> ToolCurve:
    """Return the curve through the rows of a polyline, corners blended as far as is allowed.

    Raises TooSharpError where it nearly turns back.
    """
    u, points, allowed = u[rows] - u[rows[0]], points[rows], allowed[rows]
    both = blended(u, np.hstack([points, allowed]), _too_far, knots_between(u, _reach(u, points, allowed)))
    return ToolCurve.of(BSpline(both.t, both.c[:, :6].copy(), both.k), tilt_centre)


def _shaping(u: Floats, points: Floats, allowed: Floats, stops: Bools, segment: Ints) -> Bools:
    """Return which points (N,) shape the path: all but those near the chords between these.

    Stops and ends of segments, between intervals (N − 1,), are kept, and points where the tolerances `allowed` (N, 2)
    are not about linear. The blend around a corner is then as wide as the tolerances allow, however close the waypoints
    are, and knots follow the path's curvature.
    """
    from pentapod.planning.leg_path.sparse_kernels import mark_shaping  # noqa: PLC0415 - loads numba

    keep = stops.copy()
    keep[1:-1] |= segment[1:] != segment[:-1]
    near = np.repeat(_vectors(allowed), 3, axis=1) * (STRAIGHT_SHARE / TOLERANCE_SHARE / 3.0**0.5)
    mark_shaping(u, np.hstack([points, allowed]), np.hstack([near, LINEAR_SHARE * allowed]), keep)
    return keep


def _reach(u: Floats, points: Floats, allowed: Floats) -> Floats:
    """Return at which distance (N,) knots let the curve leave each point of a polyline (N, 6) by what is allowed."""
    turn = np.diff(np.diff(points, axis=0) / np.diff(u)[:, None], axis=0)
    turns = np.stack([np.linalg.norm(turn[:, part], axis=1) for part in (slice(3), slice(3, 6))], axis=1)
    reach = np.full(len(u), np.inf)
    with np.errstate(divide="ignore"):
        reach[1:-1] = NEARLY / BULGE * (_vectors(allowed[1:-1]) / turns).min(axis=1)
    return reach


def _vectors(allowed: Floats) -> Floats:
    """Return tolerances of path and axis (N, 2) with the latter as the distance between unit vectors."""
    return np.stack([allowed[:, 0], np.sin(np.minimum(allowed[:, 1], 0.5 * np.pi))], axis=1)


def _too_far(differences: Floats, chords: Floats) -> Bools:
    """Return on which spans the blended path may deviate by more than is allowed: points (N, 8) end with both numbers.

    The Bernstein coefficients of curve minus polyline enclose the deviation. A vector within ε of one of length n is at
    most asin(ε / n) from its direction.
    """
    off, turned = (np.linalg.norm(differences[:, part], axis=1).max(axis=1) for part in (slice(3), slice(3, 6)))
    nearest = _distance_to_origin(chords[:, 3:6, 0], chords[:, 3:6, 1])
    path, axis = chords[:, 6:].min(axis=2).T
    return np.asarray((off > path) | (turned > np.sin(axis) * nearest))


def _distance_to_origin(a: Floats, b: Floats) -> Floats:
    """Return the least distance (K,) from the origin to the segments from a to b (K, 3)."""
    step = b - a
    foot = -np.einsum("kj,kj->k", a, step) / np.maximum(np.einsum("kj,kj->k", step, step), 1e-300)
    return np.linalg.norm(a + np.clip(foot, 0.0, 1.0)[:, None] * step, axis=1)
