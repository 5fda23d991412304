"""FiveLegs: joints, leg vectors, leg lengths and their derivatives of a linear pentapod with any offsets."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_floats, frozen, read_only
from pentapod.base.errors import ArrayError, MachineError
from pentapod.kinematics.arithmetic import Arithmetic, Joints, Vector, dot
from pentapod.kinematics.batches import as_poses, joined_poses
from pentapod.kinematics.legs_on_line import LegsOnLine
from pentapod.numerics.blocks import blocks
from pentapod.numerics.kernels import kernels_pay

SAVED_BY_KERNELS = 30e-9
"""Seconds a pose that compiled kernels save, forwards and backwards."""

LARGEST_NUMBER = 1e9
"""Of a geometry, in metres or for the slope δ: what is computed from larger numbers could overflow."""

SINGULAR_CONDITION = 1e-12
"""Reciprocal condition number of a geometry below which forward kinematics has no correct digits."""


class FiveLegs(LegsOnLine):
    """Base attachments a_i = (x_i, y_i, 0), base (5, 2), and platform joints b_i = p + z_i i, offsets (5,), metres."""

    base: Floats
    offsets: Floats
    n_legs = 5

    @property
    def base_joints(self) -> Floats:
        """The base attachments (5, 3)."""
        return frozen(np.column_stack([self.base, np.zeros(5)]), "base_joints")

    @property
    def radii(self) -> Floats:
        """Radii of the rings on which legs end (5,), metres: there are none."""
        return np.zeros(5)

    @property
    def zeros(self) -> Floats:
        """Zero errors of the legs' scales (5,), metres: there are none."""
        return np.zeros(5)

    def leg_vectors(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return b_i − a_i (..., 5, 3) in metres for positions p and unit directions i (..., 3)."""
        legs = self.platform_joints(position, direction)
        legs[..., :2] -= self.base
        return legs

    def platform_joints(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return b_i (..., 5, 3), metres, in poses (..., 3)."""
        p, i = as_poses(position, direction)
        return p[..., None, :] + self.offsets[:, None] * i[..., None, :]

    def jacobian(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return ∂legs/∂(p, i) (..., 5, 6) at poses (..., 3): rows [e_i, z_i e_i], e_i the leg's unit vector.

        The first three columns have no unit (m/m), the last three metres. i is taken as a free vector of R³; a
        change of a unit direction is perpendicular to it.
        """
        vectors = self.leg_vectors(position, direction)
        unit = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
        return np.concatenate([unit, self.offsets[:, None] * unit], axis=-1)

    def vectors_of(self, p: Vector, i: Vector, do: Arithmetic, joints: Joints | None = None) -> list[Vector]:
        """Return `leg_vectors`, one for each leg, by a formula for numbers and symbols alike; joints: as moved."""
        base, offsets = (self.base.tolist(), self.offsets.tolist()) if joints is None else joints
        return [
            [p[0] + z * i[0] - x, p[1] + z * i[1] - y, p[2] + z * i[2]] for (x, y), z in zip(base, offsets, strict=True)
        ]

    def lengths_of(self, vectors: Sequence[Vector], do: Arithmetic) -> list[Any]:
        """Return the lengths of vectors."""
        return [do.sqrt(dot(d, d)) for d in vectors]

    def leg_lengths(self, position: ArrayLike, direction: ArrayLike, *, out: Floats | None = None) -> Floats:
        """Return leg lengths (..., 5), metres, of positions p and unit directions i (..., 3).

        out: a contiguous array (..., 5) to write them to, for large batches again and again. Raises ArrayError.
        """
        p, i = joined_poses(position, direction)
        batch = p.shape[:-1]
        p, i = p.reshape(-1, 3), i.reshape(-1, 3)
        (legs,) = outputs(None if out is None else (out,), batch, (5,))
        if kernels_pay(SAVED_BY_KERNELS * len(p)):
            from pentapod.kinematics.five_legs_kernels import lengths  # noqa: PLC0415

            lengths(read_only(p), read_only(i), self.base, self.offsets, legs)
            return legs.reshape(*batch, 5)
        x, y, z = self.base[:, :1], self.base[:, 1:], self.offsets[:, None]
        for block in blocks(len(p)):
            (px, py, pz), (u, v, w) = p[block].T.copy(), i[block].T.copy()
            squared = np.square(z * u + (px - x))
            squared += np.square(z * v + (py - y))
            squared += np.square(z * w + pz)
            legs[block] = np.sqrt(squared, out=squared).T
        return legs.reshape(*batch, 5)


def outputs(out: tuple[Floats, ...] | None, batch: tuple[int, ...], *tails: tuple[int, ...]) -> tuple[Floats, ...]:
    """Return arrays (N, *tail) of a batch to write to: views of those given, or new ones. Raises ArrayError."""
    if out is None:
        return tuple(np.empty((math.prod(batch), *tail)) for tail in tails)
    for array, tail in zip(out, tails, strict=True):
        if array.shape != batch + tail or array.dtype != np.float64 or not array.flags.c_contiguous:
            raise ArrayError(
                f"out has shape {array.shape} of {array.dtype}", expected=f"contiguous float64 of shape {batch + tail}"
            )
    return tuple(array.reshape(-1, *tail) for array, tail in zip(out, tails, strict=True))


def given(value: ArrayLike, key: str, shape: tuple[int, ...]) -> Floats:
    """Return the design's numbers as float64 of exactly this shape.

    Raises MachineError under the key, also for numbers that are not finite or beyond 1e9.
    """
    try:
        array = as_floats(value, key, shape)
    except ArrayError as error:
        raise MachineError(error.what, key=key, value=error.value, expected=error.expected) from error
    if array.shape != shape:
        raise MachineError(f"{key} has shape {array.shape}", key=key, expected=f"shape {shape}")
    largest = float(np.abs(array).max())
    if largest > LARGEST_NUMBER:
        raise MachineError("too large for a machine", key=key, value=largest, expected=f"at most {LARGEST_NUMBER:g}")
    return array
