"""Ctrl-C and SIGTERM, at any moment: no traceback, the exit code of the signal, nothing half-written."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals")

SIGNALS = {signal.SIGINT: (130, "interrupted"), signal.SIGTERM: (143, "terminated")}
OVERSIZE = Path(__file__).parents[2] / "toolpaths" / "oversize.toml"  # never fits: the search finds nothing to keep
MAIN = "from pentapod.cli.main import main; main()"

AT_AN_IMPORT = """
import os, signal, sys
from pentapod.cli.main import main
left = [int(os.environ["IMPORTS"])]
def hook(event, arguments):
    if event == "import":
        left[0] -= 1
        if left[0] == 0:
            os.kill(os.getpid(), int(os.environ["SIGNAL"]))
sys.addaudithook(hook)
main()
"""


@pytest.mark.parametrize("imports", [30, 400, *(pytest.param(n, marks=pytest.mark.slow) for n in (1, 100, 200, 600))])
@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)])
def test_signals_during_imports_end_the_command(imports, number, tmp_path):
    environment = {**os.environ, "IMPORTS": str(imports), "SIGNAL": str(int(number))}
    command = [sys.executable, "-c", AT_AN_IMPORT, "plan", str(OVERSIZE), "-o", str(tmp_path / "out")]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    code, word = SIGNALS[number]
    assert done.stderr.split() == [word]
    assert done.returncode == code
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("number", SIGNALS)
def test_signals_during_planning_end_the_command(number, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "notes.txt").write_text("mine")
    command = [sys.executable, "-c", MAIN, "plan", str(OVERSIZE), "-o", str(tmp_path / "out")]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    for _ in range(2400):  # until work is under way
        time.sleep(0.05)
        if list((tmp_path / "out").glob(".unfinished-*")):
            break
    time.sleep(0.5)
    process.send_signal(number)
    _, said = process.communicate(timeout=120)
    code, word = SIGNALS[number]
    assert process.returncode == code
    assert said.splitlines()[-1] == word, "lines of progress may be before it"
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["notes.txt"]


@pytest.mark.parametrize("number", SIGNALS)
def test_signals_that_a_library_drops_are_raised_again(number):
    code = f"""
import contextlib, signal
from pentapod.cli.progress import progress_bar
from pentapod.cli.signals import signals_as_exceptions
with signals_as_exceptions(), progress_bar(quiet=True) as progress:
    progress("before", 0.0)
    with contextlib.suppress(BaseException):
        signal.raise_signal({int(number)})
    try:
        progress("after", 0.0)
    except BaseException as error:
        print(type(error).__name__)
    progress("placement", 1.0, "interrupted: the best so far is kept")
    progress("after", 1.0)
print("end")
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stdout.split() == ["KeyboardInterrupt" if number == signal.SIGINT else "Terminated", "end"]
    assert (done.returncode, done.stderr) == (0, "")


def test_signals_during_a_compilation_wait_for_its_end():
    """llvmlite's objects, left half made, printed errors when they were destroyed."""
    code = """
import signal, sys
import numba
from pentapod.cli.signals import Terminated, signals_as_exceptions
raised = []
def hook(frame, event, argument):
    made = type(frame.f_locals.get("self")).__name__ if frame.f_code.co_name == "__init__" else ""
    if event == "call" and made == "PassBuilder" and not raised:
        raised.append(frame.f_code.co_filename)
        signal.raise_signal(signal.SIGTERM)
with signals_as_exceptions():
    try:
        sys.setprofile(hook)
        numba.njit("int64(int64)")(lambda x: x + 1)
        sys.setprofile(None)
        while True:
            pass
    except Terminated:
        sys.setprofile(None)
        print("ended" if raised else "never in llvmlite")
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=120)
    assert (done.stdout.split(), done.stderr) == (["ended"], "")


def test_signals_that_the_parent_ignores_stay_ignored(tmp_path):
    command = [sys.executable, "-c", f"import signal; signal.raise_signal(signal.SIGTERM); {MAIN}", "--version"]
    ignoring = lambda: signal.signal(signal.SIGTERM, signal.SIG_IGN)  # noqa: E731
    done = subprocess.run(command, preexec_fn=ignoring, capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert done.stdout.startswith("pentapod ")
