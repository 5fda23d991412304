"""The trust region of the smoothing: where a step fails the next one is shorter, and only there."""

import numpy as np
import pytest

from pentapod.planning.tool_axis.trust_region import OPTIONS, TrustRegion


@pytest.fixture
def failing():
    at = np.zeros(100, dtype=np.bool_)
    at[[20, 21, 60]] = True
    return at


def test_it_shrinks_where_a_step_failed_and_widens_elsewhere(failing):
    trust = TrustRegion.of(100)
    trust.shrink()
    lengths = np.full(100, 0.1)
    trust.after(lengths, failing, good=True)
    assert (trust.radii[failing] < lengths[failing]).all()
    np.testing.assert_allclose(trust.radii[~failing], 2.0 * OPTIONS.shrink * OPTIONS.largest)
    trust.after(lengths, ~failing & failing, good=False)
    assert trust.radii.max() == 0.05


def test_how_far_a_step_went_counts_around_a_place_that_failed(failing):
    """At the place itself it may not have moved: that does not say that it must not."""
    trust, lengths = TrustRegion.of(100), np.zeros(100)
    lengths[[18, 62]] = 0.5
    trust.shrink(lengths, failing)
    assert trust.radii[failing] == pytest.approx(0.5 * OPTIONS.shrink)


def test_a_step_comes_back_to_its_full_length_beside_the_places(failing):
    shares = TrustRegion.of(100).away_from(failing)
    assert (shares[failing] == 0.0).all()
    assert (shares[~failing] > 0.0).all()
    away = np.abs(np.arange(100)[:, None] - np.flatnonzero(failing)).min(axis=1)
    assert ((shares == 1.0) == (away >= OPTIONS.ramp)).all()
    assert (np.diff(shares[21:30]) > 0.0).all()
    assert (TrustRegion.of(100).away_from(failing & ~failing) == 1.0).all()


def test_it_is_used_up_where_no_coefficient_may_move(failing):
    trust = TrustRegion.of(100)
    for _ in range(9):
        trust.shrink(at=failing)
    assert not trust.is_used_up()
    for _ in range(9):
        trust.shrink()
    assert trust.is_used_up()
    trust.widen()
    assert not trust.is_used_up()
