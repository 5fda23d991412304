"""What lies far in the shade is left out of the patch on which lines are laid."""

import numpy as np
import pytest
import trimesh

from pentapod.mesh.mesh import Mesh
from pentapod.mesh.patch import Patch
from pentapod.mesh.region import Region
from pentapod.toolpath.surfaces import drive_surface
from pentapod.toolpath.surfaces.drive_surface import DriveSurface
from pentapod.toolpath.surfaces.shade import out_of_the_shade

UP = np.array([0.0, 0.0, 1.0])
RADIUS = 2e-3


def middles(patch):
    return patch.vertices[patch.faces].mean(axis=1)


@pytest.fixture(scope="module")
def table():
    """A plate on a post, on a floor: the floor under the plate cannot be machined from above."""
    floor = trimesh.creation.box((0.06, 0.06, 0.004))
    post = trimesh.creation.cylinder(0.004, 0.03, sections=48)
    plate = trimesh.creation.box((0.036, 0.036, 0.004))
    floor.apply_translation([0.0, 0.0, -0.002])
    post.apply_translation([0.0, 0.0, 0.0149])
    plate.apply_translation([0.0, 0.0, 0.0318])
    whole = trimesh.util.concatenate([floor, post, plate])
    return Mesh.of(whole.vertices, whole.faces)


def test_facets_far_from_all_that_can_be_machined_are_left_out():
    patch = Patch.whole(Mesh.of(*flat(40, 1e-3)))
    x = middles(patch)[:, 0]
    hidden = x > 0.0102
    kept = out_of_the_shade(patch, hidden, 3e-3)
    assert middles(kept)[:, 0].min() == x.min()
    assert 0.0102 + 3e-3 - 1e-3 < middles(kept)[:, 0].max() < 0.0102 + 6e-3
    assert out_of_the_shade(patch, np.zeros_like(hidden), 3e-3) is patch
    assert out_of_the_shade(patch, np.arange(len(x)) % 7 == 0, 3e-3) is patch
    assert out_of_the_shade(patch, np.ones_like(hidden), 3e-3) is patch


def test_a_large_part_and_a_small_ball_need_no_grid():
    vertices, faces = flat(40, 1e-3)
    patch = Patch.whole(Mesh.of(1e3 * vertices + [0.0, 0.0, 1e4], faces))
    hidden = middles(patch)[:, 0] > 20.5
    assert 0 < len(out_of_the_shade(patch, hidden, 1e-2).faces) == (~hidden).sum()


def flat(count, step):
    x, y = np.meshgrid(np.arange(count + 1) * step, np.arange(count + 1) * step, indexing="ij")
    k = np.arange(count * (count + 1)).reshape(count, count + 1)[:, :-1].ravel()
    a, b = np.stack([k, k + count + 1, k + count + 2], 1), np.stack([k, k + count + 2, k + 1], 1)
    return np.stack([x.ravel(), y.ravel(), 0.0 * x.ravel()], 1), np.concatenate([a, b])


def test_the_floor_under_a_plate_is_no_part_of_the_patch(table, monkeypatch):
    region = Region(direction=UP, angle=np.radians(90.0))
    patch = DriveSurface.of(table, RADIUS, UP).patch(region)
    monkeypatch.setattr(drive_surface, "out_of_the_shade", lambda patch, *_: patch)
    surface = DriveSurface.of(table, RADIUS, UP)
    whole = surface.patch(region)
    under = np.abs(middles(whole)[:, :2]).max(axis=1) < 0.012
    deep = middles(whole)[:, 2] < 0.01
    assert (under & deep).sum() > 100
    here = np.abs(middles(patch)[:, :2]).max(axis=1) < 0.012
    assert not (here & (middles(patch)[:, 2] < 0.01)).any()
    # All that can be machined is there as it was.
    seen = ~surface.hides(middles(whole), 0.5 * RADIUS)
    both = {tuple(each) for each in np.round(middles(patch), 9)}
    assert seen.sum() > 1000
    assert all(tuple(each) in both for each in np.round(middles(whole)[seen], 9))
