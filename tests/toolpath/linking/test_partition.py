"""Pieces of a toolpath: the cuts are those of the whole, and each piece comes to the work and leaves it."""

import numpy as np
import pytest

from pentapod.base.errors import ToolpathError
from pentapod.toolpath.linking.links import LinkStyle
from pentapod.toolpath.linking.partition import Piece, part_of, pass_ends
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath

UP = np.array([0.0, 0.0, 1.0])
STYLE = LinkStyle(UP, level=0.04, approach=0.004, spacing=0.001, feed=0.03)
INF = np.inf


def segment(kind: SegmentKind, *tips: tuple[float, float, float], power: float = 1.0) -> Segment:
    axes = np.tile(UP, (len(tips), 1))
    return Segment(kind, np.array(tips) * 0.01, axes, np.inf if kind == "rapid" else 0.02, power)


@pytest.fixture
def path() -> Toolpath:
    """Approach, two passes joined on the surface, a way over the part, a third pass, retract."""
    cut, link, rapid = SegmentKind.CUT, SegmentKind.LINK, SegmentKind.RAPID
    return Toolpath((
        segment(link, (0, 0, 1), (0, 0, 0)),
        segment(cut, (0, 0, 0), (1, 0, 0), (2, 0, 0), power=0.5),
        segment(link, (2, 0, 0), (2, 1, 0)),
        segment(cut, (2, 1, 0), (1, 1, 0), (0, 1, 0)),
        segment(link, (0, 1, 0), (0, 1, 1)),
        segment(rapid, (0, 1, 1), (0, 1, 3), (0, 2, 3), (0, 2, 1)),
        segment(link, (0, 2, 1), (0, 2, 0)),
        segment(cut, (0, 2, 0), (1, 2, 0), (2, 2, 0)),
        segment(link, (2, 2, 0), (2, 2, 1)),
    ), tilt_centre=0.003)  # fmt: skip


def cut_chords(path: Toolpath) -> list[tuple]:
    """Every chord that is cut, as numbers, with its power."""
    return [
        (*a, *b, s.power)
        for s in path.segments
        if s.kind is SegmentKind.CUT
        for a, b in zip(s.tips[:-1].tolist(), s.tips[1:].tolist(), strict=True)
    ]


def test_pass_ends_are_the_ends_of_cuts(path):
    np.testing.assert_allclose(path.tips[pass_ends(path)], [[0.02, 0, 0], [0, 0.01, 0], [0.02, 0.02, 0]])


@pytest.mark.parametrize("at", [2, 3, 5, 6, 11, 12])
def test_two_consecutive_pieces_make_the_cuts_of_the_whole(path, at):
    parts = [part_of(path, Piece(*ends), STYLE) for ends in ((0, at), (at, len(path) - 1))]
    assert cut_chords(parts[0]) + cut_chords(parts[1]) == cut_chords(path)
    first, second = parts
    assert first.tilt_centre == second.tilt_centre == path.tilt_centre
    # The way up from the first and down to the second: along the axis on feed, then to the clearance level.
    up, away = first.segments[-2:]
    assert (up.kind, away.kind, up.feed) == ("link", "rapid", 0.03)
    np.testing.assert_allclose(up.tips[-1] - up.tips[0], 0.004 * UP, atol=1e-12)
    assert away.tips[-1][2] == pytest.approx(0.04)
    here, down = second.segments[:2]
    assert (here.kind, down.kind) == ("rapid", "link")
    assert here.tips[0][2] == pytest.approx(0.04)
    np.testing.assert_allclose(down.tips[0] - down.tips[-1], 0.004 * UP, atol=1e-12)
    # At its own ends each does what the whole does.
    np.testing.assert_array_equal(first.tips[0], path.tips[0])
    np.testing.assert_array_equal(second.tips[-1], path.tips[-1])


@pytest.mark.parametrize("x", [0.001, 0.01, 0.012])
def test_two_boxed_pieces_make_the_cuts_of_the_whole(path, x):
    left, right = (Piece(0, len(path) - 1, high=(x, INF, INF)), Piece(0, len(path) - 1, low=(x, -INF, -INF)))
    if x < 0.005:  # all middles are to its right
        with pytest.raises(ToolpathError, match="no cut in this piece"):
            part_of(path, left, STYLE)
        assert cut_chords(part_of(path, right, STYLE)) == cut_chords(path)
        return
    parts = [part_of(path, piece, STYLE) for piece in (left, right)]
    assert sorted(cut_chords(parts[0]) + cut_chords(parts[1])) == sorted(cut_chords(path))
    assert len(cut_chords(parts[0])) == len(cut_chords(parts[1])) == 3
    # Right: the link on the surface is kept, for nothing lies between. Left: over the clearance level each time.
    kinds = ["".join(s.kind[0] for s in part.segments) for part in parts]
    assert kinds == ["lclrlclrlclr", "rlclclrlcl"]
    assert all(part.tips[:, 2].max() == pytest.approx(0.04) for part in parts)


def test_piece_of_all_waypoints_is_the_whole(path):
    whole = part_of(path, Piece(0, len(path) - 1), STYLE)
    np.testing.assert_array_equal(whole.tips, path.tips)
    assert [s.kind for s in whole.segments] == [s.kind for s in path.segments]


def test_impossible_pieces_are_errors(path):
    for first, last in ((3, 3), (-1, 4), (4, 2)):
        with pytest.raises(ToolpathError, match="no such piece"):
            Piece(first, last)
    with pytest.raises(ToolpathError, match="no such piece"):
        Piece(0, 5, low=(0.0, 0.0, 0.0), high=(1.0, 0.0, 1.0))
    with pytest.raises(ToolpathError, match="no cut"):
        part_of(path, Piece(6, 10), STYLE)


def test_str_of_pieces():
    assert str(Piece(3, 17)) == "waypoints 3 to 17"
    box = Piece(0, 9, (-INF, 0.01, 0.5e-3), (0.02, 0.03, INF))
    assert str(box) == "x up to 20 mm, y 10 to 30 mm, z from 0.5 mm"
