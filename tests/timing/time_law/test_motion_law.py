import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pentapod.timing import MotionLaw


def profile(seed, n=30, length=0.3):
    rng = np.random.default_rng(seed)
    s = np.concatenate([[0.0], np.cumsum(rng.uniform(0.1, 1.0, n))])
    x = np.concatenate([[0.0], rng.uniform(0.01, 0.3, n - 1), [0.0]])
    return s * length / s[-1], x


@given(st.integers(0, 10_000))
def test_motion_law_speed_and_acceleration_are_derivatives_of_the_station(seed):
    plain = MotionLaw.from_profile(*profile(seed))
    for law in (plain, plain.smoothed(0.004), plain.stretched(1.7 * plain.duration)):
        t = np.linspace(0, law.duration, 501)[1:-1]
        h = 1e-5
        away = np.abs(t[:, None] - law.times).min(1) > 2 * h
        assert np.allclose((law(t + h) - law(t - h))[away] / (2 * h), law(t, 1)[away], atol=1e-6)
        assert np.allclose((law(t + h, 1) - law(t - h, 1))[away] / (2 * h), law(t, 2)[away], rtol=1e-5, atol=1e-4)


@given(st.integers(0, 10_000))
def test_motion_law_squared_speed_is_linear_in_the_station(seed):
    s, x = profile(seed)
    law = MotionLaw.from_profile(s, x)
    t = np.linspace(0, law.duration, 2001)
    assert np.allclose(np.square(law(t, 1)), np.interp(law(t), s, x), atol=1e-12)
    assert np.array_equal(law(law.times), s)


@given(st.integers(0, 10_000), st.floats(1e-4, 0.5))
def test_motion_law_smoothed_is_the_moving_average(seed, window):
    law = MotionLaw.from_profile(*profile(seed))
    smooth = law.smoothed(window)
    assert smooth.duration == pytest.approx(law.duration + window)
    assert smooth([0.0, smooth.duration]).tolist() == [0.0, law.length]
    assert np.abs(smooth([0.0, smooth.duration], 1)).max() == 0.0
    assert (np.diff(smooth(np.linspace(0, smooth.duration, 3000))) >= 0.0).all()
    # The average by the midpoint rule, which knows no closed form.
    for t in np.linspace(0.05, 0.95, 7) * smooth.duration:
        taus = t - window * (np.arange(20_000) + 0.5) / 20_000
        assert smooth([t])[0] == pytest.approx(law(taus).mean(), abs=2e-8)


@settings(max_examples=30)
@given(st.integers(0, 10_000), st.floats(0.2, 5.0))
def test_motion_law_stretched_scales_time_only(seed, factor):
    law = MotionLaw.from_profile(*profile(seed))
    slow = law.stretched(factor * law.duration)
    t = np.linspace(0, 1, 300)
    assert np.allclose(slow(t * slow.duration), law(t * law.duration), atol=1e-13)
    assert np.allclose(slow(t * slow.duration, 1) * factor, law(t * law.duration, 1), atol=1e-9)


def test_motion_law_starts_as_half_a_t_squared():
    law = MotionLaw.from_profile(np.array([0.0, 1.0, 2.0]), np.array([0.0, 2.0, 0.0]))
    assert law.duration == pytest.approx(2 * np.sqrt(2.0))
    t = np.array([0.0, 1e-9, 1e-6, 0.1, 1.0])
    assert np.allclose(law(t), t**2 / 2, rtol=1e-14, atol=0)
    assert law([-1.0, 99.0]).tolist() == [0.0, 2.0]
    assert law([-1.0, 99.0], 1).tolist() == [0.0, 0.0]
