"""Would the tests notice? Mutants of verify/ by cosmic-ray's operators, each run against the tests of the verdict.

Run ``make mutation``; ``--every 10`` takes each tenth of the mutants, ``--files claims/legs.py`` those of some files.
The tests are collected once, and each runs once alone to see which lines it executes. Then every mutant lives in a
forked child, meets the tests that execute its statement, first those that kill most per second, and dies with the
first that fails. What survives is listed with its line: a test that is missing, or a change that means nothing.
"""

from __future__ import annotations

import argparse
import functools
import importlib
import importlib.machinery
import os
import pickle
import resource
import sys
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import CodeType, FrameType
from typing import Any, BinaryIO

import pytest
from _pytest.runner import runtestprotocol
from mutants import Mutant, mutant, places, put

ROOT = Path(__file__).resolve().parents[1]
VERIFY = ROOT / "src" / "pentapod" / "verify"
TESTS = ROOT / "tests" / "verify"
_OPTIONS = ("-x", "-q", "-s", "-p", "no:cacheprovider", "-p", "no:xdist")
_SINGLE = 3  # tests that come first from wherever they are
_MEMORY = 4 << 30  # bytes that a mutant may ask for


@dataclass(frozen=True)
class Look:
    """What a test does when it runs alone: seconds of it and of its fixtures, lines of verify/ that both execute."""

    seconds: float
    fixtures: float
    lines: frozenset[tuple[str, int]]


@dataclass
class Record:
    """How often each test ran on mutants of a file, and killed."""

    runs: Counter[str] = field(default_factory=Counter)
    kills: Counter[str] = field(default_factory=Counter)


# Children.


def child(work: Callable[[BinaryIO], int]) -> tuple[int, BinaryIO]:
    """Return the number of a silent child process that does the work, and what it writes."""
    read, write = os.pipe()
    number = os.fork()
    if number:
        os.close(write)
        return number, os.fdopen(read, "rb")
    os.close(read)
    silence = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silence, 1)
    os.dup2(silence, 2)
    resource.setrlimit(resource.RLIMIT_DATA, (_MEMORY, _MEMORY))
    code = 1
    try:
        with os.fdopen(write, "wb") as out:
            code = work(out)
    finally:
        os._exit(code)


