"""PlacementConstraints: the feasible set of placements, and the directions in which a placement may move.

A step of the optimisers moves the workpiece's origin in the machine frame and turns the workpiece about that origin
(`formulation.stepped`). The constraints of a fixture, a table or a box are stated here once: for sampling, as a
projection to the nearest allowed placement; for the solvers, as columns of allowed motion and as inequalities.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Bools, Floats, as_floats, frozen, set_frozen
from pentapod.base.errors import ArrayError
from pentapod.base.values import Value
from pentapod.geometry.directions import tangent_frame
from pentapod.geometry.rigid import RigidTransform


@dataclass(frozen=True, eq=False)
class PlacementConstraints(Value):
    """The allowed placements, workpiece → machine.

    motion (6, k): orthonormal columns, the allowed steps: shifts of the workpiece's origin in the machine frame, then
    Cayley vectors in the workpiece frame; each column either shifts or turns. low, high (3,): where the workpiece's
    origin may lie, metres along the machine's x, y and z; infinite where nothing bounds it. reference (3, 3) and
    largest_turn: the rotation from which the part may be turned by that angle at most, radians; π bounds nothing.
    upright: the unit direction (3,) of the workpiece that must point to `normal` (3,), machine frame; zero where none
    must. poses: the placements to choose from; empty where the origin and the rotation are to be found.

    >>> anywhere = PlacementConstraints.free()
    >>> as_clamped = PlacementConstraints.fixture([here])
    >>> anywhere.moves, as_clamped.moves
    (True, False)
    """

    motion: Floats
    low: Floats
    high: Floats
    reference: Floats
    largest_turn: float
    upright: Floats
    normal: Floats
    poses: tuple[RigidTransform, ...] = ()

    def __post_init__(self) -> None:
        low, high = np.array(self.low, dtype=np.float64), np.array(self.high, dtype=np.float64)
        if low.shape != (3,) or high.shape != (3,) or not (low <= high).all():
            bounds = [low.tolist(), high.tolist()]
            raise ArrayError("the bounds of the origin are not low ≤ high", value=bounds, expected="(3,) and (3,)")
        if not 0.0 <= self.largest_turn <= np.pi:
            raise ArrayError("the largest turn is out of range", value=self.largest_turn, expected="0 to π")
        low.setflags(write=False)  # infinite where nothing bounds them, which `frozen` refuses
        high.setflags(write=False)
        others = {name: frozen(getattr(self, name), name) for name in ("motion", "reference", "upright", "normal")}
        set_frozen(self, low=low, high=high, **others, poses=tuple(self.poses))

    @classmethod
    def free(
        cls,
        *,
        low: ArrayLike = (-np.inf, -np.inf, -np.inf),
        high: ArrayLike = (np.inf, np.inf, np.inf),
        reference: RigidTransform | None = None,
        largest_turn: float = np.pi,
    ) -> PlacementConstraints:
        """Return all six degrees of freedom, with a box for the origin and a largest turn from a reference, radians."""
        rotation = np.eye(3) if reference is None else reference.rotation
        none = np.zeros(3)
        return cls(np.eye(6), np.asarray(low), np.asarray(high), rotation, largest_turn, none, none)

    @classmethod
    def table(
        cls,
        height: float,
        *,
        x: tuple[float, float] = (-np.inf, np.inf),
        y: tuple[float, float] = (-np.inf, np.inf),
        up: ArrayLike = (0.0, 0.0, 1.0),
        normal: ArrayLike = (0.0, 0.0, -1.0),
        turn: tuple[float, float] = (-np.pi, np.pi),
    ) -> PlacementConstraints:
        """Return the constraints of a part that stands on a table parallel to the base plane.

        height: z of the workpiece's origin, machine frame. x, y: least and greatest coordinate of the origin, metres.
        up (3,): direction of the workpiece that is up on the table. normal (3,): up for the table, ±z of the machine.
        turn: least and greatest direction of the workpiece's x axis in plan, of its y axis where x stands upright,
        radians from the machine's x towards its y. The part may be shifted along the table and turned about its normal.
        """
        upright, upward = as_floats(up, "up", (3,)), as_floats(normal, "normal", (3,))
        upright, upward = upright / np.linalg.norm(upright), upward / np.linalg.norm(upward)
        if abs(abs(upward[2]) - 1.0) > 1e-12:
            raise ArrayError("a table is parallel to the base plane", key="normal", value=upward.tolist())
        motion = np.zeros((6, 3))
        motion[0, 0] = motion[1, 1] = 1.0
        motion[3:, 2] = upright
        low, high = np.array([x[0], y[0], height]), np.array([x[1], y[1], height])
        largest = min(0.5 * (turn[1] - turn[0]), np.pi)
        reference = np.eye(3) if largest == np.pi else _standing(upright, upward, 0.5 * (turn[0] + turn[1]))
        return cls(motion[:, : 3 if largest > 0.0 else 2], low, high, reference, largest, upright, upward)

    @classmethod
    def fixture(cls, poses: Sequence[RigidTransform]) -> PlacementConstraints:
        """Return the choice between given placements. Raises ArrayError where there are none."""
        if not poses:
            raise ArrayError("a fixture needs at least one pose", value=0)
        wide, none = np.full(3, np.inf), np.zeros(3)
        return cls(np.zeros((6, 0)), -wide, wide, np.eye(3), np.pi, none, none, tuple(poses))

    @property
    def moves(self) -> bool:
        """Whether placements may be improved by small steps."""
        return self.motion.shape[1] > 0

    @property
    def is_bounded(self) -> bool:
        """Whether anything limits the placements that the motion leads to."""
        return self.turn_is_bounded or bool(self.upright.any() or np.isfinite([self.low, self.high]).any())

    @property
    def turn_is_bounded(self) -> bool:
        """Whether the largest turn bounds anything."""
        return self.largest_turn < np.pi

    def within(self, rotations: Floats, origins: Floats, rng: np.random.Generator) -> tuple[Floats, Floats]:
        """Return allowed placements for random rotations (S, 3, 3) and origins (S, 3).

        Coordinates beyond a bound are drawn anew, evenly, where both ends are finite, rather than put on the bound.
        """
        for k in range(3):
            beyond = (origins[:, k] < self.low[k]) | (origins[:, k] > self.high[k])
            if beyond.any() and np.isfinite(self.low[k]) and np.isfinite(self.high[k]):
                drawn = rng.uniform(self.low[k], self.high[k], len(origins))
                origins = origins.copy()
                origins[:, k] = np.where(beyond, drawn, origins[:, k])
        if self.turn_is_bounded:
            axes, angles = _turns(self.reference.T @ self._upright(rotations))
            drawn = np.where(angles > self.largest_turn, angles * self.largest_turn / np.pi, angles)
            rotations = self.reference @ _rotations(axes, drawn)
        return self.nearest(rotations, origins)

    def nearest(self, rotations: Floats, origins: Floats) -> tuple[Floats, Floats]:
        """Return allowed placements near to rotations (S, 3, 3) and origins (S, 3); allowed ones are not changed."""
        rotations = self._upright(rotations)
        if self.turn_is_bounded:
            axes, angles = _turns(self.reference.T @ rotations)
            beyond = angles > self.largest_turn
            back = self.reference @ _rotations(axes, np.minimum(angles, self.largest_turn))
            rotations = np.where(beyond[:, None, None], back, rotations)
        return rotations, np.clip(origins, self.low, self.high)

    def _upright(self, rotations: Floats) -> Floats:
        """Return rotations (S, 3, 3) swung so that the part stands upright; the same where nothing must."""
        return _swing(rotations @ self.upright, self.normal) @ rotations if self.upright.any() else rotations

    def nearest_to(self, transform: RigidTransform) -> RigidTransform:
        """Return an allowed placement near to a given one; the same if it is allowed."""
        if not self.is_bounded:
            return transform
        rotations, origins = self.nearest(transform.rotation[None], transform.translation[None])
        return RigidTransform(rotations[0], origins[0])

    def room(self, rotation: Any, origin: Any) -> list[Any]:
        """Return the inequality constraints of a placement, not negative where it is allowed.

        Metres to each finite bound, and the difference of cosines to the largest turn; the formula serves NumPy arrays
        and casadi symbols alike.
        """
        rows: list[Any] = []
        for k in range(3):
            if self.low[k] == self.high[k]:  # held by the motion's columns
                continue
            rows += [origin[k] - float(self.low[k])] if np.isfinite(self.low[k]) else []
            rows += [float(self.high[k]) - origin[k]] if np.isfinite(self.high[k]) else []
        if self.turn_is_bounded and self.motion[3:].any():  # else held by the motion's columns
            trace = sum(float(self.reference[i, j]) * rotation[i, j] for i in range(3) for j in range(3))
            rows.append(0.5 * (trace - 1.0) - float(np.cos(self.largest_turn)))
        return rows


FREE = PlacementConstraints.free()
"""All six degrees of freedom, without bounds."""


def _standing(upright: Floats, normal: Floats, turn: float) -> Floats:
    """Return the rotation (3, 3) of a part on a table whose x axis, or y where x is upright, points to `turn`."""
    axis = np.eye(3)[0 if abs(upright[0]) < np.sqrt(0.75) else 1]
    along = axis - (axis @ upright) * upright
    along /= np.linalg.norm(along)
    there = np.array([np.cos(turn), np.sin(turn), 0.0])
    part = np.stack([along, np.cross(upright, along), upright])
    return np.asarray(np.stack([there, np.cross(normal, there), normal]).T @ part, dtype=np.float64)


def _swing(directions: Floats, target: Floats) -> Floats:
    """Return the smallest rotations (S, 3, 3) that take unit directions (S, 3) to the unit target (3,)."""
    cosine = directions @ target
    across = np.cross(directions, target)
    opposite = cosine < -1.0 + 1e-9
    if opposite.any():  # any half turn about a direction across will do
        across = np.where(opposite[:, None], tangent_frame(target)[0], across)
    sine = np.asarray(np.linalg.norm(across, axis=1), dtype=np.float64)
    axes = across / np.maximum(sine, 1e-300)[:, None]
    return _rotations(axes, np.where(opposite, np.pi, np.arctan2(sine, cosine)))


def _rotations(axes: Floats, angles: Floats) -> Floats:
    """Return rotations (S, 3, 3) about unit axes (S, 3) by angles (S,), radians (Rodrigues)."""
    skew = np.zeros((len(axes), 3, 3))
    skew[:, 0, 1], skew[:, 0, 2], skew[:, 1, 2] = -axes[:, 2], axes[:, 1], -axes[:, 0]
    skew -= skew.transpose(0, 2, 1)
    sine, cosine = np.sin(angles)[:, None, None], np.cos(angles)[:, None, None]
    return np.asarray(np.eye(3) + sine * skew + (1.0 - cosine) * (skew @ skew), dtype=np.float64)


def _turns(rotations: Floats) -> tuple[Floats, Floats]:
    """Return the unit axes (S, 3) and angles (S,) in [0, π] of rotations (S, 3, 3)."""
    twice = np.stack([
        rotations[:, 2, 1] - rotations[:, 1, 2],
        rotations[:, 0, 2] - rotations[:, 2, 0],
        rotations[:, 1, 0] - rotations[:, 0, 1],
    ], axis=1)  # fmt: skip
    sine = 0.5 * np.linalg.norm(twice, axis=1)
    cosine = 0.5 * (np.trace(rotations, axis1=1, axis2=2) - 1.0)
    angles = np.asarray(np.arctan2(sine, cosine), dtype=np.float64)
    axes = twice / np.maximum(2.0 * sine, 1e-300)[:, None]
    half: Bools = (sine < 1e-6) & (cosine < 0.0)
    if half.any():  # R + 1 = 2 a aᵀ: its longest column is the axis
        outer = rotations[half] + np.eye(3)
        lengths = np.linalg.norm(outer, axis=1)
        longest = lengths.argmax(axis=1)
        rows = np.arange(len(outer))
        axes[half] = outer[rows, :, longest] / lengths[rows, longest][:, None]
    return axes, angles
