"""Servo drives against the same linear drive in scipy, against statics, and against what they are for."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.signal import cont2discrete, dlsim, lsim
from servo_runs import LINEAR, played

from pentapod.base.errors import InputError, ProgramError
from pentapod.base.refusal import Refusal
from pentapod.kinematics.component import COMPONENTS
from pentapod.machine import Machine
from pentapod.program import Program
from pentapod.simulate import Reference, contour_errors, simulate_servo
from short_motion import motion


@pytest.mark.parametrize(("delay", "shares"), [(0, (1.0, 1.0)), (2, (1.0, 1.0)), (3, (0.0, 0.0)), (1, (0.7, 0.4))])
def test_servo_equals_the_discrete_linear_system(delay, shares):
    gains = np.array([[80, 60, 90, 70, 100.0], [600, 500, 700, 650, 550.0], [50, 30, 0, 80, 120.0]])
    dt = 1.25e-4
    drives = LINEAR | {"dead_time": delay * dt, "period": dt}
    result, reference = played(
        0.4, position_gain=gains[0], velocity_gain=gains[1], velocity_integral=gains[2], **drives,
        velocity_feedforward=shares[0], acceleration_feedforward=shares[1],
    )  # fmt: skip
    wanted = reference.at(8)
    free = np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0]]), np.eye(2), np.zeros((2, 1))
    plant, push, *_ = cont2discrete(free, dt)
    for leg in range(5):
        kp, kv, ki = gains[:, leg]
        # States: place, rate, place before, integral, and the efforts on their way.
        n = 4 + delay
        A, B = np.zeros((n, n)), np.zeros((n, 3))
        slow, slow_by = np.zeros(n), np.array([kp, shares[0], 0.0])
        slow[0], slow[2] = -kp - 1.0 / dt, 1.0 / dt
        effort, by = kv * (1.0 + ki * dt) * slow, kv * (1.0 + ki * dt) * slow_by + [0.0, 0.0, shares[1]]
        effort[3] += kv * ki
        A[:2, :2], A[2, 0], A[3], B[3] = plant, 1.0, dt * slow, dt * slow_by
        A[3, 3] = 1.0
        if delay:
            A[:2, -1], A[4], B[4] = push[:, 0], effort, by
            A[5:, 4:-1] = np.eye(delay - 1)
        else:
            A[:2] += push @ effort[None]
            B[:2] = push @ by[None]
        start = wanted[0][0, leg]
        u = np.stack([values[:, leg] for values in wanted], axis=1) - [start, 0.0, 0.0]
        _, y, _ = dlsim((A, B, np.eye(n)[:1], np.zeros((1, 3)), dt), u)
        np.testing.assert_allclose(result.legs[:, leg], start + y[::8, 0], atol=1e-12, rtol=0)


def test_servo_with_fine_sampling_converges_to_the_continuous_drive():
    """A loop sampled ever faster is the drive of the textbook, to first order in the period."""
    off = []
    for period in (5e-5, 2.5e-5):
        result, reference = played(0.4, **LINEAR, period=period, velocity_feedforward=0.5)
        lengths, rates, accelerations = reference.at(20)
        u = np.stack([lengths[:, 0] - lengths[0, 0], rates[:, 0], accelerations[:, 0]], axis=1)
        kp, kv, ki = 80.0, 600.0, 50.0
        slow, slow_by = np.array([-kp, -1.0, 0.0]), np.array([kp, 0.5, 0.0])
        rate = kv * slow + [0.0, 0.0, kv * ki]
        drive = np.array([[0, 1.0, 0], rate, slow]), np.array([[0, 0, 0], kv * slow_by + [0, 0, 1.0], slow_by])
        _, y, _ = lsim((*drive, np.array([[1.0, 0, 0]]), np.zeros((1, 3))), u, np.arange(len(u)) * 5e-5)
        off.append(np.abs(result.legs[:, 0] - lengths[0, 0] - y[::20]).max())
        lag = np.abs(u[::20, 0] - y[::20]).max()
    assert lag > 1e-3
    assert off[1] < 5e-3 * lag
    assert off[0] / off[1] == pytest.approx(2.0, abs=0.1)


def test_servo_at_rest_gives_way_to_the_ripple():
    program, machine = motion(0.3)
    still = Program(1e-3, np.tile(program.legs[:1], (400, 1)), "linear", COMPONENTS[0], program.placement,
                    program.provenance)  # fmt: skip
    force, pitch = np.array([10, 20, 30, 40, 50.0]), 4e-3
    drives = replace(machine.drives, ripple_force=force, ripple_pitch=pitch, encoder_step=0.0)
    soft = replace(drives, velocity_integral=0.0)
    result, firm = (simulate_servo(Reference(still, replace(machine, drives=d)), seed=5) for d in (soft, drives))
    np.testing.assert_allclose(firm.legs[-1], still.legs[0], atol=1e-9, rtol=0)
    phases = np.random.default_rng(5).uniform(0.0, 2.0 * np.pi, 5)
    for leg in range(5):

        def balance(x, leg=leg):
            spring = 100.0 * 80.0 * 600.0 * (still.legs[0, leg] - x)
            return spring - force[leg] * np.sin(2 * np.pi * x / pitch + phases[leg])

        x = brentq(balance, still.legs[0, leg] - 1e-4, still.legs[0, leg] + 1e-4, xtol=1e-15)
        assert abs(x - still.legs[0, leg]) > 1e-8
        np.testing.assert_allclose(result.legs[-1, leg], x, atol=1e-12, rtol=0)


def test_servo_encoder_steps_stay_within_a_few_steps():
    result, reference = played(0.6, **(LINEAR | {"encoder_step": 1e-6}))
    smooth, _ = played(0.6, **LINEAR)
    off = np.abs(result.legs - smooth.legs).max()
    assert 1e-8 < off < 4e-6
    assert np.abs(smooth.legs - reference.program.legs).max() < 3e-5


def test_servo_seed_decides_the_ripple():
    same, other = (played(0.3, seed=3)[0] for _ in range(2)), played(0.3, seed=4)[0]
    first, second = same
    assert first.legs.tobytes() == second.legs.tobytes()
    assert first.legs.tobytes() != other.legs.tobytes()
    with pytest.raises(InputError, match="seed"):
        played(0.3, seed=-1)


def test_servo_compiled_loop_equals_python():
    code = (
        f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r})\n"
        "from servo_runs import played\n"
        "import json; print(json.dumps([played(0.2, correct=c)[0].legs[::40].tolist() for c in (False, True)]))"
    )
    env = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=env, check=False)
    assert answer.returncode == 0, answer.stderr
    for found, correct in zip(json.loads(answer.stdout), (False, True), strict=True):
        np.testing.assert_allclose(found, played(0.2, correct=correct)[0].legs[::40], atol=1e-9, rtol=0)


def test_servo_unstable_loops_are_refused():
    result, _ = played(0.5, dead_time=0.02)
    assert isinstance(result, Refusal)
    assert "run away" in str(result)
    assert "[drives]" in str(result)


def test_reference_without_a_pose_is_bad_input():
    program, machine = motion(0.2)
    legs = program.legs.copy()
    legs[50, 2] *= 3.0
    with pytest.raises(ProgramError, match=r"row 4\d: these leg lengths have no pose"):
        Reference(replace(program, legs=legs), machine)


def test_contour_errors_are_distances_to_the_curve():
    rng = np.random.default_rng(1)
    t = np.linspace(0.0, 3.0, 301)
    path = np.c_[np.cos(t), np.sin(t), 0.3 * t]
    tips = path[::2] + 0.01 * rng.standard_normal((151, 3))
    up = np.tile([0.0, 0.0, 1.0], (301, 1))
    distance, angle = contour_errors(tips, up[::2], path, up, 2 * np.arange(151), 40)
    fine = np.linspace(0.0, 3.0, 30001)
    curve = np.c_[np.cos(fine), np.sin(fine), 0.3 * fine]
    nearest = np.array([np.linalg.norm(curve - tip, axis=1).min() for tip in tips])
    np.testing.assert_allclose(distance, nearest, atol=2e-5)
    assert angle.max() == 0.0


def test_contour_errors_ignore_a_neighbouring_pass():
    there = np.c_[np.linspace(0, 1, 101), np.zeros(101), np.zeros(101)]
    aside = np.array([0, 0.01, 0])
    path = np.concatenate([there, there[::-1] + aside])
    tips = there + 0.9 * aside
    up = np.tile([0.0, 0.0, 1.0], (202, 1))
    distance, _ = contour_errors(tips[:80], up[:80], path, up, np.arange(80), 10)
    np.testing.assert_allclose(distance, 0.009, atol=1e-12)


def test_reference_interpolates_the_program():
    for interpolation in ("linear", "cubic"):
        program, machine = motion(1.2, interpolation)
        lengths, rates, accelerations = Reference(program, machine).at(4)
        np.testing.assert_allclose(lengths[::4], program.legs, atol=1e-15)
        slope = np.diff(lengths, axis=0) / 2.5e-4
        middle = 0.5 * (rates[1:] + rates[:-1]) if interpolation == "cubic" else rates[:-1]
        np.testing.assert_allclose(slope, middle, atol=2e-5 if interpolation == "cubic" else 1e-9)
        assert np.abs(accelerations).max() <= Machine.load("desk").legs.max_acceleration.max()
