"""The order in which poses are visited: short ways, none of them through a limit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints


@dataclass(frozen=True)
class OrderOptions:
    """blocked: seconds that a way through a limit counts. rounds: of exchanges at most."""

    blocked: float = 1000.0
    rounds: int = 100


def short_order(seconds: Floats, clear: Bools, options: OrderOptions = OrderOptions()) -> Ints:
    """Return the order (N,) of poses in which the ways take little time, from any first to any last pose.

    seconds (N, N): of the straight ways; clear (N, N): whether they keep all limits. From the nearest pose to the next
    nearest, then pieces of the order are reversed as long as that makes it shorter (2-opt).
    """
    cost = np.where(clear, seconds, options.blocked + seconds)
    count = len(cost)
    best = min((_nearest(cost, first) for first in range(count)), key=lambda order: _length(cost, order))
    for _ in range(options.rounds):
        shorter = _reversed_piece(cost, best)
        if shorter is None:
            break
        best = shorter
    return np.array(best, dtype=np.intp)


def _nearest(cost: Floats, first: int) -> list[int]:
    order, left = [first], set(range(len(cost))) - {first}
    while left:
        order.append(min(left, key=lambda pose: (cost[order[-1], pose], pose)))
        left.remove(order[-1])
    return order


def _length(cost: Floats, order: list[int]) -> float:
    return float(cost[order[:-1], order[1:]].sum())


def _reversed_piece(cost: Floats, order: list[int]) -> list[int] | None:
    """Return the order with the piece reversed that gains most, or None."""
    best, gain = None, 1e-9
    for a in range(len(order)):
        for b in range(a + 1, len(order)):
            saved = 0.0
            if a:
                saved += cost[order[a - 1], order[a]] - cost[order[a - 1], order[b]]
            if b + 1 < len(order):
                saved += cost[order[b], order[b + 1]] - cost[order[a], order[b + 1]]
            if saved > gain:
                best, gain = order[:a] + order[a : b + 1][::-1] + order[b + 1 :], saved
    return best
