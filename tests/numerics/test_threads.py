"""Work on all cores: results in the order of the items, errors where they belong, the same on any number of cores."""

import os
import threading
import time
from multiprocessing import get_context
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial import KDTree

from pentapod.numerics.kernels import kernels_pay, kernels_used
from pentapod.numerics.threads import (
    CORES,
    MANY_POINTS,
    ROWS,
    both,
    cores,
    for_rows,
    in_threads,
    nearest_points,
    on_all_cores,
)


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


def test_this_thread_and_helpers_that_stay_do_all_items(monkeypatch):
    monkeypatch.setenv(CORES, "2")
    together, named = threading.Barrier(2, timeout=10.0), set[str]()

    def squared(k: int) -> int:
        together.wait()
        named.add(threading.current_thread().name)
        return k * k

    for _ in range(4):
        assert on_all_cores(squared, range(8)) == [k * k for k in range(8)]
    assert threading.current_thread().name in named
    assert 2 <= len(named) <= 1 + (os.cpu_count() or 1)
    monkeypatch.setenv(CORES, "1")
    assert set(on_all_cores(lambda _: threading.current_thread(), range(3))) == {threading.current_thread()}
    assert on_all_cores(squared, ()) == []


def test_helpers_may_ask_for_helpers(monkeypatch):
    monkeypatch.setenv(CORES, "4")

    def sums(k: int) -> int:
        return sum(on_all_cores(lambda n: time.sleep(1e-4) or n * k, range(5)))

    for _ in range(20):
        assert on_all_cores(sums, range(12)) == [10 * k for k in range(12)]
    with kernels_used("never"):
        assert on_all_cores(lambda _: time.sleep(1e-3) or kernels_pay(1e9), range(8)) == [False] * 8


def test_an_error_in_this_thread_or_a_helper_ends_the_work(monkeypatch):
    monkeypatch.setenv(CORES, "2")
    for wrong in (threading.main_thread().name, "pentapod"):
        begun = []

        def fails(k: int, wrong=wrong, begun=begun) -> None:
            begun.append(k)
            time.sleep(1e-3)
            if threading.current_thread().name.startswith(wrong):
                raise ZeroDivisionError

        with pytest.raises(ZeroDivisionError):
            on_all_cores(fails, range(1000))
        assert len(begun) < 1000
        assert on_all_cores(lambda k: k, range(3)) == [0, 1, 2]


@pytest.mark.parametrize("count", [MANY_POINTS, MANY_POINTS + 1])
def test_nearest_points_are_the_same_on_all_cores_which_many_points_use(count, monkeypatch):
    rng, asked = np.random.default_rng(3), []
    tree, points = KDTree(rng.random((4000, 3))), rng.random((count, 3))
    expected = tree.query(points, k=3, distance_upper_bound=0.05)
    for number in ("1", "3"):
        monkeypatch.setenv(CORES, number)
        found = nearest_points(tree, points, k=3, distance_upper_bound=0.05)
        assert all((a == b).all() for a, b in zip(found, expected, strict=True))
        nearest_points(SimpleNamespace(query=lambda *_, workers: asked.append(workers)), points)
    assert asked == [1, 3 if count > MANY_POINTS else 1]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")
def test_a_process_that_was_forked_has_helpers_of_its_own(monkeypatch):
    monkeypatch.setenv(CORES, "2")
    on_all_cores(lambda _: time.sleep(1e-3), range(8))  # the parent has some now
    with get_context("fork").Pool(1) as pool:
        assert pool.apply_async(_two_threads).get(timeout=20.0) == 2


def _two_threads() -> int:
    together = threading.Barrier(2, timeout=10.0)
    return len(set(on_all_cores(lambda _: (together.wait(), threading.current_thread().name)[1], range(4))))


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
