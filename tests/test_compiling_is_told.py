"""The first run on a machine compiles its kernels, and says so; later runs do not compile."""

import os
import subprocess
import sys

import pytest

from pentapod.compiled import kernels_available

RUN = """
import logging
logging.basicConfig(level=logging.INFO, format="%(message)s")
import numpy as np
from pentapod.timing.spline_kernels import solve_banded
solve_banded(np.ones((4, 4)), 4, np.ones(4))
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
