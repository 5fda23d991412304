"""Would the tests notice? Mutants of verify/ by cosmic-ray's operators, each run against the tests of the verdict.

Run ``make mutation``; ``--every 10`` takes each tenth of the mutants, ``--files legs.py speed.py`` those of some files.
A mutant lives in a child process that is forked once everything else is loaded and compiled, and dies with the first
test that fails. What survives is listed with its line: each is a test that is missing, or a change that means nothing.
"""

from __future__ import annotations

import argparse
import difflib
import importlib.machinery
import os
import re
import resource
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from types import CodeType

import pytest
from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator

ROOT = Path(__file__).resolve().parents[1]
VERIFY = ROOT / "src" / "pentapod" / "verify"
BY_HAND, CATCHES, ORACLES = "test_claims_by_hand.py", "test_verdict_catches.py", "test_replay_oracles.py"
TESTS = {
    "approach.py": ("test_collisions.py",),
    "bodies.py": (BY_HAND, CATCHES, ORACLES),
    "claim.py": (BY_HAND, CATCHES),
    "collisions.py": ("test_collisions.py",),
    "component.py": (BY_HAND, CATCHES, ORACLES),
    "cutting.py": ("test_gouge_claim.py",),
    "gouge.py": ("test_gouge_claim.py", BY_HAND),
    "immersion.py": ("test_gouge_claim.py",),
    "joints.py": (BY_HAND, CATCHES, ORACLES),
    "judge.py": (BY_HAND, CATCHES),
    "legs.py": (BY_HAND, CATCHES, ORACLES),
    "matching.py": ("test_matching_laws.py", BY_HAND, CATCHES),
    "origin.py": (BY_HAND, CATCHES),
    "replay.py": (BY_HAND, ORACLES, CATCHES),
    "speed.py": (BY_HAND, "test_standoff_feed.py", CATCHES, ORACLES),
    "standing.py": ("test_standing.py",),
    "survey.py": (BY_HAND, ORACLES, CATCHES),
    "tool.py": ("test_tool_claims.py", CATCHES),
    "tracking.py": (BY_HAND, CATCHES, ORACLES),
    "verdict.py": (BY_HAND, CATCHES),
    "visits.py": ("test_matching_laws.py", CATCHES),
}
"""Which tests have to notice, the quickest first."""
OPERATORS = (
    "NumberReplacer",
    "AddNot",
    "ReplaceAndWithOr",
    "ReplaceOrWithAnd",
    "ReplaceTrueWithFalse",
    "ReplaceFalseWithTrue",
    "ReplaceUnaryOperator_Delete_Not",
    "ReplaceUnaryOperator_Delete_USub",
    "ZeroIterationForLoop",
    *(f"ReplaceComparisonOperator_{a}_{b}" for a, b in (("Lt", "GtE"), ("LtE", "Gt"), ("Gt", "LtE"), ("GtE", "Lt"))),
    *(f"ReplaceComparisonOperator_{a}_{b}" for a, b in (("Eq", "NotEq"), ("Is", "IsNot"), ("IsNot", "Is"))),
    *(f"ReplaceBinaryOperator_{a}_{b}" for a, b in (("Add", "Sub"), ("Sub", "Add"), ("Mul", "Div"), ("Div", "Mul"))),
)
_MEANINGLESS = re.compile(r"[+-]_(BLOCK|AT_ONCE|CHUNK|LOOKED_AT)\b|\+.*[(\s]/,")
"""Constants that decide how much is done in one go, and nothing else; the star before arguments by name, divided."""
_CPU_SECONDS = 120  # a mutant that runs longer than this never ends: killed


def places(file: Path) -> Iterator[tuple[str, int]]:
    """Yield operator and occurrence of every mutant of a file."""
    nodes = list(ast_nodes(get_ast(file.read_text(encoding="utf-8"))))
    for name in OPERATORS:
        operator = get_operator(f"core/{name}")()
        yield from ((name, k) for k in range(sum(len(list(operator.mutation_positions(node))) for node in nodes)))


