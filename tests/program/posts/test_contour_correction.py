"""The contour correction for LinuxCNC: its mathematics against the simulation's, its bounds, and what it is worth."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from compiled_contour import CHANGE_MM, LAGS, MM, REST, Contour, Run, accelerations, commanded, contour_um, lagging
from compiled_kinematics import calibrated, compiled, poses
from pentapod.kinematics.component import COMPONENTS
from pentapod.machine import Machine
from pentapod.program.posts import PostInput
from pentapod.program.posts.linuxcnc.contour import calm_correction, contour_values
from pentapod.program.posts.linuxcnc.kinematics import controller_frame, kinematics_files
from pentapod.program.posts.linuxcnc.module import Module
from pentapod.program.posts.linuxcnc.player import player_files
from pentapod.simulate import Reference, simulate_servo
from pentapod.simulate.servo import _forward
from pentapod.simulate.servo_kernels import contour, correct
from short_motion import motion

pytestmark = compiled


def window_of(machine: Machine) -> int:
    module = Module(machine, COMPONENTS[0], controller_frame(machine, COMPONENTS[0]), ())
    return int(np.asarray(contour_values(module, 1e-3)["WINDOW"]))


def ways(machine: Machine, count: int, rows: int, seed: int, bend: float = 1.0):
    """Smooth ways of points and directions (count, 2 rows − 1, 3), half a millisecond apart, from random poses."""
    rng = np.random.default_rng(seed)
    p, i = poses(machine, count, seed)
    t = 5e-4 * np.arange(2 * rows - 1)[None, :, None]
    rates, bends = rng.normal(size=(2, 2, count, 1, 3)) * np.array([[0.05], [bend]])[:, :, None, None, None]
    points = p[:, None] + t * (rates[0] + 0.5 * t * bends[0])
    directions = i[:, None] + t * (rates[1] + 0.5 * t * bends[1])
    return points, directions / np.linalg.norm(directions, axis=-1, keepdims=True)


def test_errors_of_the_legs_are_those_of_the_simulation(tmp_path):
    machine, count = Machine.load("desk"), 100_000
    window = window_of(machine)
    points, directions = ways(machine, count, window + 2, 1)
    rng = np.random.default_rng(2)
    at = rng.integers(2, 2 * window + 2, count)
    legs = machine.robot.leg_lengths(points[np.arange(count), at], directions[np.arange(count), at])
    legs += rng.uniform(-2e-6, 2e-6, legs.shape)
    paths = machine.robot.leg_lengths(points[:, ::2].reshape(-1, 3), directions[:, ::2].reshape(-1, 3))
    found = Contour(machine, tmp_path).errors(MM * paths.reshape(count, -1, 5), MM * legs)
    expected, tips = np.empty((count, 5)), points + machine.tool_length * directions
    robot, component = machine.robot, np.array([COMPONENTS[0]], dtype=np.float64)
    fixed = (*_forward(robot, machine.tool_length), component, robot.base_joints, robot.offsets)
    for k in range(count):
        contour(legs[k], window, window - 1, (*fixed, tips[k], directions[k]), expected[k])
    # The simulation leaves out poses near singular ones, and takes the Jacobian for small differences of lengths.
    taken = expected.any(axis=1)
    assert taken.mean() > 0.97
    assert np.abs(found[taken, :5] - MM * expected[taken]).max() < 1e-5
    assert np.isfinite(found).all()


def test_commands_are_those_of_the_simulations_correction(tmp_path):
    """The same filter and model, without feedback of the model's states, on errors at random."""
    machine = lagging(Machine.load("desk"))
    errors = np.random.default_rng(3).normal(size=(100_000, 5))
    found = Contour(machine, tmp_path).filtered(errors)
    design = calm_correction(machine.drives, 1e-3)
    state, trend, shift = np.zeros(design.input_vector.shape), np.zeros((2, 5)), np.zeros(5)
    for k, error in enumerate(errors):
        correct(error, design.feedback, state, trend, shift)
        assert np.abs(shift - found[k]).max() < 1e-9


