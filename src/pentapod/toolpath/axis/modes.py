"""Axis modes: direction of the tool axis at a contact, before lead and tilt. Axes point from the tip to the spindle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pentapod.base.arrays import Floats, frozen, set_frozen
from pentapod.base.errors import ToolpathError
from pentapod.base.values import Value
from pentapod.geometry.directions import normalised


class AxisMode(Protocol):
    """Contacts and unit normals (N, 3) → unit axes (N, 3)."""

    def axes(self, contacts: Floats, normals: Floats) -> Floats:
        """Return unit axes. Raises ToolpathError where the mode does not determine one."""
        ...


@dataclass(frozen=True)
class Normal(Value):
    """Along the surface normal.

    >>> along = Orientation(mode=Normal(), smoothing=0.0)
    """

    def axes(self, contacts: Floats, normals: Floats) -> Floats:
        """Return the normals."""
        del contacts
        return normals


@dataclass(frozen=True, eq=False)
class Fixed(Value):
    """A fixed direction. direction (3,): any length.

    >>> upright = Orientation(mode=Fixed((0.0, 0.0, 1.0)))
    """

    direction: Floats | tuple[float, float, float]

    def __post_init__(self) -> None:
        set_frozen(self, direction=frozen(normalised(self.direction), "direction", (3,)))

    def axes(self, contacts: Floats, normals: Floats) -> Floats:
        """Return the direction for every contact."""
        del normals
        return np.tile(np.asarray(self.direction), (len(contacts), 1))


@dataclass(frozen=True, eq=False)
class Pointed(Value):
    """Toward or from a point; with `along`, toward or from a line, at right angles to it.

    point, along (3,): metres, workpiece frame. toward: the tip points there, as on the outside of a tube; otherwise it
    points away from there, as on the inside of a tube.

    >>> inward = Orientation(mode=Pointed((0.0, 0.0, -0.2), toward=False))
    """

    point: Floats | tuple[float, float, float]
    along: Floats | tuple[float, float, float] | None = None
    toward: bool = True

    def __post_init__(self) -> None:
        set_frozen(self, point=frozen(self.point, "point", (3,)))
        if self.along is not None:
            set_frozen(self, along=frozen(normalised(self.along), "along", (3,)))

    def axes(self, contacts: Floats, normals: Floats) -> Floats:
        """Return the directions from the point or line to the contacts, or their opposites."""
        del normals
        outwards = contacts - self.point
        if self.along is not None:
            along = np.asarray(self.along)
            outwards = outwards - (outwards @ along)[:, None] * along
        length = np.linalg.norm(outwards, axis=1)
        if (length < 1e-9).any():
            raise ToolpathError(
                "a contact lies on the point or line that sets the axis", key="axis", value=int(np.argmin(length)),
                remedy="move the point, or choose another axis mode",
            )  # fmt: skip
        return (outwards if self.toward else -outwards) / length[:, None]


@dataclass(frozen=True, eq=False)
class Between(Value):
    """Interpolated between directions given at places (K, 3), metres: inverse distance weighting (Shepard 1968).

    >>> places = np.array([[-0.03, 0.0, 0.0], [0.03, 0.0, 0.0]])
    >>> turning = Between(places, np.array([[-0.1, 0.0, 1.0], [0.1, 0.0, 1.0]]))
    """

    places: Floats
    directions: Floats

    def __post_init__(self) -> None:
        set_frozen(self, places=frozen(self.places, "places", (None, 3)))
        set_frozen(self, directions=frozen(normalised(self.directions, "directions"), "directions", (None, 3)))
        if self.places.shape != self.directions.shape or self.places.ndim != 2:
            raise ToolpathError(
                "each direction needs its place", key="directions", value=self.directions.shape, expected="(K, 3) both"
            )

    def axes(self, contacts: Floats, normals: Floats) -> Floats:
        """Return the directions weighted by inverse square distances, of unit length."""
        del normals
        square = np.square(contacts[:, None] - self.places).sum(axis=2)
        nearest = square.min(axis=1, keepdims=True)
        weights = np.where(nearest > 0.0, nearest / np.where(square > 0.0, square, 1.0), square == 0.0)
        mixed = weights @ self.directions
        length = np.linalg.norm(mixed, axis=1, keepdims=True)
        if (length < 1e-6 * weights.sum(axis=1, keepdims=True)).any():
            raise ToolpathError("the given directions cancel each other", key="directions", remedy="give more of them")
        return mixed / length


def with_lead_and_tilt(axes: Floats, feeds: Floats, lead: float, tilt: float) -> Floats:
    """Return axes (N, 3) tilted by `lead` radians forwards along the feeds (N, 3), and by `tilt` to their left.

    Lead is the angle in the plane of axis and feed, tilt in the plane across the feed. An axis along its feed stays.
    """
    flat = feeds - np.einsum("ni,ni->n", feeds, axes)[:, None] * axes
    length = np.linalg.norm(flat, axis=1, keepdims=True)
    flat = np.where(length > 1e-9, flat / np.where(length > 1e-9, length, 1.0), 0.0)
    left = np.cross(axes, flat)
    mixed = axes + np.tan(lead) * flat + np.tan(tilt) * left
    return mixed / np.linalg.norm(mixed, axis=1, keepdims=True)
