"""Keys of the motion: rows of the program between which tip, axis and joints lie on straight lines in time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.geometry.runs import equal_runs
from pentapod.kinematics.forces import leg_force_map
from pentapod.machine.leg_ends import leg_ends
from pentapod.machine.machine import Machine
from pentapod.planning.placement.placed_path import PlacedPath
from pentapod.report.figure import DETAIL
from pentapod.report.pack import Packed
from pentapod.report.page.causes import KINDS, kind_of
from pentapod.report.page.left_along import left_at, marked_along
from pentapod.report.signals import Signals
from pentapod.toolpath.toolpath import SegmentKind
from pentapod.verify.replay.free_space import PosedPolyline
from pentapod.verify.replay.path_matching import match
from pentapod.verify.verdict.material_left import MaterialLeft

SEGMENT_KINDS = (SegmentKind.CUT, SegmentKind.LINK, SegmentKind.RAPID)


@dataclass(frozen=True)
class KeyOptions:
    """How exact the keys are: together they keep 0.02 mm.

    straight_mm: largest distance of tip and joints from the straight lines in time between keys. step_mm: of stored
    points; axis_step: of components of the stored axis. on_axis_m: distance of a joint from the tool axis up to which
    it is on it.
    """

    straight_mm: float = 0.012
    step_mm: float = 0.005
    axis_step: float = 1e-5
    on_axis_m: float = 1e-7


OPTIONS = KeyOptions()


@dataclass(frozen=True, eq=False)
class Moments:
    """What the page knows of the machine at each of its keys (K), SI units, machine frame.

    beside (B,): legs whose joints are not on the tool axis; joints (K, B, 3). nearest: the limits of the margins.
    kinds: of the segments, indices into `SEGMENT_KINDS`.
    """

    times: Floats
    tips: Floats
    axes: Floats
    beside: Ints
    joints: Floats
    margins: Floats
    nearest: Ints
    causes: Ints
    segments: Ints
    kinds: Ints

    def pack(self, packed: Packed, period: float) -> None:
        """Add the arrays; period: step of the times, s."""
        packed.numbers("key.time", self.times, period)
        packed.numbers("key.tip", 1e3 * self.tips, OPTIONS.step_mm)
        packed.numbers("key.axis", self.axes, OPTIONS.axis_step)
        if len(self.beside):
            packed.numbers("key.joints", 1e3 * self.joints.reshape(len(self.times), -1), OPTIONS.step_mm)
        packed.numbers("key.margin", self.margins)
        packed.whole("key.nearest", self.nearest)
        packed.whole("key.cause", self.causes)
        packed.whole("key.segment", self.segments)
        packed.whole("key.kind", self.kinds)


@dataclass(frozen=True, eq=False)
class Keys:
    """Rows (K,) of a program, and what is shown of each.

    beside (B,): legs whose joints are not on the tool axis; joints (K, B, 3), metres. margins, nearest, deviations: the
    smallest margin, its limit, and the largest deviation, metres, from a key to the next. shares: of the feed. forces:
    of the leg with the largest, for a force of 1 N on the tip in the worst direction. pushes: the largest
    share, from a key to the next, of what a drive has there. deflections: the largest of the tip. left:
    the largest height of what is left on the surface at the key, metres. None where not known.
    """

    rows: Ints
    beside: Ints
    joints: Floats
    margins: Floats
    nearest: Ints
    shares: Floats
    deviations: Floats
    forces: Floats
    pushes: Floats | None
    deflections: Floats | None
    left: Floats | None

    @classmethod
    def of(
        cls,
        signals: Signals,
        machine: Machine,
        placed: PlacedPath,
        tolerance: float,
        left: MaterialLeft | None = None,
    ) -> Keys:
        """Return the keys of a program. tolerance: of the program against the path, metres. left: on the surface."""
        tips, axes = signals.tips, signals.axes
        beside, joints = legs_beside(machine, tips, axes)
        far = 1e3 * (machine.tool_length - machine.line_top)
        shown = np.concatenate([1e3 * tips, far * axes, 1e3 * joints.reshape(len(tips), -1)], axis=1)
        must = _marked(signals)
        if left is not None:
            must |= marked_along(signals)
        rows = straight_rows(signals.times, shown, must, OPTIONS.straight_mm)
        least = np.interp(signals.times, signals.times[signals.margin_rows], signals.smallest_margins)
        at = np.clip(np.searchsorted(signals.margin_rows, _lowest(least, rows)), 0, len(signals.margin_rows) - 1)
        position = tips[rows] + machine.tool_length * axes[rows]
        loads = leg_force_map(machine.robot, position, -axes[rows], machine.tool_length)
        return cls(
            rows, beside, joints[rows], np.minimum.reduceat(least, rows), signals.margins[at].argmin(axis=1),
            signals.speeds[rows] / signals.speed_limits[rows],
            np.maximum.reduceat(_deviations(signals, placed, tolerance), rows),
            np.linalg.norm(loads, axis=-1).max(axis=-1),
            _pushes(signals, rows),
            None if signals.deflections is None else np.maximum.reduceat(signals.deflections[:, 0], rows),
            None if left is None else left_at(signals, placed, rows, left),
        )  # fmt: skip

    def pack(self, packed: Packed, signals: Signals, kinds: Sequence[SegmentKind], period: float) -> None:
        """Add the arrays of the motion. kinds: of the toolpath's segments; period: of the controller, s."""
        rows = self.rows
        order, segments = np.array([SEGMENT_KINDS.index(kind) for kind in kinds]), signals.segments[rows]
        Moments(
            signals.times[rows], signals.tips[rows], signals.axes[rows], self.beside, self.joints, self.margins,
            self.nearest, signals.causes[rows], segments, order[segments],
        ).pack(packed, period)  # fmt: skip
        packed.numbers("key.share", 100.0 * self.shares, 0.1)
        packed.numbers("key.deviation", 1e3 * self.deviations)
        packed.numbers("key.force", self.forces)
        if self.pushes is not None:
            packed.numbers("key.push", 100.0 * self.pushes, 0.1)
        if self.deflections is not None:
            packed.numbers("key.deflection", 1e6 * self.deflections)
        if self.left is not None:
            packed.numbers("key.left", 1e3 * self.left, 0.001)

    def scales(self, tolerance: float, deflection: float | None, left: float | None) -> list[dict[str, Any]]:
        """Return by what the path can be coloured: name, array, unit, the worst and the best value, words at both ends.

        tolerance: of the program against the path, metres. deflection: as much as is allowed of the tip, if a job says.
        left: as much as may be left on the surface.
        """
        strongest, weakest = float(np.nanmax(self.forces)), float(np.nanmin(self.forces))
        scales = [
            MARGIN_SCALE,
            _scale("share of the feed", "key.share", " %", 0.0, 100.0, ("0 %", "50 %", "100 % of the feed")),
            _scale("what limits the motion", "key.cause", "", 0.0, 1.0, ()),
            _scale(
                "deviation from the path", "key.deviation", " mm", 1e3 * tolerance, 0.0,
                (f"{1e3 * tolerance:g} mm, as much as is allowed", "0 mm"),
            ),
            _scale(
                "leg force for 1 N at the tip", "key.force", " N", strongest, weakest,
                (f"{strongest:.3g} N", f"{weakest:.3g} N"),
            ),
        ]  # fmt: skip
        if self.pushes is not None:
            words = ("100 % of what a drive has", "50 %", "0 %")
            scales.append(_scale("force of the drives", "key.push", " %", 100.0, 0.0, words))
        if self.deflections is not None:
            most = 1e6 * (float(np.nanmax(self.deflections)) if deflection is None else deflection)
            words = f"{most:.3g} µm, {'the largest' if deflection is None else 'as much as is allowed'}"
            scales.append(_scale("deflection of the tip", "key.deflection", " µm", most, 0.0, (words, "0 µm")))
        if self.left is not None and left is not None:
            words = (f"{1e3 * left:.3g} mm, as much as is allowed, or more", f"{5e2 * left:.3g}", "0 mm")
            scales.append(_scale("material left", "key.left", " mm", 1e3 * left, 0.0, words))
        return scales


