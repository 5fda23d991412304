"""The passes: the core against toppra, and laws that hold whatever the problem."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pentapod.base.errors import InputError
from pentapod.timing.topp.engine import fastest
from pentapod.timing.topp.stages import Failure


def problem(seed, n=120, rows=5, lively=3.0, cap=1.0, offset=True):
    """Smooth random rows and ceilings on an uneven grid."""
    rng = np.random.default_rng(seed)
    s = np.concatenate([[0.0], np.cumsum(rng.uniform(0.2, 1.0, n))])
    s /= s[-1]
    w = rng.uniform(1, 9, (2, rows)) * np.pi
    phase = rng.uniform(0, 6, (2, rows))
    first = np.sin(w[0] * s[:, None] + phase[0]) * rng.uniform(0.2, 2, rows)
    second = lively * np.cos(w[1] * s[:, None] + phase[1]) * rng.uniform(0.2, 2, rows)
    ceiling = cap * (1.5 + np.sin(7 * s + rng.uniform(0, 6)))
    at_rest = 0.4 * np.sin(5 * s[:, None] + np.arange(rows)) if offset else None
    return {"s": s, "first": first, "second": second, "ceiling": ceiling, "offset": at_rest}


def excess(p, x):
    """Largest excess of x over its rows and bounds, in shares of the limits."""
    u = np.diff(x) / (2 * np.diff(p["s"]))
    at_rest = 0.0 if p["offset"] is None else p["offset"]
    rows = [p["first"][k] * u[:, None] + p["second"][k] * x[k][:, None] for k in (slice(0, -1), slice(1, None))]
    c = np.broadcast_to(at_rest, p["first"].shape)
    worst = max(np.abs(rows[0] + c[:-1]).max(), np.abs(rows[1] + c[1:]).max()) - 1.0
    return max(worst, (x / p["ceiling"]).max() - 1.0, -x.min())


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    cap=st.sampled_from([1e-3, 0.1, 1.0, 100.0]),
    ends=st.tuples(st.floats(0, 0.02), st.floats(0, 0.02)),
    offset=st.booleans(),
)
def test_profiles_keep_every_row_and_agree_with_toppra(seed, cap, ends, offset):
    p = problem(seed, cap=cap, offset=offset)
    ours = fastest(**p, x_start=ends[0] * cap, x_end=ends[1] * cap)
    theirs = fastest(**p, x_start=ends[0] * cap, x_end=ends[1] * cap, engine="toppra")
    assert isinstance(ours, Failure) == isinstance(theirs, Failure)
    if isinstance(ours, Failure):
        return
    assert excess(p, ours) < 1e-9
    assert ours[0] == ends[0] * cap
    assert ours[-1] == ends[1] * cap
    assert np.abs(ours - theirs).max() < 2e-4 * ours.max()

    def duration(x):
        return (2 * np.diff(p["s"]) / (np.sqrt(x[1:]) + np.sqrt(x[:-1]))).sum()

    assert duration(ours) == pytest.approx(duration(theirs), rel=1e-5)


@pytest.mark.parametrize("ds", [2.0**-40, 2.0**40])
@pytest.mark.parametrize("dx", [2.0**-40, 2.0**40])
def test_profiles_in_other_units_are_equal_to_the_last_bit(ds, dx):
    p = problem(5)
    x = fastest(**p)
    scaled = {
        "s": p["s"] * ds,
        "first": p["first"] * ds / dx,
        "second": p["second"] / dx,
        "ceiling": p["ceiling"] * dx,
        "offset": p["offset"],
    }
    assert np.array_equal(fastest(**scaled), x * dx)


@pytest.mark.parametrize("engine", ["core", "toppra"])
def test_repeated_gridpoints_change_nothing(engine):
    p = problem(8)
    twice = np.sort(np.concatenate([np.arange(121), [0, 17, 17, 60, 120]]))
    x = fastest(**p, engine=engine)
    doubled = fastest(**{k: v[twice] for k, v in p.items()}, engine=engine)
    assert np.allclose(doubled, x[twice], rtol=1e-6 if engine == "toppra" else 0, atol=0)


def test_rows_hold_on_both_sides_of_a_jump():
    """One leg whose acceleration limit drops to a quarter in the middle: it brakes for the second half before it."""
    s = np.array([0, 1, 2, 3, 3, 4, 5, 6.0])
    first = np.repeat([1.0, 4.0], 4)[:, None]
    x = fastest(s, first, 0 * first, np.full(8, np.inf))
    assert x.tolist() == pytest.approx([0, 2, 3.5, 1.5, 1.5, 1, 0.5, 0])


def test_failures_name_the_gridpoint_and_the_rows():
    s, rows = np.linspace(0, 1, 11), np.full((11, 2), [1.0, 0.5])
    free = np.full(11, np.inf)
    fast_end = fastest(s, rows, 0 * rows, np.where(s == 1, 9.0, 0.5), x_end=8.0)
    assert (fast_end.gridpoint, fast_end.reason[:8]) == (9, "no time ")
    assert fast_end.conflict == (0,)
    assert fastest(s, rows, 0 * rows, free, x_start=2.5).reason.startswith("the speed at the start is higher")
    assert fastest(s, rows, 0 * rows, free, x_end=2.5).reason.startswith("the speed at the start is lower")
    assert fastest(s, rows, 0 * rows, np.ones(11), x_end=2.0).gridpoint == 10
    assert fastest(s, 0 * rows, 0 * rows, free) == Failure(9, "no limit bounds the speed here")
    stop = fastest(s, rows, 0 * rows, np.where((s > 0.45) & (s < 0.65), 0.0, 1.0))
    assert stop == Failure(5, "the motion comes to a standstill")
    assert fastest(s, rows, rows * np.where(s == s[4], np.nan, 1)[:, None], free).gridpoint == 4


def test_wrong_arrays_and_engines_raise_input_errors():
    s, rows, free = np.linspace(0, 1, 5), np.ones((5, 1)), np.ones(5)
    with pytest.raises(InputError, match="must not fall"):
        fastest(s[::-1], rows, rows, free)
    with pytest.raises(InputError, match="standstill"):
        fastest(s, rows, rows, free, offset=np.full((1, 1), 1.5))
    with pytest.raises(InputError, match="shape"):
        fastest(s, rows[:4], rows, free)
    with pytest.raises(InputError, match="not negative"):
        fastest(s, rows, rows, free, x_end=-1.0)
    for engine in ("toppar", "numpy"):
        with pytest.raises(InputError, match="unknown engine"):
            fastest(s, rows, rows, free, engine=engine)
