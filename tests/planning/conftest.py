"""Tasks that the planner's tests share: small, quick, and on the shipped machine."""

import numpy as np
import pytest

from pentapod.machine.machine import Machine
from pentapod.planning import PlacedPath, plan
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath


def dome(size: float, slope_deg: float, waypoints: int = 400, pivot: float = 0.003) -> Toolpath:
    """A zigzag over a spherical cap `size` metres wide with slopes to slope_deg at its rim."""
    half = 0.5 * size
    rows = max(6, int(np.sqrt(waypoints) / 2))
    passes = []
    for k, y in enumerate(np.linspace(-0.97 * half, 0.97 * half, rows)):
        width = np.sqrt(half * half - y * y)
        x = np.linspace(-width, width, waypoints // rows)
        passes.append(np.stack([x if k % 2 == 0 else x[::-1], np.full_like(x, y)], axis=1))
    xy = np.concatenate(passes)
    radius = half / np.sin(np.radians(slope_deg))
    z = np.sqrt(radius**2 - (xy**2).sum(axis=1))
    return Toolpath(
        (Segment(SegmentKind.CUT, np.c_[xy, z - radius], np.c_[xy, z] / radius, 0.02),),
        pivot,
    )


@pytest.fixture(scope="session")
def desk() -> Machine:
    return Machine.load("desk")


@pytest.fixture(scope="session")
def cap() -> Toolpath:
    return dome(0.12, 35.0)


@pytest.fixture(scope="session")
def wide() -> Toolpath:
    """Too wide for the desk machine."""
    return dome(0.5, 30.0)


@pytest.fixture(scope="session")
def cap_placed(desk: Machine, cap: Toolpath) -> PlacedPath:
    """The cap where it is best, with axes that may lean by 15 degrees."""
    answer = plan(cap, desk, tilt=np.radians(15.0))
    assert isinstance(answer, PlacedPath), str(answer)
    return answer
