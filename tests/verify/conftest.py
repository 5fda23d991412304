import pytest
import replay_cases as cases


@pytest.fixture(scope="session")
def cubic():
    """A good program for a controller that interpolates by a cubic spline."""
    return cases.good_case(lean=0.5 * cases.TILT)


@pytest.fixture(scope="session")
def linear():
    """The same for a controller that interpolates linearly."""
    return cases.good_case(lean=0.5 * cases.TILT, interpolation="linear")
