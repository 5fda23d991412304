"""The part in the machine from above and from the side, as a drawing (SVG, millimetres)."""

from __future__ import annotations

import numpy as np

from pentapod.arrays import Floats
from pentapod.machine.machine import Machine
from pentapod.planning.placed_path import PlacedPath
from pentapod.report.decimate import keep_extremes, thinned_mesh
from pentapod.report.figure import LEG_COLOURS, LIMIT_COLOUR, QUIET_COLOUR
from pentapod.toolpath.mesh import Mesh

_FACETS, _POINTS = 1200, 400
_WIDTH = 480.0
_VIEWS = (
    ("from above: x to the right, y up", (0, 1), (1.0, 1.0)),
    ("from the side: x to the right", (0, 2), (1.0, 1.0)),
)


def placement_views(mesh: Mesh | None, placed: PlacedPath, machine: Machine, table: float | None) -> str:
    """Return both views as SVG elements. table: height z of the table's surface, metres, where there is one."""
    return "".join(_view(mesh, placed, machine, table, k) for k in range(len(_VIEWS)))


def _view(mesh: Mesh | None, placed: PlacedPath, machine: Machine, table: float | None, view: int) -> str:
    title, axes, _ = _VIEWS[view]
    transform = placed.placement.transform
    # The base hangs above the work: what is drawn upwards is towards the base.
    up = -1.0 if view == 1 and machine.work.centre[2] > 0.0 else 1.0

    def flat(points: Floats) -> Floats:
        return 1e3 * points[..., axes] * (1.0, up)

    base = np.column_stack([machine.pentapod.base, np.zeros(5)])
    worst = int(placed.margins.min(axis=1).argmin())
    axis = placed.axes[worst]
    joints = placed.tips[worst] + (machine.tool_length - machine.pentapod.offsets)[:, None] * axis
    tips = placed.tips[keep_extremes(placed.tips[:, 0], _POINTS // 4)]
    seen = np.concatenate([flat(base), flat(joints), flat(tips)])
    facets = np.zeros((0, 3, 2))
    if mesh is not None:
        vertices, faces = thinned_mesh(mesh.vertices, mesh.faces, _FACETS)
        facets = flat(transform.apply(vertices))[faces]
        seen = np.concatenate([seen, facets.reshape(-1, 2)])
    low, high = seen.min(axis=0), seen.max(axis=0)
    room = 0.06 * float((high - low).max())
    size = high - low + 2.0 * room
    unit = float(size.max()) / 500.0  # of line widths and letters, whatever the machine's size

    def at(points: Floats) -> str:
        shifted = np.stack([points[..., 0] - low[0] + room, high[1] + room - points[..., 1]], axis=-1)
        return " ".join(f"{x:.1f},{y:.1f}" for x, y in shifted.reshape(-1, 2))

    def line(points: Floats, colour: str, width: float, more: str = "") -> str:
        return (
            f'<polyline points="{at(points)}" fill="none" stroke="{colour}" stroke-width="{width * unit:.2f}" {more}/>'
        )

    parts = [f'<path d="{"".join(f"M{at(facet)}Z" for facet in facets)}" fill="{QUIET_COLOUR}" fill-opacity="0.45"/>']
    if view == 1:
        ends = np.array([low[0], high[0]])
        parts.append(line(np.column_stack([ends, np.zeros(2)]), QUIET_COLOUR, 1.0, 'stroke-dasharray="4 3"'))
        if table is not None:
            parts.append(line(np.column_stack([ends, np.full(2, 1e3 * up * table)]), "currentColor", 1.6))
    parts.append(line(flat(tips), LIMIT_COLOUR, 0.6))
    for leg in range(5):
        parts.append(line(flat(np.stack([base[leg], joints[leg]])), LEG_COLOURS[leg], 2.4))
        x, y = at(flat(base[leg])).split(",")
        parts.append(f'<circle cx="{x}" cy="{y}" r="{5 * unit:.2f}" fill="{LEG_COLOURS[leg]}"/>')
    far = joints[int(np.argmin(machine.pentapod.offsets))]
    parts.append(line(flat(np.stack([far, placed.tips[worst]])), "currentColor", 3.0))
    origin = flat(transform.translation)
    x, y = at(origin).split(",")
    cross = 8.0 * unit
    parts.append(
        f'<path d="M{float(x) - cross:.1f},{y}h{2 * cross:.1f}M{x},{float(y) - cross:.1f}v{2 * cross:.1f}" '
        f'stroke="currentColor" stroke-width="{1.2 * unit:.2f}"><title>origin of the mesh</title></path>'
    )
    height = _WIDTH * float(size[1] / size[0])
    return (
        f'<figure><svg viewBox="0 0 {size[0]:.1f} {size[1]:.1f}" width="{_WIDTH:.0f}" height="{height:.0f}" '
        f'role="img" aria-label="{title}" style="max-width:100%">{"".join(parts)}</svg>'
        f'<figcaption class="hint">{title}; {size[0]:.0f} × {size[1]:.0f} mm. Legs at the smallest margin.</figcaption>'
        "</figure>"
    )
