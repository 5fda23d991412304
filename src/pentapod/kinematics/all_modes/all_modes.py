"""All poses of a linear pentapod's leg readings, off the plane and on rings too: branch and prune with proof."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_floats, frozen, set_frozen
from pentapod.base.errors import ArrayError
from pentapod.base.values import Value
from pentapod.kinematics.proofs.chords import kernel_geometry
from pentapod.kinematics.tubes.leg_equations import BuiltLegs


@dataclass(frozen=True)
class SearchOptions(Value):
    """How all poses are searched.

    most_boxes: after which the search ends without proof. narrow: half width of the directions in a box from which
    Newton's method looks for a pose in it. gain: a box is pruned again while it shrinks to less than this share.
    most_poses: room for poses. depth: room for boxes that wait.
    """

    most_boxes: int = 600_000
    narrow: float = 0.1
    gain: float = 0.7
    most_poses: int = 64
    depth: int = 512


SEARCH = SearchOptions()


@dataclass(frozen=True, eq=False)
class AllPoses(Value):
    """The poses of leg readings. position, direction (K, 3): each next to one that exists, by proof.

    complete: whether it is proven that there is no other pose. boxes: how many were looked at.
    """

    position: Floats
    direction: Floats
    complete: bool
    boxes: int

    def __post_init__(self) -> None:
        for name in ("position", "direction"):
            set_frozen(self, **{name: frozen(getattr(self, name), name)})


def all_poses(
    robot: BuiltLegs, legs: ArrayLike, *, leg_error: float = 0.0, options: SearchOptions = SEARCH
) -> AllPoses:
    """Return all poses of leg readings (5,), metres, with a proof that there is no other one, where it succeeds.

    leg_error: metres by which each reading may be wrong; with any such readings there are as many poses. No proof
    succeeds where two poses nearly meet or form a continuum, or a ring's base joint is next to the line. Raises
    ArrayError.
    """
    from pentapod.kinematics.all_modes.search_kernels import search  # noqa: PLC0415 - loads numba
    from pentapod.kinematics.krawczyk.krawczyk_kernels import ROUND  # noqa: PLC0415

    readings = as_floats(legs, "legs")
    if readings.shape != (5,) or not (np.isfinite(readings) & (readings > 0.0)).all():
        raise ArrayError("not the readings of five legs", expected="five positive numbers, metres")
    if not 0.0 <= leg_error < np.inf:
        raise ArrayError("must not be negative", key="leg_error", value=leg_error, expected="metres")
    lengths = readings - robot.zeros
    roots, reaches = np.empty((options.most_poses, 6)), np.empty((options.most_poses, 6))
    count, boxes, complete = 0, 0, True
    if (lengths > 0.0).all():
        rings, geometry = np.column_stack([np.zeros((5, 8)), robot.radii]), kernel_geometry(robot, lengths)
        slack = ROUND * geometry[5, 2] ** 2 + (lengths.max() + leg_error) * leg_error
        count, boxes, complete = search(
            lengths, geometry, rings, roots, reaches, slack,
            np.empty((options.depth, 12)), options.most_boxes, options.narrow, options.gain,
        )  # fmt: skip
    return AllPoses(roots[:count, :3], roots[:count, 3:], bool(complete), int(boxes))
