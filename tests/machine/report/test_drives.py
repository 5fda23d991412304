"""What `pentapod machine check` says of the drives: by hand, and no less than what any motion asks for."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pentapod.machine import DriveForces, Dynamics, Machine, check, explain

EXAMPLE = Path(__file__).parents[3] / "examples" / "desk-forces.toml"


@pytest.fixture(scope="module")
def desk() -> Machine:
    machine = Machine.load("desk")
    return replace(machine, drive_forces=DriveForces(peak_force=np.full(5, 900.0)))


def test_the_force_for_the_acceleration_limits_covers_every_motion_at_rest(desk: Machine) -> None:
    drives = check(desk).drives
    assert drives is not None
    rng, i = np.random.default_rng(1), np.array([0.0, 0.0, 1.0])
    p = np.tile(desk.work.centre - desk.tool_length * i, (2000, 1))
    signs = rng.choice([-1.0, 1.0], (2000, 5)) * desk.legs.max_acceleration
    terms = Dynamics.of(desk).of_rows(p, np.tile(i, (2000, 1)), np.zeros((2000, 5)), signs)
    found = np.abs(terms.quadratic + terms.weight).max(axis=0)
    assert (found <= drives.needed).all()
    assert drives.needed.max() > 1.3 * 100.0 * 5.0  # more than mass times acceleration
    assert (found > 0.75 * drives.needed).all()


def test_drives_that_have_just_that_force_keep_the_limits_and_weaker_ones_a_share(desk: Machine) -> None:
    needed = check(desk).drives.needed
    just = replace(desk, drive_forces=DriveForces(peak_force=np.full(5, needed.max() * 1.0001)))
    assert check(just).drives.share >= 1.0
    half = replace(desk, drive_forces=DriveForces(peak_force=np.full(5, 0.6 * needed.max())))
    report = check(half)
    assert 0.4 < report.drives.share < 0.6
    assert f"{1e3 * report.drives.share * 5.0:.0f} mm/s²" in explain(report)
    assert "plans are slower" in explain(report)


def test_the_example_keeps_its_limits_and_machines_without_forces_say_nothing() -> None:
    assert "100% of the limits" in explain(check(Machine.load(EXAMPLE)))
    assert check(Machine.load("desk")).drives is None
