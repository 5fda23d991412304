"""Recorded runs: errors that were put into a log are found again, whatever the run's start, pace, holds and gaps."""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path

import numpy as np
import pytest
from recorded_logs import log_of, paced, with_errors

from pentapod.base.errors import InputError
from pentapod.machine import Machine, Stiffness
from pentapod.program import Program
from pentapod.program.commands import commanded
from pentapod.program.posts.motion import lengths_at
from pentapod.program.program import ProcessForce
from pentapod.simulate import Reference, simulate_servo
from pentapod.simulate.forces import leg_loads
from pentapod.simulate.recorded.comparison import compare

sys.path.append(str(Path(__file__).parents[2]))
from short_motion import loop, motion

UM = 1e-6


@pytest.fixture(scope="module")
def reference():
    return Reference(*motion(3.0))


def measure(run, name):
    return next(m for m in run.measures if m.name == name)


def test_injected_errors_of_the_legs_are_found_in_time(reference) -> None:
    asked = {
        "offset": np.array([0.0, 15.0, -30.0, 5.0, 0.0]) * UM,
        "scale": np.array([200.0, 0.0, -100.0, 0.0, 50.0]) * UM,
        "drift": np.array([0.0, 0.0, 0.0, 8.0, -4.0]) * UM,
        "lag": np.array([-2.0, -1.0, 0.0, 1.0, 2.0]) * 1e-3,
    }
    due = np.clip(np.arange(-400, 3300) * 1e-3, 0.0, 3.0)
    times = np.arange(len(due)) * 1e-3
    run = compare(log_of(times, with_errors(reference.program, due, **asked)), reference)
    assert run.start == pytest.approx(0.4, abs=1e-3)
    assert run.complete
    assert not run.holds
    found = run.errors
    assert found.lag - found.lag[2] == pytest.approx(asked["lag"], abs=0.06e-3)
    assert found.scale == pytest.approx(asked["scale"], abs=12.0 * UM)
    assert found.drift == pytest.approx(asked["drift"], abs=0.15 * UM)
    middle = float(np.mean(run.times)) * asked["drift"]
    assert found.offset == pytest.approx(asked["offset"] + middle, abs=0.5 * UM)
    assert run.pace[(run.times > 1.0) & (run.times < 2.8)] == pytest.approx(1.0, abs=0.02)


def test_lag_is_absolute_where_commands_were_recorded(reference) -> None:
    due = np.clip(np.arange(-400, 3300) * 1e-3, 0.0, 3.0)
    times, told = np.arange(len(due)) * 1e-3, lengths_at(reference.program, due)
    run = compare(log_of(times, with_errors(reference.program, due, lag=4e-3), told), reference)
    assert run.start == pytest.approx(0.4, abs=1e-6)
    assert run.errors.lag == pytest.approx(4e-3, rel=0.02)
    follows = np.abs(with_errors(reference.program, due, lag=4e-3) - told).max()
    assert measure(run, "following error").largest == pytest.approx(1e3 * follows, rel=1e-6)
    # The tip is late on its path, not off it.
    assert measure(run, "tip error in time").largest > 20.0 * measure(run, "contour error").largest


def test_a_common_lag_moves_the_start_where_no_commands_were_recorded(reference) -> None:
    due = np.clip(np.arange(-400, 3300) * 1e-3, 0.0, 3.0)
    run = compare(log_of(np.arange(len(due)) * 1e-3, with_errors(reference.program, due, lag=4e-3)), reference)
    assert run.start == pytest.approx(0.404, abs=1e-6)
    assert not run.errors.lag_is_absolute
    assert np.abs(run.errors.lag).max() < 1e-6


PACES = {
    "hold": [(0.0, 1.0), (1.2, 0.0), (2.7, 1.0)],
    "override": [(0.0, 0.5), (2.0, 1.2), (3.0, 0.7)],
    "both": [(0.0, 0.8), (1.0, 0.0), (1.5, 0.3), (3.0, 1.2)],
}