@pytest.mark.parametrize("name", ["desk", "as built", "as built with rings"])
def test_errors_lead_to_the_nearest_pose_of_the_path(name, tmp_path):
    """The nearest of 20,000 poses of the way, as far as these are apart; forward kinematics of the robot."""
    machine = {"desk": lambda: Machine.load("desk"), "as built": lambda: calibrated(3)}.get(
        name, lambda: calibrated(4, 0.012)
    )()
    count, window = 60, window_of(machine)
    points, directions = ways(machine, count, window + 2, 5, bend=0.01)
    rng = np.random.default_rng(6)
    paths = machine.robot.leg_lengths(points[:, ::2].reshape(-1, 3), directions[:, ::2].reshape(-1, 3))
    legs = paths.reshape(count, -1, 5)[:, window] + rng.uniform(-5e-5, 5e-5, (count, 5))
    found = Contour(machine, tmp_path).errors(MM * paths.reshape(count, -1, 5), MM * legs)
    p, i = machine.robot.pose(legs, COMPONENTS[0])
    good = np.flatnonzero(np.isfinite(p[:, 0]))  # with rings the design may have no pose of these readings
    assert len(good) > 0.9 * count
    fine = np.linspace(2.0, 2.0 * window + 2.0, 20_001)
    for k in good:
        t = np.arange(2 * window + 3)
        on = [np.stack([np.polynomial.Polynomial.fit(t, column, 4)(fine) for column in way[k].T], axis=1)
              for way in (points, directions)]  # fmt: skip
        tips, ends = on[0] + machine.tool_length * on[1], machine.tool_length * on[1]
        away = ((tips - p[k] - machine.tool_length * i[k]) ** 2).sum(axis=1)
        best = int(np.argmin(away + ((ends - machine.tool_length * i[k]) ** 2).sum(axis=1)))
        expected = machine.robot.leg_lengths(on[0][best][None], on[1][best][None])[0] - legs[k]
        assert np.abs(MM * expected - found[k, :5]).max() < 2e-4
        assert MM * np.sqrt(away[best]) == pytest.approx(found[k, 5], abs=2e-4)


def test_correction_is_worth_what_the_simulation_predicts(tmp_path):
    program, machine = motion(6.0)[0], lagging(motion(0.1)[1])
    reference, module = Reference(program, machine), Contour(machine, tmp_path)
    largest: dict[bool, tuple[float, float]] = {}
    for on in (False, True):
        run = module.run(commanded(6.0), LAGS, on, bound=0.5)
        legs = run.legs[REST : REST + len(program.legs)] / MM
        predicted = simulate_servo(reference, correct=on).legs
        largest[on] = tuple(float(contour_um(machine, reference, each).max()) for each in (legs, predicted))
    assert largest[False][0] == pytest.approx(largest[False][1], rel=0.02)
    assert largest[False][0] > 100.0
    assert largest[False][0] > 100.0 * largest[True][0]
    assert largest[True][1] < largest[True][0] < 1.0  # the simulation's inverts the drives as well


def test_correction_stays_good_where_the_model_is_wrong(tmp_path):
    """Drives up to five times as quick as the machine file says, as with their own feed-forward, and half as quick."""
    module = Contour(lagging(Machine.load("desk")), tmp_path)
    for factor, ratio in ((0.2, 20.0), (0.5, 20.0), (1.3, 20.0), (2.0, 10.0)):
        plain, corrected = (module.run(commanded(6.0), factor * LAGS, on, bound=1.0, range_mm=5.0) for on in (0, 1))
        assert plain.errors.max() > ratio * corrected.errors[REST + 100 :].max(), factor
        assert np.ptp(corrected.sizes[-50:]) < 1e-6  # at rest it rests


def bounded(run: Run, commands: np.ndarray, bound: float) -> None:
    """The correction is within its bound in each period, its acceleration within its share, the sum within the limit.

    Where the program itself uses more than nine tenths of the limit, the sum may be beyond it by what is needed to stop
    at the bound, which is less than the share.
    """
    shifts = run.commands - commands
    assert np.abs(shifts).max() <= bound + 1e-12
    assert accelerations(shifts).max() <= CHANGE_MM * (1.0 + 1e-6)
    most = max(5000e-6, accelerations(commands).max() + CHANGE_MM)
    assert accelerations(run.commands).max() <= most * (1.0 + 1e-6)


