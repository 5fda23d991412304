"""Choice of rail positions for given poses: maximises the worst pose's value of a given criterion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_floats, frozen, set_frozen
from pentapod.base.errors import ArrayError
from pentapod.base.values import Value
from pentapod.geometry.directions import normalised
from pentapod.kinematics.batches import broadcast
from pentapod.kinematics.families.reconfigurable import ReconfigurablePentapod
from pentapod.kinematics.forward.quadratic import reciprocal_condition
from pentapod.kinematics.jacobian import line_tangents

Criterion: TypeAlias = Callable[[Floats, Floats, Floats, Floats], Floats]
"""(base (D, 5, 2), offsets (D, 5), positions (N, 3), directions (N, 3)) → (D, N); the more the better."""


def conditioning_criterion(length: float) -> Criterion:
    """Return the criterion 1/cond(J) of the leg Jacobian, 0 on a singularity and 1 at best.

    length: metres; rotations are measured by the shift they cause at this distance. Without such a length metres and
    radians cannot be compared.
    """
    if not length > 0.0:
        raise ArrayError("length must be positive", value=length, expected="metres")

    def worst(base: Floats, offsets: Floats, positions: Floats, directions: Floats) -> Floats:
        values = np.linalg.svd(_jacobians(base, offsets, positions, directions, 0.0, length), compute_uv=False)
        return np.asarray(values[..., -1] / values[..., 0], dtype=np.float64)

    return worst


def stiffness_criterion(leg_stiffness: ArrayLike, tool_length: float) -> Criterion:
    """Return the criterion: force at the tip per shift of the tip, N/m, in the softest direction.

    leg_stiffness (5,) N/m; the force acts without a moment, and the tool may tilt as it yields. It is 1/the largest
    eigenvalue of the upper left block of `tip_compliance`; 0 on a singularity.
    """
    springs = as_floats(leg_stiffness, "leg_stiffness", (5,))
    if not (springs > 0.0).all():
        raise ArrayError("leg_stiffness must be positive", value=float(springs.min()), expected="N/m")

    def softest(base: Floats, offsets: Floats, positions: Floats, directions: Floats) -> Floats:
        jacobians = _jacobians(base, offsets, positions, directions, tool_length, 1.0)
        whole = np.swapaxes(jacobians, -1, -2) @ (springs[:, None] * jacobians)
        # Shift alone, tilt free: the Schur complement of the tilt.
        tilt, mixed = whole[..., 3:, 3:], whole[..., :3, 3:]
        regular = np.linalg.det(tilt) > 0.0
        safe = np.where(regular[..., None, None], tilt, np.eye(2))
        shift = whole[..., :3, :3] - mixed @ np.linalg.solve(safe, np.swapaxes(mixed, -1, -2))
        least = np.asarray(np.linalg.eigvalsh(shift)[..., 0], dtype=np.float64)
        return np.where(regular, np.maximum(least, 0.0), 0.0)

    return softest


@dataclass(frozen=True, eq=False)
class GuideChoice(Value):
    """Slides (5,) in metres, the criterion's least value over the poses there, and at the start."""

    rail_positions: Floats
    value: float
    start_value: float

    def __post_init__(self) -> None:
        set_frozen(self, rail_positions=frozen(self.rail_positions, "rail_positions", (5,)))


