"""Servo simulation: each leg a mass under cascaded position and velocity control, sampled as in real drives.

The pose comes from the closed-form forward kinematics. The correction by pose is contouring control in the loop: the
shortest displacement from the tool back to the path, seen by the encoders, becomes a correction of the leg commands
through the Jacobian; lag along the path is not corrected.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import InputError
from pentapod.base.refusal import Refusal, stage
from pentapod.kinematics.families.quadratic import LinearPentapod, as_quadratic
from pentapod.kinematics.forward.quadratic import NEAR_W_SQUARED
from pentapod.kinematics.robot import Robot
from pentapod.machine.dynamics.correction import NO_CORRECTION, correction_for, steps_of
from pentapod.simulate.reference import Played, Reference


@dataclass(frozen=True)
class ServoOptions:
    """Options of the servo simulation."""

    rest: float = 0.25
    """Seconds at rest before the start, in which the drives settle."""
    largest_error: float = 100.0
    """Error of a leg in metres beyond which the loop counts as unstable."""


DEFAULTS = ServoOptions()


@stage
def simulate_servo(
    reference: Reference, *, seed: int = 0, correct: bool = False, options: ServoOptions = DEFAULTS
) -> Played | Refusal:
    """Return the motion of five servo drives that play a program; the seed sets the phases of the ripple.

    correct: correct the leg commands by the pose. A Refusal says that the loops are unstable, that no correction has
    the margin asked for, or that the legs reach lengths without a pose. Raises InputError for a negative seed.

    >>> played = simulate_servo(Reference(program, machine), seed=1).unwrap()
    """
    from pentapod.simulate.servo_kernels import drive  # noqa: PLC0415  kernels are loaded where they are used

    if seed < 0:
        raise InputError("must not be negative", key="seed", value=seed)
    program, machine = reference.program, reference.machine
    drives, robot = machine.drives, machine.robot
    if correct:
        as_quadratic(robot, "the correction by the pose")
    phases = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, robot.n_legs)
    parts, delay = steps_of(drives, program.period)
    correction = correction_for(drives, program.period, parts, delay) if correct else NO_CORRECTION
    if correction is None:
        return Refusal(
            "simulation",
            "with these drives no correction by the pose keeps the stability margin",
            remedy="lower the gains or the dead time in [drives], or raise its contour_margin",
        )
    rest = int(np.ceil(options.rest / program.period))
    lengths, accelerations = _after_rest(reference.lengths, rest), _after_rest(reference.accelerations, rest)
    lengths[:rest, :, 0], lengths[:rest, :, 1:], accelerations[:rest] = program.legs[0], 0.0, 0.0
    legs, efforts = np.empty((2, len(lengths) + 1, robot.n_legs))
    with np.errstate(all="ignore"):  # unstable loops overflow; they are refused below
        drive(
            lengths,
            accelerations,
            program.period,
            parts,
            delay,
            np.stack([drives.position_gain, drives.velocity_gain, drives.velocity_integral]),
            np.array([drives.velocity_feedforward, drives.acceleration_feedforward]),
            drives.encoder_step,
            np.stack([drives.ripple_force / drives.moving_mass, drives.ripple_pitch, phases]),
            correct,
            correction.feedback,
            (
                *_forward(robot, machine.tool_length),
                np.array([program.component], dtype=np.float64),
                robot.base_joints,
                robot.offsets,
                _after_rest(reference.tips, 2 * rest),
                _after_rest(reference.directions, 2 * rest),
            ),
            legs,
            efforts,
        )
    legs, efforts = legs[rest:], efforts[rest:]
    unstable = np.logical_not(np.abs(legs - program.legs).max(axis=1) < options.largest_error)
    position, direction = robot.pose(np.where(unstable[:, None], np.nan, legs), program.component)
    lost = unstable | ~np.isfinite(position).all(axis=1)
    if lost.any():
        row = int(np.argmax(lost))
        return Refusal(
            "simulation",
            f"the legs run away from the program until they have no pose, at {row * program.period:.3f} s",
            remedy="lower the gains or the dead time in [drives]; near a singularity a small error is enough",
        )
    return Played(legs, position + machine.tool_length * direction, direction, efforts * drives.moving_mass)


def _forward(robot: Robot, tool_length: float) -> tuple[Floats, Floats, Floats]:
    """Return what the kernel's forward kinematics needs; zeros for a family without it, whose poses are not asked."""
    if not isinstance(robot, LinearPentapod):
        return np.zeros((4, robot.n_legs)), np.zeros(4), np.zeros(7)
    limits = [NEAR_W_SQUARED, robot.linear_part.near_s_squared]
    origin = [*robot.base_joints[2, :2], robot.offsets[2]]
    numbers = np.array([robot.delta, *origin, *limits, tool_length])
    return robot.linear_part.linear_map, robot.linear_part.constant, numbers


def _after_rest(values: Floats, rest: int) -> Floats:
    """Return values (N, ...) with the first one repeated `rest` times before it."""
    return np.concatenate([np.broadcast_to(values[:1], (rest, *values.shape[1:])), values])
