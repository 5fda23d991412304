"""Compiled kernels on disk: told once, never those of other sources, by one process at a time, and not for ever."""

import os
import shutil
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any, cast

import pytest

from pentapod.numerics import kernel_cache, kernels
from pentapod.numerics.kernels import kernel

RUN = """
import logging
logging.basicConfig(level=logging.INFO, format="%(message)s")
import numpy as np
from pentapod.timing.jerk.spline_kernels import solve_banded
solve_banded(np.ones((4, 4)), 4, np.ones(4))
"""

KERNEL = """
from pentapod.numerics.kernels import kernel
{imports}

@kernel
def {name}(x):
    return {value}
"""

CALL = """
import logging
logging.basicConfig(level=logging.INFO, format="%(message)s")
from pentapod.outer_kernels import outer
print(*(outer(x) for x in ({arguments},)))
"""


class Package:
    """A small package of the same name with the same way to compile, and its cache."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.sources = folder / "pentapod"
        for part in (self.sources, self.sources / "numerics"):
            part.mkdir()
            (part / "__init__.py").touch()
        for module in (kernels, kernel_cache):
            shutil.copy(module.__file__, self.sources / "numerics")
        self.write("outer", "2 * inner(x)", "from pentapod.inner_kernels import inner")
        self.write("inner", "x + 1")

    def write(self, name: str, value: str, imports: str = "") -> None:
        text = KERNEL.format(imports=imports, name=name, value=value)
        (self.sources / f"{name}_kernels.py").write_text(text, encoding="utf-8")

    def start(self, arguments: str, **environment: str) -> subprocess.Popen[str]:
        settings = {k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"}
        paths = {"PYTHONPATH": str(self.folder), "XDG_CACHE_HOME": str(self.folder / "cache"), "HOME": str(self.folder)}
        return subprocess.Popen(
            [sys.executable, "-c", CALL.format(arguments=arguments)],
            cwd=self.folder, env=settings | paths | {"LOCALAPPDATA": str(self.folder)} | environment,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip

    def run(self, arguments: str, **environment: str) -> tuple[str, str]:
        """Return what outer gives for these arguments, and what the log said."""
        process = self.start(arguments, **environment)
        answer, log = process.communicate(timeout=120)
        assert process.returncode == 0, log
        return answer.strip(), log


@pytest.fixture
def package(tmp_path: Path) -> Package:
    return Package(tmp_path)


@pytest.mark.slow
def test_the_first_run_says_that_it_compiles_and_the_second_does_not(tmp_path):
    collision_world = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    said = [
        subprocess.run(
            [sys.executable, "-c", RUN], env=collision_world, capture_output=True, text=True, check=True
        ).stderr
        for _ in range(2)
    ]
    assert said[0].count("compiling") == 1
    assert said[1] == ""
    assert [path.name[:16] for path in tmp_path.iterdir()] == ["pentapod-kernels"]


def test_a_change_of_what_a_kernel_calls_compiles_anew_and_no_stale_cache_is_used(package: Package):
    """Also with dates that go back, as they do where an older version is installed again."""
    for value, answer, compiles in (("x + 1", "4.0", 1), ("x + 2", "6.0", 1), ("x + 1", "4.0", 0), ("x + 3", "8.0", 1)):
        package.write("inner", value)
        os.utime(package.sources / "inner_kernels.py", (1e9, 1e9))
        # Python's own compiled files tell by date and size: who installs takes them away.
        found, log = package.run("1.0", PYTHONDONTWRITEBYTECODE="1")
        assert (found, log.count("compiling")) == (answer, compiles)
    assert not list(package.sources.rglob("*.nb[ci]")), "nothing beside the sources"


@pytest.mark.slow
def test_processes_that_compile_at_once_spoil_nothing(package: Package):
    """Each for other types of the same kernels, so that both write into the same index."""
    started = [package.start(argument) for argument in ("1", "1.5")]
    assert [p.communicate(timeout=120)[0].strip() for p in started] == ["4", "5.0"]
    assert package.run("1, 1.5") == ("4 5.0", ""), "both are kept, each under its own types"


def test_one_at_a_time_and_the_next_when_all_of_it_is_done(tmp_path: Path):
    one, other = (kernel_cache.ProcessLock(tmp_path / "lock") for _ in range(2))
    order = []

    def follow() -> None:
        with other:
            order.append("other")

    thread = threading.Thread(target=follow)
    with one:
        with one:
            thread.start()
            thread.join(0.2)
        thread.join(0.2)
        order.append("one")
    thread.join(10.0)
    assert order == ["one", "other"]


def test_without_a_folder_to_write_kernels_run_all_the_same(package: Package, tmp_path: Path):
    (tmp_path / "file").touch()
    found, log = package.run("1.0", NUMBA_CACHE_DIR=str(tmp_path / "file" / "inside"))
    assert found == "4.0"
    assert log.count("each run compiles them anew; NUMBA_CACHE_DIR names another folder") == 1
    assert not list(package.sources.rglob("*.nb[ci]"))


@pytest.mark.slow
def test_folders_of_other_versions_go_after_a_month_without_use(package: Package, tmp_path: Path):
    cache = tmp_path / "own"
    names = ("pentapod-kernels-old", "pentapod-kernels-young", "somebody-else")
    for name in names:
        (cache / name).mkdir(parents=True)
        (cache / name / "lock").touch()
        if "young" not in name:
            os.utime(cache / name / "lock", (1e9, 1e9))
    package.run("1.0", NUMBA_CACHE_DIR=str(cache))
    left = {path.name for path in cache.iterdir()}
    assert not {"pentapod-kernels-old"} & left
    assert {"pentapod-kernels-young", "somebody-else"} < left
    assert len(left) == 3


@kernel
def _plus(x: int, y: int) -> int:
    return x + y


@kernel
def _sum_with_a_constant(x: int) -> int:
    return _plus(x, 1) + _plus(x, x)


@kernel
def sum_with_a_constant(x: int) -> int:
    return _sum_with_a_constant(x)


def test_a_kernel_is_compiled_once_for_constants_and_variables():
    for each in (sum_with_a_constant, _sum_with_a_constant, _plus):
        cast("Any", each)._cache.flush()  # what an earlier run has compiled is not compiled again
    assert sum_with_a_constant(3) == 10
    assert len(cast("Any", _plus).overloads) == 1
