"""Blocks of large batches, so that temporaries stay in the processor's cache."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from pentapod.base.arrays import Floats

BLOCK = 4096
"""Elements of a block: a vector of it is 32 KiB, so the twenty or so of a formula fit a cache of 1 MiB."""


def blocks(count: int, size: int = BLOCK) -> Iterator[slice]:
    """Yield slices that cover range(count), each of at most `size` elements."""
    for start in range(0, count, size):
        yield slice(start, min(start + size, count))


def in_blocks(function: Callable[..., Floats], *batches: Floats) -> Floats:
    """Return function(*batches) (...), one number for each element of batches (..., n), evaluated block by block."""
    shape = batches[0].shape[:-1]
    flat = [batch.reshape(-1, batch.shape[-1]) for batch in batches]
    found = np.empty(len(flat[0]))
    for block in blocks(len(found)):
        found[block] = function(*(batch[block] for batch in flat))
    return found.reshape(shape)
