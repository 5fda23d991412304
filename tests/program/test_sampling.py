from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.component import COMPONENTS
from pentapod.machine import Machine
from pentapod.machine.parts import ControllerSettings
from pentapod.program import Provenance, quantised, read_csv, sample, write_csv


def swinging(duration):
    """A trajectory of cosines from rest to rest."""
    k = np.array([1, 2, 3, 4, 5]) * np.pi / duration

    def legs(t, order=0):
        return 0.7 + 0.05 * np.cos(k * np.asarray(t)[:, None])

    legs.duration = duration
    return legs


def sampled(duration, period, interpolation="linear"):
    machine = replace(Machine.load("desk"), controller=ControllerSettings(period, interpolation))
    source = Provenance("m", "d", "j", "v")
    return sample(swinging(duration), machine, RigidTransform.identity(), COMPONENTS[2], source)


@given(st.integers(1, 3000), st.sampled_from([1e-3, 1e-4, 1 / 1500, 0.008]))
def test_a_whole_number_of_periods_gives_that_many_intervals(count, period):
    program = sampled(count * period, period)
    assert len(program.legs) == count + 1
    assert program.duration == pytest.approx(count * period)
    assert np.allclose(program.legs, swinging(count * period)(program.times), atol=0.6e-11)


def test_the_last_row_is_the_end_point_whatever_the_period():
    program = sampled(0.1004, 1e-3)
    assert len(program.legs) == 102
    assert np.array_equal(program.legs[-1], quantised(swinging(0.1004)([0.1004]))[0])


def test_a_sampled_program_is_at_the_resolution_of_its_file(tmp_path):
    program = sampled(0.5, 1e-3, "cubic")
    back = read_csv(write_csv(program, tmp_path / "p.csv"))
    assert back.legs.tobytes() == program.legs.tobytes()
    assert (back.interpolation, back.component) == ("cubic", COMPONENTS[2])
