"""Warm-up: its list is of kernels that there are, and a kernel of it is not compiled again when it is called."""

import ast
import json
import os
import re
import subprocess
import sys
from importlib import import_module

import pytest

from pentapod.base.errors import InputError
from pentapod.numerics import warm_up
from pentapod.numerics.warm_up import SIGNATURES, compile_all, signatures, types_of

RUN = """
from pentapod.numerics.warm_up import compile_all, signatures
name = "timing.jerk.spline_kernels:solve_banded"
print(*compile_all([call for call in signatures() if call[0] == name]))
"""
USE = """
import logging, numpy as np
logging.basicConfig(level=logging.INFO)
from pentapod.timing.jerk.spline_kernels import solve_banded
solve_banded(np.ones((4, 4)), 4, np.ones(4))
"""


def test_every_kernel_of_the_list_is_there_with_as_many_arguments():
    calls = signatures()
    assert len(calls) > 100
    for name, arguments in calls:
        module, _, function = name.partition(":")
        kernel = getattr(import_module(f"pentapod.{module}"), function)
        assert kernel.py_func.__code__.co_argcount == len(arguments)
        for argument in arguments:
            types_of(argument)


def test_every_kernel_that_python_imports_is_in_the_list():
    sources = SIGNATURES.parents[1]
    listed = json.loads(SIGNATURES.read_text(encoding="utf-8"))
    missing = set()
    for file in sources.rglob("*.py"):
        if file.stem.endswith("_kernels"):
            continue
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").endswith("_kernels"):
                module = import_module(node.module)
                kernels = {f"{node.module}:{a.name}" for a in node.names if hasattr(getattr(module, a.name), "py_func")}
                missing |= {name.removeprefix("pentapod.") for name in kernels} - set(listed)
    assert not missing, "make kernels writes the list"


@pytest.mark.slow
def test_what_is_warm_is_not_compiled_again(tmp_path):
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}

    def said(code: str) -> tuple[str, str]:
        found = subprocess.run(
            [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
        )
        return found.stdout.strip(), found.stderr

    assert said(RUN)[0] == "1 1"
    assert said(RUN)[0] == "1 0"
    assert "compiling" not in said(USE)[1]


def test_the_command_says_how_many(monkeypatch, capsys):
    from pentapod.cli.main import run

    few = [call for call in signatures() if call[0] == "timing.jerk.spline_kernels:solve_banded"]
    monkeypatch.setattr(warm_up, "signatures", lambda: few)
    assert run(["warm-up", "-j", "1"]) == 0
    said = r"1 kernels are ready, in 1 forms for the types of their arguments; [01] forms compiled now, \d+ s\n"
    assert re.match(said, capsys.readouterr().out)
    assert run(["warm-up", "-j", "0"]) == 2
    assert compile_all(few)[0] == 1


def test_where_nothing_can_be_kept_is_an_error(monkeypatch):
    monkeypatch.setattr(warm_up, "kernel_cache", lambda given: None)
    with pytest.raises(InputError, match="cannot be kept"):
        warm_up.warm_up(1)
