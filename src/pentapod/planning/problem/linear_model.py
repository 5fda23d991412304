"""LinearModel: first-order model of margins and leans in placement, rail positions and tilt field."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.planning.problem.formulation import StepSlopes
from pentapod.planning.problem.problem import Candidate, PlacementProblem

REACH = np.array([0.1, 0.1, 0.1, 0.2, 0.2, 0.2])
"""The unit of a placement step: metres, and tan(angle / 2)."""


@dataclass(frozen=True)
class LinearModelOptions:
    """What enters the model.

    worst: local minima of each kind of margin. near: largest distance of a margin from the level. steepest: waypoints
    whose leans are constrained, if they use the share `steep` of the cone. tangents_deg: tangents of the cone at each
    of these leans, degrees from the lean.
    """

    worst: int = 6
    near: float = 0.25
    steepest: int = 60
    steep: float = 0.3
    tangents_deg: tuple[float, ...] = (-36.0, -22.0, -12.0, -5.0, 0.0, 5.0, 12.0, 22.0, 36.0)


OPTIONS = LinearModelOptions()


@dataclass(frozen=True, eq=False)
class LinearModel:
    """The model in the unknowns x: along moves (p, q), and the change of coefficients (2·size) in units of the cone.

    moves: columns of a placement step (p = 6), or of one and of the rail positions (p = 11). Margins near the level, of
    kinds (R,) at waypoints points (R,): values + matrix @ x. Leans as shares of the cone, several rows for each
    waypoint of steep: steepness + steep_matrix @ x. Constraints of the placement (L,): room + room_matrix @ x.
    """

    problem: PlacementProblem
    at: Candidate
    moves: Floats
    points: Ints
    kinds: Ints
    values: Floats
    matrix: Floats
    steep: Ints
    steepness: Floats
    steep_matrix: Floats
    room: Floats
    room_matrix: Floats

    @classmethod
    def of(
        cls,
        problem: PlacementProblem,
        at: Candidate,
        rows: Ints,
        level: float,
        extra: tuple[Ints, Ints],
        slopes: StepSlopes,
        room: tuple[Floats, Floats],
        moves: Floats,
        values: Floats | None = None,
    ) -> LinearModel:
        """Return the model of the margins near `level` at waypoints `rows`, and of the steepest leans of all waypoints.

        extra: indices into rows, and waypoints of leans, that enter in any case.
        room (L,): constraints of placement and rail positions, with their derivatives (L, p). slopes: derivatives of
        the margins, (n, M, p + 2) by step, rail positions and lean. values (n, M): the candidate's margins at
        `rows`, where they are known.
        """
        length, count = moves.shape
        if values is None:
            values = problem.values(at.margins, at.transform, at.coefficients, rows)
        chosen = np.union1d(valleys(values), extra[0])
        chosen = chosen[values[chosen].min(axis=1) < level + OPTIONS.near]
        point, kinds = np.nonzero(values[chosen] < level + OPTIONS.near)
        few = rows[chosen]
        slope = np.zeros((0, length + 2))
        if len(few):
            slope = slopes(at.margins, at.transform, at.coefficients, few)[point, kinds]
        field = by_field(problem.basis[few][point], slope[:, length:]) * problem.cone
        steep, share, steep_by_field = _cone_tangents(problem, at, extra[1])
        return cls(
            problem,
            at,
            moves,
            few[point],
            kinds,
            values[chosen][point, kinds],
            np.hstack([slope[:, :length] @ moves, field]),
            steep,
            share,
            np.hstack([np.zeros((len(share), count)), steep_by_field]),
            room[0],
            np.hstack([room[1] @ moves, np.zeros((len(room[0]), field.shape[1]))]),
        )

    def inequalities(self) -> tuple[Floats, Floats]:
        """Return A and b of A (x, t) ≤ b: margins not below the smallest plus t, cone and constraints kept."""
        rising = np.column_stack([-self.matrix, np.ones(len(self.matrix))])
        kept = np.vstack([self.steep_matrix, -self.room_matrix])
        kept = np.column_stack([kept, np.zeros(len(kept))])
        spare = np.maximum(np.append(1.0 - self.steepness, self.room), 0.0)
        return np.vstack([rising, kept]), np.concatenate([self.values - self.values.min(), spare])

    def step_of(self, x: Floats) -> tuple[Floats, Floats]:
        """Return the step (p,) of placement and rail positions, and the change of coefficients (size, 2)."""
        count = self.moves.shape[1]
        return self.moves @ x[:count], (x[count:] * self.problem.cone).reshape(-1, 2)


def valleys(values: Floats, count: int = OPTIONS.worst) -> Ints:
    """Return the waypoints of local minima of values (N, M) along the path, the `count` smallest of each column."""
    edge = np.full((1, values.shape[1]), np.inf)
    padded = np.concatenate([edge, values, edge])
    valley = (values <= padded[:-2]) & (values < padded[2:])
    depth = np.where(valley, values, np.inf)
    worst = np.argpartition(depth, min(count, len(values) - 1), axis=0)[:count]
    return np.unique(worst[np.take_along_axis(valley, worst, axis=0)])


def _cone_tangents(problem: PlacementProblem, at: Candidate, extra: Ints) -> tuple[Ints, Floats, Floats]:
    """Return tangents of the cone at the steepest leans: waypoints, the share used in that direction, its derivatives.

    Several tangents for each lean, since a lean on the edge may turn along it. extra: waypoints in any case.
    """
    tangents = np.radians(OPTIONS.tangents_deg)
    steepness = problem.steepness(at.coefficients)
    steep = np.union1d(valleys(-steepness[:, None], OPTIONS.steepest), extra)
    steep = steep[steepness[steep] > OPTIONS.steep]
    room = problem.samples.room(steep)[:, None]
    nominal, basis = problem.samples.nominal[steep], problem.basis[steep] / room
    outward = problem.leans(at.coefficients, steep) / (steepness[steep, None] * problem.cone * room)
    aside = np.cross(nominal, outward)
    shares, derivatives = [np.zeros(0)], [np.zeros((0, 2 * problem.basis.shape[1]))]
    for turn in tangents:
        direction = np.cos(turn) * outward + np.sin(turn) * aside
        shares.append(np.cos(turn) * steepness[steep])
        derivatives.append(by_field(basis, direction @ problem.domain.lean_plane.T))
    return np.tile(steep, len(tangents)), np.concatenate(shares), np.concatenate(derivatives)


def by_field(basis: Floats, by_lean: Floats) -> Floats:
    """Return derivatives by the coefficients, (R, 2·size), of basis (R, size) and derivatives by the lean (R, 2)."""
    return (basis[:, :, None] * by_lean[:, None, :]).reshape(len(basis), 2 * basis.shape[1])
