"""Figures of what is measured: calibration of `desk`, registration of shipped parts, modes of machines as built.

    python benchmarks/measuring.py            # or: make bench-machines

Machines, readings and touches are made here, by formulas of this file, with errors of fixed seeds. Peers: as many poses
drawn at random for the chosen ones; SciPy's `root` from random starts for the search of all modes.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from pentapod.geometry import RigidTransform
from pentapod.kinematics import AsBuiltPentapod, Component, all_poses, as_built_pose
from pentapod.machine import Machine, calibrate, sample_work_volume
from pentapod.machine.identification.observations import PoseObservations
from pentapod.machine.identification.pose_choice import choose_poses
from pentapod.machine.identification.sensitivity import tip_by_parameters
from pentapod.mesh import load_mesh
from pentapod.mesh.query.distance import MeshDistance
from pentapod.registration import CutSurface, NotRegistered, register

TOOLPATHS = Path(__file__).parents[1] / "toolpaths"
MACHINE = Machine.load("desk")
DESIGN, TOOL = AsBuiltPentapod.of(MACHINE.robot), MACHINE.tool_length
LEGS, PLACES, AXES = 2e-6, 10e-6, 20e-6
POSES, TOUCHES, TIP, NOISE = 20, 40, 2e-3, 5e-6


def built(rng: np.random.Generator, ring: float = 0.5e-3) -> AsBuiltPentapod:
    """Return a machine with errors of fractions of a millimetre, and rings up to `ring`."""
    return AsBuiltPentapod.of(
        MACHINE.robot,
        base_errors=rng.normal(size=(5, 3)) * 0.3e-3,
        offset_errors=rng.normal(size=5) * 0.2e-3,
        radii=rng.uniform(0.2, 1.0, 5) * ring,
        zeros=rng.normal(size=5) * 0.5e-3,
    )


def struts(real: AsBuiltPentapod, p: np.ndarray, i: np.ndarray) -> np.ndarray:
    """Return readings (N, 5): along and across the line from each base joint."""
    unit = i[:, None] / np.linalg.norm(i, axis=1)[:, None, None]
    d = real.base - p[:, None]
    along = (d * unit).sum(axis=2)
    across = np.linalg.norm(d - along[..., None] * unit, axis=2)
    return np.sqrt((along - real.offsets) ** 2 + (across - real.radii) ** 2) + real.zeros


def drawn(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Return positions and directions (n, 3) of platforms in the work volume."""
    work, (turn, side) = MACHINE.work, rng.uniform(0.0, 2.0 * np.pi, (2, n))
    radius, lean = 0.5 * work.diameter * np.sqrt(rng.random(n)), work.tilt * np.sqrt(rng.random(n))
    tips = work.centre + np.c_[radius * np.cos(turn), radius * np.sin(turn), work.height * (rng.random(n) - 0.5)]
    i = np.c_[np.sin(lean) * np.cos(side), np.sin(lean) * np.sin(side), np.cos(lean)]
    return tips - TOOL * i, i


def calibrations(trials: int) -> None:
    """Calibrate machines from chosen poses and from random ones; print tip errors and the share beyond 2 sigma."""
    rng = np.random.default_rng(0)
    p, i = drawn(rng, 400)
    seen = PoseObservations(p, i, DESIGN.leg_lengths(p, i), DESIGN, PLACES, AXES)
    covariances = seen.instrument_covariances + LEGS**2 * np.eye(5)
    columns = np.linalg.solve(np.linalg.cholesky(covariances), seen.columns(seen.start))
    where, along = sample_work_volume(MACHINE.work, rings=1, around=6, levels=2)
    chosen = choose_poses(columns, tip_by_parameters(DESIGN, where + TOOL * along, -along, TOOL), POSES)
    fresh = drawn(rng, 200)
    tips = fresh[0] + TOOL * fresh[1]
    errors: dict[str, list[float]] = {"chosen": [], "random": [], "as designed": []}
    beyond: list[float] = []
    for _ in range(trials):
        real = built(rng)
        for name in ("chosen", "random"):
            rows = chosen.chosen if name == "chosen" else rng.choice(len(p), POSES, replace=False)
            q, k = p[rows], i[rows]
            legs = struts(real, q, k) + LEGS * rng.normal(size=(POSES, 5))
            k = k + AXES * np.cross(rng.normal(size=k.shape), k)
            k /= np.linalg.norm(k, axis=1)[:, None]
            q = q + PLACES * rng.normal(size=q.shape)
            found = calibrate(q, k, legs, MACHINE.robot, leg_sigma=LEGS, position_sigma=PLACES, direction_sigma=AXES)
            errors[name].append(_tip_error(found.machine, real, fresh, tips))
            off = np.abs(_numbers(found.machine) - _numbers(real))
            beyond.append(float(np.mean(off > 2.0 * np.sqrt(np.diag(found.covariance)))))
        errors["as designed"].append(_tip_error(DESIGN, real, fresh, tips))
    means = {name: 1e6 * float(np.sqrt(np.mean(np.square(each)))) for name, each in errors.items()}
    print(
        f"calibration, {POSES} poses, {trials} machines: tip error {means['chosen']:.1f} um (predicted "
        f"{1e6 * chosen.tip_sigma:.1f}), from random poses {means['random']:.1f}, as designed "
        f"{means['as designed']:.0f}; beyond 2 sigma {np.mean(beyond):.2%} of the numbers (4.55 % expected)"
    )


