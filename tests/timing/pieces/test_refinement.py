"""Grid refinement of a piece: no stage is slow for long without a limit, however long the whole piece takes."""

import numpy as np
import pytest
from scipy.special import erf
from timing_paths import Piece, machine

from pentapod.timing.limits.limit import Motion
from pentapod.timing.limits.limits import Limits
from pentapod.timing.pieces.refinement import time_piece

LENGTH, BEND, WIDTH, TURN = 3.0, 1.4003, 1e-6, 1e6


def bent(bends, knots):
    """Legs of a long way that bends, far from any knot of an even grid, to the left and to the right in turn."""
    turn = TURN * (-1.0) ** np.arange(len(bends))
    rate = np.array([1.0, 0.8, -0.6, 0.3, -0.9])

    def legs(s):
        t = (s[:, None] - bends) / (2.0**0.5 * WIDTH)
        turned = WIDTH * (np.pi / 2.0) ** 0.5 * (1.0 + erf(t))
        way = (s[:, None] - bends) * turned + WIDTH**2 * np.exp(-(t**2))
        ways = s + way @ turn, 1.0 + turned @ turn, np.exp(-(t**2)) @ turn
        return np.array([0.8, 0.0, 0.0])[:, None, None] + np.stack(ways)[:, :, None] * rate

    near = (np.asarray(bends)[:, None] + np.array([-20.0, 0.0, 20.0]) * WIDTH).ravel()
    return Piece(legs, LENGTH, 0.025, inner_knots=np.unique([*near, *knots]))


@pytest.mark.parametrize(
    ("bends", "knots"), [([BEND], [BEND - 1.4e-3, BEND + 1.4e-3]), ([BEND, BEND + 1.8e-3], [])], ids=["one", "two"]
)
def test_no_stage_is_slow_for_long_without_a_limit(bends, knots):
    piece, m = bent(bends, knots), machine(a=5.0)
    profile = time_piece(piece, Limits.of(m, velocity_margin=1e-3, acceleration_margin=1e-3, guard=0.0), 1e-3, 1e-3)
    x, s = profile.x, profile.s
    pushes = np.diff(x) / (2.0 * np.diff(s))
    starts, ends = (
        profile.limits.shares(profile.derivatives, Motion.of(x, u)).max(axis=1)
        for u in (np.append(pushes, 0.0), np.append(0.0, pushes))
    )
    free = np.minimum(starts[:-1], ends[1:]) < 0.9
    seconds = 2.0 * np.diff(s) / (np.sqrt(x[:-1]) + np.sqrt(x[1:]))
    lost = np.where(free, seconds - np.diff(s) / 0.025, 0.0)
    assert np.sqrt(x[np.searchsorted(s, BEND)]) < 0.02
    assert lost.max() < 4e-3
