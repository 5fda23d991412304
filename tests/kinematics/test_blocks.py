"""Blocks cover a range once, in order."""

from hypothesis import given
from hypothesis import strategies as st

from pentapod.kinematics.blocks import blocks


@given(st.integers(0, 500), st.integers(1, 64))
def test_blocks_cover_the_range(count: int, size: int) -> None:
    covered = [k for block in blocks(count, size) for k in range(count)[block]]
    assert covered == list(range(count))
    assert all(block.stop - block.start <= size for block in blocks(count, size))
