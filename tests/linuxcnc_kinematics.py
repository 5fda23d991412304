"""The real pentakins of LinuxCNC, called in a process of its own: legs of poses, and poses of legs.

Needs the Debian package linuxcnc-uspace, or only its files: PENTAPOD_LINUXCNC names the folder that they were
unpacked into (`dpkg -x`), "/" when it is not set.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = os.environ.get("PENTAPOD_LINUXCNC", "/")
MODULE = Path(ROOT) / "usr/lib/linuxcnc/modules/pentakins.so"
HAL = Path(ROOT) / "usr/lib/liblinuxcnchal.so.0"

called = pytest.mark.skipif(not MODULE.exists(), reason="there are no files of LinuxCNC")

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
