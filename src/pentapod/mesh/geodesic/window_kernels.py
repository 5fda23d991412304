"""Windows on edges: where on an edge a front arrives straight from a virtual source, and which of two arrives first.

A window is a row b0, b1, x, y, start: on its edge, between b0 and b1 from the edge's first vertex, the distance is that
from a virtual source at (x, y), y off the edge, plus `start`. A straight front has its virtual source `FAR` away. The
windows of an edge do not overlap; they are a list, linked by `links` (W, 3): the next one, the facet from which it
arrives, and whether it was propagated. All lengths are in steps.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.numerics.kernels import kernel

FAR = 1e7
"""Distance of the virtual source of a straight front: 100 steps of such a front are bent by 1e-4 steps."""
TIE = 1e-7
"""A window must be nearer by this many steps than one that is there already."""
NARROW = 1e-9
"""Windows that are narrower than this many steps are left out."""
NEXT, FACET, DONE = 0, 1, 2
COLUMNS = 5
"""Numbers of a window: b0, b1, x, y, start."""
NEW = 0
"""The row of the window that is being inserted."""


class Fronts(NamedTuple):
    """The windows of all edges, and what is known of vertices.

    windows (W, 5), links (W, 3): rows, see above. heads, counts (E,): the first window of each edge, or −1; how many it
    has. state (2,): rows in use, the new window's among them; the first row that is free again, or −1. keys (E,): when
    each edge is to be propagated. distance (V,): steps to each vertex. bent (V,): whether only ways that turn at the
    end of a window reach it. out (4,), own, other (2,), pieces, owners, cuts (3,): scratch.
    """

    windows: Floats
    links: Ints
    heads: Ints
    counts: Ints
    state: Ints
    keys: Floats
    distance: Floats
    bent: Bools
    out: Floats
    own: Floats
    other: Floats
    pieces: Floats
    owners: Ints
    cuts: Floats


@kernel
def roomy(fronts: Fronts, rows: int) -> Fronts:
    """Return fronts with space for that many further rows."""
    if fronts.state[0] + rows <= len(fronts.windows) and 3 * rows <= len(fronts.owners):
        return fronts
    size = 2 * len(fronts.windows) + 4 * rows
    windows, links = np.empty((size, COLUMNS)), np.empty((size, 3), dtype=np.intp)
    windows[: fronts.state[0]] = fronts.windows[: fronts.state[0]]
    links[: fronts.state[0]] = fronts.links[: fronts.state[0]]
    return Fronts(
        windows, links, fronts.heads, fronts.counts, fronts.state, fronts.keys, fronts.distance, fronts.bent,
        fronts.out,
        fronts.own,
        fronts.other, np.empty((6 * rows, 2)), np.empty(6 * rows, dtype=np.intp), fronts.cuts,
    )  # fmt: skip


@kernel
def norm(x: float, y: float) -> float:
    """Return the length of a vector; quicker than math.hypot, which guards against overflow."""
    return math.sqrt(x * x + y * y)


@kernel
def reach(windows: Floats, k: int, x: float) -> float:
    """Return the distance, in steps, of the place x on the edge of window k."""
    return windows[k, 4] + norm(x - windows[k, 2], windows[k, 3])


@kernel
def slope(windows: Floats, k: int, x: float) -> float:
    """Return the change of the distance along the edge at x."""
    distance = norm(x - windows[k, 2], windows[k, 3])
    return (x - windows[k, 2]) / distance if distance > 0.0 else 0.0


@kernel
def _kink(windows: Floats, k: int, low: float, high: float, at_low: float, at_high: float) -> float:
    """Return where the tangents of a window's distance at low and high meet: about where it is farthest off a chord."""
    p, q = slope(windows, k, low), slope(windows, k, high)
    if q - p <= 1e-12:
        return 0.5 * (low + high)
    return min(max((at_low - at_high + q * high - p * low) / (q - p), low), high)


