"""The part in the machine from above, from the side, and by itself from above, as drawings (SVG, millimetres)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.machine.leg_ends import arms_beside, leg_ends, line_top, rails, strut_ends
from pentapod.machine.machine import Machine
from pentapod.mesh.mesh import Mesh
from pentapod.planning.placement.placed_path import PlacedPath
from pentapod.report.decimate import thinned_mesh
from pentapod.report.figure import DETAIL, HELD_COLOUR, LIMIT_COLOUR, QUIET_COLOUR, leg_colour
from pentapod.report.held import Held
from pentapod.report.sheet.dimensions import dimension_lines

LETTER = 15.0
"""Height of letters in a drawing 500 wide."""

CIRCLE = 73
"""Points of the circle that bounds a work volume in a drawing."""

_DIMENSIONED = 0.2
"""Share of a drawing's size that its rim takes where it has dimension lines."""


@dataclass(frozen=True, eq=False)
class _Subject:
    """What is drawn, machine frame, metres.

    facets (F, 3, 3); tips (K, 3); base, joints (n_legs, 3); far, tip, origin (3,).
    arms: which legs end beside the line, and where their arms meet it (m, 3). limb (k, 2, 3): rail and strut.
    hangs: whether the base is above the work, so that the machine's z points down. table: z of its surface, if any.
    around (G, 3, 3): facets of the fixture; holder: its name. cross: what stands at `origin`; pose: that of the legs.
    """

    facets: Floats
    tips: Floats
    base: Floats
    joints: Floats
    arms: tuple[Ints, Floats]
    limb: Floats
    far: Floats
    tip: Floats
    origin: Floats
    hangs: bool
    table: float | None
    around: Floats
    holder: str
    cross: str = "origin of the mesh"
    pose: str = "Legs as at the smallest margin."


def placement_views(
    mesh: Mesh | None, placed: PlacedPath, machine: Machine, table: float | None, held: Held | None = None
) -> str:
    """Return the views as SVG elements.

    table: height z of the table's surface, metres, where there is one; held: the fixture.
    """
    subject = _subject(mesh, placed, machine, table, held)
    # As an operator sees it: where z points down and x to the right, y points towards the viewer.
    y, side = ("down", "y towards you") if subject.hangs else ("up", "y away from you")
    return (
        _view(subject, f"from above: x to the right, y {y}", (0, 1))
        + _view(subject, f"from the side: x to the right, {side}", (0, 2))
        + _view(subject, f"the part from above: x to the right, y {y}", (0, 1), close=True)
        + _view(subject, f"the part from the side: x to the right, {side}", (0, 2), close=True)
    )


def machine_views(machine: Machine) -> str:
    """Return a machine from above and from the side as SVG elements, the tool upright in the middle of its work."""
    work, hangs = machine.work, bool(machine.work.centre[2] > 0.0)
    tip, axis = work.centre, np.array([0.0, 0.0, -1.0])
    turn = np.linspace(0.0, 2.0 * np.pi, CIRCLE)
    circle = 0.5 * work.diameter * np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=-1)
    half = np.array([0.0, 0.0, 0.5 * work.height])
    base, joints = leg_ends(machine, tip, axis)
    beside, heights = arms_beside(machine)
    none = np.zeros((0, 3, 3))
    subject = _Subject(
        none, np.concatenate([tip - half + circle, tip + half + circle]), base, joints,
        (beside, tip + heights[:, None] * axis), np.concatenate([rails(machine), strut_ends(machine, tip, axis)]),
        line_top(machine, tip, axis), tip, tip, hangs, None, none, "", "middle of the work volume", "Tool upright.",
    )  # fmt: skip
    y, side = ("down", "y towards you") if hangs else ("up", "y away from you")
    return _view(subject, f"from above: x to the right, y {y}", (0, 1)) + _view(
        subject, f"from the side: x to the right, {side}", (0, 2)
    )