@pytest.mark.parametrize("changes", PACES.values(), ids=PACES)
def test_held_and_overridden_runs_are_judged_against_the_path(reference, changes) -> None:
    times, due = paced(reference.program, changes, 6.5)
    offset, scale = np.array([20.0, 0.0, -10.0, 0.0, 0.0]) * UM, np.array([0.0, 0.0, 0.0, 150.0, 0.0]) * UM
    clean = compare(log_of(times, lengths_at(reference.program, due)), reference)
    assert clean.start is None
    assert clean.complete
    assert measure(clean, "contour error").largest < 2e-4
    assert {m.name for m in clean.measures}.isdisjoint({"tip error in time", "axis error in time"})
    noise = np.random.default_rng(0).normal(0.0, 0.2 * UM, (len(due), 5))
    run = compare(log_of(times, with_errors(reference.program, due, offset=offset, scale=scale) + noise), reference)
    assert run.errors.offset == pytest.approx(offset, abs=0.7 * UM)
    assert run.errors.scale == pytest.approx(scale, abs=12.0 * UM)
    # The same errors without a hold are as far off the path.
    even = np.clip(np.arange(3200) * 1e-3, 0.0, 3.0)
    same = with_errors(reference.program, even, offset=offset, scale=scale)
    plain = compare(log_of(np.arange(3200) * 1e-3, same), reference)
    assert measure(run, "contour error").largest == pytest.approx(measure(plain, "contour error").largest, rel=0.05)
    places = run.alignment.places * reference.program.period
    moving = run.alignment.moving
    assert np.abs(places - due[run.alignment.first : run.alignment.last])[moving].max() < 0.02


def test_holds_are_told_with_time_place_and_duration(reference) -> None:
    times, due = paced(reference.program, PACES["hold"], 6.5)
    run = compare(log_of(times, lengths_at(reference.program, due)), reference)
    (hold,) = run.holds
    standing = times[(np.diff(due, prepend=-1.0) < 1e-6) & (due < 2.9)]
    assert hold.time == pytest.approx(standing[0], abs=0.03)
    assert hold.duration == pytest.approx(np.ptp(standing), abs=0.06)
    assert hold.program_time == pytest.approx(due[times.searchsorted(2.0)], abs=0.01)


