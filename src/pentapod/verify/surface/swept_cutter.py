"""Swept volume of a solid of the cutter over a motion, in a tree of boxes, for queries about what it leaves."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.geometry.directions import normalised, tangent_frame
from pentapod.geometry.solids import Solid
from pentapod.mesh.query.tree import along_morton_curve
from pentapod.numerics.threads import for_rows, in_threads
from pentapod.verify.replay.along_toolpath import Motion
from pentapod.verify.replay.stretches import Stretches, StretchOptions, deviation_bounds

if TYPE_CHECKING:
    from pentapod.verify.surface.swept_cutter_kernels import Swept

PER_LEAF = 4
"""Stretches in a leaf of the tree."""

BLOCKS = 32
"""Blocks into which a surface is divided, whatever the number of threads."""

FIXED_SHARE = 0.1
"""Share of the deviation from straight stretches by which an axis that counts as fixed may turn the solid."""


@dataclass(frozen=True, eq=False)
class SweptSolid:
    """The swept volume of one solid, in straight stretches, in a tree of boxes.

    stretches (S, 13): start and displacement of the tip (of a ball: of its centre), axis at start and end, and the
    bound on the deviation of the motion. boxes (2 L − 1, 6): around the solid's axis. starts (L + 1,): of the leaves.
    numbers (5,): of the solid, as `Solid.numbers`; wide: its largest distance from its axis, metres. kind: as in
    the kernels. frame (3, 3): where the axis never turns, rows are the axes of stretches and boxes; z is that axis.
    """

    stretches: Floats
    boxes: Floats
    starts: Ints
    numbers: Floats
    wide: float
    kind: int
    frame: Floats | None

    @classmethod
    def of(cls, motion: Motion, solid: Solid, chords: Bools, near: float) -> SweptSolid | None:
        """Return the swept volume over some chords (M − 1,) of a motion; None where the motion has no useful bound.

        near: stretches are cut until the motion deviates from them by no more, metres, or they are single chords.
        """
        tilt_centre, wide = motion.toolpath.tilt_centre, solid.largest_radius
        # The path of a ball about the tilt centre does not depend on how the tool turns.
        at_tilt_centre = solid.is_ball and solid.low == tilt_centre
        lever = 0.0 if at_tilt_centre else max(abs(solid.low - tilt_centre), abs(solid.high - tilt_centre)) + wide
        of, off = _stretches(motion, chords, lever, near)
        known = off < wide
        of, off = of.where(known), off[known]
        if not len(off):
            return None
        axes = motion.axes[of.starts], motion.axes[of.ends]
        drop = solid.low - tilt_centre if solid.is_ball else -tilt_centre
        ends = motion.tilt_centres[of.starts] + drop * axes[0], motion.tilt_centres[of.ends] + drop * axes[1]
        numbers = np.array((0.0, 0.0, 0.0, 0.0, wide) if solid.is_ball else solid.numbers)
        return cls.along(ends, axes, off, numbers, is_ball=solid.is_ball, near=near)

    @classmethod
    def along(
        cls,
        ends: tuple[Floats, Floats],
        axes: tuple[Floats, Floats],
        off: Floats,
        numbers: Floats,
        *,
        is_ball: bool,
        near: float,
    ) -> SweptSolid:
        """Return the swept volume along stretches of the solid's origin, ends two of (S, 3), with unit axes there.

        off (S,): by how much the motion deviates from them, metres. An axis that turns the solid by less than a share
        of `near`, metres, counts as fixed, and this as a part of the deviation.
        """
        from pentapod.verify.surface.swept_cutter_kernels import BALL, FIXED, TURNS  # noqa: PLC0415  loads numba

        low, high, wide = float(numbers[0]), float(numbers[1]), float(numbers[2:4].max() + numbers[4])
        (start, end), (first, last), kind = ends, axes, BALL if is_ball else TURNS
        frame: Floats | None = None
        if not is_ball:
            lever = max(abs(low), abs(high)) + wide  # no point of the solid is farther from its origin
            axis = normalised(first.sum(axis=0) + last.sum(axis=0))
            turn = lever * max(float(np.linalg.norm(each - axis, axis=1).max()) for each in axes)
            if turn <= FIXED_SHARE * near:
                kind, off = FIXED, off + turn
                frame = np.stack([*tangent_frame(axis), axis])
                start, end = start @ frame.T, end @ frame.T
                first = last = np.broadcast_to([0.0, 0.0, 1.0], start.shape)
        along = np.stack([start + low * first, start + high * first, end + low * last, end + high * last])
        middles = along.mean(axis=0)
        order = along_morton_curve(middles, np.stack([middles.min(axis=0), middles.max(axis=0)]))
        rows = np.concatenate([start, end - start, first, last, off[:, None]], axis=1)[order]
        # An axis that turns evenly leaves the hull of its end positions by no more than this.
        bulge = 0.125 * max(abs(low), abs(high)) * float(np.sum((last - first) ** 2, axis=1).max())
        boxes, starts = _boxes(along.min(axis=0)[order] - bulge, along.max(axis=0)[order] + bulge)
        return cls(np.ascontiguousarray(rows), boxes, starts, numbers, wide, kind, frame)

    @property
    def _swept(self) -> Swept:
        return self.stretches, self.boxes, self.starts, self.numbers, self.wide, self.kind

    def _framed(self, vectors: Floats) -> Floats:
        """Return vectors (..., 3) in the frame of the stretches."""
        return vectors if self.frame is None else np.ascontiguousarray(vectors @ self.frame.T)

    def entries(self, points: Floats, normals: Floats, heights: Floats) -> None:
        """Lower heights (N,), metres, to where rays from points along unit normals (N, 3) enter the swept volume."""
        from pentapod.verify.surface.swept_cutter_kernels import entries  # noqa: PLC0415  loads numba

        for_rows(entries, (self._framed(points), self._framed(normals)), (self._swept,), (heights,))

    def distances(self, points: Floats, gaps: Floats) -> None:
        """Lower gaps (N,), metres, to the distances of points (N, 3) from the swept volume."""
        from pentapod.verify.surface.swept_cutter_kernels import distances  # noqa: PLC0415  loads numba

        for_rows(distances, (self._framed(points),), (self._swept,), (gaps,))

    def uncovered(
        self, corners: Floats, normals: Floats, height: float, coarse: float, fine: float
    ) -> tuple[Floats, Floats]:
        """Return the cells (K, 12), corners and normal, of triangles (N, 3, 3) that are not proven covered.

        Also (4,) the largest height that is left at the middles of covered cells, metres, and where. See the kernel.
        """
        from pentapod.verify.surface.surface_left_kernels import uncovered  # noqa: PLC0415  loads numba

        def done(block: slice) -> tuple[Floats, Floats]:
            here = self._framed(corners[block]), self._framed(normals[block])
            room = max(2 * len(here[0]), 1 << 14)
            while True:
                found, deepest = np.empty((room, 12)), np.array([0.0, np.nan, np.nan, np.nan])
                count = uncovered(*here, height, coarse, fine, self._swept, deepest, found)
                if count <= room:
                    return found[:count], deepest
                room = count

        answers = list(in_threads(done, _of_equal_area(corners)))
        if not answers:
            return np.empty((0, 12)), np.array([0.0, np.nan, np.nan, np.nan])
        cells = np.concatenate([found for found, _ in answers])
        deepest = max((deepest for _, deepest in answers), key=lambda each: float(each[0]))
        if self.frame is not None:
            cells, deepest[1:] = (cells.reshape(-1, 4, 3) @ self.frame).reshape(-1, 12), deepest[1:] @ self.frame
        return cells, deepest


def _of_equal_area(corners: Floats) -> list[slice]:
    """Return blocks of triangles (N, 3, 3) of about equal area, for as many cells in each."""
    if not len(corners):
        return []
    edges = np.cumsum(np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1))
    inner = np.searchsorted(edges, np.arange(1, BLOCKS) * (edges[-1] / BLOCKS))
    return [slice(a, b) for a, b in pairwise(np.unique(np.concatenate([[0], inner, [len(corners)]])).tolist())]


def _stretches(motion: Motion, chords: Bools, lever: float, near: float) -> tuple[Stretches, Floats]:
    """Return the longest stretches that are near enough to the motion, and the deviations (n,) from them."""
    options = StretchOptions()
    size, todo = options.longest, Stretches.along(chords).cut(options.longest)
    starts, ends, off = list[Ints](), list[Ints](), list[Floats]()
    while len(todo.starts):
        far = deviation_bounds(motion, todo, lever, options)
        good = (far <= near) | (size == 1)
        starts.append(todo.starts[good])
        ends.append(todo.ends[good])
        off.append(far[good])
        size = max(size // options.cuts, 1)
        todo = todo.where(~good).cut(size)
    if not starts:
        return todo, np.empty(0)
    return Stretches(np.concatenate(starts), np.concatenate(ends)), np.concatenate(off)


def _boxes(low: Floats, high: Floats) -> tuple[Floats, Ints]:
    """Return the boxes (2 L − 1, 6) of a complete tree over boxes (S, 3) to (S, 3), and where its leaves begin."""
    count = len(low)
    leaves = 1 << max(0, (count // PER_LEAF).bit_length() - 1)
    starts = (np.arange(leaves + 1) * count) // leaves
    boxes = np.empty((2 * leaves - 1, 6))
    boxes[leaves - 1 :, :3] = np.minimum.reduceat(low, starts[:-1], axis=0)
    boxes[leaves - 1 :, 3:] = np.maximum.reduceat(high, starts[:-1], axis=0)
    first = leaves - 1
    while first > 0:
        above = (first - 1) // 2
        level = boxes[first : 2 * first + 1]
        boxes[above:first, :3] = np.minimum(level[::2, :3], level[1::2, :3])
        boxes[above:first, 3:] = np.maximum(level[::2, 3:], level[1::2, 3:])
        first = above
    return boxes, starts
