"""LinearModel: margins and leans around a candidate, to first order, and the best step that they promise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pentapod.arrays import Floats, Ints
from pentapod.geometry.rigid import RigidTransform
from pentapod.planning.margins import Margins
from pentapod.planning.setting import Candidate, Setting

REACH = np.array([0.1, 0.1, 0.1, 0.2, 0.2, 0.2])
"""The unit of a placement step: metres, and tan(angle / 2). The unit of a coefficient is the cone."""

_PIVOTS = 5_000
"""Linear programs take some hundred pivots; where the simplex method goes in circles, no step is taken."""

_NEAR = 0.4
"""Margins within this much of the level enter the model."""
_WORST_OF_KIND, _STEEPEST, _STEEP = 12, 60, 0.3
_TANGENTS = np.radians([-36.0, -22.0, -12.0, -5.0, 0.0, 5.0, 12.0, 22.0, 36.0])

Slopes = Callable[[Margins, RigidTransform, Floats, Ints], Floats]


@dataclass(frozen=True, eq=False)
class LinearModel:
    """Unknowns x: placement step along motion (6, k), and change of coefficients (2·size); units: REACH and the cone.

    Margins ≈ values + matrix @ x, (R,), of the margins that come near the level; leans as shares of the cone ≈
    steepness + steep_matrix @ x; the room of the placement (L,) ≈ room + room_matrix @ x.
    """

    setting: Setting
    at: Candidate
    motion: Floats
    values: Floats
    matrix: Floats
    steepness: Floats
    steep_matrix: Floats
    room: Floats
    room_matrix: Floats

    @classmethod
    def of(
        cls,
        setting: Setting,
        at: Candidate,
        rows: Ints,
        level: float,
        extra: Ints,
        slopes: Slopes,
        room: tuple[Floats, Floats],
        motion: Floats,
    ) -> LinearModel:
        """Return the model of what comes near `level` among waypoints `rows`, and of rows[extra] in any case.

        room: of the placement, (L,), with its derivatives (L, 6) by the step. motion (6, k): how it may step.
        """
        values = setting.values(at.margins, at.transform, at.coefficients, rows)
        chosen = np.union1d(valleys(values, _WORST_OF_KIND), extra)
        chosen = chosen[values[chosen].min(axis=1) < level + _NEAR]
        point, kinds = np.nonzero(values[chosen] < level + _NEAR)
        few = rows[chosen]
        slope = slopes(at.margins, at.transform, at.coefficients, few)[point, kinds] if len(few) else np.zeros((0, 8))
        by_field = _by_field(setting.basis[few][point], slope[:, 6:]) * setting.cone
        share, steep_by_field = _cone_tangents(setting, at, rows, extra)
        return cls(
            setting,
            at,
            motion,
            values[chosen][point, kinds],
            np.hstack([slope[:, :6] * REACH @ motion, by_field]),
            share,
            np.hstack([np.zeros((len(share), motion.shape[1])), steep_by_field]),
            room[0],
            np.hstack([room[1] * REACH @ motion, np.zeros((len(room[0]), by_field.shape[1]))]),
        )

    def best_step(self, reach: float) -> tuple[Floats, Floats, float]:
        """Return the placement step (6,), the change of coefficients (size, 2), and how much margin they promise."""
        from scipy.optimize import linprog  # noqa: PLC0415  heavy: only when planning

        count, smallest = self.matrix.shape[1], float(self.values.min())
        rising = np.column_stack([-self.matrix, np.ones(len(self.matrix))])
        kept = np.vstack([self.steep_matrix, -self.room_matrix])
        kept = np.column_stack([kept, np.zeros(len(kept))])
        answer = linprog(
            np.append(np.zeros(count), -1.0),
            A_ub=np.vstack([rising, kept]),
            b_ub=np.concatenate([self.values - smallest, np.maximum(np.append(1.0 - self.steepness, self.room), 0.0)]),
            bounds=[(-reach, reach)] * count + [(0.0, None)],
            method="highs-ds",
            options={"maxiter": _PIVOTS},
        )
        x = np.asarray(answer.x, dtype=np.float64) if answer.status == 0 else np.zeros(count + 1)
        moving = self.motion.shape[1]
        step, change = REACH * (self.motion @ x[:moving]), x[moving:-1] * self.setting.cone
        return step, change.reshape(-1, 2), float(x[-1])


def valleys(values: Floats, count: int = _WORST_OF_KIND) -> Ints:
    """Return the waypoints where a margin of values (N, M) is smaller than beside it, the worst of each kind."""
    edge = np.full((1, values.shape[1]), np.inf)
    padded = np.concatenate([edge, values, edge])
    valley = (values <= padded[:-2]) & (values < padded[2:])
    depth = np.where(valley, values, np.inf)
    worst = np.argpartition(depth, min(count, len(values) - 1), axis=0)[:count]
    return np.unique(worst[np.take_along_axis(valley, worst, axis=0)])


def _cone_tangents(setting: Setting, at: Candidate, rows: Ints, extra: Ints) -> tuple[Floats, Floats]:
    """Return tangents of the cone at the steepest leans: the share used in each tangent's direction, its derivatives.

    Several tangents for each lean, since a lean on the edge may well turn along it.
    """
    steepness = setting.steepness(at.coefficients, rows)
    steep = np.union1d(valleys(-steepness[:, None], _STEEPEST), extra)
    steep = steep[steepness[steep] > _STEEP]
    nominal, basis = setting.task.nominal[rows[steep]], setting.basis[rows[steep]]
    outward = setting.leans(at.coefficients, rows[steep]) / (steepness[steep, None] * setting.cone)
    aside = np.cross(nominal, outward)
    shares, derivatives = [np.zeros(0)], [np.zeros((0, 2 * setting.basis.shape[1]))]
    for turn in _TANGENTS:
        direction = np.cos(turn) * outward + np.sin(turn) * aside
        shares.append(np.cos(turn) * steepness[steep])
        derivatives.append(_by_field(basis, direction @ setting.domain.lean_plane.T))
    return np.concatenate(shares), np.concatenate(derivatives)


def _by_field(basis: Floats, by_lean: Floats) -> Floats:
    """Return derivatives by the coefficients, (R, 2·size), of basis (R, size) and derivatives by the lean (R, 2)."""
    return (basis[:, :, None] * by_lean[:, None, :]).reshape(len(basis), 2 * basis.shape[1])
