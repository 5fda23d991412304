"""Pictures in: grey levels from PNG, JPEG and other picture files."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from pentapod.arrays import Floats
from pentapod.errors import ToolpathError
from pentapod.toolpath.drawings_in import extra, small_file

_MOST_PIXELS = 20_000_000


def read_darkness(path: str | Path) -> Floats:
    """Return the darkness (rows, columns), 0 for white to 1 for black, of a picture; what is transparent is white.

    Raises ToolpathError, naming the file, for what is no picture or has too many pixels.
    """
    path = Path(path)
    pillow = extra("PIL.Image", "pillow", path)
    data = small_file(path)
    try:
        with pillow.open(io.BytesIO(data)) as picture:
            if picture.width * picture.height > _MOST_PIXELS:
                raise ToolpathError(
                    "the picture is too large",
                    file=path,
                    value=picture.size,
                    expected=f"at most {_MOST_PIXELS:,} pixels",
                )
            white = pillow.new("RGBA", picture.size, "white")
            white.alpha_composite(picture.convert("RGBA"))
            grey = np.asarray(white.convert("L"), dtype=np.float64)
    except ToolpathError:
        raise
    except (OSError, ValueError, SyntaxError, EOFError, pillow.DecompressionBombError) as error:
        raise ToolpathError(f"cannot be read as a picture: {error}".splitlines()[0], file=path) from error
    return 1.0 - grey / 255.0