@kernel
def _crossing(windows: Floats, k: int, low: float, high: float, at_low: float, at_high: float) -> float:
    """Return where the new window and window k are equally far, between low and high.

    at_low, at_high: new less k there, of different signs. By the Illinois method.
    """
    for _ in range(60):
        x = high - at_high * (high - low) / (at_high - at_low)
        if not low < x < high:
            x = 0.5 * (low + high)
        at = reach(windows, NEW, x) - reach(windows, k, x)
        if abs(at) < 1e-12 or high - low < NARROW:
            return x
        if (at > 0.0) == (at_high > 0.0):
            high, at_high, at_low = x, at, 0.5 * at_low
        else:
            low, at_low, at_high = x, at, 0.5 * at_high
    return 0.5 * (low + high)


@kernel
def _cuts(windows: Floats, k: int, low: float, high: float, cuts: Floats) -> int:
    """Write the places (up to 2) where the nearer of the new window and window k changes; return their number."""
    new_low, new_high = reach(windows, NEW, low), reach(windows, NEW, high)
    old_low, old_high = reach(windows, k, low), reach(windows, k, high)
    at_low, at_high = new_low - old_low, new_high - old_high
    if (at_low > 0.0) != (at_high > 0.0):
        cuts[0] = _crossing(windows, k, low, high, at_low, at_high)
        return 1
    if at_low > 0.0:
        middle = _kink(windows, NEW, low, high, new_low, new_high)
    else:
        middle = _kink(windows, k, low, high, old_low, old_high)
    at = reach(windows, NEW, middle) - reach(windows, k, middle)
    if (at > 0.0) == (at_low > 0.0) or not low < middle < high:
        return 0
    cuts[0] = _crossing(windows, k, low, middle, at_low, at)
    cuts[1] = _crossing(windows, k, middle, high, at, at_high)
    return 2


@kernel
def _note(pieces: Floats, owners: Ints, count: int, low: float, high: float, owner: int) -> int:
    """Append a piece of an owner's window, joined with the one before if that is the same owner's; return the count."""
    if high - low <= NARROW:
        return count
    if count > 0 and owners[count - 1] == owner and low - pieces[count - 1, 1] <= NARROW:
        pieces[count - 1, 1] = high
        return count
    pieces[count, 0], pieces[count, 1], owners[count] = low, high, owner
    return count + 1


@kernel
def _envelope(windows: Floats, links: Ints, first: int, pieces: Floats, owners: Ints, cuts: Floats) -> tuple[int, bool]:
    """Write the pieces of an edge's windows and the new one, and whose they are; return how many, and if any is new.

    The nearer window owns each place; a tie goes to the one that is there.
    """
    start, stop = windows[NEW, 0], windows[NEW, 1]
    count, won, at, k = 0, False, start, first
    while k >= 0:
        begin, end = windows[k, 0], windows[k, 1]
        low, high = max(begin, start), min(end, stop)
        if high - low <= NARROW:
            if begin >= stop - NARROW and at < stop - NARROW:
                count, at, won = _note(pieces, owners, count, at, stop, NEW), stop, True
            count = _note(pieces, owners, count, begin, end, k)
            k = links[k, NEXT]
            continue
        count = _note(pieces, owners, count, begin, low, k)
        if low - at > NARROW:
            count, won = _note(pieces, owners, count, at, low, NEW), True
        number = _cuts(windows, k, low, high, cuts)
        cuts[number] = high
        begin = low
        for c in range(number + 1):
            middle = 0.5 * (begin + cuts[c])
            nearer = reach(windows, NEW, middle) < reach(windows, k, middle) - TIE
            won = won or (nearer and cuts[c] - begin > NARROW)
            count = _note(pieces, owners, count, begin, cuts[c], NEW if nearer else k)
            begin = cuts[c]
        count = _note(pieces, owners, count, high, end, k)
        at = max(at, high)
        k = links[k, NEXT]
    if stop - at > NARROW:
        count, won = _note(pieces, owners, count, at, stop, NEW), True
    return count, won


@kernel
def _node(links: Ints, state: Ints) -> int:
    """Return the number of a free row. state: rows in use, first of the free ones."""
    k = state[1]
    if k >= 0:
        state[1] = links[k, NEXT]
        return k
    state[0] += 1
    return state[0] - 1


