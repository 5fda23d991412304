"""Regions: upright walls, shares of the surface, and why a region is empty."""

from __future__ import annotations

import re

import numpy as np
import pytest
import trimesh

from pentapod.mesh import Mesh, Region
from pentapod.mesh.patch import Patch
from pentapod.mesh.region_share import RegionShare, why_empty


def box(*sides):
    shape = trimesh.creation.box(sides)
    return Mesh.of(shape.vertices, shape.faces)


def walls():
    shape = trimesh.creation.cylinder(0.02, 0.01, sections=64)
    return Mesh.of(shape.vertices, shape.faces[np.abs(shape.face_normals[:, 2]) < 0.5])


@pytest.mark.parametrize("by", [0.0, 1e-9, 1e-4])
def test_a_region_of_90_degrees_holds_upright_walls(by):
    part = box(0.04, 0.03, 0.02)
    turned = trimesh.transformations.rotation_matrix(by, [1, 2, 0])[:3, :3]
    part = Mesh.of(part.vertices @ turned.T, part.faces)
    assert Patch.of(part, Region(angle=np.pi / 2)).areas.sum() == pytest.approx(12e-4 + 2 * 14e-4)
    assert Patch.of(part, Region(angle=np.radians(89.0))).areas.sum() == pytest.approx(12e-4)
    assert Patch.of(part, Region(angle=np.pi)).areas.sum() == pytest.approx(part.facet_areas.sum())


def test_shares_of_a_box():
    part = box(0.04, 0.03, 0.02)
    found = RegionShare.of(part, Region(angle=np.radians(80.0)))
    assert (found.facing, found.boxed, found.inside) == pytest.approx((40 / 52, 40 / 52, 12 / 52))
    assert found.flattest == pytest.approx(0.0)
    assert sorted(found.widths) == pytest.approx([0.03, 0.04])
    half = Region(box=((-1, -1, -1), (0, 1, 1)), angle=np.pi / 2)
    found = RegionShare.of(part, half)
    assert (found.boxed, found.inside) == pytest.approx(((6 + 8 + 6) / 52, (6 + 8 + 6) / 52))
    assert sorted(found.widths) == pytest.approx([0.02, 0.03])
    assert RegionShare.of(part, Region(angle=np.pi / 2)).inside == pytest.approx(40 / 52)
    side = RegionShare.of(part, Region(direction=(1.0, 0.0, 0.0), angle=np.radians(80.0)))
    assert side.inside == pytest.approx(6 / 52)


@pytest.mark.parametrize(
    ("part", "region", "why"),
    [
        (walls(), Region(), "its flattest place is 90° from the direction, and region_angle_deg is 80"),
        (walls().flipped(), Region(), "and region_angle_deg is 80"),
        (box(1, 1, 1), Region(box=((2, 2, 2), (3, 3, 3))), "holds nothing of the part, which spans -500..500 x"),
        (box(1, 1, 1), Region(box=((-1, -1, -1), (1, 1, -0.4)), angle=1.0), "and region_angle_deg is 57.3"),
        (box(1, 1, 1), Region(box=((-0.4, -0.4, -1), (0.4, 0.4, 0))), "in the box faces away from the direction"),
    ],
)
def test_an_empty_region_is_told_why(part, region, why):
    assert re.search(why, why_empty(part, region))


def test_backs_are_turned_by_flip_and_an_inverted_solid_by_repair():
    up = Mesh.of([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    assert "100 % of the surface faces away from the direction" in why_empty(up.flipped(), Region())
    assert "inside out" in why_empty(box(1, 1, 1).flipped(), Region())
    below = Region(box=((-0.4, -0.4, -1), (0.4, 0.4, 0)), angle=np.pi)
    assert "hidden from the direction by the part above" in why_empty(box(1, 1, 1), below)
