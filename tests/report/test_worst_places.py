"""The table of worst places and the band of margins, on signals written by hand."""

import dataclasses
import re

import numpy as np
import pytest

from pentapod.machine import Machine
from pentapod.report.margin_band import margin_band
from pentapod.report.signals import Signals
from pentapod.report.worst import worst_places

ROWS = 100


@pytest.fixture
def signals():
    """A machine that stands in the middle of its strokes, with one row for each thing that is worst."""
    limits = Machine.load("desk").legs
    legs = np.tile(0.5 * (limits.min_length + limits.max_length), (ROWS, 1))
    rates, accelerations = np.full((ROWS, 5), 0.01), np.full((ROWS, 5), -0.1)
    legs[11, 3], legs[12, 1] = limits.min_length[3] + 1.5e-3, limits.max_length[1] - 2.5e-3
    rates[13, 4], accelerations[14, 0] = -0.4 * limits.max_velocity[4], 0.7 * limits.max_acceleration[0]
    margins = np.full((10, 2), 0.6)
    margins[7, 1] = 0.125
    cutting = np.arange(ROWS) >= 20
    speeds = np.full(ROWS, 0.025)
    speeds[30:33], speeds[50:60], speeds[:15] = 0.02, 0.02, 0.001
    return Signals(
        times=0.1 * np.arange(ROWS), segments=np.arange(ROWS) // 10, tips=np.full((ROWS, 3), -0.0125), legs=legs,
        axes=np.tile([0.0, 0.0, -1.0], (ROWS, 1)), rates=rates, accelerations=accelerations, margins=margins,
        margin_names=("leg 1 too long", "legs 1 and 2 touch"), margin_rows=10 * np.arange(10), cutting=cutting,
        speeds=speeds, speed_limits=np.full(ROWS, 0.025), causes=np.zeros(ROWS, dtype=np.intp), cause_names=("feed",),
    )  # fmt: skip


def test_worst_places_name_quantity_value_and_place(signals):
    found = {place.what: place for place in worst_places(signals, Machine.load("desk"))}
    wanted = {
        "smallest margin: legs 1 and 2 touch": (70, "0.125"),
        "leg 4, shortest against its stroke": (11, "1.50 mm above the shortest"),
        "leg 2, longest against its stroke": (12, "2.50 mm below the longest"),
        "leg 5, largest rate": (13, "200 mm/s, 40.0% of the limit"),
        "leg 1, largest acceleration": (14, "3500 mm/s², 70.0% of the limit"),
        "cutting below the programmed feed": (55, "16.2% of the cutting time"),
    }
    assert {what: (place.row, place.value) for what, place in found.items()} == wanted
    assert found["leg 5, largest rate"].where == "1.300 s, segment 1, tip at (−12.5, −12.5, −12.5) mm"
    assert found["leg 5, largest rate"].time == pytest.approx(1.3)
    assert found["cutting below the programmed feed"].where == "longest from 5.000 s to 5.900 s"


def test_worst_places_of_a_program_that_cuts_nothing_or_always_at_its_feed(signals):
    signals = dataclasses.replace(signals, speeds=np.full(ROWS, 0.025))
    (place,) = [p for p in worst_places(signals, Machine.load("desk")) if p.what.startswith("cutting")]
    assert (place.value, place.where, place.row, place.time) == ("0.0% of the cutting time", "", None, None)
    signals = dataclasses.replace(signals, cutting=np.zeros(ROWS, dtype=bool))
    assert not [p for p in worst_places(signals, Machine.load("desk")) if p.what.startswith("cutting")]


def test_margin_band_keeps_a_dip_of_one_waypoint():
    margins = np.tile([0.5, 0.8], (5000, 1))
    margins[1003, 1] = -0.25
    tips = np.column_stack([np.linspace(0.0, 1.0, 5000), np.zeros(5000), np.zeros(5000)])
    band = margin_band(tips, margins, ("leg 1 too long", "joint 2"))
    polygons = re.findall(r'<polygon points="([^"]*)"[^>]*><title>([^<]*)</title>', band)
    (points, title) = next((p, t) for p, t in polygons if t.startswith("joint 2"))
    assert title.endswith("smallest margin -0.250")
    zero = float(re.search(r'<line [^>]* y1="([0-9.]*)"', band)[1])
    places = [tuple(map(float, point.split(","))) for point in points.split()]
    assert max(y for _, y in places) > zero + 10.0
    assert "1000 mm along the path" in band
    assert len(band) < 100_000
