"""Large batches in blocks: the temporaries of a block stay in the processor's cache."""

from __future__ import annotations

from collections.abc import Iterator

BLOCK = 4096
"""Elements of a block: a vector of it is 32 KiB, so the twenty or so of a formula fit a cache of 1 MiB."""


def blocks(count: int, size: int = BLOCK) -> Iterator[slice]:
    """Yield slices that cover range(count), each of at most `size` elements."""
    for start in range(0, count, size):
        yield slice(start, min(start + size, count))
