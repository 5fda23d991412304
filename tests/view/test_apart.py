"""A call in a process of its own: reports and result come back; it can be ended where it reports nothing."""

import sys
import threading
import time

import pytest

from pentapod.base.errors import InputError, PentapodError
from pentapod.view.apart import Apart, EndedError


def doubled(number, progress):
    """Report, print between the answers as libraries do, and return the double."""
    progress("half", 0.5, "of it")
    sys.stdout.write("a library prints")
    return 2 * number


def wrong(progress):
    """Raise an error of the project."""
    raise InputError("no such number", key="number", value=3)


def endless(progress):
    """Report once, and then nothing."""
    progress("begun", 0.0, "")
    time.sleep(600.0)


def dying(progress):
    """End the process, as a crash in native code does."""
    sys.exit(3)


def test_reports_and_the_result_come_back():
    seen = []
    assert Apart().result(doubled, 21, progress=lambda *report: seen.append(report)) == 42
    assert seen == [("half", 0.5, "of it")]


@pytest.mark.slow
def test_an_error_has_its_text():
    with pytest.raises(PentapodError, match=r"number: no such number \(got 3\)"):
        Apart().result(wrong, progress=lambda *report: None)


def test_a_call_is_ended_where_it_reports_nothing():
    apart, ended = Apart(), []

    def end(*report):
        threading.Timer(0.1, lambda: (ended.append(time.monotonic()), apart.end())).start()

    with pytest.raises(EndedError):
        apart.result(endless, progress=end)
    assert time.monotonic() - ended[0] < 30.0


def test_a_call_that_was_ended_before_is_not_made():
    apart = Apart()
    apart.end()
    with pytest.raises(EndedError):
        apart.result(doubled, 21, progress=lambda *report: None)


def test_the_death_of_the_process_is_no_result():
    with pytest.raises(EndedError):
        Apart().result(dying, progress=lambda *report: None)
