"""Correction by the pose: what it is worth on several motions, where it must hold, what it must leave alone."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from servo_runs import contour, played

from pentapod.base.errors import MachineError
from pentapod.base.refusal import Refusal
from pentapod.job import Job, run
from pentapod.kinematics.component import COMPONENTS
from pentapod.machine import Machine
from pentapod.machine.drives import Drives
from pentapod.machine.dynamics.correction import correction_for
from pentapod.program import Program, quantised, read_csv
from pentapod.simulate import Reference, servo, simulate_servo
from short_motion import motion, rise


def rms(values):
    return np.sqrt(np.mean(np.square(values)))


def program_along(tips, i):
    """A program through tips (N, 3) and directions (N, 3), a row each millisecond."""
    short, machine = motion(0.1)
    i = i / np.linalg.norm(i, axis=1, keepdims=True)
    legs = machine.robot.leg_lengths(machine.work.centre + tips - machine.tool_length * i, i)
    return Program(1e-3, quantised(legs), "cubic", COMPONENTS[0], short.placement, short.provenance)


def zigzag():
    """Four passes of 40 mm, each from rest to rest, at 160 mm/s; steps of 3 mm between them."""
    way = 0.04 * rise(np.linspace(0.0, 1.0, 551)), 0.003 * rise(np.linspace(0.0, 1.0, 151))
    x, y = [np.zeros(1)], [np.zeros(1)]
    for turn in range(4):
        back, forth = turn % 2, 1 - 2 * (turn % 2)
        x += [0.04 * back + forth * way[0], np.full(151, 0.04 * (1 - back))]
        y += [np.full(551, 0.003 * turn), 0.003 * turn + way[1]]
    x, y = np.concatenate(x) - 0.02, np.concatenate(y)
    return program_along(np.c_[x, y, 0.0 * x], np.tile([0.05, -0.1, 1.0], (len(x), 1)))


def wave():
    """A line of 60 mm over waves of 3 mm, the axis along the surface's normal."""
    s = rise(np.linspace(0.0, 1.0, 6001))
    k = 2.0 * np.pi / 0.03
    x, slope = 0.06 * s - 0.03, 0.0015 * k * np.cos(0.06 * k * s)
    return program_along(np.c_[x, 0.5 * x, 0.0015 * np.sin(0.06 * k * s)], np.c_[-slope, 0.0 * s, np.ones_like(s)])


def spin():
    """The tool leans by 15° and goes about a spot, which its tip leaves by 2 mm."""
    s = rise(np.linspace(0.0, 1.0, 5001))
    turn, lean = 4.0 * np.pi * s, np.radians(15.0) * np.sin(np.pi * s)
    tips = 0.002 * np.c_[np.sin(turn), 1.0 - np.cos(turn), 0.0 * s]
    return program_along(tips, np.c_[np.sin(lean) * np.cos(turn), np.sin(lean) * np.sin(turn), np.cos(lean)])


PROGRAMS = {
    "at the largest accelerations": lambda: motion(1.2)[0],
    "a calm loop": lambda: motion(6.0)[0],
    "straight, with stops": zigzag,
    "waves": wave,
    "turning": spin,
}


@pytest.mark.parametrize("name", PROGRAMS)
def test_correction_by_pose_lowers_the_contour_error_threefold(name):
    program = PROGRAMS[name]()
    for seed in range(3):
        (plain, reference), (corrected, _) = (played(program, correct=c, seed=seed) for c in (False, True))
        before, after = contour(plain, reference), contour(corrected, reference)
        assert before[0].max() > 5e-6
        assert before[0].max() >= 3.0 * after[0].max()
        assert rms(before[0]) >= 5.0 * rms(after[0])
        assert before[1].max() >= 3.0 * after[1].max()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["dome", "laser", "wavy", "saddle"])
def test_correction_by_pose_lowers_the_contour_error_of_whole_jobs_threefold(name, tmp_path):
    """Rapids included. Where the laser's spot creeps while its axis turns, 3 µm along the way are 0.2 mrad of axis."""
    run(Job.load(Path(__file__).parents[2] / "toolpaths" / f"{name}.toml"), tmp_path)
    reference = Reference(read_csv(tmp_path / "program.csv"), Machine.load("desk"))
    for seed in range(3):
        results = (simulate_servo(reference, seed=seed, correct=c) for c in (False, True))
        before, after = (contour(result, reference) for result in results)
        assert before[0].max() >= 3.0 * after[0].max()
        assert rms(before[0]) >= 5.0 * rms(after[0])
        assert before[1].max() >= (2.5 if name == "laser" else 3.0) * after[1].max()


