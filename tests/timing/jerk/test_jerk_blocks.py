"""Jerk limits solved in blocks: near the law of the whole, and within its limits."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from pentapod.timing.jerk.jerk_limited import NO_AGREEMENT, JerkProblem, jerk_limited
from pentapod.timing.jerk.options import BlockOptions, JerkOptions
from pentapod.timing.jerk.rows import JerkRows
from pentapod.timing.topp.engine import fastest
from pentapod.timing.topp.stages import Failure

SPEED, PUSH, JERK = 0.5, 5.0, 200.0


@dataclass
class Waves:
    """Rows of five legs that are sums of waves of their own, with a feed."""

    jerk: float = JERK

    def legs(self, s):
        rng = np.random.default_rng(1)
        wave, phase = rng.uniform(20, 90, (5, 3)), rng.uniform(0, 6, (5, 3))
        at = s[:, None, None] * wave + phase
        return [
            (k(at) * wave**n / wave[:, :1] / 3).sum(2)
            for n, k in ((1, np.cos), (2, lambda y: -np.sin(y)), (3, lambda y: -np.cos(y)))
        ]

    def __call__(self, s):
        one, two, three = self.legs(s)
        ceiling = np.minimum(np.square(SPEED / np.abs(one).max(axis=1)), np.where(np.sin(9 * s) > 0, 0.04, 0.01))
        rows = np.stack([three, 1.5 * two, 0.5 * one], axis=-1) / self.jerk
        return JerkRows(one / PUSH, two / PUSH, np.zeros((1, 5)), rows, ceiling)


def profile(length=1.5, step=1e-4, x_start=0.0, x_end=0.0):
    s = np.linspace(0.0, length, round(length / step) + 1)
    rows = Waves()(s)
    x = fastest(s, rows.first, rows.second, rows.ceiling, x_start=x_start, x_end=x_end)
    assert not isinstance(x, Failure), x
    return s, x


def duration(law):
    return law.nodes.law().duration


def limited(s, x, **blocks):
    """The jerk-limited law; blocks: options of the decomposition into blocks."""
    return jerk_limited(JerkProblem(s, x, Waves(), np.empty(0), JerkOptions(blocks=BlockOptions(**blocks))))


@pytest.fixture(scope="module")
def whole():
    s, x = profile()
    return s, x, limited(s, x)


def test_blocks_find_the_law_of_the_whole(whole):
    s, x, law = whole
    blocked = limited(s, x, size=2500, overlap=512)
    assert not np.array_equal(blocked.nodes.x, law.nodes.x)
    assert duration(blocked) == pytest.approx(duration(law), rel=1e-3)
    assert (np.diff(blocked.nodes.s) > 0.0).all()
    assert blocked.nodes.x[0] == blocked.nodes.x[-1] == 0.0
    # Limits by differences of the legs along the law, which know nothing of rows.
    for found in (law.nodes, blocked.nodes):
        rows = Waves()(found.s)
        above = found.x / np.maximum(np.minimum(np.interp(found.s, s, x), rows.ceiling), 1e-300)
        assert np.quantile(above, 0.99) < 1 + 1e-6  # at the gridpoints, which are half of them
        assert above.max() < 1.006  # between them
        assert np.abs(rows.first * found.slope[:, None] / 2 + rows.second * found.x[:, None]).max() < 1.005
        motion = found.law()
        t = np.linspace(0.01, motion.duration - 0.01, 100_001)
        h = 1e-6
        push = [
            Waves().legs(motion(t + d))[0] * motion(t + d, 2)[:, None]
            + Waves().legs(motion(t + d))[1] * motion(t + d, 1)[:, None] ** 2
            for d in (-h, h)
        ]
        assert np.quantile(np.abs(push[1] - push[0]).max(axis=1) / (2 * h) / JERK, 0.999) < 1.03


def test_overlap_of_blocks_grows_where_they_disagree(whole, monkeypatch):
    """Blocks beside cuts at which all agree are not solved again."""
    s, x, law = whole
    asked, solved, seam = [], JerkProblem.solved, JerkProblem.seam
    monkeypatch.setattr(JerkProblem, "solved", lambda self, block: asked.append(block) or solved(self, block))

    def strict(self, cut, overlap, *laws):
        return None if cut == 5000 and overlap < 32 else seam(self, cut, overlap, *laws)

    monkeypatch.setattr(JerkProblem, "seam", strict)
    blocked = limited(s, x, size=2500, overlap=8, blend=4)
    assert blocked.overlap == 32
    assert duration(blocked) == pytest.approx(duration(law), rel=1e-3)
    assert [block.begin for block in asked if block.low < block.begin - 8] == [5000, 5000]
    assert len(asked) == 6 + 2 * 2


def test_laws_that_differ_are_joined_where_no_limit_is_exceeded(whole):
    """At a low speed a law may pass to one that differs by some percent; without room for that they do not agree."""
    long, short = (
        JerkProblem(*whole[:2], Waves(), np.empty(0), JerkOptions(blocks=BlockOptions(blend=blend)))
        for blend in (128, 4)
    )
    (block,) = long.blocks([])
    one = long.solved(block)
    other = replace(one, y=0.9 * one.y)
    low, high = long.seam(7000, 1024, one, other)
    assert high - low == pytest.approx(128e-4)
    assert short.seam(7000, 64, one, other) is None


def test_blocks_that_never_agree_have_no_law(whole):
    assert limited(*whole[:2], size=2500, overlap=512, agreement=-1.0) == NO_AGREEMENT


@pytest.mark.parametrize(("v", "w"), [(0.02, 0.0), (0.0, 0.03), (0.04, 0.02)])
def test_law_has_the_given_speeds_at_its_ends(v, w):
    """Without acceleration there."""
    s, x = profile(0.4, x_start=v * v, x_end=w * w)
    law = limited(s, x)
    assert not isinstance(law, Failure)
    nodes = law.nodes
    assert nodes.s[0] == 0.0
    assert nodes.s[-1] == s[-1]
    for end, speed in ((0, v), (-1, w)):
        assert nodes.x[end] == pytest.approx(speed**2, rel=1e-9, abs=1e-300)
        assert abs(nodes.slope[end]) < 1e-9
    resting = limited(*profile(0.4))
    assert duration(law) < duration(resting)
