"""Image: grey levels of a picture as engraving depth or as laser power, line by line over a surface."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from pentapod.base.arrays import Bools, Floats, frozen, set_frozen
from pentapod.base.errors import ToolpathError
from pentapod.base.keys import VECTOR, Key
from pentapod.geometry.runs import equal_runs, marked_runs
from pentapod.toolpath.inputs.pictures import read_darkness
from pentapod.toolpath.lines.projection import below, projected
from pentapod.toolpath.options import PathOptions
from pentapod.toolpath.strategies.curves import Laying, rotation_matrix, surface_map
from pentapod.toolpath.strategy import ContactPaths, Order, Strategy
from pentapod.toolpath.surface import Surface


class Effect(StrEnum):
    """depth: dark is deep. power: dark is full power; the tool stays on the surface."""

    DEPTH = "depth"
    POWER = "power"


@dataclass(frozen=True, kw_only=True, eq=False)
class ImageOptions(PathOptions):
    """Grey levels as depth or as laser power.

    darkness (rows, columns): from 0, white, to 1, black; the first row is the top one; pixels are square. effect: see
    `Effect`. laying, rotation: as for curves.

    >>> picture = ImageOptions(darkness=np.eye(8), width=0.03)
    """

    darkness: Annotated[
        Floats | None,
        Key(
            "", "picture (.png, .jpg, ...), relative to this job file",
            name="file", kind=Path, read=read_darkness, needed=True,
        ),
    ] = None  # fmt: skip
    width: Annotated[float, Key("mm", "width of the picture on the surface", gt=0.0, needed=True)] = 0.05
    stepover: Annotated[float, Key("mm", "distance between lines", gt=0.0, of_part=1.0)] = 0.5e-3
    effect: Annotated[Effect | str, Key("", "meaning of dark: deep, or full power")] = Effect.DEPTH
    depth: Annotated[float, Key("mm", "depth of black", ge=0.0, of_part=1.0)] = 0.3e-3
    levels: Annotated[int, Key("", "steps of power", ge=1, le=256)] = 8
    threshold: Annotated[float, Key("", "darkness from 0 to 1 up to which pixels are left out", ge=0.0, lt=1.0)] = 0.05
    laying: Annotated[Laying | str, Key("", "as for drawings")] = Laying.PROJECT
    position: Annotated[
        Floats | tuple[float, float, float] | None,
        Key("mm", "position of the picture's middle, mesh frame; the middle of the region if left out", kind=VECTOR),
    ] = None
    rotation: Annotated[float, Key("deg", "rotation of the picture, anticlockwise", ge=-360.0, le=360.0)] = 0.0

    @classmethod
    def depth_of(cls, values: Any) -> float:
        """Return the depth of black; 0 where dark means power."""
        return 0.0 if values.effect == Effect.POWER else super().depth_of(values)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.darkness is None:
            raise ToolpathError("there is no picture", key="darkness")
        darkness = frozen(self.darkness, "darkness", (None, None))
        if min(darkness.shape) < 2 or darkness.min() < 0.0 or darkness.max() > 1.0:
            raise ToolpathError("the picture must hold darkness from 0 to 1", key="darkness", value=darkness.shape)
        set_frozen(self, darkness=darkness)


def image_paths(surface: Surface, options: ImageOptions) -> ContactPaths:
    """Return lines over the dark parts of the picture, each point as deep as it is dark, or in runs of equal power.

    Raises ToolpathError if nothing of the picture is dark enough or meets the region.
    """
    darkness = np.asarray(options.darkness)
    rows, columns = darkness.shape
    pixel = options.width / columns
    height = pixel * rows
    count = max(1, round(height / options.stepover))
    y = (0.5 * (count - 1) - np.arange(count)) * (height / count)
    x = (np.arange(columns) + 0.5 - 0.5 * columns) * pixel
    mapped, rotation = (
        surface_map(surface, options, options.laying, options.position),
        rotation_matrix(options.rotation),
    )
    powered = options.effect is Effect.POWER
    lines: list[Floats] = []
    powers: list[float] = []
    for k, level in enumerate(y):
        dark = darkness[min(max(int((0.5 * height - level) / pixel), 0), rows - 1)]
        power = np.ceil(dark * options.levels - 1e-9) / options.levels if powered else dark
        runs = _dark_runs(dark > options.threshold, power if powered else None)
        for a, b in runs[::-1] if k % 2 else runs:
            line = np.stack([x[a : b + 1], np.full(b + 1 - a, level)], axis=1) @ rotation
            lines.append(line[::-1] if k % 2 else line)
            powers.append(float(power[a]))
    if not lines:
        raise ToolpathError("nothing of the picture is dark enough", key="threshold", value=options.threshold)
    if not powered:
        mapped = below(mapped, lambda plane: options.depth * _darkness_at(darkness, pixel, plane @ rotation.T))
    depth = options.depth_of(options)
    passes, notes = projected(
        lines,
        mapped,
        options,
        spacing=min(options.spacing, pixel),
        wrapped=options.laying is Laying.WRAP,
        depth=depth,
        depth_slope=1.5 * depth / pixel,  # from white to black within a pixel
    )
    if not len(passes):
        raise ToolpathError("the picture does not meet the surface", key="position")
    return ContactPaths(
        passes,
        order=Order.GIVEN,
        both_ways=False,
        depth=depth,
        power=np.array(powers)[passes.levels] if powered else None,
        visible=options.laying is Laying.PROJECT,
        notes=notes,
    )


def _darkness_at(darkness: Floats, pixel: float, plane: Floats) -> Floats:
    """Return the darkness (N,) at points (N, 2) of the picture, metres from its middle: bilinear interpolation."""
    from scipy.ndimage import map_coordinates  # noqa: PLC0415  slow, and few jobs have a picture

    rows, columns = darkness.shape
    column = np.clip(plane[:, 0] / pixel + 0.5 * columns - 0.5, 0.0, columns - 1.0)
    row = np.clip(0.5 * rows - plane[:, 1] / pixel - 0.5, 0.0, rows - 1.0)
    return np.asarray(map_coordinates(darkness, np.stack([row, column]), order=1), dtype=np.float64)


def _dark_runs(dark: Bools, power: Floats | None) -> list[tuple[int, int]]:
    """Return first and last pixel of each run of dark pixels (n,), split where the power (n,) changes.

    Split runs continue from pixel to pixel. A run of one pixel takes the next one too; at the rim it is left out.
    """
    runs: list[tuple[int, int]] = []
    for a, b in marked_runs(dark).tolist():
        starts = [a] if power is None else (a + equal_runs(power[a:b])[:, 0]).tolist()
        ends = [*starts, min(max(b - 1, a + 1), len(dark) - 1)]
        runs += [(p, q) for p, q in pairwise(ends) if q > p]
    return runs


STRATEGY = Strategy("image", ImageOptions, image_paths)
