"""plan_measuring: a proven program through chosen poses, in a short order, and the file to fill in."""

from itertools import pairwise

import numpy as np
import pytest

from pentapod.base.errors import InputError
from pentapod.job.measuring.candidates import Instruments, candidates
from pentapod.job.measuring.measuring import MeasuringOptions, plan_measuring
from pentapod.job.measuring.order import short_order
from pentapod.kinematics import Component
from pentapod.machine import Instrument, Machine
from pentapod.planning.limits.margins import Margins
from pentapod.program import read_csv


@pytest.fixture(scope="module")
def desk() -> Machine:
    return Machine.load("desk")


def test_the_program_rests_in_the_poses_of_the_file(desk, tmp_path):
    found = plan_measuring(desk, tmp_path, 3, options=MeasuringOptions(dwell=0.2, random=5))
    assert found.verdict.passed
    assert {path.name for path in tmp_path.iterdir()} == {"program.csv", "verdict.json", "measurements.csv"}
    program = read_csv(tmp_path / "program.csv")
    assert program.component == Component(1, 1)
    for legs in found.poses.legs:
        near = np.abs(program.legs - legs).max(axis=1) < 1e-8
        assert near.sum() >= 0.2 / program.period, "it rests there"
    text = (tmp_path / "measurements.csv").read_text().splitlines()
    assert text[-1].startswith("3,")
    assert text[-1].endswith(",,,,,,")


@pytest.mark.parametrize("instrument", ["pose", "tracker", "ballbar"])
def test_candidates_keep_limits_and_component(desk, instrument):
    ball = (0.085, -0.017, 0.6) if instrument == "ballbar" else None
    found = candidates(desk, Component(1, 1), Instruments(Instrument(instrument), centre=ball, reach=(0.1, 0.17)))
    assert Margins.of(desk, Component(1, 1))(found.tips, found.axes).min() >= 0.05
    assert len(found.tips) > 50
    if ball is not None:
        distance = np.linalg.norm(found.tips - np.array(ball), axis=1)
        assert distance.min() >= 0.1
        assert distance.max() <= 0.17


def test_the_order_is_short_and_avoids_ways_through_limits():
    rng = np.random.default_rng(0)
    points = rng.random((9, 2))
    seconds = np.linalg.norm(points[:, None] - points[None], axis=-1)
    clear = np.ones((9, 9), dtype=bool)
    clear[0, :] = clear[:, 0] = False
    clear[0, 4] = clear[4, 0] = True
    order = short_order(seconds, clear).tolist()
    assert sorted(order) == list(range(9))
    assert all(clear[a, b] for a, b in pairwise(order))
    chance = np.mean([seconds[p[:-1], p[1:]].sum() for p in (rng.permutation(9) for _ in range(200))])
    assert seconds[order[:-1], order[1:]].sum() < 0.75 * chance


def test_bad_input(desk, tmp_path):
    with pytest.raises(InputError, match="wrong count of poses"):
        plan_measuring(desk, tmp_path, 5000)
    with pytest.raises(InputError, match="a ball bar needs its ball"):
        plan_measuring(desk, tmp_path, 20, Instruments(Instrument.BALLBAR))
    far = Instruments(Instrument.BALLBAR, centre=(9.0, 0.0, 0.0), reach=(0.1, 0.2))
    with pytest.raises(InputError, match="no pose of the work volume"):
        plan_measuring(desk, tmp_path, 20, far)
    assert list(tmp_path.iterdir()) == []
