"""Band of the smallest margin along the path, coloured by the active limit."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from itertools import pairwise

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.geometry.polyline import arc_length
from pentapod.geometry.runs import equal_runs
from pentapod.report.drawings.colours import LIMIT_COLOUR, QUIET_COLOUR
from pentapod.report.figure import DETAIL

WIDTH, HEIGHT, LEFT, BOTTOM = 1080.0, 200.0, 44.0, 26.0
"""Size of the drawing and of its margins, in its own units."""

LIMIT_COLOURS = ("#2a78d6", "#e08a00", "#1baa7a", "#c2417c", "#7a5cd6", "#5f7d8c", "#a3742a", "#3b9ab2")


def margin_band(tips: Floats, margins: Floats, names: Sequence[str]) -> str:
    """Return the band as SVG with its legend, over the arc length of the tip, mm. Each interval names its limit.

    tips (N, 3), metres; margins (N, M) of the limits `names`.
    """
    length = 1e3 * arc_length(tips)
    smallest, nearest = margins.min(axis=1), margins.argmin(axis=1)
    edges = np.unique(np.linspace(0, len(smallest), min(DETAIL.band_columns, len(smallest)) + 1).astype(np.intp))
    worst = np.array([a + int(smallest[a:b].argmin()) for a, b in pairwise(edges)])
    order = [int(k) for k in np.argsort(-np.bincount(nearest[worst], minlength=len(names)), kind="stable")]
    colours = {k: (LIMIT_COLOURS[n] if n < len(LIMIT_COLOURS) else QUIET_COLOUR) for n, k in enumerate(order)}
    top = max(float(smallest[worst].max()), 0.05)
    low = min(float(smallest.min()), 0.0)
    total = max(float(length[-1]), 1e-9)

    def x(value: float) -> float:
        return LEFT + (WIDTH - LEFT) * value / total

    def y(value: float) -> float:
        return 8.0 + (HEIGHT - BOTTOM - 8.0) * (top - value) / (top - low)

    limits = nearest[worst]
    parts: list[str] = []
    for first, end in equal_runs(limits).tolist():
        a, b = int(edges[first]), int(edges[end]) - 1
        left, right = x(float(length[a])), x(float(length[min(b + 1, len(length) - 1)]))
        corners = [(left, y(0.0)), (left, y(float(smallest[worst[first]])))]
        corners += [(x(float(length[w])), y(float(smallest[w]))) for w in worst[first:end]]
        corners += [(right, y(float(smallest[worst[end - 1]]))), (right, y(0.0))]
        points = " ".join(f"{px:.1f},{py:.1f}" for px, py in corners)
        name = escape(names[int(limits[first])])
        title = f"{name}: waypoints {a} to {b}, smallest margin {float(smallest[a : b + 1].min()):.3f}"
        parts.append(
            f'<polygon points="{points}" fill="{colours[int(limits[first])]}"><title>{title}</title></polygon>'
        )
    zero = f'<line x1="{LEFT}" x2="{WIDTH}" y1="{y(0.0):.1f}" y2="{y(0.0):.1f}" stroke="{LIMIT_COLOUR}"/>'
    ticks = "".join(
        f'<text x="{LEFT - 6}" y="{y(v) + 4:.1f}" text-anchor="end">{v:.2f}</text>' for v in (0.0, 0.5 * top, top)
    )
    ends = (
        f'<text x="{LEFT}" y="{HEIGHT - 6}">0</text>'
        f'<text x="{WIDTH}" y="{HEIGHT - 6}" text-anchor="end">{total:.0f} mm along the path</text>'
    )
    present = [k for k in order if (limits == k).any()]
    legend = "".join(
        f'<span style="white-space:nowrap;margin-right:1.2em">{_swatch(colours[k])} {escape(names[k])}</span>'
        for k in present[: len(LIMIT_COLOURS)]
    )
    others = "" if len(present) <= len(LIMIT_COLOURS) else f"{_swatch(QUIET_COLOUR)} others"
    return (
        f'<svg viewBox="0 0 {WIDTH:.0f} {HEIGHT:.0f}" width="100%" role="img" font-size="12" fill="currentColor" '
        f'aria-label="smallest margin along the path">{"".join(parts)}{zero}{ticks}{ends}</svg><p>{legend}{others}</p>'
    )


def _swatch(colour: str) -> str:
    """Return a square of a colour, as a picture, so that it is printed, too."""
    return f'<svg width="10" height="10" aria-hidden="true"><rect width="10" height="10" fill="{colour}"/></svg>'
