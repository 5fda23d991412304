"""GeneralPentapod: a linear pentapod whose offsets need not be proportional to the base attachments' x."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pentapod.base.arrays import Bools, Floats, as_batch, frozen, set_frozen
from pentapod.base.errors import MachineError
from pentapod.base.values import Value
from pentapod.kinematics.arithmetic import Arithmetic, Vector
from pentapod.kinematics.batches import as_poses, broadcast, joined_poses
from pentapod.kinematics.five_legs import SINGULAR_CONDITION, FiveLegs, given
from pentapod.kinematics.forward.line_equations import LineEquations, line_condition
from pentapod.kinematics.forward.line_roots import interior, root
from pentapod.kinematics.forward.singularity_polynomial import polynomial_terms
from pentapod.kinematics.forward.solution_line import SolutionLine
from pentapod.kinematics.jacobian import line_tangents
from pentapod.kinematics.mode import MODES, Mode, as_labels
from pentapod.kinematics.proofs.by_leg_equations import ProvenByLegEquations
from pentapod.kinematics.robot import Branch, SingularSurface
from pentapod.numerics.blocks import blocks

_EPS = float(np.finfo(np.float64).eps)


@dataclass(frozen=True)
class SideOptions:
    """How a pose next to a double root is moved to the side of its order.

    least_step: the first step, as a share of the solution line's size; a double root is uncertain by about 2⁻²⁶ of it.
    doublings: how often the step is doubled at most.
    """

    least_step: float = 2.0**-40
    doublings: int = 24


SIDE_OPTIONS = SideOptions()


@dataclass(frozen=True, eq=False)
class GeneralPentapod(Value, FiveLegs, ProvenByLegEquations):
    """Five base attachments a_i = (x_i, y_i, 0) and any offsets z_i along the platform line, b_i = p + z_i i.

    base (5, 2) and offsets (5,) in metres, machine frame: the base plane is z = 0. Leg lengths have at most four
    isolated real poses, two roots with two mirror images each (lemma 1 of docs/proofs.md), named by a `Mode`; only the
    quadratic family and other special geometries have self-motions, infinite sets of poses, besides. Where
    the offsets are proportional these are the four of `LinearPentapod`, to the same accuracy, and where they
    nearly are nothing special happens: there is one formula for both.

    Raises MachineError: not five attachments or offsets, numbers that are not finite or beyond 1e9, an
    architecturally singular geometry.
    """

    base: Floats
    offsets: Floats
    equations: LineEquations = field(init=False, repr=False)
    branches = MODES
    singularities = (SingularSurface("mirror plane w = 0", "deg"), SingularSurface("singular surface", "mm"))

    def __post_init__(self) -> None:
        base, offsets = given(self.base, "base", (5, 2)), given(self.offsets, "offsets", (5,))
        set_frozen(self, base=frozen(base, "base"), offsets=frozen(offsets, "offsets"))
        measure = line_condition(base, offsets)
        if not measure >= SINGULAR_CONDITION:
            raise MachineError(
                "the geometry is architecturally singular: no pose is held by its legs",
                key="base",
                value=measure,
                expected="a reciprocal condition number well above 1e-3",
                remedy="move a base attachment or an offset",
            )
        set_frozen(self, equations=LineEquations.of(base, offsets))

    def assembly_modes(self, legs: ArrayLike) -> tuple[Floats, Floats]:
        """Return positions and directions (..., 4, 3) of the four modes, in the order of `MODES`.

        legs (..., 5) metres. NaN where no pose has these leg lengths (`assembly_obstacles` says why): then all four
        modes are NaN.
        """
        lengths = as_batch(legs, "legs", (5,))
        flat, batch = lengths.reshape(-1, 5), lengths.shape[:-1]
        position, direction = np.empty((len(flat), 4, 3)), np.empty((len(flat), 4, 3))
        for k, (order, image) in enumerate(MODES):
            if image > 0:
                position[:, k], direction[:, k] = self._solve(flat, np.full(len(flat), order, dtype=np.float64))
            else:
                position[:, k], direction[:, k] = self.mirror(position[:, k - 1], direction[:, k - 1])
        return position.reshape(*batch, 4, 3), direction.reshape(*batch, 4, 3)

    def pose(self, legs: ArrayLike, mode: ArrayLike) -> tuple[Floats, Floats]:
        """Return positions and directions (..., 3) in a mode: a `Mode`, or labels (..., 2).

        legs (..., 5) metres; the labels, each ±1, broadcast against their batch. NaN where no pose has these
        leg lengths, and where a label is 0 or NaN. Raises ArrayError for other labels and other shapes.
        """
        labels = as_labels(as_batch(mode, "mode", (2,)), "mode", "for the order and for the image")
        lengths, labels = broadcast(as_batch(legs, "legs", (5,)), labels, ("legs", "mode"))
        batch, lengths, labels = lengths.shape[:-1], lengths.reshape(-1, 5), labels.reshape(-1, 2)
        named = (np.abs(labels) == 1.0).all(axis=-1)
        position, direction = self._solve(np.where(named[:, None], lengths, np.nan), labels[:, 0])
        mirrored = (labels[:, 1] < 0.0)[:, None]
        other_position, other_direction = self.mirror(position, direction)
        position = np.where(mirrored, other_position, position)
        direction = np.where(mirrored, other_direction, direction)
        return position.reshape(*batch, 3), direction.reshape(*batch, 3)

    def branch(self, position: ArrayLike, direction: ArrayLike) -> NDArray[np.int8]:
        """Return the labels (..., 2) of the mode of each pose (..., 3): order and image; 0 where singular or NaN."""
        p, i = joined_poses(position, direction)
        pz, w = p[..., 2] + self.offsets[2] * i[..., 2], i[..., 2]
        labels = np.stack([self.order_value(p, i), np.where(w == 0.0, pz, w)], axis=-1)
        known = np.isfinite(p.sum(axis=-1) + i.sum(axis=-1))
        return np.where(known[..., None], np.sign(labels), 0.0).astype(np.int8)

    @property
    def conditioning(self) -> float:
        """The reciprocal condition number of the four linear equations: 0 is singular in every pose."""
        return line_condition(self.base, self.offsets)

    @property
    def numbers(self) -> Mapping[str, object]:
        """base, offsets and the family's name."""
        return {"family": "general", "base": self.base, "offsets": self.offsets}

    def singularity_margins(self, p: Vector, i: Vector, branch: Branch, do: Arithmetic) -> list[Any]:
        """Return w by the sign of the image, and a lower bound of the distance to the singular surface by the order's.

        w = 0 is not singular, but the two images of a pose change their names there. At one orientation the polynomial
        (2) is quadratic in p, with gradient g and Hessian H: within 2 |P| / (|g| + √(|g|² + 2 ‖H‖ |P|)) it has no zero.
        """
        mode, (x3, y3), z3 = Mode(*branch), self.base[2].tolist(), float(self.offsets[2])
        n, nx, ny, nu, nv = (self.equations.null_vector * (1.0, -1.0, -1.0, -1.0, -1.0)).tolist()
        (u, v, w), pz = i, p[2] + z3 * i[2]
        ax, ay = pz * u - (p[0] + z3 * u - x3) * w, pz * v - (p[1] + z3 * v - y3) * w
        value = w * (n * pz + nx * ax + ny * ay) - pz * (nu * ax + nv * ay)
        by_x, by_y, along = w * (nu * pz - nx * w), w * (nv * pz - ny * w), nu * u + nv * v
        by_z = w * (n + nx * u + ny * v) - (nu * ax + nv * ay) - pz * along
        bent = do.sqrt(2.0 * (nu * nu + nv * nv) * w * w + 4.0 * along * along + 1e-60)
        squared = by_x * by_x + by_y * by_y + by_z * by_z + 1e-60
        size = do.most(value, -value)
        distance = 2.0 * value / (do.sqrt(squared) + do.sqrt(squared + 2.0 * bent * size))
        return [mode.image * w, mode.order * distance]

    def order_value(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return the polynomial (2) (...) of poses (..., 3), m², its cofactors scaled to the length of the null vector.

        It is −½ of the quartic's slope at the pose's root: negative on the first root, positive on the second, zero on
        a singularity. Its sign is the mode's order.
        """
        p, i = as_poses(position, direction)
        return polynomial_terms(self, p, i)[..., :5] @ (self.equations.null_vector * (1.0, -1.0, -1.0, -1.0, -1.0))

    def mirror(self, position: ArrayLike, direction: ArrayLike) -> tuple[Floats, Floats]:
        """Return the poses (..., 3) reflected in the base plane: the same leg lengths, the same order."""
        flip = np.array([1.0, 1.0, -1.0])
        return as_batch(position, "position", (3,)) * flip, as_batch(direction, "direction", (3,)) * flip

    def _solve(self, legs: Floats, order: Floats) -> tuple[Floats, Floats]:
        """Poses (N, 3) with image +1 of legs (N, 5), on the roots that order (N,) = ±1 names."""
        position, direction = np.full((len(legs), 3), np.nan), np.full((len(legs), 3), np.nan)
        for block in blocks(len(legs)):
            lengths, sign = legs[block], order[block]
            known = np.flatnonzero(np.isfinite(lengths).all(axis=-1) & (lengths >= 0.0).all(axis=-1))
            line = SolutionLine.of(self.equations, np.square(lengths[known].T, order="C"))
            between = interior(line)
            known, line = known[between.exists], line.take(between.exists)
            low, tau, high = (values[between.exists] for values in (between.low, between.tau, between.high))
            single = line.factors(tau).f()[0] <= 0.0  # a double root, to rounding
            outside = np.where(single, tau, np.where(sign[known] > 0.0, high, low))
            tau = root(line, outside, tau)
            p, i = self._pose_of(line, tau)
            p, i = self._on_side_of_order(line, tau, sign[known], *_newton_refinement(self, p, i, lengths[known]))
            below = _below(p[:, 2] + self.offsets[2] * i[:, 2], i[:, 2])[:, None]
            mirrored = self.mirror(p, i)
            position[block.start + known] = np.where(below, mirrored[0], p)
            direction[block.start + known] = np.where(below, mirrored[1], i)
        return position, direction

    def _on_side_of_order(
        self, line: SolutionLine, tau: Floats, order: Floats, position: Floats, direction: Floats
    ) -> tuple[Floats, Floats]:
        """Poses (N, 3) with those that rounding has put beyond the singularity moved back to their order's side.

        Next to a double root f is flat: a step along the line that is as long as the root is uncertain changes the leg
        lengths by their rounding only.
        """
        step = SIDE_OPTIONS.least_step * (np.abs(tau) + np.abs(line.start).max(axis=0))
        for _ in range(SIDE_OPTIONS.doublings):
            wrong = np.flatnonzero(self.order_value(position, direction) * order <= 0.0)
            if not wrong.size:
                break
            moved = self._pose_of(line.take(wrong), tau[wrong] + order[wrong] * step[wrong])
            position[wrong], direction[wrong] = moved
            step[wrong] *= 2.0
        return position, direction

    def _pose_of(self, line: SolutionLine, tau: Floats) -> tuple[Floats, Floats]:
        """Poses (N, 3) at the roots (N,). The larger of w² and pz²/l_3² gives a root, the product the other."""
        _, px, py, u, v = line.at(tau)
        d1, e, g, *_ = line.factors(tau)
        high = e > d1 * line.reach_squared
        larger = np.sqrt(np.maximum(np.where(high, e, d1), 0.0))
        other = g / np.where(larger > 0.0, larger, 1.0)
        pz, w = np.where(high, larger, other), np.where(high, other, larger)
        i = np.stack([u, v, w], axis=-1)
        i /= np.linalg.norm(i, axis=-1, keepdims=True)
        p = np.stack([px + self.base[2, 0], py + self.base[2, 1], pz], axis=-1)
        return p - self.offsets[2] * i, i


def _below(pz: Floats, w: Floats) -> Bools:
    """Return whether a pose is the image −1."""
    return (w < 0.0) | ((w == 0.0) & (pz < 0.0))


def _newton_refinement(pentapod: FiveLegs, position: Floats, direction: Floats, legs: Floats) -> tuple[Floats, Floats]:
    """Return poses (N, 3) after a Newton step towards the lengths legs (N, 5); NaN where the given ones are.

    It reduces the error of a closed form to that of the lengths. A step is kept only where it does not increase the
    largest error of the squared lengths, up to rounding, and keeps the sign of the Jacobian's determinant: it never
    changes the assembly mode.
    """
    vectors, tangents = pentapod.leg_vectors(position, direction), line_tangents(direction)
    error, matrix = _errors(vectors, legs), _matrix(pentapod, vectors, tangents)
    with np.errstate(over="ignore", invalid="ignore"):
        determinant = np.linalg.det(matrix)
        regular = np.isfinite(determinant) & (np.abs(determinant) > 0.0)
    safe = np.where(regular[:, None, None], matrix, np.eye(5))
    step = np.linalg.solve(safe, -0.5 * error[..., None])[..., 0]
    p = position + step[:, :3]
    i = direction + (tangents @ step[:, 3:, None])[..., 0]
    with np.errstate(over="ignore", invalid="ignore"):
        i = i / np.linalg.norm(i, axis=-1, keepdims=True)
        vectors = pentapod.leg_vectors(p, i)
        rounding = 4.0 * _EPS * np.square(legs).max(axis=-1)
        better = np.abs(_errors(vectors, legs)).max(axis=-1) <= np.maximum(np.abs(error).max(axis=-1), rounding)
        same_mode = np.linalg.det(_matrix(pentapod, vectors, line_tangents(i))) * determinant > 0.0
    keep = (regular & better & same_mode)[:, None]
    return np.where(keep, p, position), np.where(keep, i, direction)


def _errors(vectors: Floats, legs: Floats) -> Floats:
    """Return |b_i − a_i|² − l_i² (N, 5)."""
    return np.square(vectors).sum(axis=-1) - np.square(legs)


def _matrix(pentapod: FiveLegs, vectors: Floats, tangents: Floats) -> Floats:
    """Return half the derivative (N, 5, 5) of the squared lengths along (p, tangents)."""
    return np.concatenate([vectors, pentapod.offsets[:, None] * (vectors @ tangents)], axis=-1)
