"""Drawings of the set-up: the machine with the part from above and from the front, the part by itself, dimensions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.machine.leg_ends import arms_beside, base_rim, leg_ends, line_top, rails, strut_ends
from pentapod.machine.machine import Machine
from pentapod.mesh.topology import Topology
from pentapod.report.drawings.colours import HELD_COLOUR, LIMIT_COLOUR, QUIET_COLOUR, leg_colour
from pentapod.report.drawings.outline import Outline, outline_of
from pentapod.report.drawings.paper import Paper, Rooms
from pentapod.report.drawings.planned_run import PlannedRun
from pentapod.report.drawings.touch_off import TouchOff

MOST_POINTS = 1500
"""Points of the tool path that are drawn."""

FAR = 0.35
"""Share of the part's size by which the origin of its mesh may be beside it, to be drawn with it."""

CIRCLE = 73
"""Points of a circle."""

ABOVE, FRONT = Rooms(16.0, 10.0, 76.0, 30.0), Rooms(16.0, 12.0, 76.0, 18.0)
"""Room around the machine, seen from above and from the front."""

PART = Rooms(22.0, 14.0, 76.0, 48.0)
"""Room around the part by itself."""


_DRAWN: WeakKeyDictionary[PlannedRun, dict[tuple[int, ...], str]] = WeakKeyDictionary()
"""Drawings of the runs that are in use, by the waypoints to touch off."""


@dataclass(frozen=True, eq=False)
class View:
    """A direction of view: unit vectors (3,) to the right, upwards on the paper, and towards the viewer.

    names: of the machine's axes to the right and along the paper, and whether they point to the right and upwards.
    """

    title: str
    caption: str
    right: Floats
    up: Floats
    names: tuple[str, str] = ("", "")
    signs: tuple[float, float] = (1.0, 1.0)

    def flat(self, points: Floats) -> Floats:
        """Return points (..., 3), metres, on the paper (..., 2), mm."""
        return 1e3 * np.stack([points @ self.right, points @ self.up], axis=-1)

    def seen(self, vertices: Floats, topology: Topology) -> Outline:
        """Return the outline of a mesh with vertices (V, 3), metres, on the paper, mm."""
        frame = np.stack([self.right, self.up, np.cross(self.right, self.up)])
        return outline_of(1e3 * vertices @ frame.T, topology)

    def coordinates(self, flat: Floats) -> Floats:
        """Return machine coordinates (..., 2), mm, of places on the paper."""
        return flat * self.signs


@dataclass(frozen=True, eq=False)
class _Bones:
    """The machine in a pose: base joints, platform joints, line from the tip to the spindle's nose and to its top."""

    base: Floats
    joints: Floats
    arms: tuple[Ints, Floats]
    limb: Floats
    tip: Floats
    nose: Floats
    top: Floats
    rim: Floats

    @classmethod
    def of(cls, machine: Machine, tip: Floats, axis: Floats) -> _Bones:
        """Return those of a pose of the tool."""
        base, joints = leg_ends(machine, tip, axis)
        beside, heights = arms_beside(machine)
        limb = np.concatenate([rails(machine), strut_ends(machine, tip, axis)])
        nose, top = tip + machine.bodies.shaft_end * axis, line_top(machine, tip, axis)
        return cls(
            base, joints, (beside, tip + heights[:, None] * axis), limb, tip, nose, top, base_rim(machine, CIRCLE)
        )

    @property
    def points(self) -> Floats:
        """All that has to be on the paper (K, 3)."""
        return np.concatenate([
            self.base, self.joints, self.limb.reshape(-1, 3), [self.tip, self.nose, self.top], self.rim,
        ])  # fmt: skip


def setup_drawings(run: PlannedRun, points: Sequence[TouchOff]) -> str:
    """Return four drawings as SVG in <figure>s: machine from above and from the front, part from above and the side.

    The part from the side is seen along its lean, where it is tilted. Letters have the size of the page's captions
    where a drawing is 350 CSS pixels wide. points: to touch off. They are remembered: report and sheet show the same.
    """
    known, key = _DRAWN.setdefault(run, {}), tuple(point.waypoint for point in points)
    if key not in known:
        above, front, side = _from_above(run.hangs), _from_front(run.hangs), _along_lean(run)
        part_above, part_front, part_side = (
            view.seen(run.vertices, run.mesh.topology) for view in (above, front, side)
        )
        known[key] = (
            _in_machine(run, above, part_above)
            + _in_machine(run, front, part_front)
            + _part(run, above, part_above, points)
            + _part(run, side, part_side, points)
        )
    return known[key]


