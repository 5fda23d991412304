"""Programs near their limits, played with overrides, and what differences of the played legs say of the limits."""

from __future__ import annotations

import dataclasses

import numpy as np

from pentapod.machine import Machine
from pentapod.program import Program
from pentapod.program.posts.motion import lengths_at
from pentapod.simulate.paced import Player
from short_motion import motion

AT_THE_LIMIT_S = 0.842
LIMITS = (("max_velocity", 1), ("max_acceleration", 2), ("max_jerk", 3))


def shares(machine: Machine, legs, period):
    """The largest share of each limit that differences of legs use, rest before and after."""
    padded = np.concatenate([np.repeat(legs[:1], 3, axis=0), legs, np.repeat(legs[-1:], 3, axis=0)])
    return [np.abs(np.diff(padded, n, axis=0) / period**n / getattr(machine.legs, name)).max() for name, n in LIMITS]


def off_path(program: Program, legs, places):
    return np.abs(legs - lengths_at(program, places * program.period)).max()


def played(player: Player, wanted, **rows):
    run = player.play(wanted, **rows)
    return run.legs, run.rows, run.paces, run.states


def random_overrides(count, seed):
    """Steps of the override at random: holds, resumes, any share."""
    rng, wanted = np.random.default_rng(seed), np.ones(count)
    start = 0
    while start < count:
        wanted[start:] = rng.choice([0.0, 0.3, 0.7, 1.0, 1.2, rng.uniform(0.0, 1.2)])
        start += int(rng.integers(30, 1500))
    return wanted


def there_and_back(program: Program, times: int) -> Program:
    """A program forth and back: at rest in between."""
    legs = [program.legs[:-1], program.legs[:0:-1]] * times
    return dataclasses.replace(program, legs=np.concatenate([*legs, program.legs[:1]]))


def fast_program() -> tuple[Program, Machine]:
    """A program at 98 % of the accelerations, forth and back, and a machine that hardly limits the jerk."""
    program, machine = motion(AT_THE_LIMIT_S)
    machine = dataclasses.replace(machine, legs=dataclasses.replace(machine.legs, max_jerk=np.full(5, 1e6)))
    source = dataclasses.replace(program.provenance, machine_digest=machine.digest)
    program = there_and_back(dataclasses.replace(program, provenance=source), 6)
    return program, machine
