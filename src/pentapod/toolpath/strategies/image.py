"""Image: grey levels as engraving depth or as laser power, line by line over a surface."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from scipy.ndimage import map_coordinates

from pentapod.base.arrays import Bools, Floats, frozen, set_frozen
from pentapod.base.errors import ToolpathError
from pentapod.base.keys import VECTOR, Key
from pentapod.cutters.tool import Tool
from pentapod.geometry.runs import equal_runs, marked_runs
from pentapod.mesh.mesh import Mesh
from pentapod.toolpath.drawing import Drawing, Order
from pentapod.toolpath.inputs.pictures import read_darkness
from pentapod.toolpath.lines.projection import projected, sunk
from pentapod.toolpath.options import PathOptions
from pentapod.toolpath.strategies.curves import CurveOptions, Laying, flat_turn, projection, wrapping
from pentapod.toolpath.strategies.strategy import Strategy

_LANE = np.array([[0.0, 0.0], [1.0, 0.0]])


class Effect(StrEnum):
    """depth: dark is deep. power: dark is full power; the tool stays on the surface."""

    DEPTH = "depth"
    POWER = "power"


@dataclass(frozen=True, kw_only=True, eq=False)
class ImageOptions(PathOptions):
    """Grey levels as depth or as laser power.

    darkness (rows, columns): 0 for white to 1 for black, the first row on top; pixels are square. effect: see
    `Effect`. laying, rotation: as for curves.
    """

    darkness: Annotated[
        Floats | None,
        Key(
            "", "picture (.png, .jpg, ...), relative to this job file",
            name="file", kind=Path, read=read_darkness, needed=True,
        ),
    ] = None  # fmt: skip
    width: Annotated[float, Key("mm", "of the picture on the surface", gt=0.0, needed=True)] = 0.05
    stepover: Annotated[float, Key("mm", "between lines", gt=0.0, of_part=1.0)] = 0.5e-3
    effect: Annotated[Effect | str, Key("", "what dark means: deep, or full power")] = Effect.DEPTH
    depth: Annotated[float, Key("mm", "depth of black", ge=0.0, of_part=1.0)] = 0.3e-3
    levels: Annotated[int, Key("", "steps of power", ge=1, le=256)] = 8
    threshold: Annotated[float, Key("", "darkness from 0 to 1 up to which is left out", ge=0.0, lt=1.0)] = 0.05
    laying: Annotated[Laying | str, Key("", "as for drawings")] = Laying.PROJECT
    position: Annotated[
        Floats | tuple[float, float, float] | None,
        Key("mm", "where the picture's middle goes, mesh frame; the middle of the region if left out", kind=VECTOR),
    ] = None
    rotation: Annotated[float, Key("deg", "of the picture, anticlockwise", ge=-360.0, le=360.0)] = 0.0

    @classmethod
    def sink_of(cls, values: Any) -> float:
        """Return the depth of black; 0 where dark means power."""
        return 0.0 if values.effect == Effect.POWER else super().sink_of(values)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.darkness is None:
            raise ToolpathError("there is no picture", key="darkness")
        darkness = frozen(self.darkness, "darkness", (None, None))
        if min(darkness.shape) < 2 or darkness.min() < 0.0 or darkness.max() > 1.0:
            raise ToolpathError("the picture must hold darkness from 0 to 1", key="darkness", value=darkness.shape)
        set_frozen(self, darkness=darkness)


def draw_image(mesh: Mesh, tool: Tool, options: ImageOptions) -> Drawing:
    """Return lines over the dark parts of the picture, each point as deep as it is dark, or in runs of equal power.

    Raises ToolpathError where nothing of the picture is dark enough or meets the region.
    """
    del tool
    darkness = np.asarray(options.darkness)
    rows, columns = darkness.shape
    pixel = options.width / columns
    height = pixel * rows
    count = max(1, round(height / options.stepover))
    y = (0.5 * (count - 1) - np.arange(count)) * (height / count)
    lane = _LANE * [options.width, 1.0] - [0.5 * options.width, 0.0]
    turn = flat_turn(options.rotation)
    laid = CurveOptions(
        region=options.region, view=options.view, lines=(lane,), laying=options.laying, position=options.position
    )
    landing = projection(mesh, laid) if options.laying is Laying.PROJECT else wrapping(mesh, laid)
    lines: list[Floats] = []
    shades: list[float] = []
    for k, level in enumerate(y):
        x, dark = _row(darkness, pixel, height, float(level))
        steps = np.ceil(dark * options.levels - 1e-9) / options.levels if options.effect is Effect.POWER else dark
        runs = _dark_runs(dark > options.threshold, steps if options.effect is Effect.POWER else None)
        for a, b in runs[::-1] if k % 2 else runs:
            line = np.stack([x[a : b + 1], np.full(b + 1 - a, level)], axis=1) @ turn
            lines.append(line[::-1] if k % 2 else line)
            shades.append(float(steps[a]))
    if not lines:
        raise ToolpathError("nothing of the picture is dark enough", key="threshold", value=options.threshold)
    if options.effect is Effect.DEPTH:
        landing = sunk(landing, lambda plane: options.depth * _shade(darkness, pixel, plane @ turn.T))
    sink = options.sink_of(options)
    passes, notes = projected(
        lines,
        landing,
        options,
        spacing=min(options.spacing, pixel),
        wrapped=options.laying is Laying.WRAP,
        sink=sink,
        slope=1.5 * sink / pixel,  # from white to black within a pixel
    )
    if not len(passes):
        raise ToolpathError("the picture does not meet the surface", key="position")
    visible = options.laying is Laying.PROJECT
    if options.effect is Effect.POWER:
        power = np.array(shades)[passes.levels]
        return Drawing(passes, 0.0, Order.GIVEN, both_ways=False, power=power, visible=visible, notes=notes)
    return Drawing(passes, 0.0, Order.GIVEN, both_ways=False, sink=options.depth, visible=visible, notes=notes)


def _shade(darkness: Floats, pixel: float, plane: Floats) -> Floats:
    """Return the darkness (N,) at points (N, 2) of the picture's own plane: between pixels' middles, in both ways."""
    rows, columns = darkness.shape
    column = np.clip(plane[:, 0] / pixel + 0.5 * columns - 0.5, 0.0, columns - 1.0)
    row = np.clip(0.5 * rows - plane[:, 1] / pixel - 0.5, 0.0, rows - 1.0)
    return np.asarray(map_coordinates(darkness, np.stack([row, column]), order=1), dtype=np.float64)


def _row(darkness: Floats, pixel: float, height: float, y: float) -> tuple[Floats, Floats]:
    """Return x (n,) across the picture, metres from its middle, and the darkness there on the line at y."""
    rows, columns = darkness.shape
    row = min(max(int((0.5 * height - y) / pixel), 0), rows - 1)
    x = (np.arange(columns) + 0.5 - 0.5 * columns) * pixel
    return x, darkness[row]


def _dark_runs(dark: Bools, steps: Floats | None) -> list[tuple[int, int]]:
    """Return first and last pixel of each run of dark ones, split where the steps of power change.

    What is split goes on from pixel to pixel; a run of one pixel borrows the next, or is left out at the rim.
    """
    runs: list[tuple[int, int]] = []
    for a, b in marked_runs(dark).tolist():
        starts = [a] if steps is None else (a + equal_runs(steps[a:b])[:, 0]).tolist()
        ends = [*starts, min(max(b - 1, a + 1), len(dark) - 1)]
        runs += [(p, q) for p, q in pairwise(ends) if q > p]
    return runs


STRATEGY = Strategy("image", ImageOptions, draw_image)