def _subject(
    mesh: Mesh | None, placed: PlacedPath, machine: Machine, table: float | None, held: Held | None
) -> _Subject:
    transform, worst = placed.placement.transform, int(placed.margins.min(axis=1).argmin())
    axis, tip = placed.axes[worst], placed.tips[worst]
    base, joints = leg_ends(machine, tip, axis)
    starts = placed.toolpath.starts
    even = np.linspace(0, len(placed.tips) - 1, min(len(placed.tips), DETAIL.view_points)).astype(np.intp)
    tips = placed.tips[np.unique(np.concatenate([even, starts[:: -(-len(starts) // DETAIL.view_points)]]))]
    facets = np.zeros((0, 3, 3))
    if mesh is not None:
        vertices, faces = thinned_mesh(mesh.vertices, mesh.faces, DETAIL.view_facets)
        facets = transform.apply(vertices)[faces]
    far, hangs = line_top(machine, tip, axis), bool(machine.work.centre[2] > 0.0)
    around = np.zeros((0, 3, 3))
    if held is not None:
        vertices, faces = thinned_mesh(held.vertices, held.faces, DETAIL.view_facets)
        around = vertices[faces]
    origin, name = transform.translation, "" if held is None else held.name
    beside, heights = arms_beside(machine)
    arms = beside, tip + heights[:, None] * axis
    limb = np.concatenate([rails(machine), strut_ends(machine, tip, axis)])
    return _Subject(facets, tips, base, joints, arms, limb, far, tip, origin, hangs, table, around, name)


@dataclass(frozen=True, eq=False)
class _Paper:
    """Map from points (..., 2), mm, to the right and up, to a drawing of the box from low to high."""

    low: Floats
    high: Floats
    rim: float = 0.07

    @property
    def room(self) -> float:
        """Width of the rim, mm."""
        return self.rim * float((self.high - self.low).max())

    @property
    def size(self) -> Floats:
        """Width and height (2,), mm, with the rim."""
        return self.high - self.low + 2.0 * self.room

    @property
    def unit(self) -> float:
        """Unit of line widths and letters, mm: 1/500 of the drawing."""
        return float(self.size.max()) / 500.0

    def at(self, points: Floats) -> Floats:
        """Return SVG coordinates (..., 2): to the right and down."""
        right, up = points[..., 0], points[..., 1]
        return np.stack([right - self.low[0] + self.room, self.high[1] + self.room - up], axis=-1)

    def _words(self, points: Floats) -> str:
        return " ".join(f"{x:.1f},{y:.1f}" for x, y in self.at(points).reshape(-1, 2))

    def line(self, points: Floats, colour: str, width: float, more: str = "") -> str:
        """Return a polyline, `width` units wide."""
        pen = f'stroke="{colour}" stroke-width="{width * self.unit:.2f}"'
        return f'<polyline points="{self._words(points)}" fill="none" {pen} {more}/>'

    def filled(self, facets: Floats, colour: str, name: str) -> str:
        """Return facets (F, 3, 2) as one shape with a title."""
        shape = "".join(f"M{self._words(facet)}Z" for facet in facets)
        return f'<path d="{shape}" fill="{colour}" fill-opacity="0.45"><title>{name}</title></path>'

    def numbered(self, point: Floats, number: int, colour: str) -> str:
        """Return a dot with its number."""
        (x, y), u = self.at(point), self.unit
        return (
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{5.0 * u:.2f}" fill="{colour}"/><text x="{x + 8.0 * u:.1f}" '
            f'y="{y - 6.0 * u:.1f}" font-size="{LETTER * u:.1f}" fill="currentColor">{number}</text>'
        )

    def cross(self, point: Floats, name: str) -> str:
        """Return a cross with a title."""
        (x, y), arm = self.at(point), 8.0 * self.unit
        return (
            f'<path d="M{x - arm:.1f},{y:.1f}h{2 * arm:.1f}M{x:.1f},{y - arm:.1f}v{2 * arm:.1f}" '
            f'stroke="currentColor" stroke-width="{1.2 * self.unit:.2f}"><title>{name}</title></path>'
        )


def _view(subject: _Subject, title: str, axes: tuple[int, int], *, close: bool = False) -> str:
    """Return one view as a <figure>. axes: of the machine, to the right and along the page; close: the part alone."""
    up = -1.0 if subject.hangs else 1.0

    def flat(points: Floats) -> Floats:
        return 1e3 * points[..., axes] * (1.0, up)

    seen = [flat(subject.tips), flat(subject.facets).reshape(-1, 2)]
    seen += (
        []
        if close
        else [
            flat(subject.base),
            flat(subject.joints),
            flat(subject.limb).reshape(-1, 2),
            flat(subject.around).reshape(-1, 2),
        ]
    )
    shown = np.concatenate(seen)
    paper = _Paper(shown.min(axis=0), shown.max(axis=0), _DIMENSIONED if close else _Paper.rim)
    parts = [paper.filled(flat(subject.around), HELD_COLOUR, subject.holder)] if len(subject.around) else []
    parts.append(paper.filled(flat(subject.facets), QUIET_COLOUR, "part"))
    if axes[1] == 2 and not close:
        parts += _levels(paper, None if subject.table is None else 1e3 * up * subject.table)
    parts.append(paper.line(flat(subject.tips), LIMIT_COLOUR, 0.6))
    if not close:
        base, legs = flat(subject.base), flat(np.stack([subject.base, subject.joints], axis=1))
        parts += [paper.line(leg, leg_colour(k), 2.4) for k, leg in enumerate(legs)]
        for k, foot in zip(*subject.arms, strict=True):
            parts.append(paper.line(flat(np.stack([subject.joints[k], foot])), leg_colour(k), 1.6))
        parts += [paper.line(line, QUIET_COLOUR, 2.4) for line in flat(subject.limb)]
        parts += [paper.numbered(joint, k + 1, leg_colour(k)) for k, joint in enumerate(base)]
        parts.append(paper.line(flat(np.stack([subject.far, subject.tip])), "currentColor", 3.0))
    parts.append(paper.cross(flat(subject.origin), subject.cross))
    if close and len(subject.facets):
        corners = flat(subject.facets).reshape(-1, 2)
        low, high = corners.min(axis=0), corners.max(axis=0)
        ends = np.array([[low[0], high[1]], [high[0], low[1]]])  # upper left and lower right
        machine = ends * (1.0, up)
        names = ("xyz"[axes[0]], "xyz"[axes[1]])
        parts.append(dimension_lines(paper.at(ends), machine[0], machine[1], paper.unit, names))
    (width, height), extent = paper.size, paper.high - paper.low
    origin = ", ".join(f"{'xyz'[k]} = {round(1e3 * float(subject.origin[k]), 2) + 0.0:.2f}" for k in axes)
    as_at = "" if close else f" {subject.pose}"
    return (
        f'<figure><svg viewBox="0 0 {width:.1f} {height:.1f}" role="img" aria-label="{title}">{"".join(parts)}'
        f'</svg><figcaption class="caption">{title}; {extent[0]:.0f} × {extent[1]:.0f} mm. The cross, '
        f"{subject.cross}: {origin.replace('-', '−')} mm.{as_at}</figcaption></figure>"
    )


def _levels(paper: _Paper, table: float | None) -> list[str]:
    """Return the base plane as a dashed line, and the table's surface at its height, mm, where there is one."""
    ends = np.array([paper.low[0], paper.high[0]])
    base = paper.line(np.column_stack([ends, np.zeros(2)]), QUIET_COLOUR, 1.0, 'stroke-dasharray="4 3"')
    if table is None:
        return [base]
    return [base, paper.line(np.column_stack([ends, np.full(2, table)]), "currentColor", 1.6)]
