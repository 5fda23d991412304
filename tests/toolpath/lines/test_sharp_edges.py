"""Creases that passes leave out: which stretches are followed."""

import numpy as np
import pytest
import trimesh

from pentapod import Mesh, Region
from pentapod.mesh.passes import Passes
from pentapod.toolpath.lines.sharp_edges import crease_lines, uncrossed
from pentapod.toolpath.surfaces.drive_surface import DriveSurface

R, STEPOVER = 3e-3, 4e-3
RIDGE = R - np.sqrt(R**2 - (0.5 * STEPOVER) ** 2)


def passes(*lines):
    return Passes.of([(points, np.tile([0.0, 0.0, 1.0], (len(points), 1))) for points in map(np.asarray, lines)])


def straight(first, last, count=200):
    return np.linspace(first, last, count)


def crossing(*places):
    """Passes along y that cross the x axis."""
    return passes(*(straight([x, -0.01, 0.0], [x, 0.01, 0.0], 201) for x in places))


def lengths(creases, crossed_by):
    return np.round(1e3 * uncrossed(creases, crossed_by, STEPOVER, R).lengths, 1).tolist()


@pytest.mark.parametrize("turn", [0.0, 0.3, 0.7, 0.785, 1.0])
@pytest.mark.parametrize("lean", [0.0, 0.3])
def test_the_crease_at_the_foot_of_a_wall_is_one_line_however_the_wall_stands(turn, lean):
    """A wall on a plate: the ball's centre is R from both, along the whole of it."""
    blocks = [
        trimesh.creation.box(bounds=b) for b in ([[0, 0, 0], [0.03, 0.02, 4e-3]], [[0, 0, 0], [5e-3, 0.02, 0.02]])
    ]
    up = np.array([np.sin(lean) * np.cos(1.1), np.sin(lean) * np.sin(1.1), np.cos(lean)])
    turned = trimesh.geometry.align_vectors([0.0, 0.0, 1.0], up)
    turned = turned @ trimesh.transformations.rotation_matrix(turn, [0.0, 0.0, 1.0])
    part = trimesh.util.concatenate(blocks)
    part.apply_transform(turned)
    surface = DriveSurface.of(Mesh.of(part.vertices, part.faces), R, up)
    lines = crease_lines(surface.patch(Region(direction=up, angle=np.radians(90.0))))
    points = lines.points[lines.rows(int(lines.lengths.argmax()))] @ turned[:3, :3]
    straight = np.abs(points[:, 1] - 0.01) < 0.01
    assert np.ptp(points[:, 1]) > 0.02 - 1.5e-3
    np.testing.assert_allclose(points[straight][:, [0, 2]] - [5e-3 + R, 4e-3 + R], 0.0, atol=0.05e-3)
    assert (np.diff(points[straight, 1]) > 0).all() or (np.diff(points[straight, 1]) < 0).all()


def test_a_crease_is_followed_between_crossings_more_than_a_stepover_apart():
    crease = passes(straight([0.0, 0.0, 0.0], [0.03, 0.0, 0.0]))
    (length,) = lengths(crease, crossing(0.0, 0.004, 0.016, 0.02, 0.024, 0.028, 0.03))
    assert 11.0 < length <= 12.1


def test_beyond_the_last_crossing_half_a_stepover_counts():
    crease = passes(straight([0.0, 0.0, 0.0], [0.0155, 0.0, 0.0]))
    assert len(lengths(crease, crossing(0.0, 0.004, 0.008, 0.012))) == 1
    assert not lengths(crease, crossing(0.0, 0.004, 0.008, 0.012, 0.0145))


def test_the_foot_of_a_narrow_pit_is_followed_where_passes_stay_above_it():
    """A loop 3.5 mm long: shorter than a stepover, but without any pass in it."""
    turn = np.linspace(0.0, 2.0 * np.pi, 60)
    foot = 0.55e-3 * np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    foot[-1] = foot[0]
    for above, kept in ((2e-3, 1), (0.5 * RIDGE, 0)):
        assert len(lengths(passes(foot), passes(foot + np.array([0.0, 0.0, above])))) == kept


def test_a_short_open_crease_is_noise_unless_passes_leave_much_under_it():
    """Passes half a stepover beside it leave no more than their ridge there; those far above leave all of the rest."""
    crease = passes(straight([0.0, 0.0, 0.0], [0.002, 0.0, 0.0]))
    beside = [straight([-0.01, y, 0.0], [0.01, y, 0.0]) for y in (-0.5 * STEPOVER, 0.5 * STEPOVER)]
    assert not lengths(crease, passes(*beside))
    assert lengths(crease, passes(*(line + np.array([0.0, 0.0, 0.5 * R]) for line in beside))) == [2.0]
