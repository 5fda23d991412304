"""Find a machine: how the shipped machines `desk`, `steep` and `bench-general` were designed.

A linear pentapod has few numbers: five base joints (x, y), the platform joints along the tool axis (in the quadratic
family at delta · x, in the general one anywhere), the length from the lowest platform joint to the tip, and where the
work lies. Most choices are useless: legs cross each other or the spindle, or small forces at the tip become large ones
in the legs. This script samples the work volume, prices what each design lacks there, and lowers the price with CMA-ES
(N. Hansen, "The CMA evolution strategy: a tutorial", 2016) from many starts, all candidates of a generation evaluated
at once with NumPy.

    python examples/01_design_a_machine.py --machine steep --minutes 20 --seed 1

prints each improvement as numbers that go into a machine file; `pentapod machine check FILE` then judges that
file by dense sampling. Shipped designs are rounded to whole millimetres.
"""

from __future__ import annotations

import argparse
import itertools
import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from pentapod.machine import segment_distance

LEG_RADIUS, SHAFT_RADIUS, JOINT_RADIUS, SHAFT_END = 0.008, 0.012, 0.080, 0.060
PAIRS = np.array(list(itertools.combinations(range(5), 2)))

REST_LOW, REST_HIGH = [0.09, -0.35, -0.35, 0.35], [0.25, 0.35, 0.35, 1.00]


