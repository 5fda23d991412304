"""LegsOnRings: legs from anywhere in space to rings around the platform line, as LinuxCNC's pentakins has them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_floats, set_frozen
from pentapod.base.errors import ArrayError, MachineError
from pentapod.kinematics.arithmetic import Arithmetic, Joints, Vector, dot
from pentapod.kinematics.batches import as_poses
from pentapod.kinematics.legs_on_line import LegsOnLine


class LegsOnRings(LegsOnLine):
    """Five legs from a_k in space to rings around the platform line; all in metres, machine frame.

    base (5, 3): where the base joints are. offsets (5,): z_k, the positions of the platform joints along the line.
    radii (5,), none negative: leg k ends on a circle of this radius that turns freely about the line at z_k (0 is a
    joint on the line itself). zeros (5,): what a leg's scale reads is its length plus this.

        reading_k = √((i·(a_k − p) − z_k)² + (ρ_k − r_k)²) + zero_k,   ρ_k the distance of a_k from the line

    Raises MachineError: wrong shapes, numbers that are not finite, negative radii.
    """

    base: Floats
    offsets: Floats
    radii: Floats
    zeros: Floats
    n_legs = 5

    def __post_init__(self) -> None:
        for name, shape in (("base", (5, 3)), ("offsets", (5,)), ("radii", (5,)), ("zeros", (5,))):
            value = getattr(self, name)
            if np.shape(value) != shape:
                raise MachineError(f"{name} has shape {np.shape(value)}", key=name, expected=f"shape {shape}")
            array = broadcast_to_legs(value, name, shape).copy()
            array.flags.writeable = False
            set_frozen(self, **{name: array})
        if not np.ptp(self.base, axis=0).any():
            raise MachineError("all base joints are in one place", key="base")
        if (self.radii < 0.0).any():
            leg = int(np.argmin(self.radii))
            raise MachineError(
                f"leg {leg + 1}: its ring has a negative radius",
                key="radii",
                value=float(self.radii[leg]),
                expected="metres, 0 for a joint on the line",
            )

    @property
    def base_joints(self) -> Floats:
        """The base joints (5, 3)."""
        return self.base

    def leg_lengths(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return the readings of the legs (..., 5), metres, of positions p and unit directions i (..., 3)."""
        p, i = as_poses(position, direction)
        t, _, normal = self._in_tool_frame(p, i)
        return np.hypot(t - self.offsets, np.linalg.norm(normal, axis=-1) - self.radii) + self.zeros

    def leg_vectors(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return the vectors (..., 5, 3) from the base joints to the nearest points of the rings, metres."""
        p, i = as_poses(position, direction)
        t, ratio, normal = self._in_tool_frame(p, i)
        return (self.offsets - t)[..., None] * i[..., None, :] - (1.0 - ratio)[..., None] * normal

    def platform_joints(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return the points of the rings (..., 5, 3) at which the legs end, metres."""
        return self.base + self.leg_vectors(position, direction)

    def vectors_of(self, p: Vector, i: Vector, do: Arithmetic, joints: Joints | None = None) -> list[Vector]:
        """Return `leg_vectors`, one for each leg, by a formula for numbers and symbols alike; joints: as moved."""
        base, offsets = (self.base.tolist(), self.offsets.tolist()) if joints is None else joints
        vectors: list[Vector] = []
        for a, z, radius in zip(base, offsets, self.radii.tolist(), strict=True):
            d = [p[k] - a[k] for k in range(3)]
            if radius:
                along = dot(d, i)
                across = [d[k] - along * i[k] for k in range(3)]
                share = radius / do.sqrt(dot(across, across))
                d = [d[k] - share * across[k] for k in range(3)]
            vectors.append([d[k] + z * i[k] for k in range(3)])
        return vectors

    def lengths_of(self, vectors: Sequence[Vector], do: Arithmetic) -> list[Any]:
        """Return the readings of legs along vectors: their lengths and zeros."""
        return [do.sqrt(dot(d, d)) + zero for d, zero in zip(vectors, self.zeros.tolist(), strict=True)]

    def jacobian(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return ∂readings/∂(p, i) (..., 5, 6) at poses (..., 3): m/m, then metres per change of i.

        i counts as a free vector of R³; a change of a unit direction is perpendicular to it, and for such a change the
        result is exact. NaN where the base joint of a ring is on the line: there its leg may point anywhere.
        """
        p, i = as_poses(position, direction)
        t, ratio, normal = self._in_tool_frame(p, i)
        along, across, i = (t - self.offsets)[..., None], (1.0 - ratio)[..., None] * normal, i[..., None, :]
        by_position = -along * i - across  # from the base joint to the ring
        by_direction = -self.offsets[:, None] * along * i + (ratio * t - self.offsets)[..., None] * normal
        length = np.sqrt(np.einsum("...c,...c->...", by_position, by_position))
        return np.concatenate([by_position, by_direction], axis=-1) / length[..., None]

    def pose_loads(self, position: Floats, direction: Floats, leg: int, force: Floats) -> tuple[Floats, Floats]:
        """Return what forces (N, 3) on the end of a leg do on p and on i (N, 3), by virtual work; poses (N, 3).

        As in `jacobian`: i counts as a free vector. On a ring the end turns about the line as the base joint asks.
        """
        d, z, radius = self.base[leg] - position, self.offsets[leg], self.radii[leg]
        if not radius:
            return force, z * force
        along = np.einsum("nc,nc->n", d, direction)[:, None]
        normal = d - along * direction
        rho = np.linalg.norm(normal, axis=1, keepdims=True)
        m = normal / rho  # the ring's radius; it changes by what moves the base joint across the plane of m and i
        across = force - np.einsum("nc,nc->n", force, m)[:, None] * m
        lean = np.einsum("nc,nc->n", across, direction)[:, None]
        share = radius / rho
        return force - share * (across - lean * direction), z * force - share * (lean * d + along * across)

    def _in_tool_frame(self, p: Floats, i: Floats) -> tuple[Floats, Floats, Floats]:
        """Return t = i·(a − p), r / ρ (..., 5), and the perpendiculars from the line to a (..., 5, 3)."""
        d = self.base - p[..., None, :]
        t = np.einsum("...kc,...c->...k", d, i)
        normal = d - t[..., None] * i[..., None, :]
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = self.radii / np.linalg.norm(normal, axis=-1)
        ratio = np.where(self.radii == 0.0, 0.0, np.where(np.isinf(ratio), np.nan, ratio))
        return t, ratio, normal


def broadcast_to_legs(value: ArrayLike, key: str, shape: tuple[int, ...]) -> Floats:
    """Return numbers of legs in this shape; one value counts for all. Raises MachineError under the key."""
    try:
        return np.broadcast_to(as_floats(value, key), shape)
    except ArrayError as error:
        raise MachineError(error.what, key=key, value=error.value, expected=error.expected) from error
    except ValueError as error:
        raise MachineError(f"{key} has shape {np.shape(value)}", key=key, expected=f"shape {shape}") from error
