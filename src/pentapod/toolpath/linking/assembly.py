"""Assembly of a toolpath from contact paths: waypoints, order, links, tips; the last step of every strategy."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.cutters.tool import Tool
from pentapod.geometry.directions import tangent_frame
from pentapod.geometry.runs import run_starts
from pentapod.mesh.passes import Passes
from pentapod.toolpath.lines.resampling import resample
from pentapod.toolpath.linking.linking import Linker, Run
from pentapod.toolpath.linking.ordering import aligned, ordered
from pentapod.toolpath.linking.tour import travel, travel_bound
from pentapod.toolpath.options import PathOptions
from pentapod.toolpath.path_report import PathReport
from pentapod.toolpath.strategy import ContactPaths, Order, empty_region
from pentapod.toolpath.surface import Surface
from pentapod.toolpath.toolpath import Toolpath


@dataclass(frozen=True)
class AssemblyOptions:
    """reach: distance in stepovers up to which links stay on the surface, if `PathOptions.stay` is None.

    reach_of_beam: the same in approach heights, of a tool that stands off from the part, where that is more: a retract
    and an approach, with stops at their corners, take longer than the way over the surface.
    hidden_slack: height of the part above a waypoint, metres, from which it is hidden. halvings: of the step between a
    waypoint that is hidden and one that is not, to find where the pass ends. least_cosine: of the region's angle, for
    the height of the surface above lines below it.
    """

    reach: float = 3.0
    reach_of_beam: float = 4.0
    hidden_slack: float = 1e-6
    halvings: int = 6
    least_cosine: float = 0.05


def assembled(
    strategy: str,
    surface: Surface,
    tool: Tool,
    options: PathOptions,
    paths: ContactPaths,
    assembly: AssemblyOptions = AssemblyOptions(),
) -> tuple[Toolpath, PathReport]:
    """Return the toolpath along contact paths, and its report.

    Nominal axes are the surface's smooth normals. The motion begins and ends at the clearance level. Raises
    ToolpathError if no pass is left.
    """
    passes, source, hidden = _waypoints(paths, surface, options, assembly)
    shortest = options.shortest_pass(paths.stepover)
    long = passes.lengths >= shortest
    dropped, dropped_length = int((~long).sum()), float(passes.lengths[~long].sum())
    passes, source = passes.where(long), source[long]
    if not len(passes):
        raise empty_region(surface.part, options, dropped, shortest)
    # A pass may become several: levels carry its number meanwhile.
    levels = passes.levels
    passes = surface.waypoints(replace(passes, levels=np.arange(len(passes))), options)
    if not len(passes):
        raise empty_region(surface.part, options, dropped, shortest)
    source, passes = source[passes.levels], replace(passes, levels=levels[passes.levels])
    power = np.ones(len(passes)) if paths.power is None else paths.power[source]
    reach = assembly.reach * paths.stepover if options.stay is None else options.stay
    if tool.tilt_centre < 0.0 and options.stay is None:  # it stands off
        reach = max(reach, assembly.reach_of_beam * options.approach)
    # A proven link may be of any length, but not back along a pass that is cut one way.
    anywhere = surface.slides and paths.both_ways and options.stay is None
    runs: list[Run] = []
    for entry in ordered(passes, paths.order, paths.both_ways, reach):
        rows = np.arange(len(passes.points))[passes.rows(entry.index)]
        if passes.closed[entry.index] and paths.order is not Order.GIVEN:
            # A closed pass begins where it is nearest to the end of the previous one.
            here = runs[-1].contacts[-1] if runs else passes.points[rows[0]]
            begin = int(np.linalg.norm(passes.points[rows[:-1]] - here, axis=1).argmin())
            rows = np.concatenate([rows[begin:-1], rows[: begin + 1]])
        rows = rows[::-1] if entry.backwards else rows
        stay = np.inf if anywhere else reach if entry.near else 0.0
        stay = stay if paths.depth == 0.0 else 0.0
        runs.append(Run(passes.points[rows], passes.normals[rows], float(power[entry.index]), stay))
    linker = Linker(surface, tool, options, runs=runs, stepover=paths.stepover or options.spacing)
    toolpath = linker.toolpath()
    firsts, lasts = np.stack([r.contacts[0] for r in runs]), np.stack([r.contacts[-1] for r in runs])
    report = PathReport(
        strategy=strategy,
        passes=len(passes),
        waypoints=len(toolpath),
        stepover=paths.stepover,
        cut_length=float(passes.lengths.sum()),
        stay_downs=linker.stay_downs,
        hops=linker.hops,
        retracts=len(passes) - linker.stay_downs - linker.hops,
        travel=travel(firsts, lasts),
        travel_bound=travel_bound(firsts, lasts),
        dropped=dropped,
        dropped_length=dropped_length,
        hidden=hidden,
        tight=surface.tight(passes),
        notes=paths.notes,
    )
    return toolpath, report


def _waypoints(
    paths: ContactPaths, surface: Surface, options: PathOptions, assembly: AssemblyOptions
) -> tuple[Passes, Ints, int]:
    """Return the waypoints without those that the part hides, the pass (P,) that each comes from, and how many hide."""
    passes, hidden = paths.passes, 0
    if paths.order is Order.ZIGZAG:
        passes = aligned(passes, tangent_frame(options.up)[0])
    # Resampling drops passes and hiding splits them; levels are kept, so they carry the number of the pass meanwhile.
    levels = passes.levels
    passes = resample(
        replace(passes, levels=np.arange(len(passes))),
        chordal=options.chordal,
        spacing=options.spacing,
        axis_step=options.axis_step if surface.turns else np.inf,
        closest=min(options.closest, options.chordal),
    )
    if not paths.visible:
        # A line below the surface is hidden by the surface itself, up to its depth measured along the view.
        slack = assembly.hidden_slack + paths.depth / max(np.cos(options.region.within), assembly.least_cosine)
        passes, hidden = _seen(passes, surface, slack, options.closest, assembly.halvings)
    source = passes.levels
    return replace(passes, levels=levels[source]), source, hidden


def _seen(passes: Passes, surface: Surface, slack: float, closest: float, halvings: int) -> tuple[Passes, int]:
    """Return the passes as far as the part does not hide them, and how many waypoints it hides.

    On a drive surface they end where it begins to, as far as halving finds the place; no waypoint is nearer than
    `closest` metres to it. On the part itself they end at the last waypoint: a chord between two is not on the part.
    """
    keep = ~surface.hides(passes.points, slack)
    if keep.all():
        return passes, 0
    if not surface.slides:
        return passes.split(keep), int((~keep).sum())
    rows = np.flatnonzero(passes.within & (keep[1:] != keep[:-1]))
    out, into = np.where(keep[rows], rows, rows + 1), np.where(keep[rows], rows + 1, rows)
    low, high = np.zeros(len(rows)), np.ones(len(rows))

    def between(values: Floats, share: Floats) -> Floats:
        return values[out] + share[:, None] * (values[into] - values[out])

    for _ in range(halvings):
        middle = 0.5 * (low + high)
        seen = ~surface.hides(between(passes.points, middle), slack)
        low, high = np.where(seen, middle, low), np.where(seen, high, middle)
    far = low * passes.steps[rows] > closest
    points, normals = (
        np.insert(values, rows[far] + 1, between(values, low)[far], axis=0)
        for values in (passes.points, passes.normals)
    )
    counts = np.diff(passes.starts) + np.bincount(passes.pass_of_point[rows[far]], minlength=len(passes))
    whole = Passes(points, normals, run_starts(counts), passes.levels)
    return whole.split(np.insert(keep, rows[far] + 1, True)), int((~keep).sum())