@kernel
def insert(fronts: Fronts, edge: int, facet: int) -> bool:
    """Add the new window, arriving from a facet, wherever it is the nearest on an edge; return whether it is."""
    windows, links, state, owners = fronts.windows, fronts.links, fronts.state, fronts.owners
    if windows[NEW, 1] - windows[NEW, 0] <= NARROW:
        return False
    count, won = _envelope(windows, links, fronts.heads[edge], fronts.pieces, owners, fronts.cuts)
    if not won:
        return False
    # Old rows stay where they are for their first piece; those without one are freed.
    k = fronts.heads[edge]
    while k >= 0:
        after, kept = links[k, NEXT], False
        for c in range(count):
            kept = kept or owners[c] == k
        if not kept:
            links[k, NEXT], state[1] = state[1], k
        k = after
    last, used = -1, -1
    for c in range(count):
        owner, low, high = owners[c], fronts.pieces[c, 0], fronts.pieces[c, 1]
        row = owner
        if owner in (NEW, used):
            row = _node(links, state)
            for j in range(2, COLUMNS):
                windows[row, j] = windows[owner, j]
            links[row, FACET] = facet if owner == NEW else links[owner, FACET]
            links[row, DONE] = 0 if owner == NEW else links[owner, DONE]
        used = used if owner == NEW else owner
        windows[row, 0], windows[row, 1] = low, high
        if last < 0:
            fronts.heads[edge] = row
        else:
            links[last, NEXT] = row
        last = row
    links[last, NEXT] = -1
    fronts.counts[edge] = count
    return True


@kernel
def merge(fronts: Fronts, edge: int, slack: float, turn: float) -> None:
    """Join neighbouring windows of an edge that are still to be propagated, where that changes no distance by `slack`.

    The joint window keeps the distances at its ends.
    """
    windows, links, state = fronts.windows, fronts.links, fronts.state
    k = fronts.heads[edge]
    while k >= 0 and links[k, NEXT] >= 0:
        n = links[k, NEXT]
        alike = links[k, FACET] == links[n, FACET] and links[k, DONE] == 0 and links[n, DONE] == 0
        if alike and windows[n, 0] - windows[k, 1] <= NARROW and _joined(windows, k, n, slack, turn):
            windows[k, 1] = windows[n, 1]
            links[k, NEXT] = links[n, NEXT]
            links[n, NEXT], state[1] = state[1], n
            fronts.counts[edge] -= 1
        else:
            k = n


@kernel
def _joined(windows: Floats, a: int, b: int, slack: float, turn: float) -> bool:
    """Give window a the virtual source of both a and its neighbour b, if there is one; return whether there is."""
    low, cut, high = windows[a, 0], windows[a, 1], windows[b, 1]
    wide, other, end = (a, b, high) if cut - low >= high - windows[b, 0] else (b, a, low)
    middle = 0.5 * (windows[other, 0] + windows[other, 1])
    same = abs(reach(windows, wide, middle) - reach(windows, other, middle)) < TIE
    if same and abs(reach(windows, wide, end) - reach(windows, other, end)) < TIE:
        for j in range(2, COLUMNS):
            windows[a, j] = windows[wide, j]
        return True
    start, width = windows[wide, 4], high - low
    r0, r1 = reach(windows, a, low) - start, reach(windows, b, high) - start
    x = 0.5 * (width + (r0 - r1) * (r0 + r1) / width)
    square = (r0 - x) * (r0 + x)
    if r0 <= 0.0 or r1 <= 0.0 or square <= 0.0:
        return False
    x, y = low + x, math.sqrt(square)
    for j in range(3):
        place, k = (0.5 * (low + cut), a) if j == 0 else ((cut, a) if j == 1 else (0.5 * (cut + high), b))
        if abs(start + norm(place - x, y) - reach(windows, k, place)) > slack:
            return False
    for j in range(2):
        place, k = (high, b) if j else (low, a)
        if abs((place - x) / norm(place - x, y) - slope(windows, k, place)) > turn:
            return False
    windows[a, 2], windows[a, 3], windows[a, 4] = x, y, start
    return True
