"""Pictures (PNG, JPEG and others) as grey levels, read with pillow."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ToolpathError
from pentapod.toolpath.inputs.files import LIMITS, extra, small_file

_WHITE_16_BITS = 65_535.0
_FORMATS = ("PNG", "JPEG", "GIF", "BMP", "TIFF", "PPM", "WEBP")
"""Formats that are read; some others of pillow start programs."""


def read_darkness(path: str | Path) -> Floats:
    """Return the darkness (rows, columns), 0 for white to 1 for black, of a picture; transparent pixels are white.

    Raises ToolpathError with the file: not a picture, or too many pixels.

    >>> read_darkness("dot.pgm").tolist()  # one black point
    [[1.0]]
    """
    path = Path(path)
    pillow = extra("PIL.Image", "pillow", path)
    data = small_file(path)
    try:
        with pillow.open(io.BytesIO(data), formats=_FORMATS) as picture:
            if picture.width * picture.height > LIMITS.pixels:
                most = f"at most {LIMITS.pixels:,} pixels"
                raise ToolpathError("the picture is too large", file=path, value=picture.size, expected=most)
            if picture.mode.startswith("I"):
                # 16 bits a pixel; pillow's conversion to 8 bits turns almost all levels white.
                deep = np.asarray(picture, dtype=np.float64)
                if deep.min() < 0.0 or deep.max() > _WHITE_16_BITS:
                    raise ToolpathError("more than 16 bits a pixel", file=path, remedy="save it with 8 or 16 bits")
                return 1.0 - deep / _WHITE_16_BITS
            if picture.mode == "F":
                raise ToolpathError("grey levels are not whole numbers", file=path, remedy="save it with 8 bits")
            white = pillow.new("RGBA", picture.size, "white")
            white.alpha_composite(picture.convert("RGBA"))
            grey = np.asarray(white.convert("L"), dtype=np.float64)
    except ToolpathError:
        raise
    except Exception as error:  # of any kind: the parser's exceptions depend on what is in the file
        what = " ".join(str(error).replace(repr(path), "").split())[:80] or type(error).__name__
        remedy = f"save it as one of {', '.join(_FORMATS)}"
        raise ToolpathError(f"cannot be read as a picture: {what}", file=path, remedy=remedy) from error
    return 1.0 - grey / 255.0