def hurry(seconds: float) -> None:
    """End this process where it goes on for much longer than these seconds: what never ends counts as noticed."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    limit = int(used.ru_utime + used.ru_stime + 10.0 + 5.0 * seconds)
    resource.setrlimit(resource.RLIMIT_CPU, (limit, resource.RLIM_INFINITY))


def passes(item: pytest.Item, following: pytest.Item | None) -> bool:
    """Run a test; return whether it passed."""
    return all(report.passed for report in runtestprotocol(item, log=False, nextitem=following))


def grouped(tests: list[pytest.Item]) -> list[pytest.Item]:
    """Return the tests with all but the first few file by file, so that the fixtures of a file are made once."""
    return [*tests[:_SINGLE], *sorted(tests[_SINGLE:], key=lambda item: item.path)]


def look(item: pytest.Item, out: BinaryIO) -> int:
    """Run a test alone and write what it does."""
    lines: set[tuple[str, int]] = set()
    folder = f"{VERIFY}{os.sep}"

    def inside(frame: FrameType, event: str, _: object) -> Any:
        if event == "line":
            lines.add((frame.f_code.co_filename, frame.f_lineno))
        return inside

    def calls(frame: FrameType, _: str, __: object) -> Any:
        return inside if frame.f_code.co_filename.startswith(folder) else None

    start = time.process_time()
    sys.settrace(calls)
    reports = runtestprotocol(item, log=False, nextitem=None)
    sys.settrace(None)
    busy = (time.process_time() - start) / sum(report.duration for report in reports)
    fixtures, call = (busy * sum(r.duration for r in reports if r.when == when) for when in ("setup", "call"))
    pickle.dump(Look(call, fixtures, frozenset((Path(file).name, line) for file, line in lines)), out)
    return 0 if all(report.passed for report in reports) else 1


def meet(it: Mutant, tests: Sequence[tuple[pytest.Item, float]], out: BinaryIO) -> int:
    """Run tests, with the seconds they take, on a mutant until one fails; write the number of each before it runs."""
    if not put(it):
        return _meet_anew(it, tests, out)
    for k, (item, seconds) in enumerate(tests):
        _begin(k, seconds, out)
        if not passes(item, tests[k + 1][0] if k + 1 < len(tests) else None):
            return 1
    return 0


def _begin(number: int, seconds: float, out: BinaryIO) -> None:
    out.write(b"%d\n" % number)
    out.flush()
    hurry(seconds)


def _meet_anew(it: Mutant, tests: Sequence[tuple[pytest.Item, float]], out: BinaryIO) -> int:
    """Do the same where the change is none of a function: load all that comes from the file once more."""
    names = {item.nodeid: k for k, (item, _) in enumerate(tests)}

    class Chosen:
        @pytest.hookimpl(trylast=True)
        def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
            items[:] = sorted((item for item in items if item.nodeid in names), key=lambda item: names[item.nodeid])

        def pytest_runtest_logstart(self, nodeid: str) -> None:
            _begin(names[nodeid], tests[names[nodeid]][1], out)

    usual, good_case = importlib.machinery.SourceFileLoader.get_code, sys.modules["replay_cases"].good_case
    for name in list(sys.modules):
        if name.startswith(("pentapod.verify", "replay_cases", "test_")):
            del sys.modules[name]

    def get_code(self: importlib.machinery.SourceFileLoader, fullname: str) -> CodeType | None:
        if Path(self.path) == it.file:
            return compile(it.source, self.path, "exec", dont_inherit=True)
        return usual(self, fullname)

    importlib.machinery.SourceFileLoader.get_code = get_code
    hurry(20.0)
    cases: Any = importlib.import_module("replay_cases")
    cases.good_case = good_case
    return int(pytest.main([*_OPTIONS, *{str(item.path) for item, _ in tests}], plugins=[Chosen()]))


# The run.


class Run:
    """Takes the place of pytest's own loop over the tests that it collected."""

    def __init__(self, given: argparse.Namespace) -> None:
        self.given = given
        self.killed = self.count = 0

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        """Run all mutants."""
        session.config._tmp_path_factory.getbasetemp()  # pyright: ignore[reportAttributeAccessIssue]
        cases: Any = sys.modules["replay_cases"]
        cases.good_case = functools.cache(cases.good_case)
        start = time.perf_counter()
        for item, following in zip(session.items, [*session.items[1:], None], strict=True):
            if not passes(item, following):
                raise SystemExit(f"{item.nodeid} fails without any change")
        print(f"{len(session.items)} tests pass, {time.perf_counter() - start:.0f} s", flush=True)
        self._looks = {item: self._look(item) for item in session.items}
        print(f"each seen alone, {time.perf_counter() - start:.0f} s", flush=True)
        sites = [(VERIFY / name, *place) for name in self.given.files for place in places(VERIFY / name)]
        todo = [made for site in sites[self.given.first :: self.given.every] if (made := mutant(*site)) is not None]
        if self.given.among is not None:
            named = self.given.among.read_text(encoding="utf-8")
            todo = [it for it in todo if it.told in named]
        self._all(todo)
        print(f"{self.killed} of {self.count} mutants killed: {self.killed / self.count:.1%}")
        return True

    def _look(self, item: pytest.Item) -> Look:
        number, out = child(lambda to: look(item, to))
        with out:
            found = pickle.load(out)
        if os.waitpid(number, 0)[1]:
            raise SystemExit(f"{item.nodeid} fails alone")
        return found

    def _all(self, todo: list[Mutant]) -> None:
        records: dict[str, Record] = {}
        running: dict[int, tuple[Mutant, list[tuple[pytest.Item, float]], BinaryIO]] = {}
        start, waiting = time.perf_counter(), iter(todo)
        per_file: dict[str, list[int]] = {it.file.name: [0, 0] for it in todo}
        while True:
            while len(running) < self.given.processes and (it := next(waiting, None)) is not None:
                tests = self._chosen(it, records.setdefault(it.file.name, Record()))
                number, out = child(lambda to, it=it, tests=tests: meet(it, tests, to))
                running[number] = it, tests, out
            if not running:
                break
            number, status = os.wait()
            it, tests, out = running.pop(number)
            with out:
                ran = [tests[int(k)][0].nodeid for k in out.read().split()]
            record = records[it.file.name]
            record.runs.update(ran)
            record.kills.update(ran[-1:] if status else ())
            self.count += 1
            self.killed += status != 0
            tally = per_file[it.file.name]
            tally[0] += 1
            tally[1] += status != 0
            if not status:
                print(f"survived {len(ran)} tests: {it.told}", flush=True)
            if self.count % 20 == 0:
                seconds = time.perf_counter() - start
                print(f"{self.count} of {len(todo)} mutants, {self.killed} killed, {seconds:.0f} s", flush=True)
        for name, (count, killed) in per_file.items():
            print(f"{name}: {killed} of {count} killed, {killed / count:.1%}")

    def _chosen(self, it: Mutant, record: Record) -> list[tuple[pytest.Item, float]]:
        """Return the tests that a mutant has to meet, and their seconds: first what kills most in a second.

        A statement that no test executes stands outside all functions: then those that execute some of its file, and
        those that execute nothing and look at what is there.
        """
        statement, looks = {(it.file.name, line) for line in it.lines}, self._looks.items()
        tests = [item for item, seen in looks if not statement.isdisjoint(seen.lines)] or [
            item for item, seen in looks if not seen.lines or any(name == it.file.name for name, _ in seen.lines)
        ]

        sharing = Counter(item.path for item in tests)

        def worth(item: pytest.Item) -> float:
            share = (record.kills[item.nodeid] + 0.1) / (record.runs[item.nodeid] + 1.0)
            return share / (self._looks[item].seconds + self._looks[item].fixtures / sharing[item.path] + 0.01)

        chosen, begun, left = list[pytest.Item](), set[Path](), self.given.seconds
        for item in sorted(tests, key=worth, reverse=True):
            left -= self._looks[item].seconds + (0.0 if item.path in begun else self._looks[item].fixtures)
            if left < 0.0 and chosen:
                break
            begun.add(item.path)
            chosen.append(item)
        return [(item, self._looks[item].seconds + self._looks[item].fixtures) for item in grouped(chosen)]


def main() -> int:
    """Print what survives, and the share that is killed."""
    parser = argparse.ArgumentParser(description=__doc__)
    files = sorted(str(file.relative_to(VERIFY)) for file in VERIFY.rglob("*.py") if file.name != "__init__.py")
    parser.add_argument("--files", nargs="*", default=files)
    parser.add_argument("--tests", nargs="*", default=[""], help="only those of these files of tests/verify")
    parser.add_argument("--every", type=int, default=1, help="only each n-th mutant")
    parser.add_argument("--first", type=int, default=0, help="the first of those")
    parser.add_argument("--among", type=Path, help="only those named in this file: the survivors of another run, say")
    parser.add_argument("--least", type=float, default=0.9, help="share that has to be killed")
    parser.add_argument("--seconds", type=float, default=30.0, help="of tests until a mutant counts as a survivor")
    parser.add_argument("--processes", type=int, default=1, help="mutants that run at the same time")
    given = parser.parse_args()
    os.chdir(ROOT)
    run = Run(given)
    code = pytest.main([*_OPTIONS, *(str(TESTS / name) for name in given.tests)], plugins=[run])
    return int(code) or (0 if run.killed >= given.least * run.count else 1)


if __name__ == "__main__":
    sys.exit(main())
