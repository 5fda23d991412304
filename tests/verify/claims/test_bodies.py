"""The clearance between bodies, with distances that are given: nothing near is passed over, and the place is right."""

import numpy as np
import pytest
import replay_cases as cases
from hypothesis import given, settings
from hypothesis import strategies as st

from pentapod.verify.claims import bodies

PERIOD = 0.002


def judged(monkeypatch, gaps, chords):
    """The finding for gaps (M, 2) between two pairs at samples, and chords (M − 1,) of the faster end, metres."""
    # The distances are those of no machine: they are looked up by the number of the sample, which is its x.
    monkeypatch.setattr(bodies, "clearances", lambda _, where, __: gaps[np.rint(where[:, 0]).astype(int)])
    monkeypatch.setattr(bodies, "pair_names", lambda _: ("first and second", "first and third"))
    speeds = np.stack([np.zeros(len(chords)), np.zeros(len(chords)), chords / (0.5 * PERIOD)], axis=1)
    path, samples = cases.toolpath_of(cases.strokes()[:1]), cases.along_x(np.arange(len(gaps)))
    return bodies.clearance(cases.measured(path, samples, bounds={"speeds": speeds}, period=PERIOD))


@given(st.integers(0, 10_000), st.integers(2, 300), st.floats(0.1, 1.0))
@settings(max_examples=200)
def test_no_sample_that_comes_near_is_passed_over(seed, count, wildness):
    """Distances change by up to twice the way: blocks far away at their middle may still hold the nearest sample."""
    rng = np.random.default_rng(seed)
    chords = rng.uniform(0.0, 1e-3, count - 1) * (rng.uniform(size=count - 1) < 0.7)
    change = 2.0 * wildness * chords[:, None] * rng.choice([-1.0, 1.0], (count - 1, 2))
    gaps = 0.3 + np.concatenate([np.zeros((1, 2)), np.cumsum(change, axis=0)]) + rng.uniform(0.0, 0.05, 2)
    with pytest.MonkeyPatch.context() as patch:
        finding = judged(patch, gaps, chords)
    around = np.maximum(np.append(chords, 0.0), np.append(0.0, chords))
    nearest = (gaps - around[:, None]).min(axis=1)
    assert finding.value <= 1e3 * gaps.min() + 1e-9
    assert finding.value >= 1e3 * nearest.min() - 1e-9
    around = nearest[2 * finding.where.row : 2 * finding.where.row + 2]
    assert finding.value == pytest.approx(1e3 * around.min())
    assert finding.where.time_s == pytest.approx(0.5 * PERIOD * int(np.argmin(nearest)), abs=1e-9)
    assert finding.passed


@pytest.mark.parametrize("at", [0, 1, 31, 32, 63, 64, 69, 70])
def test_the_nearest_sample_and_pair_are_named(monkeypatch, at):
    chords = np.full(70, 1e-3)
    gaps = np.full((71, 2), 0.2)
    gaps[:, 1] = 0.01 + 1.5e-3 * np.abs(np.arange(71) - at)
    finding = judged(monkeypatch, gaps, chords)
    assert finding.where.time_s == pytest.approx(0.5 * PERIOD * at, abs=1e-9)
    assert finding.value == pytest.approx(10.0 - 1.0)
    assert finding.method.startswith("first and third come closest; ")


def test_what_may_touch_between_samples_does_not_pass(monkeypatch):
    gaps, chords = np.full((3, 2), 0.001), np.array([0.0, 0.0011])
    finding = judged(monkeypatch, gaps, chords)
    assert not finding.passed
    assert (finding.where.time_s, finding.value) == (0.5 * PERIOD, pytest.approx(-0.1))
    assert judged(monkeypatch, gaps, np.array([0.0, 0.0009])).passed
