"""Leans along a path alone: where no tilt field keeps the limits, or as a plan of nearly the same path has them.

A tilt field is smooth over the part: neighbouring passes lean alike. Where that is not enough, leans may follow the
path alone, as `AxisSpline` has them. It begins with leans of a grid that keep the limits and turn evenly. Where no lean
within the field's cone keeps them, as between two walls, wider cones are tried.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree

from pentapod.base.arrays import Floats, Ints
from pentapod.base.progress import Progress, silent
from pentapod.planning.placement.lean_choice import LeanChoice
from pentapod.planning.placement.placed_path import PlacedPath
from pentapod.planning.placement.sampling import best_tilted_margins
from pentapod.planning.problem.problem import Candidate, PlacementProblem
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.planning.problem.tilt_field import lean
from pentapod.planning.problem.weights import NEEDED_MARGIN
from pentapod.planning.tool_axis.axis_programs import AxisPrograms
from pentapod.planning.tool_axis.restoration import restored_everywhere
from pentapod.planning.tool_axis.smoothing import smoothed
from pentapod.planning.tool_axis.smoothing_options import OPTIONS as SMOOTHING
from pentapod.planning.tool_axis.smoothing_options import SmoothingOptions
from pentapod.planning.tool_axis.spline import AxisSpline, stations_of
from pentapod.toolpath.toolpath import Toolpath


@dataclass(frozen=True)
class LeansOptions:
    """How a spline of leans is begun, and what margin it keeps.

    spare: margin that leans along the path should keep, as a multiple of the needed one, as the tool may come nearer to
    the part between waypoints. roomy: margin of the leans that are chosen, as such a multiple, since the spline does
    not meet them exactly; more: factor on it near waypoints, up to `beside` metres of path, at which the spline falls
    short. rounds: of this. kept: share of the smallest margin of a plan of nearly the same path that is kept. lever:
    metres that one radian of the path's axis counts for, where the waypoint of that plan is sought. wider_deg: half
    angles of wider cones. rings: of the grid of tilts, where a coarser one has no lean that fits.
    """

    spare: float = 2.0
    roomy: float = 2.5
    more: float = 1.4
    beside: float = 1e-3
    rounds: int = 8
    kept: float = 0.9
    lever: float = 0.01
    wider_deg: tuple[float, ...] = (20.0, 30.0, 45.0)
    rings: int = 4


OPTIONS = LeansOptions()

QUICKLY = replace(SMOOTHING, decrease=1e-2, steps=25)
"""How leans that turn evenly already are smoothed: up to 40 steps changed two cycle times by less than 0.3 %."""

ENOUGH = NEEDED_MARGIN + 2.0 * SMOOTHING.slack
"""Margin that a spline is asked to keep, so that it has the needed one."""


def asked() -> float:
    """Return the margin that leans along a path are asked to keep, with the spare."""
    return OPTIONS.spare * ENOUGH


class EvenLeans(NamedTuple):
    """Leans (N, 3), and the smallest margin of the spline through them."""

    leans: Floats
    smallest: float


@dataclass(frozen=True, eq=False)
class OwnLeans:
    """The waypoints `rows` (n,) at which a candidate's tilt field does not keep the needed margin, with some spare.

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
        values = problem.values_of(at.margins, at.transform, field, enough=2.0 * asked())
        rows = np.flatnonzero(values.min(axis=1) < asked())
        return cls(problem, at, field, rows, *_best_tilted(problem.samples.at(rows), at))

    def in_best_cone(self, own: Floats, limit: float) -> OwnLeans:
        """Return these own leans, or those in a wider cone: the first one in which leans are found that turn evenly.

        Else the one in which their spline is nearest to keep the margin, or in which the fewest waypoints do not fit.
        own, limit: as for `in_cones`.
        """
        tried, wider = [self], in_cones(self.problem, own, limit)[1:]
        if not wider:
            return self
        for wide in wider:
            if tried[-1].fit and tried[-1].even.smallest >= asked() - SMOOTHING.slack:
                return tried[-1]
            margins, leans = _best_tilted(wide.samples.at(self.rows), self.at)
            tried.append(replace(self, problem=wide, margins=margins, leans=leans))
        return max(tried, key=lambda each: (-len(each.unfit), each.even.smallest if each.fit else 0.0))

    @cached_property
    def fit(self) -> bool:
        """Whether each waypoint fits by itself."""
        return not len(self.unfit)

    @cached_property
    def unfit(self) -> Ints:
        """The waypoints (k,) at which every lean of the grid exceeds a limit."""
        return self.rows[self.margins.min(axis=1) < NEEDED_MARGIN]

    @property
    def mixed(self) -> Floats:
        """The leans (N, 3) of the field, and the waypoints' own ones where it falls short."""
        found = self.field.copy()
        found[self.rows] = self.leans
        return found

    @property
    def nearest(self) -> Floats:
        """The leans (N, 3) of the field, or of the spline through even ones: those that fit at more waypoints."""
        spline = AxisSpline.of(self.problem.samples, self.problem.cone)
        even = spline.leans(spline.fitted(self.even.leans))
        field, other = ((self._values(each) < NEEDED_MARGIN).sum() for each in (self.field, even))
        return self.field if field <= other else even

    def along_path(self, progress: Progress = silent) -> Floats | None:
        """Return the leans (N, 3) of a smooth spline that was found to keep the needed margin; None without."""
        if not self.fit or self.problem.samples.tilt == 0.0:
            return None
        # What the spline through them keeps is not lost where no smoother one is found.
        keep = float(np.clip(self.even.smallest, ENOUGH, asked()))
        return along_spline(self.problem, self.at, keep, self.even.leans, progress, QUICKLY)

    @cached_property
    def even(self) -> EvenLeans:
        """The leans that turn evenly along the path, and whose spline is nearest to keep the margin."""
        problem, places = self.problem, stations_of(self.problem.samples)
        choice = LeanChoice.of(problem, self.at, self.field, self.rows, places)
        spline = AxisSpline.of(problem.samples, problem.cone)
        best, wanted = EvenLeans(self.field, -np.inf), np.full(len(places), OPTIONS.roomy * NEEDED_MARGIN)
        for _ in range(OPTIONS.rounds):
            leans = choice.leans(wanted)
            values = self._values(spline.leans(spline.fitted(leans)))
            if (smallest := float(values.min())) > best.smallest:
                best = EvenLeans(leans, smallest)
            short = np.flatnonzero(values < asked() - SMOOTHING.slack)
            if not len(short):
                break
            away = KDTree(places[short, None]).query(places[:, None])[0]
            wanted[away < OPTIONS.beside] *= OPTIONS.more
        return best

    def _values(self, leans: Floats) -> Floats:
        """Return the smallest margin (N,) at each waypoint; too small beyond the limit of the axes."""
        problem, samples = self.problem, self.problem.samples
        values = problem.values_of(self.at.margins, self.at.transform, leans, enough=2.0 * asked()).min(axis=1)
        inside = samples.inside(lean(samples.nominal, leans))
        return values if inside is None else np.minimum(values, asked() + inside)


