"""Drawing: the lines of an SVG or DXF file on a surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import numpy as np

from pentapod.base.arrays import Floats, set_frozen
from pentapod.base.keys import Key
from pentapod.toolpath.inputs.drawings import read_lines
from pentapod.toolpath.options import check_positive
from pentapod.toolpath.strategies.curves import CurveOptions, curve_paths
from pentapod.toolpath.strategy import Strategy


@dataclass(frozen=True, kw_only=True, eq=False)
class DrawingOptions(CurveOptions):
    """The lines of a drawing.

    file: SVG or DXF; curves in it become chords within a quarter of `chordal`. Raises ToolpathError where it cannot be
    read.

    >>> drawing = DrawingOptions(file="line.svg", scale=0.5, depth=1e-4)
    >>> len(drawing.lines)
    1
    """

    lines: Sequence[Floats] = field(init=False, default=())
    file: Annotated[Path | str, Key("", "drawing (.svg, .dxf), relative to this job file", kind=Path)]
    scale: Annotated[float, Key("", "factor on the drawing's own size", gt=0.0)] = 1.0
    centred: Annotated[bool, Key("", "the drawing's middle is its origin, not the file's own")] = True

    def __post_init__(self) -> None:
        check_positive("scale", self.scale)
        lines = read_lines(self.file, 0.25 * self.chordal / self.scale)
        if self.centred:
            points = np.concatenate(lines)
            lines = [line - 0.5 * (points.min(axis=0) + points.max(axis=0)) for line in lines]
        set_frozen(self, lines=lines)
        super().__post_init__()


STRATEGY = Strategy("drawing", DrawingOptions, curve_paths)
