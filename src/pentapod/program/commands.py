"""Commands: what drives are told so that the legs, under their loads, have the lengths of a program.

A leg that pushes with the force F gets shorter by F/k. Told l + F/k, it has the length l. The force is that of the
weights in the pose of the lengths l, and of a process force against the motion; it is known before the leg yields. What
a screw or a table of pitch errors adds comes after it: `LegModel`. Commands are made where programs are posted, and
nowhere before.
"""

from __future__ import annotations

import dataclasses
from dataclasses import replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from pentapod.base.arrays import Bools, Floats
from pentapod.base.errors import InputError, MachineError
from pentapod.kinematics.forces import leg_force_map
from pentapod.machine.calibration.digest import digest_of
from pentapod.machine.dynamics.deflection import weight_yields
from pentapod.machine.leg_model import LegModel
from pentapod.machine.machine import Machine
from pentapod.numerics.blocks import blocks
from pentapod.program.header import COMPENSATION, CUT_ROWS, PROCESS_FORCE
from pentapod.program.program import GRAVITY, Program
from pentapod.program.resolution import quantised

ROUNDS = 60
"""Most rounds of the fixed point from commands to lengths. By weight a leg yields other than before by less than a
thousandth of the change of its length; of a process force that is below a half, by `FADING`."""

SETTLED_M = 1e-12
"""Change of a length that ends the fixed point, metres: a tenth of the last digit of program files."""

SMOOTH_S = 0.1
"""Seconds in which a process force grows from nothing to all of it, and fades."""

PASSES = 3
"""Moving averages in a row, together `SMOOTH_S` wide: after three a force begins without a step of acceleration."""

SLOW_M_S = 1e-3
"""Speed below which a process force fades, as the tool stands or turns back."""

FADING = 6.0
"""It fades below so many times the speed that takes the tip in `SMOOTH_S` as far as it yields, where that is more.

Else nobody could tell from commands where the tool goes: averages let through a velocity of up to 3.2 / `SMOOTH_S` for
each metre that a length is off, so that 3.2 / 6 of it, or less, comes back as force over stiffness.
"""

MOST_OF_IT = 0.97
"""Share of a process force below which it is told how much of it is compensated for."""

NO_LEG_MODEL = LegModel()

NOT_COMPENSATED = "drives do not compensate for the weight: the calibration may have taken it for geometry"

ROWS_AT_ONCE = 1 << 15
"""Rows that are computed together, which bounds the memory."""


def compensation_sentence(program: Program, machine: Machine) -> str:
    """Return what drives compensate for, and by how much their lengths differ from the program's.

    Where they compensate for nothing: why, on a calibrated machine whose legs are known to yield; "" on others.
    """
    if not program.provenance.compensation:
        return NOT_COMPENSATED if machine.calibration is not None and machine.yielding_known else ""
    most = 1e6 * float(np.abs(springs(program, program.machine(machine), program.legs)).max())
    process = ""
    if (force := program.process_force) is not None:
        made = np.linalg.norm(_forces(program, program.machine(machine), program.legs), axis=1)[cutting_rows(program)]
        share = float(np.median(made)) / force.newtons
        # Told where it is not nearly all: what is slow, or yields far, is not pushed back in full.
        part = "" if share > MOST_OF_IT else f"{share:.0%} (the feed is too low, or legs yield too far, for all) of "
        process = f" and {part}{force.newtons:g} N against the motion on cuts"
    return (
        f"posts compensate for what the legs yield to weight{process}: drives are told up to {most:.3g} µm more or less"
    )


def commanded(program: Program, machine: Machine | None) -> Program:
    """Return a program with rows as the drives are told them; the same one where that is what the legs read.

    Raises MachineError where the program is compensated and the machine says nothing of its stiffness.
    """
    if machine is None or program.provenance.commands:
        return program
    digest = commands_digest(program, machine)
    if not digest:
        return program
    there = program.machine(machine)
    legs = program.legs + springs(program, there, program.legs)
    legs = there.commands(legs, np.array(program.component))
    return replace(program, legs=quantised(legs), provenance=replace(program.provenance, commands=digest))


def read_back(program: Program, machine: Machine) -> Program:
    """Return a program with rows as the legs read, of one with commands; any other as it is.

    Raises InputError: commands by another leg model, stiffness or weight.
    """
    digest, found = commands_digest(program, machine), program.provenance.commands
    if not found:
        return program
    if found != digest:
        raise InputError(
            "the rows are commands of another leg model, stiffness or weight", key="commands", value=found,
            expected=digest, remedy="name the machine's file with which it was posted",
        )  # fmt: skip
    legs = readings(program, program.machine(machine), program.legs)
    return replace(program, legs=quantised(legs), provenance=replace(program.provenance, commands=""))


def readings(program: Program, machine: Machine, commands: Floats) -> Floats:
    """Return the lengths of the legs (N, n_legs) where the drives of a program's machine are told `commands`."""
    travel = machine.readings(commands, np.array(program.component))
    legs = travel
    for _ in range(ROUNDS if program.provenance.compensation else 0):
        before, legs = legs, travel - springs(program, machine, legs)
        if not np.nanmax(np.abs(legs - before), initial=0.0) > SETTLED_M:
            return legs
    if program.provenance.compensation:
        raise InputError(
            "the lengths of the legs cannot be told from these commands", key="commands",
            value=f"legs yield {1e3 * np.nanmax(np.abs(legs - travel), initial=0.0):.3g} mm",
            remedy="give a smaller force, or legs that yield less",
        )  # fmt: skip
    return legs