def _best_tilted(samples: ToolpathSamples, at: Candidate) -> tuple[Floats, Floats]:
    """Return margins (n, M) and leans (n, 3) at each waypoint's best tilt; of a finer grid where it does not fit."""
    margins, leans = best_tilted_margins(samples, at.margins, at.transform)
    short = np.flatnonzero(margins.min(axis=1) < NEEDED_MARGIN)
    if len(short):
        finer = best_tilted_margins(samples.at(short), at.margins, at.transform, rings=OPTIONS.rings)
        margins[short], leans[short] = finer
    return margins, leans


def in_cones(problem: PlacementProblem, own: Floats, limit: float) -> list[PlacementProblem]:
    """Return a problem, and the same one with wider cones.

    own (N, 3): axes of the toolpath. limit: largest angle of the tool from these, radians, where it exceeds the cone.
    """
    found = [problem]
    for degrees in OPTIONS.wider_deg:
        cone = min(float(np.radians(degrees)), limit)
        if 0.0 < found[-1].samples.tilt < cone:
            found.append(problem.along(problem.samples.widened(own, cone, limit)))
    return found


def leans_as_planned(
    problem: PlacementProblem,
    at: Candidate,
    path: Toolpath,
    placed: PlacedPath,
    limit: float,
    progress: Progress = silent,
) -> tuple[PlacementProblem, Floats] | None:
    """Return leans (N, 3) of a path near those of a plan of nearly the same path; None where none were found.

    With them comes the problem, which may have a wider cone.

    problem: at all waypoints of the path, with the common axis of that plan; at: a candidate at its placement. limit:
    as for `in_cones`.
    """
    samples, options = problem.samples, OPTIONS
    if samples.tilt == 0.0:
        return None
    known, wanted = (np.hstack([each.tilt_centres, options.lever * each.axes]) for each in (placed.toolpath, path))
    axes = placed.placement.transform.inverse().rotate(placed.axes)[KDTree(known).query(wanted)[1]]
    leans = axes / (axes * samples.nominal).sum(axis=1, keepdims=True) - samples.nominal
    smallest = float(problem.values_of(at.margins, at.transform, leans).min())
    # Where the leans keep little by themselves, they come up to what the plan had, with the spare.
    keep = max(ENOUGH, min(options.kept * placed.smallest_margin, max(smallest, asked())))
    steepest = np.linalg.norm(leans, axis=1)
    cones = in_cones(problem, path.axes, limit)
    wide = next((each for each in cones if (steepest <= each.longest()).all()), cones[-1])
    found = along_spline(wide, at, keep, leans, progress, SMOOTHING)
    return None if found is None else (wide, found)


def along_spline(
    problem: PlacementProblem,
    at: Candidate,
    keep: float,
    leans: Floats,
    progress: Progress,
    options: SmoothingOptions,
) -> Floats | None:
    """Return leans (N, 3) of a smooth spline from given ones that keeps a margin, or a part of it; None without."""
    spline = smoothed(problem, at, keep, options, progress, leans)
    return None if spline is None else AxisSpline.of(problem.samples, problem.cone).leans(spline)


def restored_along_spline(
    problem: PlacementProblem, at: Candidate, keep: float, leans: Floats, progress: Progress
) -> Floats | None:
    """Return leans (N, 3) of a spline through given ones that keep a margin, or come nearer to it.

    They change where the spline does not keep it. None where they exceed the limit of the axes.
    """
    programs = AxisPrograms(problem, at, QUICKLY)
    c, margins = restored_everywhere(programs, programs.spline.fitted(leans), keep, progress)
    return None if programs.beyond_own_limit(margins, keep) else programs.spline.leans(c)
