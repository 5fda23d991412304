"""Units × scales × kinds of path: no failure, limits kept in every stage, toppra's duration where it has one."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matrix_cases import MATRIX, Case, arrays, cases

from pentapod.timing.topp.engine import fastest
from pentapod.timing.topp.stages import Failure

CASES = cases()


def duration(s, x):
    ends = np.sqrt(x[:-1]) + np.sqrt(x[1:])
    steps = np.diff(s)
    return float((2.0 * steps[steps > 0.0] / ends[steps > 0.0]).sum())


def used(s, first, second, x):
    """Return by how much the pushes exceed 1 at most, and the size of the terms that cancel in them."""
    moves = np.diff(s) > 0.0
    u = (np.diff(x)[moves] / (2.0 * np.diff(s)[moves]))[:, None]
    ends = [(first[k][moves] * u, second[k][moves] * x[k][moves][:, None]) for k in (slice(0, -1), slice(1, None))]
    return max(np.abs(a + b).max() for a, b in ends) - 1.0, max(np.abs(a).max() for a, _ in ends) + 1.0


def apart(case, finer=1):
    """Return by which share the duration is above toppra's on a grid `finer` times as fine, None where it has none."""
    s, first, second, ceiling = arrays(case, finer)
    x, reference = (fastest(s, first, second, ceiling, engine=engine) for engine in ("core", "toppra"))
    return None if isinstance(reference, Failure) else duration(s, x) / duration(s, reference) - 1.0


def check(case, *, oracle):
    """Return whether toppra had an answer; everything about ours is asserted.

    The passes are greedy: where x all but vanishes in a corner between coarse gridpoints, what is reached next may fall
    a thousand times as fast as x grows, and what toppra gives up by its tolerance decides which of two feasible
    profiles follows. About one case of a thousand; a finer grid has no such corner.
    """
    s, first, second, ceiling = arrays(case)
    x = fastest(s, first, second, ceiling)
    assert not isinstance(x, Failure), f"{case}: {x}"
    assert np.isfinite(x).all()
    assert (x >= 0.0).all()
    assert (x <= ceiling * (1.0 + 1e-12)).all()
    moves = np.diff(s) > 0.0
    excess, rounding = used(s, first, second, x)
    assert excess <= 1e-9 * rounding, str(case)
    if not oracle or not moves.all():  # toppra does not take a gridpoint twice
        return False
    by = apart(case)
    if by is None:
        return False
    if abs(by) > 1e-5:
        by = min((b for b in (apart(case, 2), apart(case, 4)) if b is not None), key=abs)
    assert abs(by) <= 1e-5, str(case)
    return True


@pytest.mark.parametrize("case", CASES[:: MATRIX["fast_stride"]], ids=str)
def test_matrix_reduced(case):
    check(case, oracle=True)


@pytest.mark.parametrize(
    "case",
    [
        Case("polyline", "unit interval", 1.14564e-06, 3936838375),
        Case("raster", "millimetre", 0.00109168, 1341107991),
        Case("raster", "metre", 4.98538e-06, 2686532027),
    ],
    ids=str,
)
def test_durations_differ_from_toppra_on_coarse_grids_alone(case):
    """The worst of some 5,000: on a grid 4 times as fine the durations agree, on a finer one toppra's are longer."""
    assert apart(case) > 1.9e-5
    assert abs(apart(case, 4)) < 5e-6
    assert -3e-5 < apart(case, 16) < 0.0


@pytest.mark.slow
def test_matrix_by_file():
    assert len(CASES) >= 2000
    solved = sum(check(case, oracle=True) for case in CASES)
    assert solved > 0.8 * len(CASES)  # six kinds of seven have an oracle


def any_case():
    return st.builds(
        Case,
        st.sampled_from(MATRIX["kinds"]),
        st.sampled_from(MATRIX["units"]),
        st.floats(-6.0, 1.0).map(lambda x: 10.0**x),
        st.integers(0, 2**32 - 1),
    )


@settings(max_examples=60, deadline=None)
@given(any_case())
def test_matrix_by_hypothesis_reduced(case):
    check(case, oracle=False)


@pytest.mark.slow
@settings(max_examples=2000, deadline=None)
@given(any_case())
def test_matrix_by_hypothesis(case):
    check(case, oracle=True)


@pytest.mark.parametrize("unit", MATRIX["units"])
@pytest.mark.parametrize("scale", MATRIX["scales_m"][::3])
def test_durations_do_not_depend_on_units_and_scales(unit, scale):
    """The same motion in other units lasts as long: in metres and in steps of the grid, to the last digits."""
    plain, other = (arrays(Case("polyline", name, scale, 3)) for name in ("metre", unit))
    times = [duration(a[0], fastest(*a)) for a in (plain, other)]
    assert times[1] == pytest.approx(times[0], rel=1e-11)


@pytest.mark.parametrize("spec", MATRIX["refused"], ids=lambda spec: spec["reason"])
@pytest.mark.parametrize("scale", MATRIX["scales_m"])
def test_failures_name_gridpoint_and_reason(spec, scale):
    s, first, second, ceiling = arrays(Case(spec["kind"], "metre", scale, 1))
    result = fastest(
        s,
        first,
        second,
        ceiling,
        x_start=spec.get("start_share", 0.0) * ceiling[0],
        x_end=spec.get("end_share", 0.0) * ceiling[-1],
    )
    assert isinstance(result, Failure)
    assert spec["reason"] in result.reason
    assert result.gridpoint in (0, len(s) - 1)
