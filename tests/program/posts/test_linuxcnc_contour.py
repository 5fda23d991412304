"""The contour correction in LinuxCNC, off and on, with drives that lag: module and player, by the legs recorded.

Needs linuxcnc-uspace, linuxcnc-uspace-dev and the right to a network of its own (`unshare`); skipped without.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree

from compiled_contour import CHANGE_MM, LAGS, accelerations, lagging
from linuxcnc_runs import built, play
from pentapod.kinematics.component import COMPONENTS
from pentapod.machine import Machine
from pentapod.program.posts import PostInput
from short_motion import motion, placed, post

pytestmark = pytest.mark.slow
MM, UM = 1e3, 1e6
BOUND_MM = 0.5


def changed(file: Path, *changes: tuple[str, str]) -> None:
    text = file.read_text()
    for pattern, words in changes:
        text, count = re.subn(pattern, words, text, flags=re.MULTILINE)
        assert count, pattern
    file.write_text(text)


def lag(hal: Path) -> None:
    """Let HAL's `lowpass` stand between the corrected commands and what the scales read."""
    share = 1.0 - np.exp(-1e-3 / LAGS)
    changed(hal, (r"^net drive(\d) (\S+) => (\S+)$", r"net drive\1 \2 => drive\1.in\nnet scale\1 drive\1.out => \3"))
    names = [f"drive{k + 1}" for k in range(5)]
    lines = [f"loadrt lowpass names={','.join(names)}"]
    lines += [f"addf {name} servo-thread\nsetp {name}.gain {share[k]:.12f}" for k, name in enumerate(names)]
    text = hal.read_text()
    first = next(line for line in text.splitlines() if line.startswith("net drive1"))
    hal.write_text(text.replace(first, "\n".join([*lines, first])))


def off_path(machine: Machine, commands: np.ndarray, legs: np.ndarray) -> np.ndarray:
    """Ways (N,) in µm from the tips of legs to the curve of those of the commands, mm, by the robot."""
    tips = []
    for rows in (commands, legs):
        p, i = machine.robot.pose(rows / MM, COMPONENTS[0])
        assert np.isfinite(p).all()
        tips.append(p + machine.tool_length * i)
    n = np.arange(len(commands))
    dense = CubicSpline(n, tips[0])(np.linspace(0.0, n[-1], 200 * n[-1] + 1))
    return UM * cKDTree(dense).query(tips[1])[0]


@built
def test_correction_keeps_the_module_on_its_path_although_the_drives_lag(tmp_path):
    largest: dict[bool, float] = {}
    program, desk = motion(1.0)
    machine = lagging(desk)
    for on in (False, True):
        folder = tmp_path / str(on) / "kinematics"
        post(PostInput(program, machine, placed()), "linuxcnc", folder.parent)
        lag(folder / "pentapod.hal")
        changed(folder / "pentapod.ini", ("^ENABLE = 0", f"ENABLE = {on:d}"), ("^BOUND_UM = .*", "BOUND_UM = 500"))
        more = [f"net feedback{k + 1} => sampler.0.pin.{5 + k}" for k in range(5)]
        more += [f"net drive{k + 1} => sampler.0.pin.{10 + k}" for k in range(5)]
        more += [f"net contour-{name} pentapod-contour.{name} => sampler.0.pin.{15 + k}"
                 for k, name in enumerate(("error", "size-um"))]  # fmt: skip
        changed(folder / "record.hal", ("cfg=fffffs", f"cfg={'f' * 17}s"), (r"sampler.0.pin.5", "sampler.0.pin.17"))
        with (folder / "record.hal").open("a") as file:
            file.write("\n".join(more) + "\n")
        table = play(folder)
        table = table[int(np.flatnonzero(table[:, 17] > 0)[0]) - 100 :]
        commands, legs, shifts = table[:, :5], table[:, 5:10], table[:, 10:15] - table[:, :5]
        shifts = shifts - shifts[0]  # homing leaves an offset between joints and motors
        away = off_path(machine, commands, legs)
        largest[on] = float(away.max())
        # What the component tells of the same period is to the nearest pose, of tip and axis: never nearer.
        told = MM * table[:, 15]
        assert (told > away - 0.5).all()
        if on:
            assert np.abs(shifts).max() <= BOUND_MM
            assert np.abs(shifts).max() == pytest.approx(1e-3 * table[:, 16].max(), abs=2e-6)
            assert accelerations(shifts).max() < 3.0 * CHANGE_MM + 8e-6  # six decimals of halsampler
        else:
            assert np.abs(shifts).max() < 2e-6
    assert largest[False] > 100.0
    # At the corners of G-code the error changes sooner than the drives can follow.
    assert largest[False] > 10.0 * largest[True]


@built
def test_correction_keeps_the_player_on_its_path_although_the_drives_lag(tmp_path):
    largest: dict[bool, float] = {}
    program, desk = motion(6.0)
    machine = lagging(desk)
    for on in (False, True):
        folder = tmp_path / str(on) / "player"
        post(PostInput(program, machine, placed()), "linuxcnc", folder.parent)
        hal = folder / "player.hal"
        lag(hal)
        changed(hal, ("cfg=f{12}$", f"cfg={'f' * 17}"))
        more = [f"net scale{k + 1} => sampler.0.pin.{12 + k}" for k in range(5)]
        more += ["setp pentapod-contour.bound-um 500", f"setp pentapod-contour.enable {on:d}"]
        hal.write_text(hal.read_text() + "\n".join(more) + "\n")
        changed(folder / "play.sh", (r"legs = \(NF - 3\) / 2", "legs = 5"))
        table = play(folder)
        # From where the drives have come to rest at the first row.
        first = int(np.flatnonzero(np.abs(table[:, 12:17] - table[:, 5:10]).max(axis=1) < 1e-5)[0])
        largest[on] = float(off_path(machine, table[first:, 5:10], table[first:, 12:17]).max())
    assert largest[False] > 100.0
    assert largest[False] > 100.0 * largest[True]
