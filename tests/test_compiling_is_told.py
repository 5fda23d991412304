"""The first run on a machine compiles its kernels, and says so; later runs do not compile."""

import os
import shutil
import subprocess
import sys

import pytest

from pentapod import compiled
from pentapod.compiled import kernels_available

RUN = """
import logging
logging.basicConfig(level=logging.INFO, format="%(message)s")
import numpy as np
from pentapod.timing.spline_kernels import solve_banded
solve_banded(np.ones((4, 4)), 4, np.ones(4))
"""

KERNEL = """
from pentapod.compiled import kernel
{imports}

@kernel
def {name}(x: float) -> float:
    return {value}
"""


@pytest.mark.skipif(not kernels_available(), reason="no kernels without numba")
def test_the_first_run_says_that_it_compiles_and_the_second_does_not(tmp_path):
    surroundings = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    said = [
        subprocess.run([sys.executable, "-c", RUN], env=surroundings, capture_output=True, text=True, check=True).stderr
        for _ in range(2)
    ]
    assert said[0].count("compiling") == 1
    assert said[1] == ""


@pytest.mark.skipif(not kernels_available(), reason="no kernels without numba")
def test_kernels_are_compiled_anew_when_those_they_call_have_changed(tmp_path):
    """Also where an upgrade leaves the older version's cache in place."""
    package = tmp_path / "pentapod"
    package.mkdir()
    (package / "__init__.py").touch()
    shutil.copy(compiled.__file__, package)
    outer = KERNEL.format(imports="from pentapod.inner_kernels import inner", name="outer", value="2.0 * inner(x)")
    (package / "outer_kernels.py").write_text(outer, encoding="utf-8")
    run = [sys.executable, "-c", "from pentapod.outer_kernels import outer; print(outer(1.0))"]
    for step, answer in ((1.0, "4.0"), (2.0, "6.0")):
        inner = KERNEL.format(imports="", name="inner", value=f"x + {step}")
        (package / "inner_kernels.py").write_text(inner, encoding="utf-8")
        told = subprocess.run(run, cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(tmp_path)}, capture_output=True,
                              text=True, check=True)  # fmt: skip
        assert told.stdout.strip() == answer
