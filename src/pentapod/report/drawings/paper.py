"""Paper: a drawing in SVG whose letters keep their size, with dimensions, and labels that lie on nothing else."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from html import escape

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.report.drawings.boxes import LETTER, Box, Place, box_of, common, size, through, width_of
from pentapod.report.drawings.svg_paths import ARROW, arrow_head, path_through

_AROUND = tuple(sorted(np.ndindex(5, 5), key=lambda k: ((k[0] - 2) ** 2 + (k[1] - 2) ** 2, k)))
"""Steps beside a point, from 2 on, the nearest first: the disc of a point goes to the first one that is free."""

CROSSED = 0.1
"""Area of a text on another one, in square units, that is as bad as a unit of a line through a text."""

STEPS = (-13.0, 13.0, -26.0, 26.0, -39.0, 39.0, -52.0, 52.0)
"""How far up and down a label may be from its point, where there is no room beside it."""

FAR = 14.0
"""Distance of a label from its point, from which on a line leads there."""

_HALO = "paint-order:stroke;stroke:var(--sheet,#fff);stroke-width:3px;stroke-linejoin:round"


@dataclass(frozen=True)
class Rooms:
    """Room around what is drawn, for dimensions: left, above, right, below."""

    left: float
    above: float
    right: float
    below: float


WIDTH, HIGHEST, LOWEST = 350.0, 220.0, 130.0
"""Width of a drawing, and how high it may be."""


@dataclass
class Paper:
    """A drawing of the plane region low..high (2,), mm, to the right and upwards; no higher than it has to be."""

    low: Floats
    high: Floats
    rooms: Rooms
    width: float = WIDTH
    parts: list[str] = field(default_factory=list[str])
    taken: list[Box] = field(default_factory=list[Box])
    discs: list[tuple[float, float]] = field(default_factory=list[tuple[float, float]])
    strokes: list[Floats] = field(default_factory=list[Floats])

    @property
    def height(self) -> float:
        """Its height."""
        rooms, (wide, high) = self.rooms, np.maximum(self.high - self.low, 1e-9)
        needed = (self.width - rooms.left - rooms.right) * high / wide + rooms.above + rooms.below
        return float(np.clip(np.ceil(needed), LOWEST, HIGHEST))

    @property
    def scale(self) -> float:
        """Units of the drawing for a millimetre."""
        rooms = self.rooms
        free = np.array([self.width - rooms.left - rooms.right, self.height - rooms.above - rooms.below])
        return float((free / np.maximum(self.high - self.low, 1e-9)).min())

    def at(self, points: Floats | Sequence[float]) -> Floats:
        """Return the places on the drawing of points (..., 2)."""
        rooms = self.rooms
        middle = np.array([
            0.5 * (rooms.left + self.width - rooms.right), 0.5 * (rooms.above + self.height - rooms.below),
        ])  # fmt: skip
        offset = np.asarray(points, dtype=np.float64) - 0.5 * (self.low + self.high)
        return middle + self.scale * offset * (1.0, -1.0)

    def holds(self, point: Floats) -> bool:
        """Whether a point, mm, is on the drawing, beside its dimensions."""
        (x, y), rooms = self.at(point), self.rooms
        return 4.0 < x < self.width - rooms.right and 4.0 < y < self.height - rooms.below

    def line(self, points: Floats, colour: str = "currentColor", width: float = 1.0, more: str = "") -> None:
        """Draw a line through points (K, 2), mm."""
        self._path(path_through([self.at(points)]), colour, width, f'fill="none" {more}')

    def bar(self, points: Floats, colour: str, width: float, more: str = "") -> None:
        """Draw a line through points (K, 2), mm, and keep labels off it."""
        self.line(points, colour, width, more)
        self.cross(*self.at(points))

    def lines(self, lines: Iterable[Floats], colour: str, width: float) -> None:
        """Draw lines (K, 2), mm, as one."""
        if path := path_through([self.at(line) for line in lines]):
            self._path(path, colour, width, 'fill="none"')

    def area(self, lines: Iterable[Floats], colour: str, name: str) -> None:
        """Fill what is within closed lines (K, 2), mm, holes left open, and draw its border."""
        if path := path_through([self.at(line) for line in lines], close="Z"):
            more = f'fill="{colour}" fill-opacity="0.3" fill-rule="evenodd"'
            self._path(path, "currentColor", 1.1, more, f"<title>{escape(name)}</title>")

    def stroke(self, path: str, width: float = 0.8, colour: str = "currentColor") -> None:
        """Draw an SVG path in units of the drawing."""
        self._path(path, colour, width, 'fill="none"')

    def ball(self, point: Floats, text: str, colour: str, ink: str = "#fff") -> None:
        """Draw a disc with a number, and keep labels off it."""
        x, y = self.at(point)
        self._disc(x, y, text, colour, ink)

    def flag(self, point: Floats, text: str, colour: str) -> None:
        """Draw a disc with a number at a point, mm; beside it, with a line, where another disc is there already."""
        (x, y), radius = self.at(point), 0.65 * LETTER
        free = [
            (a, b)
            for a, b in ((x + 2.4 * radius * (dx - 2), y + 2.4 * radius * (dy - 2)) for dx, dy in _AROUND)
            if radius < a < self.width - radius and radius < b < self.height - radius
            and all(np.hypot(a - c, b - d) > 2.0 * radius for c, d in self.discs)
        ]  # fmt: skip
        a, b = free[0] if free else (x, y)
        if (a, b) != (x, y):
            self.stroke(f"M{x:.1f} {y:.1f}L{a:.1f} {b:.1f}", 1.0)
        self._disc(a, b, text, colour, "#fff")

    def _disc(self, x: float, y: float, text: str, colour: str, ink: str) -> None:
        radius = 0.65 * LETTER
        self.discs.append((x, y))
        self.parts.append(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}" fill="{colour}" stroke="{ink}" stroke-width="0.8"/>'
            f'<text x="{x:.1f}" y="{y + 0.34 * LETTER:.1f}" font-size="{0.9 * LETTER:.1f}" font-weight="600" '
            f'text-anchor="middle" fill="{ink}">{escape(text)}</text>'
        )
        self.keep((x - radius, y - radius, x + radius, y + radius))

    def ring(self, low: Floats, high: Floats, colour: str) -> None:
        """Draw a circle around a region low..high (2,), mm, that is hard to see: smaller than two letters."""
        a, b = self.at(low), self.at(high)
        reach = 0.5 * float(np.linalg.norm(b - a))
        if reach < 2.0 * LETTER:
            (x, y), reach = 0.5 * (a + b), reach + 5.0
            self.parts.append(
                f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{reach:.1f}" fill="none" stroke="{colour}" stroke-width="1.4"/>'
            )
            self.keep((x - reach, y - reach, x + reach, y + reach))

    def keep(self, box: Box) -> None:
        """Keep labels off a box: left, upper, right, lower edge."""
        self.taken.append(box)

    def cross(self, *points: Floats | Sequence[float]) -> None:
        """Keep labels off the line through places (2,), in units of the drawing."""
        line = np.asarray(points, dtype=np.float64)
        self.strokes += [line[k : k + 2] for k in range(len(line) - 1)]

    def label(self, text: str, places: Sequence[Place], kind: str = "label") -> Box:
        """Write a text at the first of some places where it is within the drawing, on no other text and on no line.

        Returns its box.
        """
        least = np.inf
        (x, y, anchor), box = places[0], box_of(places[0], text)
        for place in places:
            here = box_of(place, text)
            if (hidden := self._hidden(here)) < least:
                least, (x, y, anchor), box = hidden, place, here
            if least == 0.0:
                break
        self.keep(box)
        self.parts.append(
            f'<text class="{kind}" x="{x:.1f}" y="{y:.1f}" font-size="{LETTER:g}" text-anchor="{anchor}" '
            f'fill="currentColor" style="{_HALO}">{escape(text)}</text>'
        )
        return box

    def label_at(self, point: Floats, text: str) -> None:
        """Write a text beside a point, mm: on the left first, since dimensions lead to the right and down."""
        x, y = self.at(point)
        side, off = 9.0, 0.36 * LETTER
        near = [
            (x - side, y - 5.0, "end"), (x - side, y + off, "end"), (x + side, y - 5.0, "start"),
            (x + side, y + off, "start"), (x - side, y + side + LETTER, "end"), (x + side, y + side + LETTER, "start"),
            (x, y - 12.0, "middle"), (x, y + 12.0 + LETTER, "middle"),
        ]  # fmt: skip
        far = [(a + out * (a - x), b + step, c) for step in STEPS for out in (0.0, 2.0, 5.0) for a, b, c in near]
        left, upper, right, lower = self.label(text, [*near, *far])
        a, b = np.clip(x, left, right), np.clip(y, upper, lower)
        if np.hypot(a - x, b - y) > FAR:
            self.stroke(f"M{x:.1f} {y:.1f}L{a:.1f} {b:.1f}", 0.4)

    def spot(self, point: Floats, text: str, colour: str) -> None:
        """Draw a point with its name."""
        x, y = self.at(point)
        self.parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{colour}"/>')
        self.keep((x - 3.0, y - 3.0, x + 3.0, y + 3.0))
        self.label_at(point, text)

    def datum(self, point: Floats) -> None:
        """Draw the mark of a datum: a circle in quarters."""
        (x, y), r = self.at(point), 5.5
        self.parts.append(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{r}" fill="var(--sheet,#fff)" stroke="currentColor"/>'
            f'<path d="M{x:.1f} {y:.1f}V{y - r:.1f}A{r} {r} 0 0 1 {x + r:.1f} {y:.1f}Z'
            f'M{x:.1f} {y:.1f}V{y + r:.1f}A{r} {r} 0 0 1 {x - r:.1f} {y:.1f}Z" fill="currentColor"/>'
        )
        self.discs.append((x, y))
        self.keep((x - r, y - r, x + r, y + r))

    def arrow(self, point: Floats, along: Floats, length: float, text: str) -> None:
        """Draw an arrow of a length in units of the drawing from a point, mm, with a label at its head."""
        reach = float(np.linalg.norm(along))
        if reach < 0.4:  # it points to the viewer
            return
        (x, y), (dx, dy) = self.at(point), length * along * (1.0, -1.0)
        self.stroke(f"M{x:.1f} {y:.1f}L{x + dx:.1f} {y + dy:.1f}", 1.2)
        self.cross((x, y), (x + dx, y + dy))
        self.parts.append(arrow_head(x + dx, y + dy, dx, dy))
        ux, uy = dx / (reach * length), dy / (reach * length)
        ahead = [(far, 0.0) for far in (9.0, 16.0, 24.0)]
        beside = [(far, side) for far in (0.0, 9.0, 18.0) for side in (-9.0, 9.0)]
        places = [
            (x + dx + far * ux - side * uy, y + dy + far * uy + side * ux + 0.36 * LETTER, "middle")
            for far, side in ahead + beside
        ]
        self.label(text, places)

    def across(self, start: Floats, end: Floats, text: str, ends: tuple[str, str] | None = None) -> None:
        """Draw the dimension to the right from one point to another, below the drawing. ends: texts at its ends."""
        (ax, ay), (bx, by) = sorted((self.at(start).tolist(), self.at(end).tolist()))
        y = self.height - self.rooms.below + 20.0
        self.stroke(f"M{ax:.1f} {ay + 3:.1f}V{y + 3:.1f}M{bx:.1f} {by + 3:.1f}V{y + 3:.1f}", 0.5)
        for a, b in ((ax, ay), (bx, by)):
            self.cross((a, b + 3.0), (a, y + 3.0))
        self._measure((ax, y), (bx, y))
        middle, beside, out = 0.5 * (ax + bx), y + 0.36 * LETTER, 2.5 * ARROW
        within: list[Place] = [(middle, y - 4.0, "middle")] if width_of(text) + 8.0 < bx - ax else []
        self.label(text, [*within, (bx + out, beside, "start"), (ax - out, beside, "end"),
                          (middle, y + 1.3 * LETTER, "middle")], "dimension")  # fmt: skip
        if ends is not None:
            for there, x, anchor in ((ends[0], ax, "end"), (ends[1], bx, "start")):
                inside = max(0.5 * width_of(there) + 2.0, x)
                places: list[Place] = [(inside, y + 1.4 * LETTER, "middle"), (x, y + 1.4 * LETTER, anchor)]
                self.label(there, [*places, (inside, y + 2.4 * LETTER, "middle")], "coordinate")

    def upright(self, start: Floats, end: Floats, text: str, ends: tuple[str, str] | None = None) -> None:
        """Draw the dimension upwards from one point to another, right of the drawing. ends: of the lower, the upper."""
        (ax, ay), (bx, by) = sorted((self.at(start).tolist(), self.at(end).tolist()), key=lambda p: -p[1])
        x = self.width - self.rooms.right + 12.0
        self.stroke(f"M{ax + 3:.1f} {ay:.1f}H{x + 3:.1f}M{bx + 3:.1f} {by:.1f}H{x + 3:.1f}", 0.5)
        for a, b in ((ax, ay), (bx, by)):
            self.cross((a + 3.0, b), (x + 3.0, b))
        self._measure((x, ay), (x, by))
        side, off = x + 5.0, 0.36 * LETTER
        middle = 0.5 * (ay + by) + off
        if ends is not None:
            for there, y, step in ((ends[0], ay, LETTER), (ends[1], by, -LETTER)):
                places = [(side, y + off + k * step, "start") for k in (0.0, 0.5, 1.0, 1.5, 2.0)]
                self.label(there, places, "coordinate")
        steps = (0.0, LETTER, -LETTER, 2.4 * LETTER, -2.4 * LETTER, 3.6 * LETTER, -3.6 * LETTER)
        self.label(text, [(side, middle + step, "start") for step in steps], "dimension")

    def svg(self, title: str, caption: str) -> str:
        """Return the drawing as a <figure>. title: for those who do not see it."""
        return (
            f'<figure class="drawing"><svg viewBox="0 0 {self.width:g} {self.height:g}" role="img" '
            f'aria-label="{escape(title)}">{"".join(self.parts)}</svg>'
            f'<figcaption class="caption">{escape(caption)}</figcaption></figure>'
        )

    def _measure(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Draw the line of a dimension with its arrows; they point inwards where there is no room between them."""
        (ax, ay), (bx, by) = start, end
        dx, dy = bx - ax, by - ay
        length = float(np.hypot(dx, dy))
        ux, uy = (dx / length, dy / length) if length > 0.0 else (1.0, 0.0)
        if length > 2.5 * ARROW:
            self.stroke(f"M{ax:.1f} {ay:.1f}L{bx:.1f} {by:.1f}")
            self.parts += [arrow_head(bx, by, ux, uy), arrow_head(ax, ay, -ux, -uy)]
        else:
            out = 2.0 * ARROW
            self.stroke(f"M{ax - out * ux:.1f} {ay - out * uy:.1f}L{bx + out * ux:.1f} {by + out * uy:.1f}")
            self.parts += [arrow_head(bx, by, -ux, -uy), arrow_head(ax, ay, ux, uy)]

    def _path(self, path: str, colour: str, width: float, more: str, inner: str = "") -> None:
        pen = f'stroke="{colour}" stroke-width="{width:g}" stroke-linejoin="round" stroke-linecap="round"'
        self.parts.append(
            f'<path d="{path}" {pen} {more}>{inner}</path>' if inner else f'<path d="{path}" {pen} {more}/>'
        )

    def _hidden(self, box: Box) -> float:
        frame = (0.0, 0.0, self.width, self.height)
        lined = through(box, np.array(self.strokes)) if self.strokes else 0.0
        hidden = sum(common(box, other) for other in self.taken) + 4.0 * (size(box) - common(box, frame))
        return hidden + CROSSED * lined