def mutant(file: Path, name: str, occurrence: int) -> tuple[str, str] | None:
    """Return what changed and the source of a mutant; None where the change means nothing."""
    source = file.read_text(encoding="utf-8")
    mutated = mutate_code(source, get_operator(f"core/{name}")(), occurrence)
    if mutated is None:
        raise SystemExit(f"{file.name} has no mutant {name} {occurrence}")
    changed = difflib.unified_diff(source.splitlines(), mutated.splitlines(), lineterm="", n=0)
    lines = [line for line in changed if line[:1] in "+-@" and line[:3] not in ("+++", "---")]
    return None if any(_MEANINGLESS.match(line) for line in lines) else ("  ".join(lines), mutated)


def survives(file: Path, mutated: str) -> bool:
    """Return whether all tests pass with this source in place of the file's; in a child process."""
    child = os.fork()
    if child:
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    resource.setrlimit(resource.RLIMIT_CPU, (_CPU_SECONDS, _CPU_SECONDS))
    silence = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silence, 1)
    os.dup2(silence, 2)
    for name in [name for name in sys.modules if name.startswith(("pentapod.verify", "replay_cases"))]:
        del sys.modules[name]
    usual = importlib.machinery.SourceFileLoader.get_code

    def get_code(self: importlib.machinery.SourceFileLoader, fullname: str) -> CodeType | None:
        if Path(self.path) == file:
            return compile(mutated, self.path, "exec", dont_inherit=True)
        return usual(self, fullname)

    importlib.machinery.SourceFileLoader.get_code = get_code
    try:
        tests = [str(ROOT / "tests" / "verify" / test) for test in TESTS[file.name]]
        code = pytest.main(["-x", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", "-k", "not cubic", *tests])
    except BaseException:
        code = 1
    os._exit(int(code))


def warm() -> None:
    """Load and compile what mutants share."""
    sys.path.insert(0, str(ROOT / "tests" / "verify"))
    import replay_cases as cases  # noqa: PLC0415 - found by the line above

    from pentapod.verify import verify  # noqa: PLC0415 - the children load it anew

    for interpolation in ("linear", "cubic"):
        case = cases.good_case(interpolation=interpolation)
        if not verify(case.program, case.machine, case.toolpath, **cases.TOLERANCES).passed:
            raise SystemExit("the good program does not pass")


def main() -> int:
    """Print what survives, and the share that is killed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--files", nargs="*", default=tuple(TESTS))
    parser.add_argument("--every", type=int, default=1, help="only each n-th mutant")
    parser.add_argument("--first", type=int, default=0, help="the first of those")
    parser.add_argument("--least", type=float, default=0.9, help="share that has to be killed")
    given = parser.parse_args()
    untested = {file.name for file in VERIFY.glob("*.py")} - {*TESTS, "__init__.py"}
    if untested:
        raise SystemExit(f"no tests are named for {', '.join(sorted(untested))}")
    os.chdir(ROOT)
    warm()
    sites = [(VERIFY / name, *place) for name in given.files for place in places(VERIFY / name)]
    total = len(sites)
    found = [(*site[:2], mutant(*site)) for site in sites[given.first :: given.every]]
    todo = [(file, operator, *made) for file, operator, made in found if made is not None]
    start, killed = time.perf_counter(), 0
    for number, (file, operator, changed, source) in enumerate(todo, start=1):
        if survives(file, source):
            print(f"survived: {file.name} {operator}: {changed}", flush=True)
        else:
            killed += 1
        if number % 5 == 0:
            print(f"{number} of {len(todo)} mutants, {killed} killed, {time.perf_counter() - start:.0f} s", flush=True)
    print(f"{killed} of {len(todo)} mutants killed: {killed / len(todo):.1%} (of {total} that there are)")
    return 0 if killed >= given.least * len(todo) else 1


if __name__ == "__main__":
    sys.exit(main())
