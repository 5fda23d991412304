"""Interpolated setpoints: legs, station, tip and tool axis over time, as the controller's polynomials."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import factorial
from typing import Literal

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.geometry.interpolant import Interpolant, clamped_slopes
from pentapod.numerics.blocks import blocks
from pentapod.timing.path.path import PieceLike

PADDING_ROWS = 16
"""Rows after which the spline no longer depends on where they begin: an influence falls to 0.27 from row to row."""

MARGIN_ROWS = 3
"""Rows on both sides of some intervals on which what is measured of these depends."""


@dataclass(frozen=True, eq=False)
class SetpointRows:
    """Setpoints at equal periods: legs (N, legs), stations (N,) in metres; tips, axes (N, 3) if limited."""

    legs: Floats
    stations: Floats
    tips: Floats | None = None
    axes: Floats | None = None

    @classmethod
    def at(cls, piece: PieceLike, s: Floats, *, tool: bool) -> SetpointRows:
        """Return the rows of a piece at stations s (N,); tool: with tips and axes."""
        return cls(piece(s, 0), s, *(piece.pose(s) if tool else ()))

    @classmethod
    def concatenated(cls, parts: Sequence[SetpointRows]) -> SetpointRows:
        """Return the rows of one part after the other; tips and axes where all parts have them."""
        if len(parts) == 1:
            return parts[0]
        tips, axes = [part.tips for part in parts], [part.axes for part in parts]
        tips, axes = ([y for y in column if y is not None] for column in (tips, axes))
        return cls(
            np.concatenate([part.legs for part in parts]),
            np.concatenate([part.stations for part in parts]),
            np.concatenate(tips) if len(tips) == len(parts) else None,
            np.concatenate(axes) if len(axes) == len(parts) else None,
        )

    def __getitem__(self, rows: slice) -> SetpointRows:
        """Return some of the rows."""
        tips, axes = (None if y is None else y[rows] for y in (self.tips, self.axes))
        return SetpointRows(self.legs[rows], self.stations[rows], tips, axes)

    def __len__(self) -> int:
        return len(self.stations)

    def shifted(self, distance: float) -> SetpointRows:
        """Return the rows with stations `distance` metres further on."""
        return SetpointRows(self.legs, self.stations + distance, self.tips, self.axes)

    def slopes(self) -> SetpointRows:
        """Return the slopes of the clamped cubic splines through the rows, per row."""
        tips, axes = (None if y is None else clamped_slopes(y) for y in (self.tips, self.axes))
        return SetpointRows(clamped_slopes(self.legs), clamped_slopes(self.stations[:, None])[:, 0], tips, axes)


@dataclass(frozen=True, eq=False)
class InterpolatedSetpoints:
    """Setpoints as the controller interpolates them; `count` intervals from row `first` on are judged.

    piece: the one to which these rows belong; stations are counted from its start. slopes: those of the spline at the
    rows, per period, where the rows are part of a longer run; else the spline through these rows has them.
    """

    rows: SetpointRows
    piece: PieceLike
    period: float
    interpolation: Literal["linear", "cubic"]
    first: int
    count: int
    slopes: SetpointRows | None = None

    def parts(self, size: int) -> Iterator[tuple[int, InterpolatedSetpoints]]:
        """Yield the setpoints of at most `size` intervals at a time, and the number of the first of these.

        The polynomials of a long program would fill the memory.
        """
        rows = self.rows
        slopes = rows.slopes() if self.interpolation == "cubic" else None
        for part in blocks(self.count, size):
            low = max(self.first + part.start - MARGIN_ROWS, 0)
            near = slice(low, min(self.first + part.stop + 1 + MARGIN_ROWS, len(rows)))
            own = None if slopes is None else slopes[near]
            first, count = self.first + part.start - low, part.stop - part.start
            yield part.start, replace(self, rows=rows[near], first=first, count=count, slopes=own)

    @property
    def own_rows(self) -> slice:
        """The rows that are judged."""
        return slice(self.first, self.first + self.count + 1)

    @property
    def own_intervals(self) -> slice:
        """The intervals between them."""
        return slice(self.first, self.first + self.count)

    @cached_property
    def legs(self) -> Interpolant:
        """The legs over time."""
        return self._through(self.rows.legs, None if self.slopes is None else self.slopes.legs)

    @cached_property
    def station(self) -> Interpolant:
        """The station over time, one column."""
        slopes = None if self.slopes is None else self.slopes.stations[:, None]
        return self._through(self.rows.stations[:, None], slopes)

    @cached_property
    def tip(self) -> Interpolant:
        """The tip over time, where the rows have it."""
        return self._through(np.asarray(self.rows.tips), None if self.slopes is None else self.slopes.tips)

    @cached_property
    def axis(self) -> Interpolant:
        """The tool axis over time, likewise."""
        return self._through(np.asarray(self.rows.axes), None if self.slopes is None else self.slopes.axes)

    def _through(self, rows: Floats, slopes: Floats | None) -> Interpolant:
        if slopes is None:
            return Interpolant.through(rows, self.period, self.interpolation)
        return Interpolant.along(rows, slopes, self.period)


def spline_padding(piece: PieceLike, speed: float, period: float, *, start: bool, tool: bool = False) -> SetpointRows:
    """Return PADDING_ROWS + 1 rows that come to a piece's start, or leave its end, at constant speed.

    By Taylor polynomials of degree 3: the controller's spline continues through them without a step of acceleration or
    jerk. tool: with tips and axes. The piece's own row is included.
    """
    station = 0.0 if start else piece.length
    distance = speed * period * np.arange(PADDING_ROWS + 1)
    distance = np.asarray(-distance[::-1] if start else distance, dtype=np.float64)
    at = np.array([station])

    def beyond(of: Callable[[int], Floats]) -> Floats:
        rows = [of(order) * distance[:, None] ** order / factorial(order) for order in range(4)]
        return np.asarray(np.sum(rows, axis=0), dtype=np.float64)

    poses = (beyond(lambda order, k=k: piece.pose(at, order)[k]) for k in (0, 1)) if tool else ()
    return SetpointRows(beyond(lambda order: piece(at, order)), station + distance, *poses)
