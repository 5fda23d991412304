"""The real pentakins of LinuxCNC, called in this process: the same machine, rings and all.

Needs the Debian package linuxcnc-uspace, or only its files: PENTAPOD_LINUXCNC names the folder that they were
unpacked into (`dpkg -x`), "/" where it is installed. Skipped without.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from pentapod.kinematics import AsBuiltPentapod, LinearPentapod, as_built_pose

ROOT = os.environ.get("PENTAPOD_LINUXCNC", "")
MODULE = Path(ROOT) / "usr/lib/linuxcnc/modules/pentakins.so"
HAL = Path(ROOT) / "usr/lib/liblinuxcnchal.so.0"

pytestmark = pytest.mark.skipif(not (ROOT and MODULE.exists()), reason="PENTAPOD_LINUXCNC names no LinuxCNC")

# Runs by itself: HAL keeps shared memory, and would keep it as long as the tests run. Millimetres and degrees.
CALLER = """
import ctypes as C, json, sys

class Vector(C.Structure):
    _fields_ = [(name, C.c_double) for name in "xyz"]

class Pose(C.Structure):
    _fields_ = [("tran", Vector)] + [(name, C.c_double) for name in "abcuvw"]

job = json.load(sys.stdin)
hal = C.CDLL(job["hal"], mode=C.RTLD_GLOBAL)
kins = C.CDLL(job["module"])
assert kins.rtapi_app_main() == 0
try:
    setter = hal.hal_param_float_set
    setter.argtypes = [C.c_char_p, C.c_double]
    for k, (base, z, r) in enumerate(zip(job["base"], job["z"], job["r"])):
        names = ("base.%d.x", "base.%d.y", "base.%d.z", "effector.%d.z", "effector.%d.r")
        for name, value in zip(names, (*base, z, r)):
            assert setter(("pentakins." + name % k).encode(), value) == 0
    flags, legs = C.c_ulong(0), (C.c_double * 16)()
    inverse, forward = [], []
    for x, y, z, a, b in job["poses"]:
        pose = Pose(Vector(x, y, z), a, b)
        assert kins.kinematicsInverse(C.byref(pose), legs, C.byref(flags), C.byref(flags)) == 0
        inverse.append(legs[:5])
        near = Pose(Vector(x + 0.5, y - 0.4, z + 0.3), a + 0.2, b - 0.1)
        code = kins.kinematicsForward(legs, C.byref(near), C.byref(flags), C.byref(flags))
        forward.append([code, near.tran.x, near.tran.y, near.tran.z, near.a, near.b])
    json.dump({"inverse": inverse, "forward": forward}, sys.stdout)
finally:
    kins.rtapi_app_exit()
"""


NOMINAL = LinearPentapod.quadratic(
    0.2 * np.array([(-2.0, 1.0), (-1.0, -2.0), (0.0, 0.0), (1.0, -2.0), (2.0, 2.0)]), 0.5
)


def asked(machine, p, tilts, tmp_path):
    """What pentakins makes of poses: p (n, 3) metres, A and B (n, 2) degrees. Legs (n, 5), error codes, and poses."""
    job = {
        "hal": str(HAL),
        "module": str(MODULE),
        "base": (machine.base * 1e3).tolist(),
        "z": (machine.offsets * 1e3).tolist(),
        "r": (machine.radii * 1e3).tolist(),
        "poses": np.c_[p * 1e3, tilts].tolist(),
    }
    environment = os.environ | {
        "HOME": str(tmp_path),
        "RTAPI_UID": "65534",
        "RTAPI_FIFO_PATH": str(tmp_path / "fifo"),
        "LD_LIBRARY_PATH": str(HAL.parent),
    }
    run = subprocess.run(
        [sys.executable, "-c", CALLER],
        input=json.dumps(job),
        env=environment,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    answer = json.loads(run.stdout[run.stdout.index("{") :])
    forward = np.array(answer["forward"])
    assert (forward[:, 0] == 0).all()
    return np.array(answer["inverse"]) * 1e-3, forward[:, 1:4] * 1e-3, pointing(forward[:, 4:])


def pointing(tilts):
    """The directions (n, 3) of A and B (n, 2) degrees."""
    a, b = np.radians(tilts).T
    return np.c_[np.cos(a) * np.sin(b), -np.sin(a), np.cos(a) * np.cos(b)]


def poses(rng, n):
    return rng.uniform((-0.2, -0.2, 0.4), (0.2, 0.2, 0.8), (n, 3)), rng.uniform(-25.0, 25.0, (n, 2))


def test_pentakins_agrees(tmp_path):
    rng = np.random.default_rng(0)
    machine = AsBuiltPentapod.of(
        NOMINAL,
        base_errors=rng.normal(size=(5, 3)) * 1e-3,
        offset_errors=rng.normal(size=5) * 1e-3,
        radii=[0.0, 0.002, 0.005, 0.001, 0.008],
    )
    p, tilts = poses(rng, 500)
    theirs, position, direction = asked(machine, p, tilts, tmp_path)
    legs = machine.leg_lengths(p, pointing(tilts))
    assert np.abs(legs - theirs).max() < 2e-15
    found = as_built_pose(machine, NOMINAL, legs, (1, 1))
    assert found.proven.mean() > 0.99
    sure = found.proven
    assert np.abs(found.position - position)[sure].max() < 1e-9
    assert np.abs(found.direction - direction)[sure].max() < 1e-9


def test_pentakins_agrees_with_the_closed_form(tmp_path):
    """On the linear pentapod itself, all rings of radius 0: legs, and Newton's poses against the closed form."""
    p, tilts = poses(np.random.default_rng(1), 500)
    theirs, position, direction = asked(AsBuiltPentapod.of(NOMINAL), p, tilts, tmp_path)
    assert np.abs(NOMINAL.leg_lengths(p, pointing(tilts)) - theirs).max() < 1e-9
    ours = NOMINAL.pose(theirs, (1, 1))
    assert np.abs(ours[0] - position).max() < 1e-9
    assert np.abs(ours[1] - direction).max() < 1e-9
