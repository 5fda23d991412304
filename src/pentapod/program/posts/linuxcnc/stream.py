"""LinuxCNC's HAL: setpoints at servo rate through one `limit3` for each leg, without LinuxCNC's planner."""

from __future__ import annotations

from pentapod.machine.machine import Machine
from pentapod.program.posts.drives import HALSTREAMER
from pentapod.program.posts.linuxcnc.config import number, packaged, servo_period_ns
from pentapod.program.posts.registry import PostInput

ROUNDING = 1e-9
"""Relative: good programs meet the limits to the last digit, and rounding must not be clipped."""


def stream_files(given: PostInput) -> dict[str, bytes]:
    """Return the setpoints, and HAL and script that play them. Raises InputError."""
    powered = given.program.laser_power is not None
    hal = _hal(given.the_machine(), servo_period_ns(given.program.period), powered=powered)
    return {**HALSTREAMER.write(given), "stream.hal": hal.encode(), "play.sh": packaged("play_stream.sh")}


def limit_lines(machine: Machine) -> list[str]:
    """Return the lines of HAL that set each leg's `limit3` to the limits of the machine."""
    limits, lines = machine.legs, list[str]()
    for k in range(machine.robot.n_legs):
        leg = f"leg{k + 1}"
        lines += [
            f"setp {leg}.min {number(1e3 * limits.min_length[k])}",
            f"setp {leg}.max {number(1e3 * limits.max_length[k])}",
            f"setp {leg}.maxv {number(1e3 * limits.max_velocity[k] * (1.0 + ROUNDING))}",
            f"setp {leg}.maxa {number(1e3 * limits.max_acceleration[k] * (1.0 + ROUNDING))}",
        ]
    return lines


def _hal(machine: Machine, period_ns: int, *, powered: bool) -> str:
    """Return the HAL. powered: whether the rows end with the laser's power, for the signal laser-power."""
    count = machine.robot.n_legs
    lines = [
        f"loadrt threads name1=servo-thread period1={period_ns}",
        f"loadrt streamer depth=16000 cfg={'f' * (count + powered)}",
        f"loadrt limit3 names={','.join(f'leg{k + 1}' for k in range(count))}",
        f"loadrt sampler depth=16000 cfg={'f' * 2 * count}",
        "setp streamer.0.enable 0",
        "setp sampler.0.enable 0",
        "addf streamer.0 servo-thread",
        *(f"addf leg{leg} servo-thread" for leg in range(1, count + 1)),
        "addf sampler.0 servo-thread",
    ]
    for k in range(count):
        lines += [
            f"net setpoint{k + 1} streamer.0.pin.{k} => leg{k + 1}.in sampler.0.pin.{k}",
            f"net limited{k + 1} leg{k + 1}.out => sampler.0.pin.{k + count}",
        ]
    lines += limit_lines(machine)
    if powered:
        lines.append(f"net laser-power streamer.0.pin.{count}")
    return "\n".join(lines) + "\n"
