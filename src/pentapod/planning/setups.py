"""setups: the fewest contiguous parts of a path that fit the machine, each clamped anew."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from pentapod.progress import Progress, silent
from pentapod.refusal import Refusal
from pentapod.toolpath.parting import Parting, part_of, pass_ends
from pentapod.toolpath.toolpath import Toolpath

Fits = Callable[[Toolpath], bool]

Part = tuple[int, int]
"""First and last waypoint."""


def setups(
    toolpath: Toolpath, fits: Fits, parting: Parting, most: int, whole: Refusal, progress: Progress = silent
) -> tuple[Part, ...] | Refusal:
    """Return the parts, at most `most`, into which a path that does not fit as a whole is split; or a refusal.

    A part of what fits fits too: so taking each time the longest beginning that fits gives the fewest parts. A part ends
    where a pass does; within a pass only where that pass alone does not fit.
    """
    parts: list[Part] = []
    last = len(toolpath) - 1
    ends = [int(end) for end in pass_ends(toolpath)]
    ends[-1] = last  # the last part keeps the path's own end
    start = 0
    while start < last:
        if len(parts) == most:
            return _refusal(f"{most} set-ups are not enough: {_waypoints(start, last)} are left", whole)
        progress("set-ups", start / last, f"set-up {len(parts) + 1} from waypoint {start}")

        def fitting(end: int, start: int = start) -> bool:
            return fits(part_of(toolpath, start, end, parting))

        ahead = [end for end in ends if end > start]
        end = _furthest(ahead if start > 0 else ahead[:-1], fitting)
        if end is None:  # not even one pass
            end = _furthest(range(_first_cut(toolpath, start) + 1, ahead[0]), fitting)
        if end is None:
            return _refusal(f"no set-up reaches even the first of {_waypoints(start, ahead[0])}", whole)
        parts.append((start, end))
        start = end
    return tuple(parts)


def _waypoints(first: int, last: int) -> str:
    return f"waypoints {first} to {last}"


def _refusal(cause: str, whole: Refusal) -> Refusal:
    """Return the refusal of a path in set-ups, with what was in the way of the whole."""
    return Refusal("placement", f"{cause}; in one set-up {whole.cause}", whole.blames, whole.remedy)


def _furthest(ends: Sequence[int], fitting: Callable[[int], bool]) -> int | None:
    """Return the last of the ends that fits, by halving; None where none does."""
    if not ends or fitting(ends[-1]):
        return ends[-1] if ends else None
    low, high = -1, len(ends) - 1
    while high - low > 1:
        middle = (low + high) // 2
        if fitting(ends[middle]):
            low = middle
        else:
            high = middle
    return ends[low] if low >= 0 else None


def _first_cut(toolpath: Toolpath, start: int) -> int:
    """Return the first waypoint of a cut from `start` on."""
    for segment, first, end in zip(toolpath.segments, toolpath.starts[:-1], toolpath.starts[1:], strict=True):
        if segment.kind == "cut" and end > start:
            return max(int(first), start)
    return start