def choose_rail_positions(
    robot: ReconfigurablePentapod,
    position: ArrayLike,
    direction: ArrayLike,
    criterion: Criterion,
    *,
    start: ArrayLike | None = None,
    least_measure: float = 0.01,
    candidates: int = 2048,
    seed: int = 0,
) -> GuideChoice:
    """Return the slides within their travel that make the worst of poses (N, 3) best, by a criterion.

    start (5,): where the guides are, 0 by default. Only slides are considered that they reach by moving evenly without
    F = 0 on the way, and whose `architectural_measure` is least_measure at least. Positions are of p, machine frame.
    Points evenly all over the travel, then Nelder and Mead's method from the best four: a good choice, not a proven
    optimum, and never worse than the start. Raises ArrayError where the start is outside the travel or too near to
    architectural singularity.
    """
    p, i = broadcast(as_floats(position, "position", (3,)), normalised(direction), ("position", "direction"))
    p, i = p.reshape(-1, 3), i.reshape(-1, 3)
    if not (len(p) and candidates > 0):
        raise ArrayError("there is nothing to choose from", value=(len(p), candidates), expected="poses and candidates")
    low, high = robot.travel.T
    here = np.zeros(5) if start is None else as_floats(start, "start", (5,))
    if ((here < low) | (here > high)).any():
        raise ArrayError("start is outside the travel of the guides", value=here.tolist())
    if reciprocal_condition(robot.base_at(here), robot.pentapod.delta) < least_measure:
        raise ArrayError("the machine is too near to architectural singularity at the start", expected="another start")

    def values(rail_positions: Floats) -> Floats:
        worst = np.empty(len(rail_positions))
        for k in range(0, len(rail_positions), 64):
            base, offsets = robot.base_at(rail_positions[k : k + 64]), robot.offsets_at(rail_positions[k : k + 64])
            worst[k : k + 64] = criterion(base, offsets, p, i).min(axis=1)
        return worst

    def allowed(rail_positions: Floats) -> bool:
        measure = reciprocal_condition(robot.base_at(rail_positions), robot.pentapod.delta)
        return measure >= least_measure and robot.stays_regular(here, rail_positions)

    start_value = float(values(here[None])[0])
    tried = _spread(low, high, candidates, seed)
    scores = values(tried)
    best, value = here, start_value
    starts: list[Floats] = []
    for k in np.argsort(-scores):
        if len(starts) < 4 and scores[k] > 0.0 and allowed(tried[k]):
            starts.append(tried[k])
    for near in starts:
        rail_positions, score = _refine(near, low, high, values, allowed)
        if score > value:
            best, value = rail_positions, score
    return GuideChoice(best, value, start_value)


def _jacobians(
    base: Floats, offsets: Floats, positions: Floats, directions: Floats, tool_length: float, length: float
) -> Floats:
    """Return ∂legs/∂(tip, tilts · length) (D, N, 5, 5) of D designs at N poses."""
    joints = positions[:, None, :] + offsets[:, None, :, None] * directions[:, None, :]
    legs = joints - np.concatenate([base, np.zeros((*base.shape[:-1], 1))], axis=-1)[:, None]
    unit = legs / np.asarray(np.linalg.norm(legs, axis=-1, keepdims=True), dtype=np.float64)
    levers = (offsets - tool_length)[:, None, :, None] / length
    return np.concatenate([unit, levers * (unit @ line_tangents(directions))], axis=-1)


def _spread(low: Floats, high: Floats, count: int, seed: int) -> Floats:
    """Return points (count, 5) evenly all over the travel: an additive recurrence (M. Roberts's R sequence)."""
    ratio = 1.0
    for _ in range(60):  # the root of r⁶ = r + 1, the golden ratio of five dimensions
        ratio = (1.0 + ratio) ** (1.0 / 6.0)
    shift = np.random.default_rng(seed).random(5)
    points = (shift + np.arange(count)[:, None] * ratio ** -np.arange(1.0, 6.0)) % 1.0
    return low + points * (high - low)


def _refine(
    start: Floats, low: Floats, high: Floats, values: Callable[[Floats], Floats], allowed: Callable[[Floats], bool]
) -> tuple[Floats, float]:
    """Return a better point near `start` and its value, by Nelder and Mead's method on the guides that move."""
    from scipy.optimize import minimize  # noqa: PLC0415  heavy: only where guides are chosen

    free = high > low

    def whole(part: Floats) -> Floats:
        rail_positions = start.copy()
        rail_positions[free] = np.clip(part, low[free], high[free])
        return rail_positions

    def cost(part: Floats) -> float:
        rail_positions = whole(part)
        return -float(values(rail_positions[None])[0]) if allowed(rail_positions) else 0.0

    if not free.any():
        return start, float(values(start[None])[0])
    found = minimize(cost, start[free], method="Nelder-Mead", options={"maxfev": 300, "xatol": 1e-6, "fatol": 1e-12})
    rail_positions = whole(found.x)
    return rail_positions, -cost(rail_positions[free])
