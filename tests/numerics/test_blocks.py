"""Blocks cover a range once, in order, and keep the temporaries of large batches small."""

import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pentapod.kinematics import (
    GeneralPentapod,
    LinearPentapod,
    assembly_obstacles,
    certify_component,
    tip_force_amplification,
)
from pentapod.numerics.blocks import blocks


@given(st.integers(0, 500), st.integers(1, 64))
def test_blocks_cover_the_range(count: int, size: int) -> None:
    covered = [k for block in blocks(count, size) for k in range(count)[block]]
    assert covered == list(range(count))
    assert all(block.stop - block.start <= size for block in blocks(count, size))


ROBOT = LinearPentapod.quadratic([(-0.4, 0.2), (-0.2, -0.4), (0.0, 0.0), (0.2, -0.4), (0.4, 0.4)], 0.5)
GENERAL = GeneralPentapod(ROBOT.base, [0.31, -0.2, 0.05, 0.14, -0.1])
BATCH = {
    "general forward kinematics": lambda p, i, legs: GENERAL.pose(legs, (1, 1)),
    "certificate": lambda p, i, legs: certify_component(ROBOT, np.stack([legs[:-1], legs[1:]], axis=-1), (1, 1)),
    "obstacles": lambda p, i, legs: assembly_obstacles(ROBOT, legs),
    "amplification": lambda p, i, legs: tip_force_amplification(ROBOT, p, i, 0.1),
}


@pytest.mark.parametrize("name", BATCH)
def test_large_batches_need_little_more_memory_than_their_input(name: str) -> None:
    n, t = 100_000, np.linspace(0.0, 1.0, 100_000)
    p = np.c_[0.1 * np.cos(40 * t), 0.1 * np.sin(31 * t), 0.6 + 0.05 * np.sin(17 * t)]
    i = np.c_[0.3 * np.sin(23 * t), 0.3 * np.cos(29 * t), np.ones(n)]
    i /= np.linalg.norm(i, axis=1)[:, None]
    legs = ROBOT.leg_lengths(p, i)
    BATCH[name](p[:10], i[:10], legs[:10])  # whatever is cached
    tracemalloc.start()
    found = BATCH[name](p, i, legs)
    peak, kept = tracemalloc.get_traced_memory()[1], tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    assert found is not None
    assert peak - kept <= 3 * legs.nbytes