@pytest.mark.parametrize(
    "drives",
    [
        {"velocity_feedforward": 0.0},
        {"position_gain": [80, 70, 80, 90, 75], "velocity_feedforward": 0.0, "ripple_force": 0.0},
        {"position_gain": [80, 70, 80, 90, 75], "velocity_gain": [500, 600, 700, 600, 650], "dead_time": 1e-3},
        {"velocity_integral": 0.0},
        {"period": 1e-3},
    ],
    ids=["no feed-forward", "unequal gains", "unequal and late", "no integral", "drives at the controller's period"],
)
def test_correction_helps_other_drives(drives):
    for seed in range(2):
        (plain, reference), (corrected, _) = (played(6.0, correct=c, seed=seed, **drives) for c in (False, True))
        before, after = contour(plain, reference), contour(corrected, reference)
        assert before[0].max() > 5e-6
        assert before[0].max() >= 5.0 * after[0].max()
        assert rms(before[0]) >= 5.0 * rms(after[0])
        assert before[1].max() >= 5.0 * after[1].max()


@pytest.mark.slow
def test_correction_works_with_random_gains():
    """Soft and stiff, quick and late, at the machine's largest accelerations: it never makes things much worse."""
    rng = np.random.default_rng(11)
    tried, ratios = 0, []
    while tried < 24:
        position = rng.uniform(15.0, 160.0)
        velocity = position * rng.uniform(2.5, 12.0)
        dead = rng.uniform(0.0, min(0.35 / velocity, 1e-3))  # with more a drive hardly holds by itself
        drives = {
            "position_gain": position, "velocity_gain": velocity, "velocity_integral": rng.uniform(0.0, 0.5) * position,
            "dead_time": dead, "period": rng.choice([1.25e-4, 5e-4]),
            "encoder_step": rng.choice([0.0, 1e-7, 1e-7, 1e-6]),
        }  # fmt: skip
        (plain, reference), (corrected, _) = (played(1.2, correct=c, seed=tried, **drives) for c in (False, True))
        assert not isinstance(plain, Refusal)
        assert not isinstance(corrected, Refusal), drives
        before, after = contour(plain, reference)[0], contour(corrected, reference)[0]
        noise = 3.0 * drives["encoder_step"]
        assert after.max() <= before.max() + noise, drives
        if dead <= 2.5e-4 and drives["encoder_step"] <= 1e-7:
            ratios.append(before.max() / after.max())
        tried += 1
    assert len(ratios) >= 6
    assert min(ratios) >= 3.0


def test_correction_tolerates_a_wrong_model(monkeypatch):
    """The drives are a fifth stiffer or softer than the controller believes, and late twice as much."""

    def believes(drives, period, parts, delay):
        believed = replace(
            drives, position_gain=drives.position_gain * [0.8, 1.2, 1.0, 0.8, 1.2],
            velocity_gain=drives.velocity_gain * [1.2, 1.2, 0.8, 0.8, 1.0],
        )  # fmt: skip
        return correction_for(believed, period, parts, delay // 2)

    right, reference = played(1.2, correct=True)
    monkeypatch.setattr(servo, "correction_for", believes)
    (plain, _), (corrected, _) = (played(1.2, correct=c) for c in (False, True))
    assert corrected.legs.tobytes() != right.legs.tobytes()
    before, after = contour(plain, reference), contour(corrected, reference)
    assert before[0].max() >= 3.0 * after[0].max()
    assert rms(before[0]) >= 3.0 * rms(after[0])


def test_correction_amplifies_nothing_beyond_the_margin():
    """What ripple does across a straight pass: from pitches far below what the correction can answer to far above."""
    program, found = zigzag(), {}
    for margin in (1.4, 3.0):
        found[margin] = []
        for pitch in (2e-2, 5e-3, 1.2e-3, 4e-4, 3e-4, 2e-4):
            drives = {"ripple_pitch": pitch, "encoder_step": 0.0, "contour_margin": margin}
            across = []
            for correct in (False, True):
                with_it, without = (played(program, correct=correct, **drives, ripple_force=f)[0] for f in (20.0, 0.0))
                across.append(rms((with_it.tips - without.tips)[200:350, 1:]))
            found[margin].append(across[1] / across[0])
        assert found[margin][0] < 0.05
        assert 1.02 < max(found[margin]) <= margin  # beyond its reach it cannot but enlarge
    assert found[3.0][1] < 0.5 * found[1.4][1]  # who allows more gets more


@pytest.mark.parametrize("late", [5e-3, 0.02])
def test_correction_of_unstable_drives_is_refused(late):
    result, _ = played(0.3, correct=True, dead_time=late)
    assert isinstance(result, Refusal)
    assert "no correction by the pose" in str(result)
    assert "[drives]" in str(result)


@pytest.mark.parametrize("margin", [1.0, 0.0, np.nan, np.inf])
def test_contour_margin_that_no_correction_can_keep_is_bad_input(margin):
    with pytest.raises(MachineError, match="contour_margin"):
        Drives(contour_margin=margin)


def test_correction_leaves_the_lag_along_the_path_alone():
    drives = {"velocity_feedforward": 0.0, "ripple_force": 0.0}
    (plain, reference), (corrected, _) = (played(6.0, correct=c, **drives) for c in (False, True))
    late = [np.linalg.norm(r.tips - reference.tips[::2], axis=1).max() for r in (plain, corrected)]
    assert late[0] > 5e-4
    assert late[1] == pytest.approx(late[0], rel=0.1)