@dataclass(frozen=True, eq=False)
class Search:
    """What is looked for: bounds of the unknowns, the volume, needs, and where the search starts.

    Unknowns: x1..x5, y1..y5 (m); delta, or the five platform joints along the line (m); tip beyond the outermost
    platform joint (m); work centre (m).
    """

    low: np.ndarray
    high: np.ndarray
    start: np.ndarray
    wanted: dict[str, tuple[int, float, float, float]]
    tilt: float
    """Degrees of the cone of tool axes."""
    dome_tilt: float
    """Degrees by which the tool leans at the corners of the dome."""

    def unpacked(self, designs: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return base joints (n, 5, 2), platform joints (n, 5), tool lengths (n,) and work centres (n, 3)."""
        base = np.stack([designs[:, 0:5], designs[:, 5:10]], axis=-1)
        along, beyond, centre = designs[:, 10:-4], designs[:, -4], designs[:, -3:]
        offsets = along if along.shape[1] == 5 else along * base[..., 0]
        return base, offsets, offsets.max(axis=1) + beyond, centre


@dataclass(frozen=True)
class Volume:
    """Tips in a cylinder with tool axes in a cone about the vertical, and a dome (metres, radians)."""

    diameter: float
    height: float
    tilt: float
    dome_tilt: float

    def poses(self, around: int, heights: int, azimuths: int) -> tuple[np.ndarray, np.ndarray]:
        """Return tips (m, 3) relative to the centre and platform directions (m, 3), on the boundary."""
        turn = 2.0 * np.pi * np.arange(around) / around
        rim = 0.5 * self.diameter * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
        levels = np.linspace(-0.5, 0.5, heights) * self.height
        tips = np.array([[x, y, z] for x, y in rim for z in levels])
        lean = 2.0 * np.pi * (np.arange(azimuths) + 0.25) / azimuths
        s, c = np.sin(self.tilt), np.cos(self.tilt)
        axes = np.stack([s * np.cos(lean), s * np.sin(lean), np.full(azimuths, c)], axis=-1)
        tips, axes = np.repeat(tips, azimuths, axis=0), np.tile(axes, (len(tips), 1))
        dome = dome_poses(self.dome_tilt)
        return np.concatenate([tips, dome[0]]), np.concatenate([axes, dome[1]])


def dome_poses(lean: float) -> tuple[np.ndarray, np.ndarray]:
    """Return tips (m, 3) and platform directions (m, 3) at the corners of a square dome of 150 mm.

    The corners are where it is steepest, 40 degrees; the tool leans outwards by `lean`, or 12 degrees of
    azimuth to either side of that. Once on the surface, 19 mm below the dome's middle (+z is down), and once
    retracted by 25 mm.
    """
    turn = np.radians([45, 135, 225, 315])[:, None, None] + np.zeros((4, 3, 2))
    side = np.radians([-12, 0, 12])[None, :, None]
    lift = np.array([0.019, -0.006])[None, None, :]
    r = 0.075 * np.sqrt(2.0)
    tips = np.stack([r * np.cos(turn), r * np.sin(turn), lift + 0 * turn], axis=-1)
    s, c = np.sin(lean), np.cos(lean)
    axes = np.stack([-s * np.cos(turn + side), -s * np.sin(turn + side), c + 0 * turn], axis=-1)
    return tips.reshape(-1, 3), axes.reshape(-1, 3)


def figures(search: Search, designs: np.ndarray, tips: np.ndarray, axes: np.ndarray) -> dict[str, np.ndarray]:
    """Return what decides about each design (n,), the worst over all poses: metres, radians or ratios."""
    base, offsets, tool, centre = search.unpacked(designs)
    p = centre[:, None, :] + tips - tool[:, None, None] * axes  # (n, m, 3)
    joints = p[:, :, None, :] + offsets[:, None, :, None] * axes[:, None, :]  # (n, m, 5, 3)
    feet = np.concatenate([base, np.zeros((len(base), 5, 1))], axis=-1)[:, None]
    legs = joints - feet
    lengths = np.linalg.norm(legs, axis=-1)
    e = legs / lengths[..., None]

    a, b = PAIRS.T
    feet_all = np.broadcast_to(feet, joints.shape)
    between = segment_distance(feet_all[:, :, a], joints[:, :, a], feet_all[:, :, b], joints[:, :, b])
    top = p + offsets.min(axis=1)[:, None, None] * axes
    end = p + (tool - SHAFT_END)[:, None, None] * axes
    shaft = segment_distance(feet_all, joints - JOINT_RADIUS * e, top[:, :, None], end[:, :, None])
    to_axis = -np.einsum("nmki,mi->nmk", e, axes)  # cosine of leg (towards base) and tool axis: −e · −i
    gaps = np.diff(np.sort(offsets, axis=1), axis=1)
    feet_gap = np.linalg.norm(base[:, PAIRS[:, 0]] - base[:, PAIRS[:, 1]], axis=-1)
    mean = e.mean(axis=1)
    mean /= np.linalg.norm(mean, axis=-1, keepdims=True)
    singular = singular_distance(base, offsets, p, axes)
    return {
        "base radius": np.linalg.norm(base, axis=-1).max(axis=1),
        "leg ratio": lengths.max(axis=(1, 2)) / lengths.min(axis=(1, 2)),
        "shortest leg": lengths.min(axis=(1, 2)),
        "longest leg": lengths.max(axis=(1, 2)),
        "platform gap": gaps.min(axis=1),
        "platform length": np.ptp(offsets, axis=1),
        "base gap": feet_gap.min(axis=1),
        "leg clearance": between.min(axis=(1, 2)) - 2.0 * LEG_RADIUS,
        "shaft clearance": shaft.min(axis=(1, 2)) - LEG_RADIUS - SHAFT_RADIUS,
        "leg depth": shortfall(between - 2.0 * LEG_RADIUS),
        "shaft depth": shortfall(shaft - LEG_RADIUS - SHAFT_RADIUS),
        "joint angle": np.arccos(np.clip(-to_axis, -1, 1)).max(axis=(1, 2)),
        "top": top[..., 2].min(axis=1),
        "base cone": np.arccos(np.clip(np.einsum("nmki,nki->nmk", e, mean), -1, 1)).max(axis=(1, 2)),
        "S": np.maximum(singular.min(axis=1), -singular.max(axis=1)),
        "amplification": amplification(e, offsets, tool, axes),
    }


def singular_distance(base: np.ndarray, offsets: np.ndarray, p: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Return a lower bound (n, m), signed, of how far each pose can shift before it meets the singular surface.

    At one orientation the singularity polynomial is quadratic in the position; see `GeneralPentapod`. In the quadratic
    family it is linear, and the bound is the distance.
    """
    (x, y), z = np.moveaxis(base - base[:, 2:3], -1, 0), offsets - offsets[:, 2:3]
    rows = np.stack([z, -x, -y, -x * z, -y * z], axis=-1)[:, [0, 1, 3, 4]]
    null = np.linalg.svd(rows)[2][:, -1] * [1.0, -1.0, -1.0, -1.0, -1.0]
    n, nx, ny, nu, nv = null.T[..., None]
    u, v, w = axes.T
    px, py, pz = np.moveaxis(p + offsets[:, 2, None, None] * axes, -1, 0)
    px, py = px - base[:, 2, 0, None], py - base[:, 2, 1, None]
    ax, ay = pz * u - px * w, pz * v - py * w
    value = w * (n * pz + nx * ax + ny * ay) - pz * (nu * ax + nv * ay)
    along = nu * u + nv * v
    by_z = w * (n + nx * u + ny * v) - (nu * ax + nv * ay) - pz * along
    bent = np.sqrt(2.0 * (nu * nu + nv * nv) * w * w + 4.0 * along * along)
    squared = np.square(w * (nu * pz - nx * w)) + np.square(w * (nv * pz - ny * w)) + by_z * by_z + 1e-60
    return 2.0 * value / (np.sqrt(squared) + np.sqrt(squared + 2.0 * bent * np.abs(value)))


def shortfall(clearance: np.ndarray) -> np.ndarray:
    """Return how much is missing to 6 mm, over all pairs, on average over the poses (n,).

    Where bodies cross, the smallest clearance is flat; this mean still tells which way is out.
    """
    return np.maximum(0.006 - clearance, 0.0).sum(axis=2).mean(axis=1)


def amplification(e: np.ndarray, offsets: np.ndarray, tool: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Return the largest spectral norm (n,) of the map from tip force to leg forces."""
    u1 = np.cross(axes, [0.0, 1.0, 0.0])
    u1 /= np.linalg.norm(u1, axis=-1, keepdims=True)
    across = np.stack([u1, np.cross(axes, u1)], axis=-2)  # (m, 2, 3)
    rows = np.moveaxis(e, -2, -1)  # (n, m, 3, 5): forces along the legs, moments about the line's point p
    turning = np.einsum("mai,nmik->nmak", across, rows) * offsets[:, None, None, :]
    load = np.concatenate(
        [
            np.broadcast_to(np.eye(3), (*e.shape[:2], 3, 3)),
            tool[:, None, None, None] * np.broadcast_to(across, (*e.shape[:2], 2, 3)),
        ],
        axis=-2,
    )
    matrix = np.concatenate([rows, turning], axis=-2) + 1e-12 * np.eye(5)
    force = np.linalg.solve(matrix, load)
    gram = np.einsum("nmki,nmkj->nmij", force, force)
    gram = np.where(np.isfinite(gram), np.clip(gram, -1e12, 1e12), 1e12)
    return np.sqrt(np.linalg.eigvalsh(gram)[..., -1].max(axis=1))


# name: (sense, needed, wished, scale). Below the need a design costs ten times more than below the wish.
DESK: dict[str, tuple[int, float, float, float]] = {
    "base radius": (-1, 0.598, 0.595, 0.05),
    "leg ratio": (-1, 1.865, 1.84, 0.1),
    "shortest leg": (+1, 0.38, 0.38, 0.1),
    "platform gap": (+1, 0.045, 0.050, 0.02),
    "platform length": (-1, 0.45, 0.40, 0.1),
    "base gap": (+1, 0.120, 0.150, 0.05),
    "leg clearance": (+1, 0.005, 0.010, 0.01),
    "shaft clearance": (+1, 0.005, 0.010, 0.01),
    "leg depth": (-1, 0.0, 0.0, 0.001),
    "shaft depth": (-1, 0.0, 0.0, 0.001),
    "joint angle": (-1, np.radians(110), np.radians(105), 0.2),
    "top": (+1, 0.10, 0.15, 0.05),
    "base cone": (-1, np.radians(45), np.radians(30), 0.2),
    "S": (+1, 0.20, 0.25, 0.1),
    "amplification": (-1, 5.8, 5.0, 1.0),
}
# Tool axes to 45 degrees have a price: a larger base, longer legs (the shortest is as much longer than the stroke as in
# `desk`, 50 mm), wider joints, larger forces.
STEEP = DESK | {
    "leg ratio": (-1, 1.90, 1.89, 0.02),
    "base radius": (-1, 1.10, 1.00, 0.1),
    "platform length": (-1, 0.60, 0.45, 0.1),
    "joint angle": (-1, np.radians(130), np.radians(110), 0.2),
    "base cone": (-1, np.radians(55), np.radians(45), 0.2),
    "amplification": (-1, 8.0, 5.8, 1.0),
}

# Where the searches start: the shipped designs before rounding.
_DESK = np.array(
    [0.5857, 0.2240, -0.3260, -0.5966, -0.0554, -0.1203, 0.5538, 0.4981, -0.0389, -0.5952,
     0.1847, 0.0900, 0.0853, -0.0175, 0.4667]
)  # fmt: skip
_STEEP = np.array(
    [0.7760, 0.3196, -0.5737, -0.9889, -0.1366, 0.6302, -0.9473, -0.8187, 0.0838, 0.9903,
     0.1429, 0.0900, -0.0113, -0.0127, 0.4637]
)  # fmt: skip
_GENERAL = np.array(
    [0.0372, 0.3458, -0.5921, -0.2883, -0.4927, 0.5874, 0.4842, -0.0584, -0.5205, 0.0541,
     -0.1855, -0.0241, 0.1001, 0.0501, -0.1355, 0.0900, 0.3389, -0.2426, 0.5635]
)  # fmt: skip


def _bounds(base: float, along: list[tuple[float, float]]) -> tuple[np.ndarray, np.ndarray]:
    """Return bounds of the unknowns: base joints within ± base, those of the platform as given."""
    low, high = zip(*along, strict=True)
    return np.array([-base] * 10 + [*low, *REST_LOW]), np.array([base] * 10 + [*high, *REST_HIGH])


MACHINES = {
    "desk": Search(*_bounds(0.60, [(0.10, 0.60)]), _DESK, DESK, 26.0, 26.0),
    "steep": Search(*_bounds(1.20, [(0.10, 0.60)]), _STEEP, STEEP, 45.0, 26.0),
    "bench-general": Search(*_bounds(0.60, [(-0.25, 0.25)] * 5), _GENERAL, DESK, 30.0, 30.0),
}


def price(search: Search, designs: np.ndarray, tips: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Return the price (n,) of each design: 0 if every wish is met."""
    inside = np.clip(designs, search.low, search.high)
    values = figures(search, inside, tips, axes)
    total = 100.0 * np.abs(designs - inside).sum(axis=1)
    for name, (sense, need, wish, scale) in search.wanted.items():
        value = values[name]
        total += 10.0 * np.maximum(sense * (need - value), 0.0) / scale
        total += np.maximum(sense * (wish - value), 0.0) / scale
    return np.where(np.isfinite(total), total, 1e9)


def minimise(
    cost: Any,
    search: Search,
    start: np.ndarray,
    sigma: float,
    *,
    rng: np.random.Generator,
    generations: int,
    give_up: float,
) -> tuple[np.ndarray, float]:
    """Return the best point found and its cost: CMA-ES with the default constants of Hansen's tutorial."""
    n = len(start)
    size = 4 + int(3 * np.log(n)) + 12
    half = size // 2
    weights = np.log(half + 0.5) - np.log(np.arange(1, half + 1))
    weights /= weights.sum()
    mu = 1.0 / np.square(weights).sum()
    cc, cs = (4 + mu / n) / (n + 4 + 2 * mu / n), (mu + 2) / (n + mu + 5)
    c1 = 2 / ((n + 1.3) ** 2 + mu)
    cmu = min(1 - c1, 2 * (mu - 2 + 1 / mu) / ((n + 2) ** 2 + mu))
    damping = 1 + 2 * max(0.0, np.sqrt((mu - 1) / (n + 1)) - 1) + cs
    expected = np.sqrt(n) * (1 - 1 / (4 * n) + 1 / (21 * n * n))
    mean, spread = start.copy(), np.diag(np.square(search.high - search.low)) * 0.05
    path_c, path_s = np.zeros(n), np.zeros(n)
    best, best_cost = start, np.inf
    for g in range(generations):
        values, vectors = np.linalg.eigh(spread)
        root = vectors * np.sqrt(np.maximum(values, 1e-20))
        z = rng.standard_normal((size, n))
        y = z @ root.T
        x = mean + sigma * y
        costs = cost(x)
        order = np.argsort(costs)[:half]
        if costs[order[0]] < best_cost:
            best, best_cost = x[order[0]], float(costs[order[0]])
        step = weights @ y[order]
        mean = mean + sigma * step
        path_s = (1 - cs) * path_s + np.sqrt(cs * (2 - cs) * mu) * (vectors @ (weights @ (z[order])))
        short = np.linalg.norm(path_s) / np.sqrt(1 - (1 - cs) ** (2 * g + 2)) < (1.4 + 2 / (n + 1)) * expected
        path_c = (1 - cc) * path_c + short * np.sqrt(cc * (2 - cc) * mu) * step
        spread = (1 - c1 - cmu) * spread + c1 * np.outer(path_c, path_c) + cmu * (y[order].T * weights) @ y[order]
        sigma *= np.exp((cs / damping) * (np.linalg.norm(path_s) / expected - 1))
        if g == generations // 3 and best_cost > give_up:
            break
        if sigma * np.sqrt(np.diag(spread)).max() < 1e-4:
            break
    return np.clip(best, search.low, search.high), best_cost


def show(search: Search, design: np.ndarray, cost: float, dense: tuple[np.ndarray, np.ndarray]) -> None:
    """Print a design and its figures on a dense sample."""
    base, offsets, tool, centre = (1e3 * values[0] for values in search.unpacked(design[None]))
    along = f"delta = {design[10]:.4f}" if len(design) == 15 else f"platform_mm = {np.round(offsets, 1).tolist()}"
    print(f"price {cost:.4f}  {along}  base_mm = {np.round(base, 1).tolist()}")
    print(f"  length_mm = {tool:.1f}  centre_mm = {np.round(centre, 1).tolist()}")
    values = figures(search, design[None], *dense)
    print("  " + ", ".join(f"{name} {value[0]:.4g}" for name, value in values.items()))
    print("  design = " + repr(np.round(design, 5).tolist()), flush=True)


def main() -> None:
    """Search until the time is up."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--machine", choices=MACHINES, default="desk")
    parser.add_argument("--minutes", type=float, default=20.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--tilt", type=float, help="degrees of the cone of tool axes; the machine's when left out")
    parser.add_argument("--diameter", type=float, default=150.0, help="mm of the cylinder of tips")
    parser.add_argument("--height", type=float, default=60.0, help="mm of the cylinder of tips")
    options = parser.parse_args()
    rng, search = np.random.default_rng(options.seed), MACHINES[options.machine]
    tilt, lean = np.radians(search.tilt if options.tilt is None else options.tilt), np.radians(search.dome_tilt)
    volume = Volume(options.diameter * 1e-3, options.height * 1e-3, tilt, lean)
    coarse, dense = volume.poses(8, 2, 16), volume.poses(16, 3, 24)
    span, size = search.high - search.low, len(search.start)

    def cost(x: np.ndarray) -> np.ndarray:
        return price(search, x, *coarse)

    stop, best, best_cost, run = time.monotonic() + 60.0 * options.minutes, search.start, np.inf, 0
    while time.monotonic() < stop:
        if run % 4 == 0:  # near the best so far, which is the known geometry at first
            start, sigma = best + 0.05 * (run > 0) * rng.standard_normal(size) * span, 0.3
        else:
            crowd = search.low + span * rng.random((600, size))
            start, sigma = crowd[np.argmin(cost(crowd))], 0.6
        found, found_cost = minimise(cost, search, start, sigma, rng=rng, generations=500, give_up=4.0 * best_cost)
        found_cost = float(price(search, found[None], *dense)[0])
        print(f"run {run}: {found_cost:.3f}", flush=True)
        if found_cost < best_cost:
            best, best_cost = found, found_cost
            show(search, best, best_cost, dense)
        run += 1


if __name__ == "__main__":
    main()
