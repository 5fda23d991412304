"""Motions of a part that touches do not determine, named: shifts, turns about axes and points, screws.

A motion is a twist (6,): the velocity of the part's centre and its rate of turn times `size`, both in metres. Surfaces
that such motions map onto themselves are the *slippable* ones (Gelfand and Guibas 2004): planes, spheres, cylinders,
surfaces of revolution, extruded surfaces and helicoids.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats, frozen, set_frozen
from pentapod.base.values import Value


@dataclass(frozen=True)
class MotionOptions:
    """pure: share of a twist below which its turn, its shift or its pitch counts as none.

    digits: of coordinates in mm; of directions one more.
    """

    pure: float = 0.05
    digits: int = 2


OPTIONS = MotionOptions()


@dataclass(frozen=True, eq=False)
class Motion(Value):
    """A motion that the touches do not determine. name: in words, mesh frame; twist (6,): workpiece frame, unit length.

    across: metres by which it moves the cut surface along its normals, at most, for each metre that it moves the part.
    """

    summary = ("name",)

    name: str
    twist: Floats
    across: float

    def __post_init__(self) -> None:
        set_frozen(self, twist=frozen(self.twist, "twist", (6,)))


def named_motions(twists: Floats, centre: Floats, size: float, cut_rows: Floats) -> tuple[Motion, ...]:
    """Return the motions (k,) that orthonormal twists (k, 6) span.

    centre (3,), size: of the twists, metres; cut_rows (P, 6): `motion_rows` of the surface that is cut.
    """
    if not len(twists):
        return ()
    mix, share, _ = np.linalg.svd(twists[:, 3:])
    share = np.append(share, np.zeros(len(twists)))[: len(twists)]
    turned = mix.T @ twists
    shifts, turns = turned[share < OPTIONS.pure], turned[share >= OPTIONS.pure]
    if len(turns) and len(shifts):
        along = np.linalg.svd(shifts[:, :3], full_matrices=False)[2][: len(shifts)]
        turns = np.hstack([turns[:, :3] - turns[:, :3] @ along.T @ along, turns[:, 3:]])
    names = [*_shift_names(shifts), *_turn_names(turns, centre, size)]
    found = [np.hstack([np.linalg.svd(shifts[:, :3])[2][: len(shifts)], np.zeros((len(shifts), 3))]), turns]
    spans = np.concatenate([span / np.linalg.norm(span, axis=1, keepdims=True) for span in found if len(span)])
    return tuple(
        Motion(name, twist, float(np.abs(cut_rows @ twist).max(initial=0.0)))
        for name, twist in zip(names, spans, strict=True)
    )


def _shift_names(shifts: Floats) -> list[str]:
    directions = np.linalg.svd(shifts[:, :3])[2][: len(shifts)] if len(shifts) else shifts[:, :3]
    return [f"a shift along {_direction(direction)}" for direction in directions]


def _turn_names(turns: Floats, centre: Floats, size: float) -> list[str]:
    """Return the names of motions with a turn; three of them about one point are named by it."""
    if not len(turns):
        return []
    rates, speeds = turns[:, 3:], turns[:, :3]
    # The point that all of them leave where it is: v + ω × c = 0, by least squares.
    cross = np.concatenate([_cross_matrix(rate) for rate in rates])
    point, *_ = np.linalg.lstsq(cross, -speeds.ravel(), rcond=1e-6)
    left = speeds + np.cross(rates, point)
    through = _point(centre + size * point)
    if len(turns) > 1 and np.abs(left).max() < OPTIONS.pure:
        axes = np.linalg.svd(rates)[2][: len(turns)]
        return [f"a turn about {_direction(axis)} through the point {through}" for axis in axes]
    names: list[str] = []
    for rate, speed in zip(rates, speeds, strict=True):
        unit = rate / np.linalg.norm(rate)
        own = np.cross(unit, speed) / np.linalg.norm(rate)
        pitch = float(unit @ speed) / float(np.linalg.norm(rate))
        name = f"a turn about the axis through {_point(centre + size * own)} along {_direction(unit)}"
        if abs(pitch) >= OPTIONS.pure:
            name += f" with a shift of {2e3 * np.pi * size * pitch:.{OPTIONS.digits}f} mm each turn"
        names.append(name)
    return names


def _cross_matrix(vector: Floats) -> Floats:
    """Return the matrix C with C @ c = vector × c."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _direction(vector: Floats) -> str:
    """Return a direction as text; the sign is such that its largest component is positive."""
    unit = vector / np.linalg.norm(vector)
    unit = unit * np.sign(unit[np.abs(unit).argmax()])
    for name, axis in zip("xyz", np.eye(3), strict=True):
        if np.linalg.norm(unit - axis) < 10.0**-(OPTIONS.digits):
            return name
    return f"({', '.join(f'{round(v, OPTIONS.digits + 1) + 0.0:g}' for v in unit.tolist())})"


def _point(point: Floats) -> str:
    return f"({', '.join(f'{round(1e3 * v, OPTIONS.digits) + 0.0:g}' for v in point.tolist())}) mm"
