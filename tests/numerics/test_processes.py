"""both: two calls at a time, the second in a fork where that is possible, with the same results everywhere."""

import os
import sys
import threading
import time

import numpy as np
import pytest

from pentapod.numerics.processes import both
from pentapod.numerics.threads import CORES


@pytest.fixture
def forks(monkeypatch):
    """Two cores; whether the second call is made in a fork of this process."""
    monkeypatch.setenv(CORES, "2")
    return sys.platform == "linux" and threading.active_count() == 1


def test_both_results_come_back_and_the_second_is_of_another_process(forks):
    x = np.random.default_rng(0).normal(size=1000)
    (here, one), (there, other) = both(lambda: (os.getpid(), np.sin(x)), lambda: (os.getpid(), np.sin(x)))
    assert here == os.getpid()
    assert (there != here) == forks
    assert np.array_equal(one, other)


def test_they_run_at_the_same_time(forks):
    if not forks:
        pytest.skip("no forks here")
    read, write = os.pipe()  # each call waits for the other
    back, forth = os.pipe()
    first = both(
        lambda: (os.write(forth, b"a"), os.read(read, 1))[1], lambda: (os.read(back, 1), os.write(write, b"b"))[0]
    )
    assert first == (b"b", b"a")
    for end in (read, write, back, forth):
        os.close(end)


def test_one_core_and_other_threads_do_without_a_fork(monkeypatch):
    monkeypatch.setenv(CORES, "1")
    assert both(os.getpid, os.getpid) == (os.getpid(), os.getpid())
    monkeypatch.setenv(CORES, "2")
    end = threading.Event()
    thread = threading.Thread(target=end.wait)
    thread.start()
    assert both(os.getpid, os.getpid) == (os.getpid(), os.getpid())
    end.set()
    thread.join()


@pytest.mark.usefixtures("forks")
def test_errors_are_raised_here_and_a_fork_that_dies_is_made_good():
    here = os.getpid()
    with pytest.raises(ZeroDivisionError):
        both(lambda: 1, lambda: 1 // 0)
    begun = time.monotonic()
    with pytest.raises(KeyError):
        both(lambda: {}["none"], lambda: time.sleep(0.0 if os.getpid() == here else 30.0))
    assert time.monotonic() - begun < 20.0  # it does not wait for the other
    assert both(lambda: 1, lambda: 2 if os.getpid() == here else os._exit(1)) == (1, 2)
