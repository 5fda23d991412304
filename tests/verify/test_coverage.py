"""What a program must machine: the region of each strategy."""

from __future__ import annotations

import numpy as np
import pytest

from pentapod.mesh.mesh import Mesh
from pentapod.mesh.patch import Patch
from pentapod.mesh.region import Region
from pentapod.toolpath import BallCutter, FlatEnd, RasterOptions, StandOff, WaterlineOptions
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


def test_a_program_need_not_machine_a_part_of_a_facet_that_is_too_steep():
    """Six rings of facets, up to 46 deg: the ball rolls over the fifth one, of 37 deg, as it is, not up to 35 deg."""
    vertices, faces = cap(30.0, 50.0, 6)()
    part, up = Mesh.of(1e-3 * vertices, faces), np.array([0.0, 0.0, 1.0])
    options = RasterOptions(stepover=2e-3, region=Region(angle=np.radians(35.0)))
    region = Coverage.of(part, BallCutter(3e-3), options, path_tolerance=20e-6).region
    slopes = np.degrees(np.arccos(part.facet_normals @ up))
    own = slopes <= 35.0
    assert 35.0 < slopes[~own].min() < 38.0
    # All of the facets of the rings inside, but where smooth normals lean beyond the angle: at most half of the last.
    assert np.degrees(np.arccos(region.facet_normals @ up)).max() <= 35.0
    whole, last = part.facet_areas[own].sum(), part.facet_areas[own & (slopes > slopes[own].max() - 1.0)].sum()
    assert whole - 0.5 * last < region.areas.sum() <= whole
    # By smooth normals alone it would be more.
    smooth = Patch.of(part, options.region).areas.sum()
    assert smooth > 1.05 * region.areas.sum()
    # What draws on the part itself goes by these, and all of it is asked for.
    for tool in (FlatEnd(3e-3), StandOff(2e-3)):
        whole = Coverage.of(part, tool, options, path_tolerance=20e-6).region
        assert whole.areas.sum() == pytest.approx(smooth, rel=1e-12)


def rough(spacing):
    """A level scan with noise: facets lean by up to 38 deg, the smooth normals at their corners by less than 28."""
    line = spacing * np.arange(25.0)
    x, y = (axis.ravel() for axis in np.meshgrid(line, line, indexing="ij"))
    z = 0.3 * spacing * np.random.default_rng(0).uniform(-1.0, 1.0, len(x))
    rows = np.arange(len(x)).reshape(25, 25)
    a, b, c, d = (each.ravel() for each in (rows[:-1, :-1], rows[1:, :-1], rows[1:, 1:], rows[:-1, 1:]))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return Mesh.of(np.stack([x, y, z], axis=1), faces, crease_angle=np.pi)


def covered_of(part):
    """What a ball of 6 mm must machine up to 30 deg, which facets are steeper, and which have only corners inside."""
    region = Region(angle=np.radians(30.0))
    covered = Coverage.of(part, BallCutter(3e-3), RasterOptions(stepover=2e-3, region=region), path_tolerance=20e-6)
    steep = part.facet_normals[:, 2] < np.cos(np.radians(30.0))
    inside = part.corner_normals[..., 2] >= np.cos(np.radians(30.0)) * np.linalg.norm(part.corner_normals, axis=2)
    assert (steep & inside.all(axis=1)).sum() > 20
    return covered.region, steep, inside.all(axis=1)


def test_steep_facets_amid_others_must_be_machined():
    part = rough(1e-3)
    region, _, inside = covered_of(part)
    assert region.areas.sum() >= part.facet_areas[inside].sum() * (1.0 - 1e-9)


def test_large_steep_facets_are_no_noise():
    """Facets of 5 mm are not covered by a ball of 6 mm that rolls beside them."""
    part = rough(5e-3)
    region, steep, _ = covered_of(part)
    assert np.degrees(np.arccos(region.facet_normals[:, 2])).max() <= 30.0 + 1e-6
    assert 0.5 * part.facet_areas[~steep].sum() < region.areas.sum() <= part.facet_areas[~steep].sum()
