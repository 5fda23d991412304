"""The folder of real parts."""

from __future__ import annotations

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def parts() -> Path:
    """The folder of real parts."""
    folder = os.environ.get("PENTAPOD_PARTS")
    if not folder:
        pytest.skip("PENTAPOD_PARTS does not name a folder of real meshes")
    return Path(folder)