def machine_drawings(machine: Machine) -> str:
    """Return a machine from above and from the front, the tool upright in the middle of its work, as <figure>s."""
    work, hangs = machine.work, bool(machine.work.centre[2] > 0.0)
    bones = _Bones.of(machine, work.centre, np.array([0.0, 0.0, -1.0 if hangs else 1.0]))
    turn = np.linspace(0.0, 2.0 * np.pi, CIRCLE)
    circle = work.centre + 0.5 * work.diameter * np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=-1)
    half = np.array([0.0, 0.0, 0.5 * work.height])
    drawn = ""
    for view in (_from_above(hangs), _from_front(hangs)):
        flat = view.flat(np.concatenate([bones.points, circle + half, circle - half, np.zeros((1, 3))]))
        paper = Paper(flat.min(axis=0), flat.max(axis=0), rooms=FRONT if view.names[1] == "z" else ABOVE)
        for ring in (circle - half, circle + half):
            paper.line(view.flat(ring), LIMIT_COLOUR)
        _draw_machine(paper, view, bones)
        _from_zero(paper, view, work.centre, "middle of the work volume")
        drawn += paper.svg(f"the machine {view.title}", f"The machine {view.title}: {view.caption}; tool upright")
    return drawn


def _from_above(hangs: bool) -> View:
    up = np.array([0.0, -1.0 if hangs else 1.0, 0.0])
    caption = f"x to the right, y {'towards you' if hangs else 'away from you'}"
    return View("from above", caption, np.array([1.0, 0.0, 0.0]), up, ("x", "y"), (1.0, float(up[1])))


def _from_front(hangs: bool) -> View:
    up = np.array([0.0, 0.0, -1.0 if hangs else 1.0])
    caption = f"x to the right, z {'down' if hangs else 'up'}"
    return View("from the front", caption, np.array([1.0, 0.0, 0.0]), up, ("x", "z"), (1.0, float(up[2])))


def _along_lean(run: PlannedRun) -> View:
    """Return the view in which a tilt is seen in its true size; that from the front where there is none."""
    front = _from_front(run.hangs)
    if not run.stand.is_tilted:
        return front
    azimuth = run.stand.azimuth
    right = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    caption = f"it leans to the right, to {words_of(np.degrees(azimuth), 1)}° in plan"
    return View("from the side", caption, right, front.up, ("", "z"), front.signs)


def _draw_machine(paper: Paper, view: View, bones: _Bones) -> None:
    """Draw base, legs, spindle and tool."""
    paper.bar(view.flat(bones.rim), QUIET_COLOUR, 0.8)
    for line in bones.limb:
        paper.bar(view.flat(line), QUIET_COLOUR, 2.0)
    for k, leg in enumerate(np.stack([bones.base, bones.joints], axis=1)):
        paper.bar(view.flat(leg), leg_colour(k), 1.8)
    for k, foot in zip(*bones.arms, strict=True):
        paper.bar(view.flat(np.stack([bones.joints[k], foot])), leg_colour(k), 1.4)
    paper.bar(view.flat(np.stack([bones.nose, bones.top])), QUIET_COLOUR, 4.0)
    paper.bar(view.flat(np.stack([bones.tip, bones.nose])), "currentColor", 1.6)
    for k, joint in enumerate(bones.base):
        paper.ball(view.flat(joint), str(k + 1), leg_colour(k))


def _in_machine(run: PlannedRun, view: View, part: Outline) -> str:
    """Return the machine in its first pose with the part, and where the part's datum is."""
    bones = _Bones.of(run.machine, run.first.tip, run.first.axis)
    held = None if run.held is None else view.seen(run.held.vertices, Topology(run.held.faces, len(run.held.vertices)))
    zero, origin = np.zeros(3), run.placement.translation
    shown = [view.flat(bones.points), view.flat(np.stack([zero, origin])), part.low[None], part.high[None]]
    shown += [] if held is None else [held.low[None], held.high[None]]
    points = np.concatenate(shown)
    sideways = view.names[1] == "z"
    paper = Paper(points.min(axis=0), points.max(axis=0), rooms=FRONT if sideways else ABOVE)
    if sideways:
        _levels(paper, run, view)
    if held is not None and run.held is not None:
        paper.area(held.areas, HELD_COLOUR, run.held.name)
    paper.area(part.areas, LIMIT_COLOUR, "part")
    paper.lines(part.lines, "currentColor", 0.5)
    _draw_machine(paper, view, bones)
    paper.ring(part.low, part.high, LIMIT_COLOUR)
    _from_zero(paper, view, origin, "datum")
    return paper.svg(f"the machine and the part {view.title}", f"In the machine, {view.title}: {view.caption}")


