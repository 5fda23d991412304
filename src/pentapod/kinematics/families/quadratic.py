"""LinearPentapod: the quadratic family's geometry and its kinematics. No limits, no bodies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pentapod.base.arrays import Floats, Ints, as_batch, frozen, read_only, set_frozen
from pentapod.base.errors import MachineError
from pentapod.base.values import Value
from pentapod.kinematics.arithmetic import Arithmetic, Vector
from pentapod.kinematics.batches import as_poses, broadcast
from pentapod.kinematics.component import COMPONENTS, Component
from pentapod.kinematics.families.offsets import check_offsets, fit_delta
from pentapod.kinematics.five_legs import SAVED_BY_KERNELS, SINGULAR_CONDITION, FiveLegs, given, outputs
from pentapod.kinematics.forward.quadratic import (
    NEAR_W_SQUARED,
    LinearPart,
    Reduced,
    reciprocal_condition,
    solve,
    w_and_s,
)
from pentapod.kinematics.forward.quadratic_near import solve_near
from pentapod.kinematics.mode import as_labels
from pentapod.kinematics.proof_results import BranchProof, ProvenMeasure
from pentapod.kinematics.proofs.by_leg_equations import ProvenByLegEquations
from pentapod.kinematics.proofs.certificate import METHOD, certify_component
from pentapod.kinematics.robot import Branch, Poses, Robot, SingularSurface
from pentapod.numerics.blocks import blocks
from pentapod.numerics.kernels import kernels_pay


@dataclass(frozen=True, eq=False)
class LinearPentapod(Value, FiveLegs, ProvenByLegEquations):
    """Five base attachments a_i = (x_i, y_i, 0) and offsets z_i along the platform line, b_i = p + z_i i.

    base (5, 2) and offsets (5,) in metres; delta: the constant z_i − z_3 = δ (x_i − x_3) of the quadratic
    family. Build one with `LinearPentapod.quadratic` or `LinearPentapod.from_offsets`. Machine frame: the
    base plane is z = 0; leg 3's attachment may be anywhere in it. Offsets that deviate by less than that, but by
    more than rounding, are replaced by z_3 + δ (x_i − x_3): closed form, leg lengths and proofs are about one machine.

    Raises MachineError: not five attachments or offsets, numbers that are not finite or beyond 1e9, offsets that do not
    fit delta (to 1e-9 of the machine's size), an architecturally singular geometry.

    >>> robot = Machine.load("desk").robot
    >>> legs = robot.leg_lengths(np.array([0.1, 0.0, 0.28]), np.array([0.0, 0.0, 1.0]))
    >>> position, direction = robot.pose(legs, Component(1, 1))
    >>> position.round(6).tolist()
    [0.1, -0.0, 0.28]
    """

    base: Floats
    offsets: Floats
    delta: float
    linear_part: LinearPart = field(init=False, repr=False)
    branches = COMPONENTS
    singularities = (
        SingularSurface("singular surface w = 0", "deg"),
        SingularSurface("singular surface S = 0", "mm"),
    )

    @classmethod
    def quadratic(cls, base: ArrayLike, delta: float) -> LinearPentapod:
        """Return the pentapod with offsets z_i = δ x_i. base (5, 2) metres. Raises MachineError."""
        xy, slope = given(base, "base", (5, 2)), float(given(delta, "delta", ()))
        return cls(xy, slope * xy[:, 0], slope)

    @classmethod
    def from_offsets(
        cls, base: ArrayLike, offsets: ArrayLike, delta: float | None = None, *, tolerance: float = 1e-9
    ) -> LinearPentapod:
        """Return the pentapod with offsets z_i (5,) along the platform line and base (5, 2), in metres.

        delta is fitted by least squares where it is not claimed. The offsets must then be z_3 + δ (x_i − x_3)
        to within `tolerance` metres, and exactly these are stored. Raises MachineError that names the leg
        which is farthest off, and by how much.
        """
        xy, z = given(base, "base", (5, 2)), given(offsets, "offsets", (5,))
        slope = fit_delta(xy, z) if delta is None else float(given(delta, "delta", ()))
        return cls(xy, check_offsets(xy, z, slope, tolerance), slope)

    def __post_init__(self) -> None:
        base, offsets = given(self.base, "base", (5, 2)), given(self.offsets, "offsets", (5,))
        delta = float(given(self.delta, "delta", ()))
        size = max(1.0, abs(delta)) * float(np.abs(base).max()) + float(np.abs(offsets).max())
        fitting = check_offsets(base, offsets, delta, 1e-9 * size)
        # One machine for kinematics and proofs alike; but what is rounded in another order is as good.
        offsets = np.where(np.abs(offsets - fitting) <= 2.0**-50 * size, offsets, fitting)
        set_frozen(self, base=frozen(base, "base"), offsets=frozen(offsets, "offsets"), delta=delta)
        measure = reciprocal_condition(base, delta)
        if not measure >= SINGULAR_CONDITION:
            raise MachineError(
                "the geometry is architecturally singular: no pose is held by its legs",
                key="base" if delta else "delta",
                value=measure,
                expected="a reciprocal condition number well above 1e-3",
                remedy="move a base attachment off the conic through the others" if delta else "choose delta ≠ 0",
            )
        set_frozen(self, linear_part=LinearPart.of(base, delta))

    def assembly_modes(self, legs: ArrayLike) -> tuple[Floats, Floats]:
        """Return positions and directions (..., 4, 3) of the four modes, in the order of `COMPONENTS`.

        legs (..., 5) metres. NaN where no pose has these leg lengths (`assembly_obstacles` says why): then all four
        modes are NaN.
        """
        signs = np.array(COMPONENTS, dtype=np.float64)
        lengths = as_batch(legs, "legs", (5,))
        batch = lengths.shape[:-1]
        position, direction = outputs(None, batch, (4, 3), (4, 3))
        self._solve(lengths.reshape(-1, 5), signs[:, None, :], position, direction)
        return position.reshape(*batch, 4, 3), direction.reshape(*batch, 4, 3)

    def pose(
        self, legs: ArrayLike, component: ArrayLike, *, out: tuple[Floats, Floats] | None = None
    ) -> tuple[Floats, Floats]:
        """Return positions and directions (..., 3) in a component: a `Component`, or signs (..., 2).

        legs (..., 5) metres; the signs, each ±1, broadcast against their batch. NaN where no pose has these leg
        lengths (`assembly_obstacles` says why), and where a sign is 0 or NaN. out: contiguous arrays (..., 3) to write
        both to, for large batches again and again. Raises ArrayError for other signs, shapes that do not fit, or an
        `out` of the wrong shape.
        """
        lengths, signs = as_batch(legs, "legs", (5,)), as_batch(component, "component", (2,))
        named = (np.abs(signs) == 1.0).all(axis=-1)
        if not named.all():
            as_labels(signs, "component", "for w and for S")
            lengths = np.where(named[..., None], lengths, np.nan)
        if signs.ndim > 1:
            lengths, signs = broadcast(lengths, signs, ("legs", "component"))
        batch = lengths.shape[:-1]
        position, direction = outputs(out, batch, (3,), (3,))
        self._solve(lengths.reshape(-1, 5), signs.reshape(-1, 2), position, direction)
        return position.reshape(*batch, 3), direction.reshape(*batch, 3)

    @property
    def proven_measures(self) -> tuple[ProvenMeasure, ...]:
        """Angle between the line and the base plane, and distance to S = 0.

        |S| / √(δ²w² + (1 − δu)²) is the distance at fixed orientation; the root is ≤ 1 + |δ|.
        """
        distance = "lower bound of the position's distance to S = 0,"
        return (
            ProvenMeasure("w", "deg", 1.0, "least angle between platform line and base plane,", METHOD),
            ProvenMeasure("S", "mm", 1e3 / (1.0 + abs(self.delta)), distance, METHOD),
        )

    def prove(self, leg_coefficients: Floats, ends: Poses, branch: ArrayLike, *, leg_error: float = 0.0) -> BranchProof:
        """Return `certify_component`: by the discriminants, quickly; the poses are not needed."""
        proof = certify_component(self, leg_coefficients, branch, leg_error=leg_error)
        return BranchProof(proof.proven, proof.refuted, proof.doubt, np.stack([proof.w_lower, proof.s_lower], axis=1))

    @property
    def conditioning(self) -> float:
        """The reciprocal condition number of the 4×4 matrix [x, y, δx², δxy], joints relative to leg 3's, in its size.

        0 is singular in every pose, above 0.01 is sound; the same for a machine of any size.
        """
        return reciprocal_condition(self.base, self.delta)

    @property
    def numbers(self) -> Mapping[str, object]:
        """base, offsets and delta."""
        return {"base": self.base, "offsets": self.offsets, "delta": self.delta}

    def singularity_margins(self, p: Vector, i: Vector, branch: Branch, do: Arithmetic) -> list[Any]:
        """Return w, and the distance to S = 0 at this orientation (`position_distance`), by the signs of the branch.

        S is taken in the reduced frame of leg 3, in which the formula of the notes holds.
        """
        component = Component(*branch)
        u, w, (x3, _), z3 = i[0], i[2], self.base[2].tolist(), float(self.offsets[2])
        px, pz = p[0] + z3 * u - x3, p[2] + z3 * w
        s = self.delta * w * px - (self.delta * u - 1.0) * pz
        across, along = self.delta * w, 1.0 - self.delta * u
        return [component.w * w, component.s * (s / do.sqrt(across * across + along * along))]

    def branch(self, position: ArrayLike, direction: ArrayLike) -> NDArray[np.int8]:
        """Return the signs (..., 2) of w and S: the component of each pose; 0 on a singularity and for NaN.

        position and direction (..., 3), machine frame. Compare with a `Component`, or hand it to `pose`.
        """
        p, i = as_poses(position, direction)
        w, s = w_and_s(p, i, self.delta, self.lever)
        signs = np.sign(np.stack(np.broadcast_arrays(w, s), axis=-1))
        known = np.isfinite(p.sum(axis=-1) + i.sum(axis=-1))
        return np.where(known[..., None], signs, 0.0).astype(np.int8)

    @property
    def lever(self) -> float:
        """z_3 − δ x_3 in metres: 0 where z_i = δ x_i."""
        return float(self.offsets[2] - self.delta * self.base[2, 0])

    def _solve(self, legs: Floats, signs: Floats, position: Floats, direction: Floats) -> None:
        """Fill poses (N, 3) of legs (N, 5) and signs (1 or N, 2); or (N, modes, 3) with signs (modes, 1, 2)."""
        linear, modes, near = self.linear_part, position.ndim == 3, np.empty(len(legs), dtype=np.bool_)
        with np.errstate(invalid="ignore", over="ignore", under="ignore"):
            if not modes and kernels_pay(SAVED_BY_KERNELS * len(legs)):
                from pentapod.kinematics.forward.quadratic_kernels import poses  # noqa: PLC0415

                limits = np.array([NEAR_W_SQUARED, linear.near_s_squared])
                geometry = (linear.linear_map, linear.constant, self.delta, self._origin, limits)
                poses(read_only(legs), read_only(signs), *geometry, position, direction, near)
            else:
                for block in blocks(len(legs)):
                    columns = legs[block].T.copy()
                    squared = np.square(columns)
                    sign = signs if modes or len(signs) == 1 else signs[block]
                    reduced, near[block] = solve(squared, linear, self.delta, sign[..., 0], sign[..., 1])
                    near[block] |= columns.min(axis=0) < 0.0
                    position[block], direction[block] = self._shifted(reduced)
            self._solve_near(np.flatnonzero(near), legs, signs, position, direction)

    def _solve_near(self, rows: Ints, legs: Floats, signs: Floats, position: Floats, direction: Floats) -> None:
        """Fill the poses of the rows (K,) that are near a singularity; else as `_solve`."""
        reach = float(np.abs(self._origin[[0, 2]]).sum())
        for block in blocks(len(rows)):
            chosen = rows[block]
            columns = legs[chosen].T.copy()
            for mode in range(position.shape[1]) if position.ndim == 3 else (...,):
                sign = signs[mode] if position.ndim == 3 else signs if len(signs) == 1 else signs[chosen]
                found = solve_near(columns, self.linear_part, self.delta, sign[:, 0], sign[:, 1], reach)
                position[chosen, mode], direction[chosen, mode] = self._shifted(found)

    def _shifted(self, reduced: Reduced) -> tuple[Floats, Floats]:
        """Return positions and directions (N, *modes, 3), machine frame, of reduced poses (*modes, N)."""
        (px, py, pz, u, v, w), (x3, y3, z3) = reduced, self._origin
        return _last(px - z3 * u + x3, py - z3 * v + y3, pz - z3 * w), _last(u, v, w)

    @property
    def _origin(self) -> Floats:
        """x_3, y_3, z_3 (3,): what the reduced frame leaves out."""
        return np.append(self.base[2], self.offsets[2])


def as_quadratic(robot: Robot, purpose: str) -> LinearPentapod:
    """Return the robot where it is of the quadratic family; raises MachineError, which names the purpose, else."""
    if isinstance(robot, LinearPentapod):
        return robot
    raise MachineError(
        f"{purpose} needs a machine of the quadratic family", key="robot", value=type(robot).__name__,
        expected="platform offsets z_3 + delta (x_i − x_3)",
    )  # fmt: skip


def _last(x: Floats, y: Floats, z: Floats) -> Floats:
    """Return vectors (N, *modes, 3) of components (*modes, N); y may lack the modes."""
    return np.stack(np.broadcast_arrays(x, y, z)).T
