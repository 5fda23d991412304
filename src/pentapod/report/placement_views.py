"""The part in the machine from above, from the side, and by itself from above, as drawings (SVG, millimetres)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.arrays import Floats
from pentapod.machine.machine import Machine
from pentapod.planning.placed_path import PlacedPath
from pentapod.report.decimate import thinned_mesh
from pentapod.report.figure import HELD_COLOUR, LEG_COLOURS, LIMIT_COLOUR, QUIET_COLOUR
from pentapod.report.held import Held
from pentapod.toolpath.mesh import Mesh

_FACETS, _POINTS = 1200, 1500
_LETTER = 15.0  # of a drawing 500 wide


@dataclass(frozen=True, eq=False)
class _Subject:
    """What is drawn, machine frame, metres. facets (F, 3, 3); tips (K, 3); base, joints (5, 3); far, tip, origin (3,).

    hangs: whether the base is above the work, so that the machine's z points down. table: z of its surface, if any.
    around (G, 3, 3): facets of what holds the part; holder: its name.
    """

    facets: Floats
    tips: Floats
    base: Floats
    joints: Floats
    far: Floats
    tip: Floats
    origin: Floats
    hangs: bool
    table: float | None
    around: Floats
    holder: str


def placement_views(
    mesh: Mesh | None, placed: PlacedPath, machine: Machine, table: float | None, held: Held | None = None
) -> str:
    """Return the views as SVG elements.

    table: height z of the table's surface, metres, where there is one; held: what holds the part.
    """
    subject = _subject(mesh, placed, machine, table, held)
    # Seen as someone sees it who stands at the machine: with z pointing down, y comes towards one where x is to the
    # right. Drawn the other way it would be the mirror image.
    y, side = ("down", "y towards you") if subject.hangs else ("up", "y away from you")
    return (
        _view(subject, f"from above: x to the right, y {y}", (0, 1))
        + _view(subject, f"from the side: x to the right, {side}", (0, 2))
        + _view(subject, f"the part from above: x to the right, y {y}", (0, 1), close=True)
    )


def _subject(
    mesh: Mesh | None, placed: PlacedPath, machine: Machine, table: float | None, held: Held | None
) -> _Subject:
    transform, worst = placed.placement.transform, int(placed.margins.min(axis=1).argmin())
    axis, tip = placed.axes[worst], placed.tips[worst]
    joints = tip + (machine.tool_length - machine.pentapod.offsets)[:, None] * axis
    starts = placed.toolpath.starts
    even = np.linspace(0, len(placed.tips) - 1, min(len(placed.tips), _POINTS)).astype(np.intp)
    tips = placed.tips[np.unique(np.concatenate([even, starts[:: -(-len(starts) // _POINTS)]]))]
    facets = np.zeros((0, 3, 3))
    if mesh is not None:
        vertices, faces = thinned_mesh(mesh.vertices, mesh.faces, _FACETS)
        facets = transform.apply(vertices)[faces]
    base = np.column_stack([machine.pentapod.base, np.zeros(5)])
    far, hangs = joints[int(np.argmin(machine.pentapod.offsets))], bool(machine.work.centre[2] > 0.0)
    around = np.zeros((0, 3, 3))
    if held is not None:
        vertices, faces = thinned_mesh(held.vertices, held.faces, _FACETS)
        around = vertices[faces]
    origin, name = transform.translation, "" if held is None else held.name
    return _Subject(facets, tips, base, joints, far, tip, origin, hangs, table, around, name)


def _view(subject: _Subject, title: str, axes: tuple[int, int], *, close: bool = False) -> str:
    """Return one view as a <figure>. axes: of the machine, to the right and along the page; close: the part alone."""
    up = -1.0 if subject.hangs else 1.0

    def flat(points: Floats) -> Floats:
        return 1e3 * points[..., axes] * (1.0, up)

    seen = [flat(subject.tips), flat(subject.facets).reshape(-1, 2)]
    seen += [] if close else [flat(subject.base), flat(subject.joints), flat(subject.around).reshape(-1, 2)]
    shown = np.concatenate(seen)
    low, high = shown.min(axis=0), shown.max(axis=0)
    room = 0.07 * float((high - low).max())
    size = high - low + 2.0 * room
    unit = float(size.max()) / 500.0  # of line widths and letters, whatever the machine's size

    def at(points: Floats) -> str:
        shifted = np.stack([points[..., 0] - low[0] + room, high[1] + room - points[..., 1]], axis=-1)
        return " ".join(f"{x:.1f},{y:.1f}" for x, y in shifted.reshape(-1, 2))

    def line(points: Floats, colour: str, width: float, more: str = "") -> str:
        return (
            f'<polyline points="{at(points)}" fill="none" stroke="{colour}" stroke-width="{width * unit:.2f}" {more}/>'
        )

    def filled(facets: Floats, colour: str, name: str) -> str:
        shape = "".join(f"M{at(facet)}Z" for facet in flat(facets))
        return f'<path d="{shape}" fill="{colour}" fill-opacity="0.45"><title>{name}</title></path>'

    parts = [filled(subject.around, HELD_COLOUR, subject.holder)] if len(subject.around) else []
    parts.append(filled(subject.facets, QUIET_COLOUR, "part"))
    if axes[1] == 2:
        ends = np.array([low[0], high[0]])
        parts.append(line(np.column_stack([ends, np.zeros(2)]), QUIET_COLOUR, 1.0, 'stroke-dasharray="4 3"'))
        if subject.table is not None:
            level = np.full(2, 1e3 * up * subject.table)
            parts.append(line(np.column_stack([ends, level]), "currentColor", 1.6))
    parts.append(line(flat(subject.tips), LIMIT_COLOUR, 0.6))
    if not close:
        parts += [line(flat(np.stack([subject.base[k], subject.joints[k]])), LEG_COLOURS[k], 2.4) for k in range(5)]
        for k in range(5):
            x, y = (float(value) for value in at(flat(subject.base[k])).split(","))
            parts.append(f'<circle cx="{x}" cy="{y}" r="{5 * unit:.2f}" fill="{LEG_COLOURS[k]}"/>')
            parts.append(_text(f"{k + 1}", x + 8.0 * unit, y - 6.0 * unit, unit))
        parts.append(line(flat(np.stack([subject.far, subject.tip])), "currentColor", 3.0))
    x, y = (float(value) for value in at(flat(subject.origin)).split(","))
    cross = 8.0 * unit
    parts.append(
        f'<path d="M{x - cross:.1f},{y}h{2 * cross:.1f}M{x},{y - cross:.1f}v{2 * cross:.1f}" '
        f'stroke="currentColor" stroke-width="{1.2 * unit:.2f}"><title>origin of the mesh</title></path>'
    )
    origin = ", ".join(f"{'xyz'[k]} = {round(1e3 * float(subject.origin[k]), 2) + 0.0:.2f}" for k in axes)
    origin = origin.replace("-", "−")
    legs = "" if close else " Legs as at the smallest margin."
    extent = high - low
    return (
        f'<figure><svg viewBox="0 0 {size[0]:.1f} {size[1]:.1f}" role="img" aria-label="{title}">{"".join(parts)}'
        f'</svg><figcaption class="caption">{title}; {extent[0]:.0f} × {extent[1]:.0f} mm. The cross, origin of the '
        f"mesh: {origin.replace('-', '−')} mm.{legs}</figcaption></figure>"
    )


def _text(words: str, x: float, y: float, unit: float) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" font-size="{_LETTER * unit:.1f}" fill="currentColor">{words}</text>'