def _pushes(signals: Signals, rows: Ints) -> Floats | None:
    if signals.forces is None:
        return None
    shares = (signals.forces.asked / signals.forces.available).max(axis=1)
    return np.asarray(np.maximum.reduceat(shares, rows), dtype=np.float64)


def _scale(name: str, array: str, unit: str, worst: float, best: float, ends: tuple[str, ...]) -> dict[str, Any]:
    return {"name": name, "array": array, "unit": unit, "worst": worst, "best": best, "ends": ends}


MARGIN_SCALE = _scale("smallest margin", "key.margin", "", 0.0, 0.5, ("0, at a limit", "0.25", "0.5 or more"))


def legs_beside(machine: Machine, tips: Floats, axes: Floats) -> tuple[Ints, Floats]:
    """Return which legs (B,) end beside the tool axis of the poses (N, 3), and their joints (N, B, 3)."""
    beside = joints_beside(machine, tips[0], axes[0])
    joints = leg_ends(machine, tips, axes)[1][:, beside] if len(beside) else np.zeros((len(tips), 0, 3))
    return beside, joints


def joints_beside(machine: Machine, tip: Floats, axis: Floats) -> Ints:
    """Return which legs (B,) end beside the tool axis; tip, axis (3,): of any pose, since the platform is rigid."""
    heights = machine.tool_length - machine.robot.offsets
    far = np.linalg.norm(leg_ends(machine, tip, axis)[1] - (tip + heights[:, None] * axis), axis=-1)
    return np.flatnonzero(far > OPTIONS.on_axis_m)


