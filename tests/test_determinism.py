"""The same job gives the same files, bit for bit, on one machine, however many cores it uses, and linear algebra."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.metadata import version

import pytest

from pentapod.base.version import processor_kind
from pentapod.program import read_csv

VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
COMMAND = [sys.executable, "-c", "from pentapod.cli.main import main; main()", "plan"]


FREE = '[placement]\nthen = "force"\n'


@pytest.mark.parametrize(
    ("passes", "placement"),
    [
        pytest.param("stepover_mm = 30\nspacing_mm = 8", None, id="fixed"),
        pytest.param("stepover_mm = 9\nspacing_mm = 4", FREE, id="free", marks=pytest.mark.slow),
    ],
)
def test_one_core_or_two(make_job, tmp_path, passes, placement):
    path = make_job(("tilt_deg = 0", "tilt_deg = 10"), ("stepover_mm = 15\nspacing_mm = 4", passes))
    if placement is not None:
        path.write_text(path.read_text().split("[placement]")[0] + placement)
    files: list[dict[str, bytes]] = []
    for threads in ("1", "2"):
        out = tmp_path / threads
        environment = os.environ | dict.fromkeys(VARIABLES, threads)
        subprocess.run([*COMMAND, str(path), "-o", str(out), "--quiet", "-j", threads], env=environment, check=True)
        files.append(
            {name: (out / name).read_bytes() for name in ("program.csv", "plan.npz", "verdict.json", "report.html")}
        )
    for name, content in files[0].items():
        assert content == files[1][name], name
    source = read_csv(tmp_path / "1" / "program.csv").provenance
    assert source.processor == processor_kind() != ""
    for name in ("numpy", "scipy", "casadi", "numba"):
        assert f"{name} {version(name)}" in source.libraries.split(", ")
