"""Parts of a toolpath: the cuts are those of the whole, and each part comes to the work and leaves it."""

import numpy as np
import pytest

from pentapod.errors import ToolpathError
from pentapod.toolpath.parting import Parting, part_of, pass_ends
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath

PARTING = Parting(approach=0.004, feed=0.03)
UP = np.array([0.0, 0.0, 1.0])


def segment(kind: SegmentKind, *tips: tuple[float, float, float]) -> Segment:
    return Segment(kind, np.array(tips) * 0.01, np.tile(UP, (len(tips), 1)), np.inf if kind == "rapid" else 0.02)


@pytest.fixture
def path() -> Toolpath:
    """Approach, two passes joined on the surface, a way over the part, a third pass, retract."""
    cut, link, rapid = SegmentKind.CUT, SegmentKind.LINK, SegmentKind.RAPID
    return Toolpath((
        segment(link, (0, 0, 1), (0, 0, 0)),
        segment(cut, (0, 0, 0), (1, 0, 0), (2, 0, 0)),
        segment(link, (2, 0, 0), (2, 1, 0)),
        segment(cut, (2, 1, 0), (1, 1, 0), (0, 1, 0)),
        segment(link, (0, 1, 0), (0, 1, 1)),
        segment(rapid, (0, 1, 1), (0, 1, 3), (0, 2, 3), (0, 2, 1)),
        segment(link, (0, 2, 1), (0, 2, 0)),
        segment(cut, (0, 2, 0), (1, 2, 0), (2, 2, 0)),
        segment(link, (2, 2, 0), (2, 2, 1)),
    ))  # fmt: skip


def cut_chords(path: Toolpath) -> list[tuple]:
    """Every chord that is cut, as numbers."""
    return [
        (*a, *b)
        for s in path.segments
        if s.kind is SegmentKind.CUT
        for a, b in zip(s.tips[:-1].tolist(), s.tips[1:].tolist(), strict=True)
    ]


def test_passes_end_where_cutting_does(path):
    np.testing.assert_allclose(path.tips[pass_ends(path)], [[0.02, 0, 0], [0, 0.01, 0], [0.02, 0.02, 0]])


@pytest.mark.parametrize("at", [2, 3, 5, 6, 11, 12])
def test_two_parts_cut_what_the_whole_does(path, at):
    last = len(path) - 1
    parts = part_of(path, 0, at, PARTING), part_of(path, at, last, PARTING)
    assert cut_chords(parts[0]) + cut_chords(parts[1]) == cut_chords(path)
    for part, begins, ends in ((parts[0], False, True), (parts[1], True, False)):
        assert part.pivot == path.pivot
        first, final = part.segments[0], part.segments[-1]
        assert first.kind is SegmentKind.LINK
        assert final.kind is SegmentKind.LINK
        if begins:
            np.testing.assert_allclose(first.tips[0] - first.tips[-1], 0.004 * UP)
            assert first.feed == 0.03
        if ends:
            np.testing.assert_allclose(final.tips[-1] - final.tips[0], 0.004 * UP)
    np.testing.assert_array_equal(parts[0].tips[0], path.tips[0])
    np.testing.assert_array_equal(parts[1].tips[-1], path.tips[-1])


def test_the_whole_is_a_part_of_itself(path):
    whole = part_of(path, 0, len(path) - 1, PARTING)
    np.testing.assert_array_equal(whole.tips, path.tips)
    assert [s.kind for s in whole.segments] == [s.kind for s in path.segments]


def test_impossible_parts_are_errors(path):
    for first, last in ((3, 3), (-1, 4), (0, len(path)), (6, 10)):
        with pytest.raises(ToolpathError):
            part_of(path, first, last, PARTING)
