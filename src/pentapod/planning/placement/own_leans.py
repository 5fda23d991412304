"""Leans along a path alone: where no tilt field keeps the limits, or as a plan of nearly the same path has them.

A tilt field is smooth over the part: neighbouring passes lean alike. Where that is not enough, leans may follow the
path alone, as `AxisSpline` has them. It begins at each waypoint's own best lean where the field falls short.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import KDTree

from pentapod.base.arrays import Floats, Ints
from pentapod.base.progress import Progress, silent
from pentapod.planning.placement.placed_path import PlacedPath
from pentapod.planning.placement.sampling import best_tilted_margins
from pentapod.planning.problem.problem import Candidate, PlacementProblem
from pentapod.planning.problem.weights import NEEDED_MARGIN
from pentapod.planning.tool_axis.smoothing import OPTIONS as SMOOTHING
from pentapod.planning.tool_axis.smoothing import smoothed
from pentapod.planning.tool_axis.spline import AxisSpline
from pentapod.toolpath.toolpath import Toolpath


@dataclass(frozen=True)
class LeansOptions:
    """How a spline of leans is begun, and what margin it keeps.

    shares: of the way from the field's lean to a waypoint's own best one that are tried, the nearest first. roomy:
    margin of the lean that is taken there, as a multiple of the needed one, since the spline does not meet it exactly.
    kept: share of the smallest margin of a plan of nearly the same path that is kept. lever: metres that one radian of
    the path's axis counts for, where the waypoint of that plan is sought.
    """

    shares: tuple[float, ...] = tuple(k / 10.0 for k in range(1, 10))
    roomy: float = 1.5
    kept: float = 0.9
    lever: float = 0.01


OPTIONS = LeansOptions()

ENOUGH = NEEDED_MARGIN + 2.0 * SMOOTHING.slack
"""Margin that a spline is asked to keep, so that it has the needed one."""


@dataclass(frozen=True, eq=False)
class OwnLeans:
    """The waypoints `rows` (n,) at which a candidate's tilt field does not keep the needed margin.

    field (N, 3): the leans of that field at all waypoints. margins (n, M), leans (n, 3): at each waypoint's best tilt
    of a grid over the cone.
    """

    problem: PlacementProblem
    at: Candidate
    field: Floats
    rows: Ints
    margins: Floats
    leans: Floats

    @classmethod
    def of(cls, problem: PlacementProblem, at: Candidate) -> OwnLeans:
        """Return the own leans where a candidate of a problem falls short."""
        field = problem.leans(at.coefficients)
        rows = np.flatnonzero(problem.values_of(at.margins, at.transform, field).min(axis=1) < NEEDED_MARGIN)
        return cls(problem, at, field, rows, *best_tilted_margins(problem.samples.at(rows), at.margins, at.transform))

    @cached_property
    def fit(self) -> bool:
        """Whether each waypoint fits by itself."""
        return bool((self.margins >= NEEDED_MARGIN).all())

    @property
    def mixed(self) -> Floats:
        """The leans (N, 3) of the field, and the waypoints' own ones where it falls short."""
        found = self.field.copy()
        found[self.rows] = self.leans
        return found

    def along_path(self, progress: Progress = silent) -> Floats | None:
        """Return the leans (N, 3) of the smoothest spline that was found to keep the needed margin; None without."""
        if not self.fit or self.problem.samples.tilt == 0.0:
            return None
        return _along(self.problem, self.at, ENOUGH, self._near_the_field(), progress)

    def _near_the_field(self) -> Floats:
        """Return leans (N, 3) that fit, each as near as may be to that of the field."""
        found, left = self.mixed, np.arange(len(self.rows))
        for share in OPTIONS.shares:
            if not len(left):
                break
            rows = self.rows[left]
            trial = self.field[rows] + share * (self.leans[left] - self.field[rows])
            values = self.problem.values_of(self.at.margins, self.at.transform, trial, rows)
            fits = values.min(axis=1) >= OPTIONS.roomy * NEEDED_MARGIN
            found[rows[fits]], left = trial[fits], left[~fits]
        return found


def leans_as_planned(
    problem: PlacementProblem, at: Candidate, path: Toolpath, placed: PlacedPath, progress: Progress = silent
) -> Floats | None:
    """Return leans (N, 3) of a path near those of a plan of nearly the same path; None where none were found.

    problem: at all waypoints of the path, with the common axis of that plan; at: a candidate at its placement.
    """
    samples, options = problem.samples, OPTIONS
    if samples.tilt == 0.0:
        return None
    known, wanted = (np.hstack([each.tilt_centres, options.lever * each.axes]) for each in (placed.toolpath, path))
    axes = placed.placement.transform.inverse().rotate(placed.axes)[KDTree(known).query(wanted)[1]]
    leans = axes / (axes * samples.nominal).sum(axis=1, keepdims=True) - samples.nominal
    smallest = float(problem.values_of(at.margins, at.transform, leans).min())
    keep = max(ENOUGH, min(options.kept * placed.smallest_margin, smallest))
    return _along(problem, at, keep, leans, progress)


def _along(problem: PlacementProblem, at: Candidate, keep: float, leans: Floats, progress: Progress) -> Floats | None:
    spline = smoothed(problem, at, keep, progress=progress, leans=leans)
    return None if spline is None else AxisSpline.of(problem.samples, problem.cone).leans(spline)
