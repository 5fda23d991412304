"""Runs, against plain loops."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pentapod.geometry.runs import distinct, equal_runs, marked_runs, members, run_starts


def plain_runs(values: list[int]) -> list[list[int]]:
    """Return what a reader would do: walk along, and note where the value changes."""
    runs: list[list[int]] = []
    for k, value in enumerate(values):
        if k == 0 or value != values[k - 1]:
            runs.append([k, k])
        runs[-1][1] = k + 1
    return runs


@given(st.lists(st.booleans(), max_size=30))
def test_marked_runs(flags: list[bool]) -> None:
    found = marked_runs(np.array(flags, dtype=np.bool_))
    assert found.shape[1] == 2
    assert found.tolist() == [run for run in plain_runs([int(f) for f in flags]) if flags[run[0]]]


@given(st.lists(st.integers(0, 2), max_size=30))
def test_equal_runs(values: list[int]) -> None:
    found = equal_runs(np.array(values, dtype=np.intp))
    assert found.shape[1] == 2
    assert found.tolist() == plain_runs(values)


@given(st.lists(st.integers(0, 4), max_size=20))
def test_run_starts(counts: list[int]) -> None:
    starts = run_starts(counts)
    assert starts.dtype == np.intp
    assert starts.tolist() == [sum(counts[:k]) for k in range(len(counts) + 1)]


@given(st.lists(st.integers(0, 4), max_size=20))
def test_members(counts: list[int]) -> None:
    run, number = members(np.array(counts, dtype=np.intp))
    pairs = [(r, n) for r, count in enumerate(counts) for n in range(count)]
    assert list(zip(run.tolist(), number.tolist(), strict=True)) == pairs


@pytest.mark.parametrize("numbers", [[], [3], [2, 2, 2], [[5, -1], [5, 4]]])
def test_distinct_integers_are_those_of_a_set_in_order(numbers):
    found = distinct(np.array(numbers, dtype=np.intp))
    assert found.tolist() == sorted(set(np.ravel(np.array(numbers, dtype=np.intp)).tolist()))