def counted(machine: Machine, position: Floats, direction: Floats, *, loaded: bool) -> Floats:
    """Return what drives count (N, n_legs), metres, where the platform rests in poses (N, 3).

    loaded: whether they compensate for the weight. Of backlash, nobody knows from which side a single pose is reached.
    """
    legs = machine.robot.leg_lengths(position, direction)
    if loaded:
        legs = legs + weight_yields(machine, position, direction)
    if not machine.leg_model.is_needed:
        return legs
    there = replace(machine, leg_model=machine.leg_model.without_backlash)
    return there.commands(legs, machine.robot.branch(position, direction))


def springs(program: Program, machine: Machine, legs: Floats) -> Floats:
    """Return how much longer legs of these lengths (N, n_legs) are without their loads, metres; 0 for no compensation.

    machine: with its guides as in the program. 0 where the lengths have no pose in the program's component. Raises
    MachineError where the machine does not say how far its legs yield.
    """
    longer = np.zeros_like(legs)
    if program.provenance.compensation != GRAVITY:
        return longer
    if not machine.yielding_known:
        raise MachineError(
            "the program is compensated for what legs yield, but this machine does not say how far they do",
            key=COMPENSATION, value=program.provenance.compensation,
            remedy="name the machine's file with which it was planned",
        )  # fmt: skip
    forces = _forces(program, machine, legs)
    for part in blocks(len(legs), ROWS_AT_ONCE):
        own = legs[part]
        position, direction = machine.robot.pose(own, program.component)
        yields = weight_yields(machine, position, direction)
        if program.process_force is not None:
            loads = leg_force_map(machine.robot, position, direction, machine.tool_length)
            lengths = np.linalg.norm(machine.robot.leg_vectors(position, direction), axis=-1)
            yields += np.einsum("nac,nc->na", loads, forces[part]) * machine.stiffness.yielding(lengths)
        longer[part] = np.where(np.isfinite(yields), yields, 0.0)
    return longer


def _forces(program: Program, machine: Machine, legs: Floats) -> Floats:
    """Return the process force (N, 3) on the tip at rows of these lengths, newtons; empty where there is none.

    It grows and fades within `SMOOTH_S`, so that the legs keep their limits where a cutter goes in and turns back.
    """
    process = program.process_force
    if process is None:
        return np.empty((0, 3))
    cutting = cutting_rows(program)
    tips, yields = np.empty((len(legs), 3)), 0.0
    for part in blocks(len(legs), ROWS_AT_ONCE):
        position, direction = machine.robot.pose(legs[part], program.component)
        tips[part] = position + machine.tool_length * direction
        loads = leg_force_map(machine.robot, position, direction, machine.tool_length)
        lengths = np.linalg.norm(machine.robot.leg_vectors(position, direction), axis=-1)
        trace = np.einsum("nac,nac,na->n", loads, loads, machine.stiffness.yielding(lengths))  # at least the largest
        yields = float(np.nanmax(np.where(cutting[part], process.newtons * trace, 0.0), initial=yields))
    velocity = np.asarray(np.gradient(tips, program.period, axis=0), dtype=np.float64)
    speed = np.linalg.norm(velocity, axis=1, keepdims=True)
    slow = max(SLOW_M_S, FADING * yields / SMOOTH_S)
    # Of fourth powers: at twice the speed at which it fades the force lacks 1.5 %, and 0.1 % at four times it.
    force = np.where(cutting[:, None], -process.newtons * velocity / (speed**4 + slow**4) ** 0.25, 0.0)
    force = np.where(np.isfinite(force), force, 0.0)  # rows without a pose: an average would pass them on
    rows = max(round(SMOOTH_S / PASSES / program.period), 1)
    for _ in range(PASSES):
        force = uniform_filter1d(force, rows, axis=0, mode="nearest")
    return force


def cutting_rows(program: Program) -> Bools:
    """Return the rows (N,) on which a program's process force acts."""
    cutting = np.zeros(len(program.legs), dtype=np.bool_)
    for first, last in () if program.process_force is None else program.process_force.cuts:
        cutting[first : last + 1] = True
    return cutting


def springs_digest(program: Program, machine: Machine) -> str:
    """Return 16 hexadecimal digits over the stiffness and the masses by which drives compensate; "" for nothing."""
    if not program.provenance.compensation:
        return ""
    return commands_digest(replace(program, process_force=None), replace(machine, leg_model=NO_LEG_MODEL))


def commands_digest(program: Program, machine: Machine) -> str:
    """Return 16 hexadecimal digits over all by which commands differ from readings; "" where they do not."""
    if not program.provenance.compensation:
        return machine.leg_model.digest
    masses = {item.name: getattr(machine.masses, item.name) for item in dataclasses.fields(machine.masses)}
    soft = {name: 1.0 / values for name, values in vars(machine.stiffness).items()}  # infinite ones have no text
    told = {COMPENSATION: program.provenance.compensation, "leg_model": machine.leg_model.digest}
    if (process := program.process_force) is not None:
        told |= {PROCESS_FORCE: process.newtons, CUT_ROWS: process.cuts}
    return digest_of({**masses, **soft, **told})
