"""The kinematics module in LinuxCNC, driven by hand: jogs towards every limit, blocks that end or pass beyond one.

Needs linuxcnc-uspace, linuxcnc-uspace-dev and the right to a network of its own (`unshare`); skipped without.
PENTAPOD_JOG_POSES=200 is the full figure: 40 s a pose.
"""

from __future__ import annotations

import os
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from compiled_kinematics import Compiled
from linuxcnc_jogs import judged, run_jogs, script
from linuxcnc_runs import built
from pentapod.machine import Machine
from pentapod.program.posts.linuxcnc.config import packaged
from pentapod.program.posts.linuxcnc.kinematics import kinematics_files
from short_motion import COMPONENTS

POSES = int(os.environ.get("PENTAPOD_JOG_POSES", "4"))
LEAST = np.array([0.1, 20.0, 0.0, 0.0, 0.0, 1.0, 1.0])
ROOM = LEAST + np.array([0.02, 8.0, 8.0, 0.02, 0.02, 6.0, 6.0])
SPEEDS = np.array([200.0, 200.0, 200.0, 28.93726, 28.93726])


def folder_of(machine: Machine, folder) -> Compiled:
    """A folder of the post, ready to play; and the same header through ctypes."""
    module = Compiled(machine, folder / "compiled")
    for name, content in kinematics_files(machine, COMPONENTS[0], 1e-3).items():
        (folder / name).write_bytes(content)
        (folder / name).chmod(0o755)
    assert packaged("play_config.sh") == (folder / "play.sh").read_bytes()
    return module


def chain(module: Compiled, count: int, seed: int) -> np.ndarray:
    """Random poses, XYZAB, from each to the next of which there is a straight way with some room."""
    rng, here, found = np.random.default_rng(seed), np.zeros(5), []
    while len(found) < count:
        there = np.r_[rng.uniform(-350.0, 350.0, 3), rng.uniform(-60.0, 60.0, 2)]
        way = here + (there - here) * np.linspace(0.0, 1.0, 200)[:, None]
        if (module.inverses(there[None])[1] > ROOM).all() and (module.inverses(way)[1] > ROOM).all():
            found.append(there)
            here = there
    return np.array(found)


@pytest.mark.slow
@built
def test_jogs_stop_before_every_limit_and_the_machine_stays_on(tmp_path):
    machine = Machine.load("desk")
    module = folder_of(machine, tmp_path)
    table, told = run_jogs(tmp_path, script(chain(module, POSES, 7), SPEEDS), 60.0 + 60.0 * POSES)
    found = judged(machine, COMPONENTS[0], table)
    assert found["enabled"] == 1.0
    assert found["refusals"] == 0.0
    assert found["least"] > 0.0, found["limit"]
    assert found["w"] > LEAST[0]
    assert found["s_mm"] > LEAST[1]
    assert found["acceleration"] < 5000.0
    jogs = [step for step in told["done"] if step[0] == "jog"]
    assert len(jogs) == 10 * POSES
    assert all(step[1] for step in jogs)  # each came to a stand by itself
    # Both ways: the second jog of each pair starts at the first one's limit.
    assert all(step[3] < -1.0 for step in jogs[1::2])
    assert set(told["said"]) == {"Jog aborted by jog-stop"}


@pytest.mark.slow
@built
def test_blocks_beyond_a_limit_are_refused_or_held(tmp_path):
    """Z up ends beyond S = 0: refused. A way that leaves the limits between its ends: held, aborted, driven back."""
    machine = Machine.load("desk")
    module = folder_of(machine, tmp_path)
    start, end = bulging(module)
    words = [" ".join(f"{letter}{x:.4f}" for letter, x in zip("XYZAB", pose, strict=True)) for pose in (start, end)]
    steps = [
        {"move": "G1 F6000 Z350"},
        *({"move": f"G1 F3000 {' '.join(f'{letter}{x:.4f}' for letter, x in zip('XYZAB', pose, strict=True))}"}
          for pose in way_to(module, start)),
        {"move": f"G1 F3000 {words[1]}"},
        {"move": f"G1 F3000 {words[0]}"},
    ]  # fmt: skip
    table, told = run_jogs(tmp_path, steps, 120.0)
    found = judged(machine, COMPONENTS[0], table)
    assert found["enabled"] == 1.0
    assert found["least"] > 0.0, found["limit"]
    assert found["acceleration"] < 5000.0
    first, *on_the_way, beyond, back = told["done"]
    assert not first[1]
    assert np.abs(np.array(first[2])).max() < 1e-6  # nothing moved
    assert any("Z350" in words or "kinematicsInverse" in words for words in told["said"])
    assert all(step[1] for step in on_the_way)
    assert not beyond[1]  # stopped between the ends
    away = np.linalg.norm(np.array(beyond[2]) - end)
    assert away > 1.0
    assert back[1]
    assert np.abs(np.array(back[2]) - start).max() < 1e-3


def bulging(module: Compiled) -> tuple[np.ndarray, np.ndarray]:
    """Two allowed poses with a straight way between them that leaves the limits by far."""
    rng = np.random.default_rng(0)
    while True:
        poses = np.c_[rng.uniform(-250.0, 250.0, (4000, 3)), rng.uniform(-45.0, 45.0, (4000, 2))]
        poses = poses[(module.inverses(poses)[1] > ROOM).all(axis=1)]
        for start, end in zip(poses[::2], poses[1::2], strict=False):
            way = start + (end - start) * np.linspace(0.0, 1.0, 60)[:, None]
            short = (module.inverses(way)[1] - LEAST).min(axis=0)
            if short[[0, 3, 4]].min() < -0.05 and len(way_to(module, start)):
                return start, end


def way_to(module: Compiled, there: np.ndarray) -> list[np.ndarray]:
    """Poses from machine zero to a pose, with room on the way; none where it is not reached so."""
    rng = np.random.default_rng(1)
    for middle in (0.5 * there, *(there + rng.uniform(-60.0, 60.0, 5) for _ in range(200))):
        ends = np.array([np.zeros(5), middle, there])
        way = np.concatenate([a + (b - a) * np.linspace(0.0, 1.0, 100)[:, None] for a, b in pairwise(ends)])
        if (module.inverses(way)[1] > ROOM).all():
            return [middle, there]
    return []


@pytest.mark.slow
@built
def test_a_program_with_m52_is_slowed_to_the_rates_of_the_legs(tmp_path):
    """There and back at a feed at which a leg is more than twice too fast; M52 only on the way there."""
    desk = Machine.load("desk")
    machine = replace(desk, legs=replace(desk.legs, max_velocity=np.full(5, 0.04)))
    folder_of(machine, tmp_path)
    steps: list[dict[str, object]] = [
        {"move": words} for words in ("G1 F6000 X-100 Y-60", "M52 P1", "G1 X100 Y60", "M52 P0", "G1 X-100 Y-60")
    ]
    table, told = run_jogs(tmp_path, steps, 120.0)
    assert all(step[1] for step in told["done"]), told
    rates = np.abs(np.diff(table[:, :5], axis=0)).max(axis=1) / 1e-3 / 40.0
    still = np.flatnonzero(np.convolve(rates, np.ones(100), "valid") == 0.0)
    moves = [rates[a:b] for a, b in pairwise(still) if b - a > 200]
    _, slowed, whole = moves[-3:]
    assert whole.max() > 2.0
    assert slowed.max() < 1.05
    assert np.median(slowed) > 0.95  # and no slower than that
