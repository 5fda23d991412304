"""With a stand-off the feed is the speed of the spot on the surface; the tip itself only keeps the rapid rate."""

from dataclasses import replace

import numpy as np
import pytest
import replay_cases as cases

from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath
from pentapod.verify import verify

STANDOFF = 5e-3
LENGTH = 0.012


def judged(good, nod, share, rapid=cases.RAPID):
    """Certificates of a straight cut at a share of the feed, whose axis turns by `nod` radians on the way.

    Made from the spot: the tip stands off along the axis, so it runs ahead where the axis turns forward.
    """

    def poses(f):
        angle = nod * (f - 0.5)
        axes = np.stack([np.sin(angle), 0.0 * f, np.cos(angle)], axis=-1)
        spots = np.stack([LENGTH * (f - 0.5), 0.0 * f, 0.0 * f], axis=-1)
        return spots + STANDOFF * axes, axes

    rows = round(1.875 * LENGTH / (share * cases.FEED) / cases.PERIOD)
    machine = replace(good.machine, rapid_velocity=rapid)
    cut = Segment(SegmentKind.CUT, *poses(np.linspace(0.0, 1.0, 241)), cases.FEED)
    toolpath = Toolpath((cut,), tilt_centre=-STANDOFF)
    program = cases.program_of(
        machine, *poses(cases.quintic(np.arange(rows + 1) / rows)), interpolation=good.program.interpolation
    )
    verdict = verify(program, machine, toolpath, **cases.TOLERANCES, job_digest="job-1")
    return {c.claim: c for c in verdict.certificates}


def failed(found):
    return {name for name, c in found.items() if not c.passed}


@pytest.fixture(params=["cubic", "linear"])
def good(request):
    return request.getfixturevalue(request.param)


@pytest.mark.parametrize("nod", [-0.4, 0.0, 0.4])
@pytest.mark.parametrize("share", [0.98, 1.05])
def test_the_spot_keeps_the_feed_whatever_the_tip_does(good, nod, share):
    found = judged(good, nod, share)
    assert failed(found) == ({"feed on cuts"} if share > 1.0 else set())
    # Legs that run linearly carry the spot slowest just before some row and fastest just after it: the verdict's value.
    rel = 2e-3 if good.program.interpolation == "cubic" else 7e-3
    assert found["feed on cuts"].value == pytest.approx(6e4 * share * cases.FEED, rel=rel)
    assert "spot" in found["feed on cuts"].method


def test_the_tip_keeps_the_rapid_rate_on_cuts_too(good):
    """The tip runs ahead of the spot by 5 mm · 0.4 rad on 12 mm: 1.167 times as fast."""
    fastest = 0.98 * cases.FEED * (1.0 + STANDOFF * 0.4 / LENGTH)
    assert failed(judged(good, 0.4, 0.98, rapid=1.01 * fastest)) == set()
    found = judged(good, 0.4, 0.98, rapid=0.99 * fastest)
    assert failed(found) == {"rapid rate"}
    rel = 3e-3 if good.program.interpolation == "cubic" else 7e-3
    assert found["rapid rate"].value == pytest.approx(6e4 * fastest, rel=rel)
