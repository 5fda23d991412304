"""identify on bad measurements: units, swapped legs, outliers, another machine, too few or degenerate poses."""

from dataclasses import replace

import numpy as np
import pytest

from pentapod.base.errors import InputError
from pentapod.kinematics import Component
from pentapod.machine import identify
from true_machine import MACHINE, measured, poses

NUMBERS = {"pose": 20, "tracker": 30, "ballbar": 60}


@pytest.fixture(scope="module", params=NUMBERS)
def seen(request):
    return measured(request.param, NUMBERS[request.param], 1)


def said(seen):
    with pytest.raises(InputError) as caught:
        identify(seen, MACHINE, file="m.csv")
    text = str(caught.value)
    assert "\n" not in text
    return text


def test_metres_for_millimetres(seen):
    assert "m.csv: leg1_mm: the legs look like metres" in said(seen.with_legs(1e-3 * seen.legs))
    scale = np.ones(seen.seen.shape[1])
    scale[:3] = 1e-3
    assert "what the instrument saw looks like metres" in said(replace(seen, seen=seen.seen * scale))


def test_inches(seen):
    assert "the legs look like inches" in said(seen.with_legs(seen.legs / 25.4))


def test_swapped_legs_are_found_and_said(seen):
    assert "legs 2 and 4 are swapped; leg2_mm holds leg 4, leg4_mm holds leg 2" in said(
        seen.with_legs(seen.legs[:, [0, 3, 2, 1, 4]])
    )
    assert "leg1_mm holds leg 3, leg2_mm holds leg 1, leg3_mm holds leg 2" in said(
        seen.with_legs(seen.legs[:, [2, 0, 1, 3, 4]])
    )


def test_another_machine(seen):
    assert 'of another geometry: "desk"' in said(replace(seen, digest="0" * 16))


def test_poses_that_fit_nothing():
    seen = measured("tracker", 30, 1)
    assert "do not fit this machine" in said(replace(seen, seen=seen.seen[::-1]))


def test_too_few_poses(seen):
    assert "poses tell" in said(seen.some(np.arange(6)))
    assert identify(measured("pose", 4, 1), MACHINE, groups=["zeros"]).calibration.identified[0] == "leg 1 zero"


def test_one_pose_measured_again_and_again_fixes_no_frame():
    seen = measured("pose", 20, 1, own_frame=True)
    assert "m.csv: the positions are on a line" in said(seen.some(np.zeros(20, dtype=int)))


def test_reversed_axes_and_another_component():
    seen = measured("pose", 20, 1)
    turned = replace(seen, seen=np.hstack([seen.seen[:, :3], -seen.seen[:, 3:]]))
    assert "the tool axes point the wrong way" in said(turned)
    assert 'write component = "++"' in said(replace(seen, component=Component(1, -1)))


@pytest.mark.parametrize("given", [True, False])
def test_outliers_are_named(given):
    seen = measured("pose", 20, 1, given=given)
    legs, positions = seen.legs.copy(), seen.seen.copy()
    legs[9, 1] += 0.5e-3
    positions[4, 0] -= 0.5e-3
    found = identify(replace(seen, legs=legs, seen=positions), MACHINE)
    named = [str(outlier) for outlier in found.outliers]
    assert named[0].startswith("line 5: what the instrument saw is")
    assert "line 10: leg 2 reads 0.4" in named[1] or "line 10: leg 2 reads 0.5" in named[1]
    assert len(named) == 2
    assert found.tip_sigma < 20e-6
    kept = identify(replace(seen, legs=legs, seen=positions), MACHINE, keep_outliers=True)
    assert kept.outliers == ()
    assert len(kept.measured) == 20


@pytest.mark.parametrize("instrument", ["tracker", "ballbar"])
def test_outliers_of_partial_measurements(instrument):
    seen = measured(instrument, NUMBERS[instrument], 1, given=False)
    values = seen.seen.copy()
    values[[3, 17], 0] += [0.5e-3, -0.5e-3]
    found = identify(replace(seen, seen=values), MACHINE)
    assert [outlier.line for outlier in found.outliers] == [4, 18]
    assert all(0.4e-3 < outlier.off < 0.6e-3 for outlier in found.outliers)


def test_no_outliers_where_there_are_none():
    named = sum(len(identify(measured("pose", 20, seed), MACHINE).outliers) for seed in range(12))
    assert named <= 1


def test_poses_that_never_lean_name_their_ambiguity():
    tips, _ = poses(25, seed=3)
    axes = np.tile([0.0, 0.0, -1.0], (25, 1))
    seen = measured("pose", 25, 1, where=(tips, axes))
    found = identify(seen, MACHINE)
    assert "leg 1: offset +1, z +1 change no reading" in found.calibration.gauges
    assert found.tip_sigma > 0.2e-3, "what is not told counts with the tolerances of building"


def test_one_pose_again_and_again_is_no_calibration():
    found = identify(measured("pose", 20, 1).some(np.zeros(20, dtype=int)), MACHINE)
    assert len(found.calibration.identified) == 5
    assert found.tip_sigma > 0.5e-3


def test_positions_on_a_line_do_not_fix_a_frame():
    tips = MACHINE.work.centre + np.linspace(-0.05, 0.05, 25)[:, None] * [1.0, 0.0, 0.0]
    seen = measured("tracker", 25, 1, own_frame=True, where=(tips, np.tile([0.0, 0.0, -1.0], (25, 1))))
    assert "on a line" in said(seen)
