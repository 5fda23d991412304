"""in_threads: results in the order of the items, few at a time, and errors where they belong."""

import threading
import time

import numpy as np
import pytest

from pentapod.numerics.kernels import kernels_pay, kernels_used
from pentapod.numerics.threads import CORES, ROWS, both, cores, for_rows, in_threads


@pytest.mark.parametrize("threads", [1, 2, 5, None])
def test_results_are_in_the_order_of_the_items(threads):
    def slow_first(k: int) -> int:
        time.sleep(0.02 if k % 3 == 0 else 0.0)
        return k * k

    assert list(in_threads(slow_first, range(20), threads)) == [k * k for k in range(20)]
    assert list(in_threads(slow_first, [], threads)) == []


def test_several_work_at_once_and_no_more_than_are_asked_for():
    together = threading.Barrier(3, timeout=10.0)
    assert list(in_threads(lambda k: together.wait() >= 0, range(3), 3)) == [True] * 3
    begun = []
    results = in_threads(lambda k: begun.append(k) or k, range(100), 2)
    assert next(results) == 0
    time.sleep(0.05)
    assert len(begun) <= 4
    results.close()


def test_one_item_takes_no_other_thread_and_more_may_be_begun_ahead():
    assert list(in_threads(lambda _: threading.current_thread(), [0], 2)) == [threading.current_thread()]
    rest_is_done = threading.Event()
    # The first ends when all others have: that needs them begun before its result is asked for.
    results = in_threads(
        lambda k: rest_is_done.wait(10.0) if k == 0 else rest_is_done.set() if k == 5 else None, range(6), 2, ahead=6
    )
    assert next(results) is True
    results.close()


def test_two_functions_work_beside_each_other(monkeypatch):
    monkeypatch.setenv(CORES, "2")
    together = threading.Barrier(2, timeout=10.0)
    first, second = both(lambda: (together.wait(), "one")[1], lambda: (together.wait(), 2)[1])
    assert (first, second) == ("one", 2)
    monkeypatch.setenv(CORES, "1")
    assert both(threading.current_thread, lambda: 3) == (threading.current_thread(), 3)


def test_an_error_comes_where_its_result_would():
    results = in_threads(lambda k: 1 // (3 - k), range(10), 2)
    assert [next(results) for _ in range(3)] == [0, 0, 1]
    with pytest.raises(ZeroDivisionError):
        next(results)


def test_what_is_set_for_a_block_holds_in_its_threads():
    with kernels_used("never"):
        assert list(in_threads(lambda _: kernels_pay(1e9), range(4), 2)) == [False] * 4
    assert cores() >= 1


def test_the_environment_says_how_many_cores_a_process_uses(monkeypatch):
    monkeypatch.setenv(CORES, "3")
    assert cores() == 3
    monkeypatch.setenv(CORES, "some")
    given = cores()
    monkeypatch.delenv(CORES)
    assert given == cores() >= 1


@pytest.mark.parametrize(
    ("count", "size"), [(0, 64), (1, 64), (500, 64), (803, 101), (ROWS, 256), (9 * ROWS + 7, ROWS)]
)
def test_rows_are_filled_in_the_same_blocks_on_any_number_of_cores(monkeypatch, count, size):
    """Each row adds the one before it in its block, so that other blocks would give other sums.

    Of few rows all cores have some.
    """
    given, found = np.random.default_rng(1).normal(size=(count, 2)), []

    def sums(rows, factor, filled, lengths):
        filled[:] = factor * np.cumsum(rows, axis=0)
        lengths[:] = len(rows)

    for number in ("1", "2", "5"):
        monkeypatch.setenv(CORES, number)
        filled, lengths = np.full((count, 2), np.nan), np.zeros(count, dtype=np.intp)
        for_rows(sums, (given,), (3.0,), (filled, lengths))
        found.append(filled)
        assert (lengths == np.minimum(size, count - size * (np.arange(count) // size))).all()
    blocks = [3.0 * np.cumsum(given[k : k + size], axis=0) for k in range(0, count, size)]
    assert all(np.array_equal(each, np.concatenate([*blocks, np.empty((0, 2))])) for each in found)