def there_and_back(reference) -> Reference:
    """Half of the motion, a dwell, and the same way back."""
    one = reference.program.legs[: len(reference.program.legs) // 2 + 400]
    legs = np.concatenate([one, np.tile(one[-1:], (500, 1)), one[::-1], one])
    return Reference(dataclasses.replace(reference.program, legs=legs, interpolation="linear"), reference.machine)


def test_a_way_that_is_gone_three_times_is_followed_in_order(reference) -> None:
    again = there_and_back(reference)
    times, due = paced(again.program, [(0.0, 0.7), (2.0, 1.2), (4.5, 0.0), (5.0, 0.8)], 11.0)
    run = compare(log_of(times, lengths_at(again.program, due)), again)
    assert measure(run, "contour error").largest < 2e-3
    places, moving = run.alignment.places * again.program.period, run.alignment.moving
    assert np.abs(places - due[run.alignment.first : run.alignment.last])[moving].max() < 0.03


def test_part_of_a_run_with_ways_before_and_after_it(reference) -> None:
    program, rng = reference.program, np.random.default_rng(1)
    due = np.arange(700, 2100) * 1e-3
    legs = lengths_at(program, due)
    away = 0.02 * np.sin(np.linspace(0.5 * np.pi, 0.0, 800))[:, None] * rng.uniform(0.7, 1.0, 5)
    legs = np.concatenate([legs[:1] + away, legs, legs[-1:] + away[::-1]])
    run = compare(log_of(np.arange(len(legs)) * 1e-3, legs), reference)
    assert not run.complete
    assert run.covered == pytest.approx((0.7, 2.1), abs=0.05)  # 1 mm of the ways
    assert run.start == pytest.approx(0.1, abs=1e-3)
    during = (run.times > 0.81) & (run.times < 2.19)
    assert measure(run, "contour error").values[during].max() < 1e-3
    # What is within a millimetre of the path before and after is told, not cut away.
    assert 0.5 < measure(run, "contour error").largest < 2.0


def test_other_periods_and_gaps(reference) -> None:
    due = np.clip(np.arange(-100, 1700) * 2e-3, 0.0, 3.0)
    times = np.arange(len(due)) * 2e-3
    kept = np.r_[0:700, 740:1800]
    legs = with_errors(reference.program, due, offset=10.0 * UM)
    run = compare(log_of(times[kept], legs[kept]), reference)
    assert run.log.lost == 40
    assert run.start == pytest.approx(0.2, abs=1e-5)
    assert run.errors.offset == pytest.approx(10.0 * UM, abs=0.1 * UM)


def test_other_programs_are_no_runs_of_this_one(reference) -> None:
    legs = reference.program.legs + np.array([0.03, -0.03, 0.03, -0.03, 0.03])
    with pytest.raises(InputError, match=r"not a run of this program.*; expected legs of .* mm; give the program"):
        compare(log_of(np.arange(len(legs)) * 1e-3, legs), reference)
    with pytest.raises(InputError, match=r"the legs are 0\.001\d* times as long .*--columns"):
        compare(log_of(np.arange(len(legs)) * 1e-3, 1e-3 * legs), reference)


def test_a_path_that_comes_near_for_a_moment_is_no_run(reference) -> None:
    """Long logs of another program, or of exchanged columns, cross the path somewhere."""
    legs = lengths_at(reference.program, np.arange(1000, 1250) * 1e-3)
    away = 0.05 * np.sin(np.linspace(0.0, 0.5 * np.pi, 400))[:, None] * np.array([1.0, -0.8, 0.9, -0.7, 0.6])
    long = np.repeat(away[-1:], 4000, axis=0)
    near = np.concatenate([legs[:1] + long, legs[:1] + away[::-1], legs, legs[-1:] + away, legs[-1:] + long])
    with pytest.raises(InputError, match="not a run of this program"):
        compare(log_of(np.arange(len(near)) * 1e-3, near), reference)
    alone = compare(log_of(np.arange(len(legs)) * 1e-3, legs), reference)  # a log cut to its run is one
    assert alone.covered == pytest.approx((1.0, 1.25), abs=0.05)


def test_simulated_drives_are_measured_as_the_simulation_measures_them(reference) -> None:
    drives = dataclasses.replace(reference.machine.drives, velocity_feedforward=0.9, ripple_force=0.0)
    slow = Reference(reference.program, dataclasses.replace(reference.machine, drives=drives))
    played = simulate_servo(slow, seed=1).unwrap()
    told = reference.program.legs
    run = compare(log_of(np.arange(len(told)) * 1e-3, played.legs, told), reference)
    # A tenth of the velocity is not fed forward: late by that over the gain.
    assert run.errors.lag == pytest.approx(0.1 / drives.position_gain[0], rel=0.2)
    off = 1e3 * np.linalg.norm(played.tips - reference.tips[::2], axis=1)
    assert measure(run, "tip error in time").largest == pytest.approx(off.max(), rel=0.02)


def test_expected_forces_are_those_of_the_motion(reference) -> None:
    program, machine = reference.program, reference.machine
    needed = leg_loads(reference) + machine.drives.moving_mass * np.gradient(
        np.gradient(program.legs, 1e-3, axis=0), 1e-3, axis=0
    )
    forces = needed + np.array([0.0, 0.0, 12.0, 0.0, 0.0])
    run = compare(log_of(program.times, program.legs, forces=forces), reference)
    assert run.expected == pytest.approx(needed, abs=0.5)
    assert measure(run, "force difference").rms == pytest.approx(12.0, abs=0.2)


def test_commands_of_a_leg_model_are_read_as_legs(reference) -> None:
    model = dataclasses.replace(reference.machine.leg_model, expansion=11.5e-6, temperature=30.0)
    machine = dataclasses.replace(reference.machine, leg_model=model)
    program: Program = reference.program
    told = machine.commands(program.legs, np.array(program.component))
    assert np.abs(told - program.legs).max() > 20.0 * UM
    run = compare(log_of(program.times, told), Reference(program, machine))
    assert measure(run, "leg error").largest < 1e-6


@pytest.mark.parametrize("force", [None, ProcessForce(50.0, ((100, 1400), (1600, 2900)))])
def test_what_drives_make_good_is_taken_out(reference, force) -> None:
    """Legs that yield: the drives count more than the length of a leg under its load."""
    stiffness = Stiffness(leg_stiffness=np.full(5, 10e6))
    machine = dataclasses.replace(reference.machine, stiffness=stiffness)
    source = dataclasses.replace(reference.program.provenance, compensation="gravity")
    program = dataclasses.replace(reference.program, provenance=source, process_force=force)
    told = commanded(program, machine)
    assert np.abs(told.legs - program.legs).max() > 3.0 * UM
    run = compare(log_of(program.times, told.legs), Reference(program, machine))
    most = 1e-6 if force is None else 0.1 * 1e3 * np.abs(told.legs - program.legs).max()  # mm; the place is not exact
    assert measure(run, "leg error").largest < most


@pytest.mark.parametrize("name", ["hexa", "prpu", "bench-general"])
def test_other_machines_run_too(name) -> None:
    machine = Machine.load(name)
    program = loop(machine, 1.5)
    offset = np.zeros(program.legs.shape[1])
    offset[0] = 20.0 * UM
    times, due = paced(program, [(0.0, 1.0), (0.6, 0.0), (1.1, 0.8)], 3.0)
    held = compare(log_of(times, lengths_at(program, due) + offset), Reference(program, machine))
    assert held.errors.offset == pytest.approx(offset, abs=1.0 * UM)
    assert len(held.holds) == 1
    assert (held.expected is None) == (not machine.leg_forces_known)
    run = compare(log_of(program.times, program.legs + offset), Reference(program, machine))
    assert run.errors.offset == pytest.approx(offset, abs=0.01 * UM)
    assert measure(run, "contour error").largest == pytest.approx(measure(held, "contour error").largest, rel=0.02)
