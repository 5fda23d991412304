"""The drives' forces in the verdict: beyond the peak, over the time, and what counts against the drives."""

from dataclasses import replace

import numpy as np
import pytest
import replay_cases as cases

from pentapod.machine import DriveForces
from pentapod.verify import CLAIMS
from pentapod.verify.replay.claim import Idle


def claimed(replay, name):
    (claim,) = (claim for claim in CLAIMS if claim.name == name)
    return claim(replay)


def limited(case, peak=1000.0, cutting=0.0, **forces):
    """The replay of a program on its machine with limited drives."""
    given = DriveForces(peak_force=np.full(5, peak), **{k: np.full(5, v) for k, v in forces.items()})
    replay = cases.replay_of(case)
    return cases.same_motion(replay, machine=replace(case.machine, drive_forces=given, cutting_force=cutting))


@pytest.fixture(scope="module", params=["linear", "cubic"])
def case(request):
    return request.getfixturevalue(request.param)


def test_the_largest_force_passes_at_the_peak_and_fails_beyond(case):
    forces = limited(case).forces
    most = np.abs(forces.push).max()
    assert 20.0 < most < 2000.0
    row, leg = np.unravel_index(int(np.abs(forces.push).argmax()), forces.push.shape)
    for share, holds in ((0.9e-3, True), (1.1e-3, False)):
        found = claimed(limited(case, most / (1.0 + share)), "leg forces")
        assert found.passed is holds
        assert found.unit == "N"
        assert found.value == pytest.approx(most)
        assert found.where.row == row
        assert found.method.startswith(f"leg {leg + 1} is closest")


def test_friction_cutting_and_speed_count_against_the_drive(case):
    plain = limited(case)
    whole = limited(case, cutting=10.0, coulomb_friction=7.0, knee_velocity=0.0, no_load_velocity=1.0)
    forces, before = whole.forces, plain.forces
    reach = forces.cutting.max(axis=1) > 0.0
    assert 0.2 < reach.mean() < 1.0  # on cuts alone
    np.testing.assert_allclose(forces.asked, np.abs(before.push) + 7.0 + forces.cutting, atol=1e-9)
    assert (forces.available < 1000.0).any()
    found, less = claimed(whole, "leg forces"), claimed(plain, "leg forces")
    assert found.value / found.bound > less.value / less.bound
    assert "10 N in any direction on the tip" in found.method


def test_the_mean_over_the_program_is_judged_by_the_continuous_force(case):
    forces = limited(case).forces
    mean = np.sqrt(np.square(forces.push).mean(axis=0))
    for share, holds in ((0.9e-3, True), (1.1e-3, False)):
        found = claimed(limited(case, continuous_force=mean.max() / (1.0 + share)), "continuous leg forces")
        assert found.passed is holds
        assert found.value == pytest.approx(mean.max())
        assert f"leg {int(mean.argmax()) + 1} " in found.method


def test_machines_that_say_nothing_of_their_drives_are_not_judged(case):
    replay = cases.replay_of(case)
    assert all(isinstance(claimed(replay, name), Idle) for name in ("leg forces", "continuous leg forces"))
