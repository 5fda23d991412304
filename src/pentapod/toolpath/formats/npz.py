"""NumPy archives of toolpaths, with the arrays of `plan.npz`; lossless."""

from __future__ import annotations

import zipfile
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pentapod.base.archives import check_array, read_arrays
from pentapod.base.errors import InputError, ToolpathError
from pentapod.base.files import packed_arrays
from pentapod.toolpath.formats.registry import Defaults, Format, register
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath

_MM, _MM_MIN = 1e3, 6e4
_FORMS: dict[str, tuple[str, tuple[int | None, ...]]] = {
    "tips_mm": ("fi", (None, 3)),
    "axes": ("fi", (None, 3)),
    "tilt_centre_mm": ("fi", ()),
    "segment_starts": ("iu", (None,)),
    "segment_kinds": ("U", (None,)),
    "segment_feeds_mm_min": ("fi", (None,)),
    "segment_powers": ("fi", (None,)),
    "dwells_s": ("fi", (None,)),
}
"""Kinds of numbers, as NumPy names them, and shape of each array."""

_WORDS = "toolpath.words"
"""(S + 1,): what is said before each segment and after the last, a word a line; only where something is."""


def toolpath_arrays(toolpath: Toolpath) -> dict[str, NDArray[Any]]:
    """Return the arrays of a toolpath, workpiece frame; a segment's first waypoint is its start.

    dwells_s (S + 1,): dwell at the first waypoint of each segment, and at the end; NaN where the tool does not stop.
    """
    values = (
        toolpath.tips * _MM,
        toolpath.axes,
        np.array(toolpath.tilt_centre * _MM),
        toolpath.starts,
        np.array([str(s.kind) for s in toolpath.segments]),
        np.array([s.feed for s in toolpath.segments]) * _MM_MIN,
        np.array([s.power for s in toolpath.segments]),
        np.array([np.nan if dwell is None else dwell for dwell in toolpath.dwells]),
    )
    arrays = {f"toolpath.{name}": value for name, value in zip(_FORMS, values, strict=True)}
    said = (*(s.words for s in toolpath.segments), toolpath.end_words)
    return {**arrays, _WORDS: np.array(["\n".join(words) for words in said])} if any(said) else arrays


def _read(file: Path, defaults: Defaults) -> Toolpath:
    del defaults
    # The end of the file alone shows whether it is an archive, before all of it is read.
    if file.is_file() and not zipfile.is_zipfile(file):
        raise ToolpathError("not a NumPy archive, or cut off", file=file, expected="an .npz file")
    found = read_arrays(file, [f"toolpath.{name}" for name in _FORMS], ToolpathError, [_WORDS])
    arrays = {name: found[f"toolpath.{name}"] for name in _FORMS}
    for name, values in arrays.items():
        check_array(values, f"toolpath.{name}", file, ToolpathError, *_FORMS[name])
    if _WORDS in found:
        check_array(found[_WORDS], _WORDS, file, ToolpathError, "U", (len(arrays["segment_kinds"]) + 1,))
    try:
        return _toolpath(arrays, [tuple(text.split("\n")) if text else () for text in found.get(_WORDS, ())])
    except InputError as error:
        raise ToolpathError(error.what, file=file, key=error.key, value=error.value, expected=error.expected) from error
    except (ValueError, TypeError, IndexError, OverflowError) as error:
        raise ToolpathError("the arrays do not make a toolpath", file=file, expected=", ".join(_FORMS)) from error


def _toolpath(arrays: dict[str, NDArray[Any]], words: list[tuple[str, ...]]) -> Toolpath:
    tips, axes = arrays["tips_mm"] / _MM, arrays["axes"]
    starts = arrays["segment_starts"].astype(np.intp)
    kinds, feeds, powers = arrays["segment_kinds"], arrays["segment_feeds_mm_min"] / _MM_MIN, arrays["segment_powers"]
    dwells = [None if np.isnan(seconds) else float(seconds) for seconds in arrays["dwells_s"]]
    fits = len(starts) - 1 == len(kinds) == len(feeds) == len(powers) == len(dwells) - 1
    if not fits or starts[0] != 0 or starts[-1] != len(tips) - 1:
        raise ToolpathError("the segments do not fit the waypoints", key="toolpath.segment_starts")
    words = words or [()] * (len(kinds) + 1)
    segments = [
        Segment(SegmentKind(str(kind)), tips[a : b + 1], axes[a : b + 1], float(feed), float(power), dwell, said)
        for kind, feed, power, dwell, said, (a, b) in zip(
            kinds, feeds, powers, dwells[1:], words[:-1], pairwise(starts), strict=True
        )
    ]
    return Toolpath(tuple(segments), float(arrays["tilt_centre_mm"].item()) / _MM, dwells[0] or 0.0, words[-1])


def _write(toolpath: Toolpath) -> bytes:
    return packed_arrays(toolpath_arrays(toolpath))


register(Format("npz", (".npz",), "NumPy archive", _read, _write))
