"""Set-ups: as few pieces as can be, between passes where that is possible, else in slabs and columns of the part."""

import itertools

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from lengths import examples
from pentapod.base.refusal import Refusal, Shortfall
from pentapod.planning.setups import setups
from pentapod.toolpath.linking.links import LinkStyle
from pentapod.toolpath.linking.partition import Piece, cutting_intervals, part_of, pass_ends
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath

UP = np.array([0.0, 0.0, 1.0])
STYLE = LinkStyle(UP, level=0.05, approach=0.003, spacing=0.1, feed=0.02)
WHOLE = Refusal(
    "placement", "it is too large", (Shortfall("leg 1 too long", ((0, 3),), 2.0, "mm"),), "Try a smaller one"
)


def passes(places: list[float], points: int = 9, length: float = 1.0) -> Toolpath:
    """Passes along x from 0 to `length`, at these y, joined on the surface."""
    segments: list[Segment] = []
    for k, y in enumerate(places):
        x = np.linspace(0.0, length, points)[:: 1 if k % 2 == 0 else -1]
        tips = np.column_stack([x, np.full(points, y), np.zeros(points)])
        if segments:
            joint = np.stack([segments[-1].tips[-1], tips[0]])
            segments.append(Segment(SegmentKind.LINK, joint, np.tile(UP, (2, 1)), 0.02))
        segments.append(Segment(SegmentKind.CUT, tips, np.tile(UP, (points, 1)), 0.02))
    return Toolpath(tuple(segments))


def no_wider(*widths: float):
    """A machine that reaches parts so wide in x and y, wherever they are."""
    return lambda part: bool((np.ptp(part.tips[:, :2], axis=0) <= np.array(widths) + 1e-9).all())


def fewest_in_a_row(path: Toolpath, fits) -> int:
    """By dynamic programming over all ways to split between passes."""
    ends = [0, *[int(e) for e in pass_ends(path)]]
    best = [0] + [10**6] * (len(ends) - 1)
    for j in range(1, len(ends)):
        for i in range(j):
            if best[i] + 1 < best[j] and fits(part_of(path, Piece(ends[i], ends[j]), STYLE)):
                best[j] = best[i] + 1
    return best[-1]


def fewest_intervals(values: list[float], width: float) -> int:
    """How many intervals of a width cover all values: no split into slabs can do with less."""
    count, reach = 0, -np.inf
    for value in sorted(values):
        if value > reach + 1e-9:
            count, reach = count + 1, value + width
    return count


def assert_all_cuts_once(path: Toolpath, pieces) -> None:
    times = np.sum([piece.cuts(path) for piece in pieces], axis=0)
    np.testing.assert_array_equal(times, cutting_intervals(path))


@settings(max_examples=examples(15, 60))
@given(st.lists(st.floats(0.0, 1.0), min_size=2, max_size=9), st.floats(0.05, 0.9))
def test_no_split_between_passes_has_fewer_pieces(places, width):
    path, fits = passes(places), no_wider(np.inf, width)
    assume(not fits(path))
    pieces = setups(path, fits, STYLE, 20, WHOLE)
    assert not isinstance(pieces, Refusal)
    assert fewest_intervals(places, width) <= len(pieces) <= fewest_in_a_row(path, fits)
    assert_all_cuts_once(path, pieces)
    assert all(fits(part_of(path, piece, STYLE)) for piece in pieces)


def test_what_can_be_split_between_passes_is_and_evenly():
    path = passes([0.0, 0.1, 0.2, 0.3, 0.4, 0.5])
    pieces = setups(path, no_wider(1.0, 0.3), STYLE, 9, WHOLE)
    assert [str(piece) for piece in pieces] == ["waypoints 0 to 26", "waypoints 26 to 53"]
    assert {piece.last for piece in pieces} <= {int(e) for e in pass_ends(path)}


def test_passes_that_are_too_long_are_split_across():
    """Four passes of length 1 where 0.4 is reached: three slabs across x; piece by piece it would have been twelve."""
    path, fits = passes([0.0, 0.1, 0.2, 0.3], points=101), no_wider(0.4, 1.0)
    pieces = setups(path, fits, STYLE, 9, WHOLE)
    assert len(pieces) == 3
    assert all(piece.is_boxed for piece in pieces)
    assert_all_cuts_once(path, pieces)
    assert all(fits(part_of(path, piece, STYLE)) for piece in pieces)
    assert str(pieces[0]).startswith("x up to ")


