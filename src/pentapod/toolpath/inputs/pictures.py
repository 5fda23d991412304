"""Reader of pictures (PNG, JPEG and others) as grey levels."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ToolpathError
from pentapod.toolpath.inputs.files import extra, small_file

_MOST_PIXELS = 20_000_000
_DEEPEST = 65_535.0
_FORMATS = ("PNG", "JPEG", "GIF", "BMP", "TIFF", "PPM", "WEBP")
"""Others that pillow knows start programs, or are hardly ever met."""


def read_darkness(path: str | Path) -> Floats:
    """Return the darkness (rows, columns), 0 for white to 1 for black, of a picture; what is transparent is white.

    Raises ToolpathError, naming the file, for what is no picture or has too many pixels.
    """
    path = Path(path)
    pillow = extra("PIL.Image", "pillow", path)
    data = small_file(path)
    try:
        with pillow.open(io.BytesIO(data), formats=_FORMATS) as picture:
            if picture.width * picture.height > _MOST_PIXELS:
                raise ToolpathError(
                    "the picture is too large",
                    file=path,
                    value=picture.size,
                    expected=f"at most {_MOST_PIXELS:,} pixels",
                )
            if picture.mode.startswith("I"):
                # 16 bits a pixel: made eight by the library, all but the darkest levels become white.
                deep = np.asarray(picture, dtype=np.float64)
                if deep.min() < 0.0 or deep.max() > _DEEPEST:
                    raise ToolpathError("more than 16 bits a pixel", file=path, remedy="save it with 8 or 16 bits")
                return 1.0 - deep / _DEEPEST
            if picture.mode == "F":
                raise ToolpathError("grey levels that are no whole numbers", file=path, remedy="save it with 8 bits")
            white = pillow.new("RGBA", picture.size, "white")
            white.alpha_composite(picture.convert("RGBA"))
            grey = np.asarray(white.convert("L"), dtype=np.float64)
    except ToolpathError:
        raise
    except Exception as error:  # of whatever kind: what is in the file decides how the parser stumbles
        what = " ".join(str(error).replace(repr(path), "").split())[:80] or type(error).__name__
        remedy = f"save it as one of {', '.join(_FORMATS)}"
        raise ToolpathError(f"cannot be read as a picture: {what}", file=path, remedy=remedy) from error
    return 1.0 - grey / 255.0
