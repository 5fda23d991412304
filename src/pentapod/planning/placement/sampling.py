"""Random sampling of placements: first guesses, ranked by their smallest margin over a few waypoints."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from heapq import heapify, heappop, heappush

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.geometry.directions import tangent_frame
from pentapod.geometry.rigid import RigidTransform
from pentapod.machine.machine import Machine
from pentapod.planning.limits.margins import Margins
from pentapod.planning.problem.problem import Candidate, PlacementProblem
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.planning.problem.tilt_field import lean, tilts
from pentapod.planning.problem.tool_access import tool_gaps


@dataclass(frozen=True)
class SamplingOptions:
    """How many random placements are tried, and which are kept.

    tries: for each branch. kept: guesses of each branch at most, which differ by apart_m in place or apart_rad in
    orientation. ranked: the best that are refined. largest_slope: greatest angle of the part's mean axis from the base
    normal, radians. judged: waypoints at which a placement is judged; first: of them, at which all are. spreads:
    standard deviations in metres of the samples around the best, one round each. fitted: waypoints to which the first
    tilt field is fitted.
    """

    tries: int = 12_000
    kept: int = 6
    ranked: int = 48
    apart_m: float = 0.02
    apart_rad: float = float(np.radians(15.0))
    largest_slope: float = float(np.radians(40.0))
    judged: int = 12
    first: int = 3
    spreads: tuple[float, ...] = (0.08, 0.03)
    fitted: int = 192


OPTIONS = SamplingOptions()


@dataclass(frozen=True, eq=False)
class Guess:
    """A placement in the branch of its margins, with its smallest margin over the representatives."""

    margins: Margins
    transform: RigidTransform
    margin: float


def first_guesses(problem: PlacementProblem, seed: int = 0, options: SamplingOptions = OPTIONS) -> Iterator[Guess]:
    """Yield the best few random placements, none near another of its branch, the best first; the same for a seed.

    Each placement is judged at a few representatives with their nominal axes, the best ones again with a cone of tilts.
    Obstacles take most of the time, and no margin is larger with them: only placements are judged with them that are
    among the best without them, when they are asked for.
    """
    samples, machine, constraints, tries = problem.samples, problem.machine, problem.constraints, options.tries
    rng = np.random.default_rng(seed)
    rows = samples.representatives(options.judged)
    centre, mean_axis = samples.tilt_centres.mean(axis=0), samples.nominal.mean(axis=0)
    mean_axis = mean_axis / max(float(np.linalg.norm(mean_axis)), 1e-9)
    few = samples.at(rows)
    gaps = tool_gaps(few, problem.margins[0].scene)
    waiting: list[tuple[float, bool, int, int]] = []
    found: list[list[RigidTransform]] = []
    for branch, margins in enumerate(problem.margins):
        rotations = _rotations(mean_axis, -float(margins.scene.branch.w), tries, options.largest_slope, rng)
        places = _places(machine, tries, rng)
        if constraints.is_bounded:
            rotations, origins = constraints.within(rotations, places - rotations @ centre, rng)
            places = origins + rotations @ centre
        for spread in options.spreads:
            best = _best(samples, margins, rotations, places - rotations @ centre, rows, options)
            repeat = tries // 3 // len(best)
            turned, near = rotations[best].repeat(repeat, axis=0), places[best].repeat(repeat, axis=0)
            rotations = np.concatenate([rotations[best], _turned(turned, spread, rng)])
            places = np.concatenate([places[best], near + rng.normal(scale=spread, size=near.shape)])
            if constraints.is_bounded:
                rotations, origins = constraints.nearest(rotations, places - rotations @ centre)
                places = origins + rotations @ centre
        translations = places - rotations @ centre
        best = _best(samples, margins, rotations, translations, rows, options)
        poses = [RigidTransform(_orthonormal(rotations[k]), translations[k]) for k in best]
        found.append([constraints.nearest_to(pose) for pose in poses])
        bounds = _without_obstacles(few, margins, found[-1]).tolist()
        waiting += [(-bound, False, branch, k) for k, bound in enumerate(bounds)]
    heapify(waiting)
    middle, kept = few.tilt_centres.mean(axis=0), [list[RigidTransform]() for _ in found]
    while waiting:
        negative, judged, branch, k = heappop(waiting)
        margins, pose = problem.margins[branch], found[branch][k]
        if len(kept[branch]) == options.kept or any(_near(pose, other, middle, options) for other in kept[branch]):
            continue
        if not judged and margins.scene.collision_world.obstacles:
            heappush(waiting, (-float(best_tilted_margins(few, margins, pose, gaps)[0].min()), True, branch, k))
        else:
            kept[branch].append(pose)
            yield Guess(margins, pose, -negative)


def best_guess(problem: PlacementProblem, seed: int, options: SamplingOptions, waypoints: int) -> float:
    """Return the margin of the best first guess.

    waypoints: number that represents the path where the placements are given.
    """
    if problem.constraints.moves:
        return next(first_guesses(problem, seed, options)).margin
    few = problem.samples.at(problem.samples.representatives(waypoints))
    poses, gaps = problem.constraints.poses, tool_gaps(few, problem.margins[0].scene)
    return max(float(best_tilted_margins(few, m, pose, gaps)[0].min()) for m in problem.margins for pose in poses)


def fitted_gaps(problem: PlacementProblem) -> Floats | None:
    """Return the gaps of the tool at the waypoints to which first tilt fields are fitted, as `tool_gaps`."""
    samples = problem.samples
    if samples.tilt == 0.0:
        return None
    return tool_gaps(samples.at(samples.representatives(OPTIONS.fitted)), problem.margins[0].scene)


def first_candidate(
    problem: PlacementProblem, margins: Margins, transform: RigidTransform, gaps: Floats | None = None
) -> Candidate:
    """Return the candidate with a smooth field fitted to the best tilts of single waypoints (least squares).

    gaps: `fitted_gaps` of the problem, where they are known.
    """
    coefficients, samples, domain = problem.upright, problem.samples, problem.domain
    if samples.tilt > 0.0:
        rows = samples.representatives(OPTIONS.fitted)
        _, leans = best_tilted_margins(samples.at(rows), margins, transform, gaps)
        # Small weights of roughness and size regularise the fit.
        smooth = np.vstack([0.3 * domain.roughness(), 1e-3 * np.eye(domain.size)])
        wanted = np.vstack([leans @ domain.lean_plane.T, np.zeros((len(smooth), 2))])
        fitted = np.linalg.lstsq(np.vstack([problem.basis[rows], smooth]), wanted, rcond=None)[0]
        coefficients = problem.within_cone(np.asarray(fitted, dtype=np.float64))
    return problem.candidate(margins, transform, coefficients)


def best_tilted_margins(
    samples: ToolpathSamples,
    margins: Margins,
    placement: RigidTransform,
    gaps: Floats | None = None,
    block: int = 4096,
    rings: int = 2,
) -> tuple[Floats, Floats]:
    """Return margins (N, M) and leans (N, 3) at each waypoint's best tilt of a grid over the cone.

    gaps: `tool_gaps` of these samples, where they are known. rings: of the grid.
    """
    out, leans = np.empty((len(samples.tilt_centres), len(margins.limits))), np.empty((len(samples.tilt_centres), 3))
    for start in range(0, len(out), block):
        rows = np.arange(start, min(start + block, len(out)))
        b = tilted(samples, rows, rings)
        axes = lean(samples.nominal[rows], b)
        poses, inside = samples.machine_poses(placement, axes, rows), samples.inside(axes, rows)
        all_margins = margins(*poses, placement, None if gaps is None else gaps[:, rows])
        if inside is not None:
            all_margins[inside < 0.0] = -np.inf
        choice = all_margins.min(axis=-1).argmax(axis=0)
        out[rows] = all_margins[choice, np.arange(len(rows))]
        leans[rows] = b[choice, np.arange(len(rows))]
    return out, leans


def tilted(samples: ToolpathSamples, rows: Ints, rings: int = 2) -> Floats:
    """Return the leans (K, n, 3) of a grid over the cone at waypoints `rows`. rings: of the grid."""
    grid = tilts(samples.tilt, rings)
    t1, t2 = tangent_frame(samples.nominal[rows])
    leans = samples.room(rows)[:, None] * (grid[:, None, :1] * t1 + grid[:, None, 1:] * t2)
    return np.asarray(leans, dtype=np.float64)


def _best(
    samples: ToolpathSamples, margins: Margins, r: Floats, t: Floats, rows: Ints, options: SamplingOptions
) -> Ints:
    """Return the best `ranked` of placements r (S, 3, 3), t (S, 3) by their smallest margin at `rows`.

    No margin is above the smallest at the first rows, without that of legs from each other: so most placements are
    judged there alone.
    """
    score = _score(samples, margins, r, t, rows[: options.first], pairs=False)
    order, block = np.argsort(-score, kind="stable"), 4 * options.ranked
    exact = np.full(len(score), -np.inf)
    for start in range(0, len(order), block):
        chosen = order[start : start + block]
        best = np.sort(exact)[-options.ranked :]
        if len(best) == options.ranked and score[chosen[0]] < best[0]:
            break
        exact[chosen] = _score(samples, margins, r[chosen], t[chosen], rows)
    return np.argsort(-exact, kind="stable")[: options.ranked]


def _without_obstacles(few: ToolpathSamples, margins: Margins, poses: list[RigidTransform]) -> Floats:
    """Return the smallest margin (G,) of each placement without obstacles, each waypoint at its best tilt."""
    first, second = tangent_frame(few.nominal)
    grid = tilts(few.tilt)
    aside = few.room(slice(None))[:, None] * (grid[:, None, :1] * first + grid[:, None, 1:] * second)
    rotations, translations = np.stack([p.rotation for p in poses]), np.stack([p.translation for p in poses])
    axes = np.einsum("gij,knj->gkni", rotations, lean(few.nominal, aside))
    centres = np.einsum("gij,nj->gni", rotations, few.tilt_centres) + translations[:, None]
    return margins.least_own(centres[:, None] - few.tilt_centre * axes, axes).max(axis=1).min(axis=-1)


def _near(one: RigidTransform, other: RigidTransform, centre: Floats, options: SamplingOptions) -> bool:
    """Return whether two placements of a path with this centre are alike."""
    apart = float(np.linalg.norm(one.apply(centre) - other.apply(centre)))
    turn = 0.5 * (float(np.trace(one.rotation.T @ other.rotation)) - 1.0)
    return apart < options.apart_m and turn > np.cos(options.apart_rad)


def _score(
    samples: ToolpathSamples, margins: Margins, r: Floats, t: Floats, rows: Ints, *, pairs: bool = True
) -> Floats:
    """Return the smallest margins (S,) at `rows`. pairs: as for `Margins.least_own`."""
    turned = np.einsum("sij,nj->sni", r, samples.nominal[rows])
    tips = np.einsum("sij,nj->sni", r, samples.tilt_centres[rows]) + t[:, None, :] - samples.tilt_centre * turned
    return margins.least_own(tips, turned, pairs=pairs).min(axis=-1, initial=np.inf)


def _rotations(mean_axis: Floats, side: float, count: int, slope: float, rng: np.random.Generator) -> Floats:
    """Return rotations (count, 3, 3) that turn the mean tool axis to within `slope` radians of side · z."""
    cosine = rng.uniform(np.cos(slope), 1.0, count)
    azimuth, spin = rng.uniform(0.0, 2.0 * np.pi, (2, count))
    sine = np.sqrt(1.0 - cosine * cosine)
    target = np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), side * cosine], axis=1)
    t1, t2 = tangent_frame(target)
    c, s = np.cos(spin)[:, None], np.sin(spin)[:, None]
    to = np.stack([c * t1 + s * t2, -s * t1 + c * t2, target], axis=2)
    m1, m2 = tangent_frame(mean_axis)
    return to @ np.stack([m1, m2, mean_axis])


def _places(machine: Machine, count: int, rng: np.random.Generator) -> Floats:
    """Return random places (count, 3) for the path's centre: a third near the work volume, the rest within reach."""
    base, reach = machine.robot.base_joints[:, :2], float(machine.legs.max_length.max()) + abs(machine.tool_length)
    low, high = base.min(axis=0), base.max(axis=0)
    side = np.sign(machine.joints.base_axes[:, 2].sum()) or 1.0
    wide = np.column_stack([rng.uniform(low, high, (count, 2)), side * rng.uniform(0.1, 1.0, count) * reach])
    near = machine.work.centre + rng.normal(scale=0.25 * machine.work.diameter, size=(count, 3))
    return np.where((np.arange(count) % 3 == 0)[:, None], near, wide)


def _turned(rotations: Floats, spread: float, rng: np.random.Generator) -> Floats:
    """Return rotations (S, 3, 3) turned by small random angles."""
    a = rng.normal(scale=2.0 * spread, size=(len(rotations), 3))
    small = np.zeros((len(a), 3, 3))
    small[:, 0, 1], small[:, 0, 2], small[:, 1, 2] = -a[:, 2], a[:, 1], -a[:, 0]
    small -= small.transpose(0, 2, 1)
    return _orthonormal(rotations @ (np.eye(3) + small))


def _orthonormal(matrix: Floats) -> Floats:
    """Return the orthonormal matrices (..., 3, 3) nearest to given ones."""
    u, _, v = np.linalg.svd(matrix)
    return u @ v
