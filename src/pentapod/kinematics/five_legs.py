"""FiveLegs: what every linear pentapod has, whatever its offsets: joints, leg vectors and leg lengths."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_floats
from pentapod.base.errors import ArrayError, MachineError
from pentapod.kinematics.batches import as_poses, joined_poses
from pentapod.numerics.blocks import blocks
from pentapod.numerics.kernels import kernels_pay

SAVED_BY_KERNELS = 30e-9
"""Seconds a pose that compiled kernels save, forwards and backwards."""

_LARGEST = 1e9
"""Metres, or the slope δ: what is computed from larger numbers could overflow."""


class FiveLegs:
    """Base attachments a_i = (x_i, y_i, 0), base (5, 2), and platform joints b_i = p + z_i i, offsets (5,), metres."""

    base: Floats
    offsets: Floats

    def leg_vectors(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return b_i − a_i (..., 5, 3) in metres for positions p and unit directions i (..., 3)."""
        p, i = as_poses(position, direction)
        legs = p[..., None, :] + self.offsets[:, None] * i[..., None, :]
        legs[..., :2] -= self.base
        return legs

    def levers(self, tool_length: float) -> Floats:
        """Return z_i − h (5,): the platform joints from the tip, along the line; metres. Raises ArrayError."""
        return self.offsets - as_floats(tool_length, "tool_length")

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

            lengths(p, i, self.base, self.offsets, legs)
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
    if largest > _LARGEST:
        raise MachineError("too large for a machine", key=key, value=largest, expected=f"at most {_LARGEST:g}")
    return array