def straight_rows(times: Floats, points: Floats, must: Bools, most: float) -> Ints:
    """Return which rows to keep, ascending, so that those between lie on straight lines in time, within `most`.

    points (N, 3 · k): of each of k points three coordinates. must (N,): rows to keep in any case; the first and the
    last are kept as well.
    """
    from pentapod.report.page.straight_rows_kernels import mark_corners  # noqa: PLC0415  numba is heavy

    keep = must.copy()
    keep[[0, -1]] = True
    mark_corners(np.ascontiguousarray(times), np.ascontiguousarray(points), most, keep)
    return np.flatnonzero(keep)


def _marked(signals: Signals) -> Bools:
    """Return the rows (N,) that are keys in any case: ends of segments, changes of the active limit, least margins."""
    must = np.zeros(len(signals.times), dtype=np.bool_)
    turns = np.flatnonzero(np.diff(signals.segments))
    must[turns] = must[turns + 1] = True
    must[signals.margin_rows[signals.margins.argmin(axis=0)]] = True
    kinds = np.array([kind_of(name) for name in signals.cause_names] or [len(KINDS)])[signals.causes]
    runs = equal_runs(kinds)
    longest = np.argsort(runs[:, 0] - runs[:, 1], kind="stable")[: DETAIL.cause_changes]
    must[runs[longest, 0]] = True
    must[np.minimum(runs[longest, 1], len(must) - 1)] = True
    return must


def _lowest(values: Floats, rows: Ints) -> Ints:
    """Return where (K,) the lowest value lies from each of the rows to the next."""
    ends = np.append(rows[1:], len(values))
    order = np.lexsort((values, np.repeat(np.arange(len(rows)), ends - rows)))
    return order[rows - rows[0]]


def _deviations(signals: Signals, placed: PlacedPath, tolerance: float) -> Floats:
    """Return the distance (N,) of the tilt centre at each row from the matched place of the toolpath, metres."""
    centres = signals.tips + placed.toolpath.tilt_centre * signals.axes
    nominal = placed.placement.transform.rotate(placed.toolpath.axes)
    path = PosedPolyline(placed.tilt_centres, nominal)
    return match(PosedPolyline(centres, signals.axes), path, tolerance).distances
