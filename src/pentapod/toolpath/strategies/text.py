"""Text: letters in single strokes on a surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Annotated

from pentapod.base.arrays import Floats, set_frozen
from pentapod.base.keys import Key
from pentapod.toolpath.inputs.lettering import lettering
from pentapod.toolpath.strategies.curves import CurveOptions, curve_paths
from pentapod.toolpath.strategy import Strategy


class Align(StrEnum):
    """Alignment of several lines."""

    LEFT = "left"
    CENTRE = "centre"
    RIGHT = "right"


@dataclass(frozen=True, kw_only=True, eq=False)
class TextOptions(CurveOptions):
    """Text, in single strokes. Raises ToolpathError for a character that the font does not have.

    >>> text = TextOptions(text="PENTAPOD", height=8e-3, depth=1e-4)
    """

    lines: Sequence[Floats] = field(init=False, default=())
    text: Annotated[str, Key("", "the text; \\n begins a new line")]
    height: Annotated[float, Key("mm", "height of capitals", gt=0.0, of_part=1.0)] = 5e-3
    letter_spacing: Annotated[float, Key("", "factor on the distance of letters", gt=0.0)] = 1.0
    align: Annotated[Align | str, Key("", "alignment of several lines")] = Align.CENTRE

    def __post_init__(self) -> None:
        set_frozen(self, lines=lettering(self.text, self.height, spacing=self.letter_spacing, align=self.align))
        super().__post_init__()


STRATEGY = Strategy("text", TextOptions, curve_paths)
