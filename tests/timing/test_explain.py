"""Explanation: times and costs add up, the bound is one, and places are named where they were put."""

import json
import re

import numpy as np
import pytest
from scipy.integrate import quad
from timing_paths import Path, Piece, by_tip, line, machine, nodding, raster, straight

from pentapod.timing import Trajectory, certify, explain, retime
from pentapod.toolpath.toolpath import SegmentKind


def timed(path, m, **options):
    trajectory = retime(path, m, **options)
    assert isinstance(trajectory, Trajectory), str(trajectory)
    return trajectory


@pytest.mark.parametrize("interpolation", ["linear", "cubic"])
def test_explained_times_and_costs_add_up(interpolation):
    m = machine(interpolation=interpolation)
    trajectory = timed(Path((raster(lines=4, feed=0.2), straight([0.5, 0, 0, 0, 0.2], 0.02, start=raster_end()))), m)
    story = explain(trajectory, m)
    assert story.duration == trajectory.duration
    assert sum(c.time for c in story.causes) == pytest.approx(story.duration)
    assert sum(c.cost for c in story.causes) == pytest.approx(story.gap)
    assert 0.0 < story.lower_bound < story.duration
    assert len(story.places) <= 10
    assert [p.cost for p in story.places] == sorted((p.cost for p in story.places), reverse=True)
    assert min(c.cost for c in story.causes) >= -1e-9


def raster_end():
    piece = raster(lines=4, feed=0.2)
    return piece(np.array([piece.length]))[0]


@pytest.mark.slow
def test_explained_lower_bound_against_quadrature():
    m = machine(v=0.05)
    knots = tuple(np.linspace(0, 0.05, 52)[1:-1])
    piece = Piece(by_tip(line(), nodding(0.02, 0.3)), 0.05, 0.03, inner_knots=knots)
    trajectory = timed(Path((piece,)), m)

    def slowness(s):
        return max(1.0 / 0.03, float((np.abs(piece(np.array([s]), 1)[0]) / 0.05).max()))

    expected, _ = quad(slowness, 0.0, 0.05, limit=2000, points=np.linspace(0, 0.05, 200)[1:-1], epsrel=1e-6)
    assert explain(trajectory, m).lower_bound == pytest.approx(expected, rel=2e-4)


def test_explanation_names_a_slow_leg_and_its_places():
    """Leg 3 alone moves in segments 4 and 6, and speeds up and slows down there; segment 5 is slow by its feed."""
    sections = [(0.1, 0.3, SegmentKind.CUT, 4), (0.12, 0.001, SegmentKind.LINK, 5), (0.22, 0.3, SegmentKind.CUT, 6)]
    m = machine(v=9.0, a=0.5)
    trajectory = timed(Path((straight([0, 0, 1, 0, 0], 0.22, sections=sections),)), m, limit_jerk=False)
    story = explain(trajectory, m)
    costs = {c.name: c for c in story.causes}
    assert costs["leg 3 acceleration"].cost > 0.95 * story.gap
    assert costs["feed"].time > 19.9
    told = [place for place in story.places if place.cause == "leg 3 acceleration"]
    assert sum(place.cost for place in told) > 0.95 * story.gap
    assert {segment for place in told for segment in place.segments} >= {4, 6}
    assert all(place.stations[1] <= 0.1 + 1e-3 or place.stations[0] >= 0.12 - 1e-3 for place in told)
    assert str(told[0]).startswith("leg 3 acceleration: ")
    assert " s lost in segment" in str(told[0])
    assert "feed-limited for 19.9" in str(story) or "feed-limited for 20" in str(story)
    assert str(costs["feed"]).endswith("; shorter with a higher feed")
    slow = costs["leg 3 acceleration"]
    assert str(slow).endswith(f"; without this limit at most {slow.cost:.3g} s shorter")
    # By hand: from rest to 0.3 m/s and down to 0.001, twice, each time v²/2a at half the speed.
    assert story.gap == pytest.approx(4 * 0.5 * 0.3 / 0.5, rel=0.03)


def test_explanation_combines_neighbouring_places_only():
    """Turns of a raster: each turn is a place of its own; the segment is the same."""
    m = machine()
    trajectory = timed(Path((raster(lines=4, width=0.08, feed=0.3),)), m)
    story = explain(trajectory, m)
    turns = [p for p in story.places if p.stations[0] > 0.01 and p.stations[1] < trajectory.path.starts[-1] - 0.01]
    assert len(turns) >= 3
    starts = sorted(p.stations[0] for p in turns)
    assert all(p.stations[1] - p.stations[0] < 0.08 for p in turns)
    assert starts[-1] - starts[0] > 0.1


def test_explanation_is_json_for_a_report():
    m = machine()
    trajectory = timed(Path((raster(lines=3, feed=0.1),)), m)
    story = explain(trajectory, m, certify(trajectory, m))
    content = json.loads(json.dumps(story.to_dict(), allow_nan=False))
    assert content["gap"] == pytest.approx(story.gap)
    assert len(content["words"]) == len(content["places"])
    assert max(use["share"] for use in content["uses"] if "jerk" not in use["quantity"]) <= 1.01
    assert str(story).splitlines()[0].startswith("cycle time ")


def test_summary_of_a_cycle_time_adds_up_the_legs_and_begins_with_the_longest():
    m = machine()
    story = explain(timed(Path((raster(lines=6, width=0.08, feed=0.3),)), m), m)
    title, *lines = story.in_short().splitlines()
    assert title == str(story).splitlines()[0]
    told = {line.strip().split("-limited for ")[0]: float(line.split(" for ")[1].split(" s")[0]) for line in lines}
    assert list(told.values()) == sorted(told.values(), reverse=True)
    assert not any(re.match(r"leg \d", name) for name in told)
    acceleration = sum(cause.time for cause in story.causes if cause.name.endswith(" acceleration"))
    assert sum(cause.name.endswith(" acceleration") for cause in story.causes) > 1
    assert told["leg acceleration"] == pytest.approx(acceleration, rel=6e-3)