@pytest.mark.parametrize(
    ("width", "depth", "tiles"),
    [
        (0.6, 0.6, 4),
        pytest.param(0.4, 0.6, 6, marks=pytest.mark.slow),
        pytest.param(0.6, 0.4, 6, marks=pytest.mark.slow),
    ],
)
def test_a_part_too_large_both_ways_is_split_in_columns(width, depth, tiles):
    path = passes(np.linspace(0.0, 1.0, 101).tolist(), points=101)
    fits = no_wider(width, depth)
    pieces = setups(path, fits, STYLE, 8, WHOLE)
    assert len(pieces) == tiles
    assert_all_cuts_once(path, pieces)
    assert all(fits(part_of(path, piece, STYLE)) for piece in pieces)


def test_too_few_set_ups_are_a_refusal():
    path = passes([0.0, 0.4, 0.8], points=3)
    answer = setups(path, no_wider(0.1, 0.1), STYLE, 2, WHOLE)
    assert isinstance(answer, Refusal)
    assert answer.cause.startswith("2 set-ups are not enough: ")
    assert answer.cause.endswith(WHOLE.cause)
    over, *others = answer.diagnosis
    assert over.constraint == "beyond 2 set-ups"
    assert tuple(others) == WHOLE.diagnosis
    assert WHOLE.remedy in answer.remedy
    nothing = setups(path, lambda _: False, STYLE, 5, WHOLE)
    assert isinstance(nothing, Refusal)
    assert nothing.diagnosis[0].waypoints == ((0, 2), (3, 5), (6, 8))  # every cut, from its first waypoint to its last
    assert " 0 %" in nothing.cause


def test_the_refusal_tells_how_much_the_allowed_set_ups_make():
    """Slabs up to 0.3 wide, which end at multiples of 1/32: three make 27/32 of the length."""
    path = passes([0.0, 0.1], points=101)
    answer = setups(path, no_wider(0.3, 1.0), STYLE, 3, WHOLE)
    assert isinstance(answer, Refusal)
    assert " 84 % " in answer.cause
    left = cutting_intervals(path)
    for first, last in answer.diagnosis[0].waypoints:
        left[first:last] = False
        assert path.tips[first:last, 0].min() >= 27 / 32 - 0.01
    assert left.sum() / cutting_intervals(path).sum() == pytest.approx(0.84, abs=0.01)


def test_how_far_the_last_set_up_reaches_is_searched_for_one_partition_alone():
    """Eight set-ups are too few for 4 by 4 tiles: a dozen searches fewer than where each scheme asks for that."""
    asked, small = [], no_wider(0.3, 0.3)

    def fits(part: Toolpath) -> bool:
        asked.append(part)
        return small(part)

    path = passes(np.linspace(0.0, 1.0, 51).tolist(), points=51)
    assert isinstance(setups(path, fits, STYLE, 8, WHOLE), Refusal)
    assert len(asked) <= 62


def test_progress_tells_the_way_and_how_far():
    told: list[tuple[str, float, str]] = []
    path = passes([0.0, 0.4, 0.8])
    setups(path, no_wider(1.0, 0.1), STYLE, 4, WHOLE, lambda *what: told.append(what))
    assert told[0] == ("set-ups", 0.0, "between passes: 0 so far")
    assert all(0.0 <= fraction <= 1.0 for _, fraction, _ in told)


def test_an_interruption_goes_through():
    def fits(_: Toolpath) -> bool:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        setups(passes([0.0, 1.0]), fits, STYLE, 3, WHOLE)


def test_same_path_same_pieces():
    path = passes(np.linspace(0.0, 1.0, 31).tolist(), points=31)
    found = [setups(path, no_wider(0.6, 0.6), STYLE, 6, WHOLE) for _ in range(2)]
    assert found[0] == found[1]
    assert all(a != b for a, b in itertools.combinations(found[0], 2))
