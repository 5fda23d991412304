"""The path as the time law sees it: protocols of a leg path and its pieces, and their derivatives by arc length."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.base.values import Value
from pentapod.machine.dynamics.dynamics import Dynamics, ForceTerms
from pentapod.toolpath.toolpath import SegmentKind


class PieceLike(Protocol):
    """A smooth stretch of the path between two exact stops; s is the tip's arc length in metres from its start.

    knots (K,): where the third derivative may jump. section_ends (M,): s where each section ends, the last
    is `length`; section_feeds (M,): m/s, infinite on rapids; section_kinds and section_segments (M,): kind
    and index of the toolpath's segment. waypoint_stations, waypoints (W,): s of the toolpath's waypoints, not
    falling, and their indices.
    `piece(s, order)` returns legs (n, legs) in metres or their derivatives d^order/ds^order, `derivatives(s, order)`
    all of them up to an order: 0 to 3, the second continuous, the third used where jerk is limited.
    `feed_rate(s)` returns how far (n,) the point whose speed is the feed moves for each metre of s: 1 for cutters,
    whose tip is never faster; less or more for the spot on the surface that a beam or spray meets from a stand-off.
    `pose(s, order)` returns tips and tool axes (n, 3) or their derivatives, order 0 to 3; it is used only where the
    motion of the tip or the axis is limited.
    """

    @property
    def length(self) -> float: ...  # noqa: D102 (described above)
    @property
    def knots(self) -> Floats: ...  # noqa: D102
    @property
    def section_ends(self) -> Floats: ...  # noqa: D102
    @property
    def section_feeds(self) -> Floats: ...  # noqa: D102
    @property
    def section_kinds(self) -> Sequence[SegmentKind]: ...  # noqa: D102
    @property
    def section_segments(self) -> Ints: ...  # noqa: D102
    @property
    def waypoint_stations(self) -> Floats: ...  # noqa: D102
    @property
    def waypoints(self) -> Ints: ...  # noqa: D102
    def feed_rate(self, s: Floats) -> Floats: ...  # noqa: D102
    def pose(self, s: Floats, order: int = 0) -> tuple[Floats, Floats]: ...  # noqa: D102
    def derivatives(self, s: Floats, order: int) -> list[Floats]: ...  # noqa: D102
    def __call__(self, s: Floats, order: int = 0) -> Floats: ...  # noqa: D102


class LegPathLike(Protocol):
    """Pieces, each at rest at both ends.

    starts (P + 1,): global arc length in metres at which each piece starts, and the end. dwells (P + 1,): seconds for
    which the machine stands there.
    """

    @property
    def pieces(self) -> Sequence[PieceLike]: ...  # noqa: D102
    @property
    def starts(self) -> Floats: ...  # noqa: D102
    @property
    def dwells(self) -> Floats: ...  # noqa: D102


@dataclass(frozen=True, eq=False)
class PathDerivatives(Value):
    """Derivatives by s at sorted stations s (n,) of a piece, order 1 first, up to `order`; computed on first use."""

    piece: PieceLike
    s: Floats
    order: int = 2

    @cached_property
    def legs(self) -> tuple[Floats, ...]:
        """The legs' derivatives, (n, legs) each."""
        return tuple(self.piece.derivatives(self.s, self.order)[1:])

    @cached_property
    def poses(self) -> tuple[tuple[Floats, Floats], ...]:
        """Tip and tool axis (n, 3), and their derivatives of orders 1 and 2."""
        return tuple(self.piece.pose(self.s, k) for k in range(3))

    def force_terms(self, dynamics: Dynamics, *, reach: bool) -> ForceTerms:
        """Return the terms of the drives' forces at the stations; reach: with that of a force on the tip."""
        key = id(dynamics), reach
        if key not in self._forces:
            self._forces[key] = dynamics, dynamics.along(self.poses, reach=reach)
        return self._forces[key][1]

    @cached_property
    def _forces(self) -> dict[tuple[int, bool], tuple[Dynamics, ForceTerms]]:
        """What `force_terms` has found, by the identity of the dynamics, which is kept from being used again."""
        return {}

    @cached_property
    def tip(self) -> tuple[Floats, ...]:
        """The tip's derivatives, (n, 3) each."""
        return tuple(self.piece.pose(self.s, k)[0] for k in range(1, self.order + 1))

    @cached_property
    def turn(self) -> tuple[Floats, ...]:
        """Axis × axis′ and axis × axis″, (n, 3) each.

        The angular velocity is turn[0] ṡ, the angular acceleration turn[0] s̈ + turn[1] ṡ²: without twist, which a tool
        axis does not have.
        """
        axis = self.piece.pose(self.s, 0)[1]
        return tuple(np.cross(axis, self.piece.pose(self.s, k)[1]) for k in (1, 2))


UNSEEN = 2.0
"""Ratio of a third derivative's mean over a stage to those at its ends above which these do not see what is inside."""


def third_derivatives(s: Floats, second: Floats, third: Floats) -> Floats:
    """Return third derivatives (n, k) at sorted stations s (n,) that see bends of the path between them.

    A bend shorter than a stage has a third derivative that no station sees. Where its mean over the stage, from the
    second derivatives at both ends, is far above those at the ends, they get the mean.
    """
    means = np.diff(second, axis=0) / np.diff(s)[:, None]
    size = np.abs(third)
    k, column = np.nonzero(np.abs(means) > UNSEEN * np.maximum(size[1:], size[:-1]))
    seen, found = third.copy(), means[k, column]
    for end in (k, k + 1):
        here = seen[end, column]
        seen[end, column] = np.where(np.abs(found) > np.abs(here), found, here)
    return seen