@pytest.mark.parametrize("duration", [0.842, 1.2, 6.0])
@pytest.mark.parametrize("bound", [0.002, 0.05, 0.5])
def test_bound_and_accelerations_hold_whatever_happens(duration, bound, tmp_path):
    """Switched at random, pushed, with a scale that stands still. 0.842 s takes 98 % of what the legs have."""
    commands = commanded(duration)
    module, rng = Contour(lagging(Machine.load("desk")), tmp_path), np.random.default_rng(7)
    switched = np.repeat(rng.integers(0, 2, len(commands) // 37 + 1), 37)[: len(commands)]
    steps = np.repeat(rng.uniform(-0.2, 0.2, (len(commands) // 150 + 1, 5)), 150, axis=0)[: len(commands)]
    noise = rng.normal(size=commands.shape) * 1e-3
    for leg in range(5):
        for given in ({"enable": switched}, {"pushed": steps}, {"pushed": noise}, {"stuck": (leg, REST + 200)},
                      {"enable": switched, "pushed": steps + noise, "stuck": (leg, REST + 300)}):  # fmt: skip
            bounded(module.run(commands, LAGS, bound=bound, **given), commands, bound)


def test_switching_moves_smoothly_and_ends_at_the_command_exactly(tmp_path):
    commands = np.repeat(commanded(6.0)[:1], 2000, axis=0)
    pushed = np.zeros_like(commands)
    pushed[:, 0] = 0.03
    on = np.zeros(2000, dtype=bool)
    on[500:1200] = True
    run = Contour(lagging(Machine.load("desk")), tmp_path).run(commands, LAGS, on, pushed)
    assert np.array_equal(run.commands[:500], commands[:500])
    assert np.array_equal(run.active, on)
    assert run.commands[1100, 0] - commands[0, 0] == pytest.approx(-0.03, abs=1e-4)
    assert run.errors[1100] < 1e-3 * run.errors[499]
    assert np.array_equal(run.commands[1400:], commands[1400:])
    assert not run.bounded.any()
    bounded(run, commands, 0.05)


def test_bit_tells_that_more_was_wanted_until_it_is_switched_on_again(tmp_path):
    commands = np.repeat(commanded(6.0)[:1], 2000, axis=0)
    pushed, on = np.zeros_like(commands), np.ones(2000, dtype=bool)
    pushed[300:600, 0] = 0.03
    on[1000:1100] = False
    run = Contour(lagging(Machine.load("desk")), tmp_path).run(commands, LAGS, on, pushed, bound=0.01)
    assert not run.bounded[:300].any()
    assert run.bounded[310:1100].all()
    assert not run.bounded[1100:].any()
    assert run.sizes.max() == pytest.approx(0.01, abs=1e-9)
    assert not run.sizes[900:].any() or run.sizes[900:].max() < 1e-6


def test_scales_without_a_pose_or_far_from_the_path_take_the_correction_to_zero_in_a_ramp(tmp_path):
    """A scale that reads nonsense, and one that is 3 mm off: the command is left alone, and taken up again after."""
    commands = np.repeat(commanded(6.0)[:1], 3000, axis=0)
    module = Contour(lagging(Machine.load("desk")), tmp_path)
    for wrong in (1e4, np.nan, 3.0):
        pushed = np.full_like(commands, 0.01) * [1, 0, -1, 0, 1]
        pushed[1000:1500, 2] = wrong
        run = module.run(commands, LAGS, True, pushed)
        assert run.active[500:1000].all()
        assert not run.active[1000:1500].any()
        assert run.sizes[999] > 0.005
        assert np.array_equal(run.commands[1300:1500], commands[1300:1500])
        assert run.active[2000:].all()
        assert run.sizes[-1] == pytest.approx(run.sizes[999], abs=1e-4)
        bounded(run, commands, 0.05)


def test_path_begins_anew_where_the_legs_jump(tmp_path):
    """As in homing: commands without a pose, then another place at once."""
    home = commanded(6.0)
    commands = np.concatenate([np.zeros((100, 5)), home])
    run = Contour(lagging(Machine.load("desk")), tmp_path).run(commands, LAGS, True, bound=0.5)
    assert not run.sizes[:101].any()
    assert np.isfinite(run.commands).all()
    assert np.abs(run.commands - commands).max() <= 0.5
    assert run.errors[100 + 2 * REST :].max() < 1e-3


def test_drives_without_a_stable_correction_have_none(tmp_path):
    machine = Machine.load("desk")
    late = dataclasses.replace(machine, drives=dataclasses.replace(machine.drives, dead_time=0.02))
    files = kinematics_files(late, COMPONENTS[0], 1e-3)
    assert "pentapod_contour.c" not in files
    assert b"contour" not in files["pentapod.hal"] + files["pentapod.ini"]
    assert files["pentapod.hal"].count(b"motor-pos-fb") == 5


def test_correction_is_off_in_all_that_is_written(tmp_path):
    program, machine = motion(0.2)
    files = kinematics_files(machine, COMPONENTS[0], 1e-3)
    assert b"[CONTOUR]\nENABLE = 0\nBOUND_UM = 50\nACCELERATION_SHARE = 0.3\n" in files["pentapod.ini"]
    played = player_files(PostInput(program, machine))
    assert played["pentapod_contour.h"] == files["pentapod_contour.h"]
    assert b"enable" not in b"".join(line for line in played["player.hal"].splitlines() if b"contour" in line)
    folder = Path(tmp_path)
    for name in ("pentapod_contour.h", "pentapod_contour.c"):
        assert b"@" not in files[name]
        (folder / name).write_bytes(files[name])
    assert b"NEW_BIT(owner, HAL_IN, pins->enable, 0," in files["pentapod_contour.c"]