def _numbers(machine: AsBuiltPentapod) -> np.ndarray:
    return np.c_[machine.base, machine.offsets, machine.radii, machine.zeros].ravel()


def _tip_error(
    believed: AsBuiltPentapod, real: AsBuiltPentapod, poses: tuple[np.ndarray, np.ndarray], tips: np.ndarray
) -> float:
    """Return the root mean square of the tip's error, metres, where the legs are set after `believed`."""
    reached = as_built_pose(real, MACHINE.robot, believed.leg_lengths(*poses), Component(1, 1))
    return float(np.sqrt(np.square(reached.position + TOOL * reached.direction - tips).sum(axis=1).mean()))


def registrations(part: str, trials: int) -> None:
    """Find a shipped part from touches of its upper side; print by how much the surface is off along its normals."""
    mesh = load_mesh(TOOLPATHS / f"{part}.stl", "mm")
    surface, above = MeshDistance.of(mesh), np.flatnonzero(mesh.facet_normals[:, 2] > 0.2)
    corners = mesh.vertices[mesh.faces]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    rows = above[:: max(1, len(above) // 400)]
    cut = CutSurface(mesh.vertices[mesh.faces[rows]].reshape(-1, 3), np.repeat(mesh.facet_normals[rows], 3, axis=0))
    errors, refused, names = [], 0, set[str]()
    for seed in range(trials):
        rng = np.random.default_rng(seed)
        facets = rng.choice(above, 4 * TOUCHES, p=areas[above] / areas[above].sum())
        weights = rng.dirichlet(np.ones(3), len(facets))
        centres = (weights[:, :, None] * mesh.vertices[mesh.faces[facets]]).sum(axis=1)
        centres += TIP * mesh.facet_normals[facets]
        free = surface.points(centres).distance > TIP - 1e-9
        turn = Rotation.from_rotvec(np.radians(2.0) * rng.normal(size=3)).as_matrix()
        truth = RigidTransform(turn, 2e-3 * rng.normal(size=3))
        touched = truth.apply(centres[free][:TOUCHES]) + NOISE * rng.normal(size=(TOUCHES, 3))
        answer = register(surface, touched, TIP, RigidTransform.identity(), cut)
        found = answer.found if isinstance(answer, NotRegistered) else answer
        if isinstance(answer, NotRegistered):
            refused += 1
            names |= set() if found is None else {motion.name for motion in found.held}
        if found is not None:
            off = found.placement.apply(cut.points) - truth.apply(cut.points)
            errors.append(np.abs((off * truth.rotate(cut.normals)).sum(axis=1)).max())
    print(
        f"registration of {part}, {TOUCHES} touches at {1e6 * NOISE:g} um, {trials} placements: surface off by "
        f"{1e6 * np.median(errors):.1f} um at worst (median); refused {refused}" + (f", {min(names)}" if names else "")
    )


def modes(machines: int, starts: int) -> None:
    """Search for all modes of machines as built, with rings on every second one; compare with SciPy's."""
    counts: dict[int, int] = {}
    complete, fewer, more, own, theirs = 0, 0, 0, 0.0, 0.0
    for seed in range(machines):
        rng = np.random.default_rng(seed)
        real = built(rng, 0.03 if seed % 2 else 1e-6)
        readings = struts(real, *drawn(rng, 1))[0]
        begin = time.process_time()
        found = all_poses(real, readings)
        own += time.process_time() - begin
        complete += found.complete
        counts[len(found.position)] = counts.get(len(found.position), 0) + 1
        begin, seen = time.process_time(), list[np.ndarray]()
        for _ in range(starts):
            x = np.concatenate([rng.uniform(-1.0, 1.0, 3), rng.normal(size=3)])

            def off(y: np.ndarray, real: AsBuiltPentapod = real, readings: np.ndarray = readings) -> np.ndarray:
                return np.append(struts(real, y[None, :3], y[None, 3:])[0] - readings, y[3:] @ y[3:] - 1.0)

            answer = root(off, x, tol=1e-13)
            if np.abs(off(answer.x)).max() < 1e-10 and all(np.abs(answer.x - y).max() > 1e-6 for y in seen):
                seen.append(answer.x)
        theirs += time.process_time() - begin
        fewer, more = fewer + (len(seen) < len(found.position)), more + (len(seen) > len(found.position))
    print(
        f"modes of {machines} machines: {dict(sorted(counts.items()))} by number of modes, {complete} proven complete; "
        f"SciPy from {starts} starts finds fewer on {fewer}, more on {more}; {1e3 * own / machines:.0f} ms each, SciPy "
        f"{theirs / own:.0f} x"
    )


def main() -> None:
    """Print a line for each figure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=40, help="calibrations")
    parser.add_argument("--machines", type=int, default=40, help="machines whose modes are searched for")
    parser.add_argument("--starts", type=int, default=200, help="SciPy's starts for each of them")
    options = parser.parse_args()
    calibrations(options.trials)
    for part in ("saddle", "wavy", "dome"):
        registrations(part, 8)
    modes(options.machines, options.starts)


if __name__ == "__main__":
    main()
