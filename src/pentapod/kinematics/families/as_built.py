"""AsBuiltPentapod: a linear pentapod as it was measured, near the family it was designed in but never exactly in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_floats, set_frozen
from pentapod.base.errors import ArrayError, MachineError
from pentapod.base.values import Value
from pentapod.kinematics.batches import as_poses
from pentapod.kinematics.five_legs import FiveLegs


@dataclass(frozen=True, eq=False)
class AsBuiltPentapod(Value):
    """Five legs from a_k in space to rings around the platform line; all in metres, machine frame.

    base (5, 3): where the base joints are, off the plane z = 0 too. offsets (5,): z_k, the heights of the platform
    joints along the line. radii (5,), none negative: leg k ends on a circle of this radius that turns freely about the
    line at z_k (LinuxCNC's pentakins; 0 is a joint on the line itself). zeros (5,): what a leg's scale reads is its
    length plus this.

        reading_k = √((i·(a_k − p) − z_k)² + (ρ_k − r_k)²) + zero_k,   ρ_k the distance of a_k from the line

    Raises MachineError: wrong shapes, numbers that are not finite, negative radii.
    """

    base: Floats
    offsets: Floats
    radii: Floats
    zeros: Floats

    @classmethod
    def of(
        cls,
        nominal: FiveLegs,
        *,
        base_errors: ArrayLike = 0.0,
        offset_errors: ArrayLike = 0.0,
        radii: ArrayLike = 0.0,
        zeros: ArrayLike = 0.0,
    ) -> AsBuiltPentapod:
        """Return a nominal machine with errors (metres) added: base_errors (5, 3), the others (5,), or one for all."""
        base = np.c_[nominal.base, np.zeros(5)] + _given(base_errors, "base_errors", (5, 3))
        offsets = nominal.offsets + _given(offset_errors, "offset_errors", (5,))
        return cls(base, offsets, _given(radii, "radii", (5,)), _given(zeros, "zeros", (5,)))

    def __post_init__(self) -> None:
        for name, shape in (("base", (5, 3)), ("offsets", (5,)), ("radii", (5,)), ("zeros", (5,))):
            value = getattr(self, name)
            if np.shape(value) != shape:
                raise MachineError(f"{name} has shape {np.shape(value)}", key=name, expected=f"shape {shape}")
            array = _given(value, name, shape).copy()
            array.flags.writeable = False
            set_frozen(self, **{name: array})
        if not self.size > 0.0:
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
    def size(self) -> float:
        """The largest distance of a base joint from their centre, metres."""
        return float(np.linalg.norm(self.base - self.base.mean(axis=0), axis=1).max())

    @property
    def scale(self) -> float:
        """The power of two nearest to `size`: metres that count as much as a radian."""
        return float(2.0 ** np.round(np.log2(self.size)))

    def leg_lengths(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return the readings of the legs (..., 5), metres, of positions p and unit directions i (..., 3)."""
        p, i = as_poses(position, direction)
        t, _, normal = self._in_tool_frame(p, i)
        return np.hypot(t - self.offsets, np.linalg.norm(normal, axis=-1) - self.radii) + self.zeros

    def leg_jacobian(self, position: ArrayLike, direction: ArrayLike) -> Floats:
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

    def _in_tool_frame(self, p: Floats, i: Floats) -> tuple[Floats, Floats, Floats]:
        """Return t = i·(a − p), r / ρ (..., 5), and the perpendiculars from the line to a (..., 5, 3)."""
        d = self.base - p[..., None, :]
        t = np.einsum("...kc,...c->...k", d, i)
        normal = d - t[..., None] * i[..., None, :]
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = self.radii / np.linalg.norm(normal, axis=-1)
        ratio = np.where(self.radii == 0.0, 0.0, np.where(np.isinf(ratio), np.nan, ratio))
        return t, ratio, normal


def _given(value: ArrayLike, key: str, shape: tuple[int, ...]) -> Floats:
    try:
        return np.broadcast_to(as_floats(value, key), shape)
    except ArrayError as error:
        raise MachineError(error.what, key=key, value=error.value, expected=error.expected) from error
    except ValueError as error:
        raise MachineError(f"{key} has shape {np.shape(value)}", key=key, expected=f"shape {shape}") from error
