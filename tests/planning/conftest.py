"""Tasks that the planner's tests share: small, quick, and on the shipped machine."""

import numpy as np
import pytest
from domes import dome

from pentapod.machine.machine import Machine
from pentapod.planning import PlacedPath, plan
from pentapod.toolpath.toolpath import Toolpath


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
