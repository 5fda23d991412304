"""Set-ups: as few parts as can be, at the ends of passes where that is possible."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pentapod.planning.setups import setups
from pentapod.refusal import Refusal
from pentapod.toolpath.parting import Parting, part_of, pass_ends
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath

PARTING = Parting(0.001, 0.02)
WHOLE = Refusal("placement", "it is too large", (), "Try a smaller one")
UP = np.array([0.0, 0.0, 1.0])


def passes(places: list[float], points: int = 9) -> Toolpath:
    """Passes along x from 0 to 1, at these y, joined on the surface."""
    segments: list[Segment] = []
    for k, y in enumerate(places):
        x = np.linspace(0.0, 1.0, points)[:: 1 if k % 2 == 0 else -1]
        tips = np.column_stack([x, np.full(points, y), np.zeros(points)])
        if segments:
            joint = np.stack([segments[-1].tips[-1], tips[0]])
            segments.append(Segment(SegmentKind.LINK, joint, np.tile(UP, (2, 1)), 0.02))
        segments.append(Segment(SegmentKind.CUT, tips, np.tile(UP, (points, 1)), 0.02))
    return Toolpath(tuple(segments))


def no_wider(width: float, axis: int = 1):
    """A machine that reaches parts of a width, wherever they are."""
    return lambda part: bool(np.ptp(part.tips[:, axis]) <= width)


def fewest(path: Toolpath, fits) -> int:
    """By dynamic programming over all ways to split at passes."""
    ends = [0, *[int(e) for e in pass_ends(path)]]
    best = [0] + [10**6] * (len(ends) - 1)
    for j in range(1, len(ends)):
        for i in range(j):
            if best[i] + 1 < best[j] and fits(part_of(path, ends[i], ends[j], PARTING)):
                best[j] = best[i] + 1
    return best[-1]


@settings(max_examples=60)
@given(st.lists(st.floats(0.0, 1.0), min_size=2, max_size=9), st.floats(0.05, 0.9))
def test_no_split_at_passes_has_fewer_parts(places, width):
    path, fits = passes(places), no_wider(width)
    if fits(path):
        return
    parts = setups(path, fits, PARTING, 20, WHOLE)
    assert not isinstance(parts, Refusal)
    assert len(parts) == fewest(path, fits)
    assert parts[0][0] == 0
    assert parts[-1][1] == len(path) - 1
    assert all(a[1] == b[0] for a, b in zip(parts, parts[1:], strict=False))
    assert {end for _, end in parts} <= {int(e) for e in pass_ends(path)}
    assert all(fits(part_of(path, *part, PARTING)) for part in parts)


def test_a_pass_that_does_not_fit_is_split_within():
    """Passes of length 1 with points every 1/8, parts of at most 0.5: half a pass each, and never across two passes."""
    path, fits = passes([0.0, 0.1]), no_wider(0.5, axis=0)
    parts = setups(path, fits, PARTING, 9, WHOLE)
    assert parts == ((0, 4), (4, 8), (8, 13), (13, 17)) or len(parts) == 4
    assert all(fits(part_of(path, *part, PARTING)) for part in parts)


def test_too_few_set_ups_are_a_refusal():
    path = passes([0.0, 0.4, 0.8])
    answer = setups(path, no_wider(0.1), PARTING, 2, WHOLE)
    assert isinstance(answer, Refusal)
    assert "2 set-ups are not enough: waypoints" in answer.cause
    assert answer.remedy == WHOLE.remedy
    nothing = setups(path, lambda _: False, PARTING, 5, WHOLE)
    assert isinstance(nothing, Refusal)
    assert "no set-up reaches" in nothing.cause


@pytest.mark.parametrize("most", [1, 3])
def test_progress_tells_the_set_up(most):
    told: list[str] = []
    setups(
        passes([0.0, 0.4, 0.8]), no_wider(0.1), PARTING, most, WHOLE,
        lambda stage, fraction, note="": told.append(f"{stage} {note}"),
    )  # fmt: skip
    assert len(told) == most
    assert told[0] == "set-ups set-up 1 from waypoint 0"
