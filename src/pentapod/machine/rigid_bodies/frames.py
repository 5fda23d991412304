"""What models of all formats share: turns of bodies, hinges in which legs hang, elements with numbers."""

from __future__ import annotations

from collections.abc import Iterable
from xml.etree import ElementTree as Xml

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.kinematics.legs_on_rings import LegsOnRings
from pentapod.kinematics.robot import Robot

LONGEST_STEP = 5e-4
"""Step of a simulation at most, seconds; the controller's period is cut in equal steps."""


def steps_in(period: float) -> int:
    """Return the steps of a simulation in a controller's period, seconds."""
    return max(1, int(np.ceil(period / LONGEST_STEP - 1e-9)))


def rotation_from_z(direction: Floats) -> Floats:
    """Return the quaternion (4,), scalar first, of the shortest rotation from the z axis to a unit direction (3,).

    Near −z, where it is not unique, half a turn about x comes first.
    """
    u, v, w = direction
    quaternion = np.array([1.0 + w, -v, u, 0.0] if w > -0.9 else [-v, 1.0 - w, 0.0, u])
    return quaternion / np.linalg.norm(quaternion)


def turned_back(quaternion: Floats, vector: Floats) -> Floats:
    """Return a vector (3,) in the frame that a quaternion (4,), scalar first, turns to the world."""
    scalar, axis = quaternion[0], -quaternion[1:]
    turned = vector + 2.0 * np.cross(axis, np.cross(axis, vector) + scalar * vector)
    return np.asarray(turned, dtype=np.float64)


def ring_radii(real: Robot) -> Floats:
    """Return the radii (n_legs,) of rings on which legs end, which turn freely about the line; 0 for others."""
    return real.radii if isinstance(real, LegsOnRings) else np.zeros(real.n_legs)


def leg_hinges(real: Robot, position: Floats, direction: Floats) -> dict[int, Floats]:
    """Return the axes (3,) of hinges in which legs hang on the platform or, along the tangent, on their ring."""
    radii = ring_radii(real)
    if not radii.any():
        return dict(real.hinges(position, direction))
    across = np.cross(direction, real.base_joints - position)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    return {leg: across[leg] for leg in np.flatnonzero(radii).tolist()}


def limb_hinge(real: Robot, rail: Floats, position: Floats, direction: Floats) -> Floats:
    """Return the axis (3,), unit, by which a passive limb's universal joint hangs on the platform.

    The robot's passive joint holds a moment along rail × axis.
    """
    hinge = np.cross(real.passive_wrenches(position, direction)[0, 3:], rail)  # it is perpendicular to the rail
    return hinge / np.linalg.norm(hinge)


def add(parent: Xml.Element, tag: str, **attributes: str | Iterable[float]) -> Xml.Element:
    """Add an element; numbers are written with all digits."""
    words = {name: value if isinstance(value, str) else text(value) for name, value in attributes.items()}
    return Xml.SubElement(parent, tag, words)


def text(values: Iterable[float]) -> str:
    """Return numbers separated by blanks, with all digits; zero has no sign."""
    return " ".join(repr(float(value) + 0.0) for value in values)


def written(root: Xml.Element) -> str:
    """Return a model as text."""
    Xml.indent(root)
    return Xml.tostring(root, encoding="unicode") + "\n"
