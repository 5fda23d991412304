"""Looser limits never make a motion slower: the matrix of paths and limits; memory follows durations."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path as File

import numpy as np
import pytest
from limit_matrix import ACCELERATIONS, JERKS, MATRIX
from timing_paths import Path, machine

from pentapod.job import Job, run
from pentapod.timing import Trajectory, certify, retime

pytestmark = pytest.mark.slow

TOOLPATHS = File(__file__).parents[2] / "toolpaths"
RISE = 1e-3


def durations(path, machine_with):
    """The seconds (4, 5) at each jerk and acceleration, of trajectories whose setpoints keep every limit."""
    found = np.empty((len(JERKS), len(ACCELERATIONS)))
    for i, jerk in enumerate(JERKS):
        for k, acceleration in enumerate(ACCELERATIONS):
            m = machine_with(acceleration, jerk)
            trajectory = retime(path, m)
            assert isinstance(trajectory, Trajectory), str(trajectory)
            uses = certify(trajectory, m)
            assert max(use.share for use in uses) < 1.0, (acceleration, jerk, [str(use) for use in uses])
            found[i, k] = trajectory.duration
    return found


def rise(found, axis):
    """The largest rise along an axis as a share of the duration before; one period may be rounding of whole periods."""
    before = found[:-1] if axis == 0 else found[:, :-1]
    return float(((np.diff(found, axis=axis) - 1e-3) / before).max())


@pytest.mark.parametrize("name", MATRIX)
def test_durations_fall_along_both_limits(name):
    def machine_with(acceleration, jerk):
        m = machine(a=acceleration, rapid=1e3, interpolation="cubic")
        m.legs = replace(m.legs, max_jerk=np.full(5, jerk))
        return m

    found = durations(Path((MATRIX[name](),)), machine_with)
    assert max(rise(found, 0), rise(found, 1)) <= RISE, found


MEMORY = """
import re, sys
from dataclasses import replace
from pathlib import Path as File
import numpy as np
from test_retime import nod
from timing_paths import Path, machine
from pentapod.timing import retime

length, acceleration, jerk = map(float, sys.argv[1:])
m = machine(a=acceleration, interpolation="cubic")
m.legs = replace(m.legs, max_jerk=np.full(5, jerk))

def peak():
    # getrusage would tell that of the process that started this one, where it is larger.
    return int(re.search(r"VmHWM:\\s*(\\d+)", File("/proc/self/status").read_text())[1])

retime(Path((nod(0.05, 0.2),)), m)  # kernels and libraries have their place
before = peak()
trajectory = retime(Path((nod(length, 0.2),)), m)
print(trajectory.duration, peak() - before)
"""


@pytest.mark.skipif(not File("/proc/self/status").exists(), reason="the peak memory of a process is read from there")
def test_memory_is_linear_in_the_duration():
    def peak(length):
        command = [sys.executable, "-c", MEMORY, str(length), "20", "400"]
        here = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
        told = subprocess.run(command, capture_output=True, text=True, check=True, env=here)
        return map(float, told.stdout.split())

    (short, little), (long, much) = peak(0.25), peak(1.0)
    assert much <= 1.5 * little * long / short


@pytest.mark.parametrize("name", ["deburr", "flower"])
def test_durations_of_shipped_jobs_fall_along_both_limits(name, tmp_path):
    """One path with short fillets between cuts, one that bends hard right before it comes to rest."""
    outcome = run(Job.load(TOOLPATHS / f"{name}.toml"), tmp_path / "out")
    path, shipped = outcome.find(Trajectory).path, outcome.machine

    def machine_with(acceleration, jerk):
        legs = replace(shipped.legs, max_acceleration=np.full(5, acceleration), max_jerk=np.full(5, jerk))
        return replace(shipped, legs=legs)

    found = durations(path, machine_with)
    rounded = 1e-3 * (len(path.pieces) - 1)  # each piece lasts whole periods
    assert max(rise(found, 0), rise(found, 1)) <= RISE + rounded / found.min(), found
