"""What a program must machine: the region of each strategy."""

from __future__ import annotations

import numpy as np
import pytest

from pentapod.mesh.mesh import Mesh
from pentapod.mesh.patch import Patch
from pentapod.toolpath import BallCutter, WaterlineOptions
from pentapod.verify import Coverage
from refused_jobs import cap


def test_waterlines_need_not_machine_a_part_of_a_facet_that_is_too_flat():
    """Three rings of facets, of 8, 25 and 42 deg: the smooth normals of the first one reach 17 deg."""
    vertices, faces = cap(30.0, 50.0, 3)()
    part, up = Mesh.of(1e-3 * vertices, faces), np.array([0.0, 0.0, 1.0])
    options = WaterlineOptions(stepover=2e-3, shallowest=np.radians(10.0))
    region = Coverage.of(part, BallCutter(3e-3), options, path_tolerance=20e-6).region
    slopes = np.degrees(np.arccos(region.facet_normals @ up))
    assert slopes.min() > 20.0
    # All of the other rings: what is steep must be machined.
    steep = np.degrees(np.arccos(part.facet_normals @ up)) > 20.0
    assert region.areas.sum() == pytest.approx(part.facet_areas[steep].sum(), rel=1e-12)
    # By smooth normals alone it would be more.
    assert Patch.whole(part).steeper(up, options.shallowest).areas.sum() > 1.02 * region.areas.sum()