def _from_zero(paper: Paper, view: View, point: Floats, name: str) -> None:
    """Mark a point (3,) and the machine's zero, and draw the dimensions from there; those along x only from above."""
    zero, place = view.flat(np.zeros(3)), view.flat(point)
    x, y = paper.at(zero)
    paper.stroke(f"M{x - 8:.1f} {y:.1f}h16M{x:.1f} {y - 8:.1f}v16", 1.2)
    paper.keep((x - 8.0, y - 8.0, x + 8.0, y + 8.0))
    paper.datum(place)
    told = view.coordinates(place)
    if view.names[1] != "z":
        paper.across(zero, place, f"{view.names[0]} {words_of(told[0])}")
    paper.upright(zero, place, f"{view.names[1]} {words_of(told[1])}")
    paper.label_at(place, name)
    paper.label_at(zero, "machine zero")


def _levels(paper: Paper, run: PlannedRun, view: View) -> None:
    """Draw the table, or the level above which it must not be."""
    height = run.lowest if run.table is None else run.table
    level = float(view.flat(np.array([0.0, 0.0, height]))[1])
    ends = np.array([[paper.low[0], level], [paper.high[0], level]])
    dashes = 'stroke-dasharray="4 3"' if run.table is None else ""
    paper.bar(ends, "currentColor", 1.0 if run.table is None else 1.8, dashes)
    text = f"{'part down to' if run.table is None else 'table'} z {words_of(1e3 * height)}"
    x, y = paper.at(ends[0])
    paper.label(text, [(x, y + 13.0, "start"), (x, y - 5.0, "start")])


def _part(run: PlannedRun, view: View, part: Outline, points: Sequence[TouchOff]) -> str:
    """Return the part by itself as it stands, with its size, its edges in the machine, and the touch-off points."""
    origin = view.flat(run.placement.translation)
    corners = np.stack([part.low, part.high])
    room = FAR * float(np.ptp(corners, axis=0).max())
    fits = bool((origin >= part.low - room).all() and (origin <= part.high + room).all())
    around = np.concatenate([corners, origin[None]]) if fits else corners
    paper = Paper(around.min(axis=0), around.max(axis=0), rooms=PART)
    upright = view.names[1] == "z"
    paper.area(part.areas, QUIET_COLOUR, "part")
    if not upright:
        even = np.linspace(0, len(run.tips) - 1, min(len(run.tips), MOST_POINTS)).astype(np.intp)
        paper.line(view.flat(run.tips[even]), LIMIT_COLOUR, 0.5, 'stroke-opacity="0.6"')
    paper.lines(part.lines, "currentColor", 0.6)
    if upright:
        _rest(paper, run, view, part)
    if fits:
        paper.datum(origin)
    for number, point in enumerate(points, start=1):
        paper.flag(view.flat(point.in_machine), str(number), "#111")
    extent = part.high - part.low
    low, high = view.coordinates(part.low), view.coordinates(part.high)
    names, lower_right = view.names, np.array([part.high[0], part.low[1]])
    sides = (f"x {words_of(low[0])}", f"x {words_of(high[0])}") if names[0] else None
    paper.across(part.low, lower_right, words_of(extent[0]), sides)
    levels = (f"{names[1]} {words_of(low[1])}", f"{names[1]} {words_of(high[1])}")
    paper.upright(lower_right, part.high, words_of(extent[1]), levels)
    if not upright:
        for name, pose in (("start", run.first), ("end", run.last)):
            if paper.holds(view.flat(pose.tip)):
                paper.spot(view.flat(pose.tip), name, LIMIT_COLOUR)
    if fits:
        for axis, name in zip(run.placement.rotation.T, "XYZ", strict=True):
            paper.arrow(origin, view.flat(1e-3 * axis), 30.0, name)
        paper.label_at(origin, "datum")
    return paper.svg(f"the part {view.title}", f"The part {view.title}: {view.caption}")


def _rest(paper: Paper, run: PlannedRun, view: View, part: Outline) -> None:
    """Draw what is under the part: the table, or the wedge that it needs."""
    low = part.low[1] if run.table is None else float(view.flat(np.array([0.0, 0.0, run.table]))[1])
    left, right = part.low[0], part.high[0]
    if not run.stand.is_tilted:
        paper.bar(np.array([[left, low], [right, low]]), "currentColor", 1.8)
        return
    # It leans to the right, so that its underside falls to the right.
    rise = float(np.tan(run.stand.lean)) * (right - left)
    wedge = np.array([[left, low], [right, low], [left, low + rise], [left, low]])
    paper.line(wedge, "currentColor", 1.0, 'stroke-dasharray="4 3"')
    x, y = paper.at([left, low])
    text = f"{words_of(np.degrees(run.stand.lean))}°"
    paper.label(
        text, [(x + 8.0, y - 5.0, "start"), (x + 8.0, y + 13.0, "start"), (x - 4.0, y + 13.0, "middle")], "angle"
    )


def words_of(value: float, digits: int = 2) -> str:
    """Return a number with a true minus."""
    return f"{round(float(value), digits) + 0.0:.{digits}f}".replace("-", "−")
