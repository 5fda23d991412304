"""LinuxCNC's pentakins: the tool path as XYZAB, planned by the controller itself, with its ini and HAL.

pentakins has the point that XYZ tells on the tool's line, and the legs' joints along the line from it, towards the
spindle. So the tip is that point, and joint i is at tool_length − z_i. The controller's frame has z along the upright
tool and its zero in the middle of the work volume, so that home is machine zero, as its Newton iteration likes it.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from pentapod.base.errors import InputError, MachineError
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.families.as_built import AsBuiltPentapod
from pentapod.kinematics.five_legs import FiveLegs
from pentapod.kinematics.robot import Branch
from pentapod.machine.machine import Machine
from pentapod.program.posts.linuxcnc.config import (
    Axis,
    files_of,
    hal_text,
    ini_text,
    joint_words,
    number,
    servo_period_ns,
)
from pentapod.program.posts.registry import PostInput
from pentapod.toolpath.formats import FORMATS
from pentapod.toolpath.formats.rotary import AB
from pentapod.toolpath.toolpath import Toolpath

FILE = "toolpath.ngc"
_ROOM_MM, _ROOM_DEG = 5.0, 5.0
_ROUNDING_MM = 0.01
_SHARE = 0.2
"""Of what a leg can do, what the tip may: legs that lean move faster than the tip."""


def pentakins_files(given: PostInput) -> dict[str, bytes]:
    """Return G-code, ini, HAL and script. Raises InputError."""
    machine = given.the_machine()
    frame = controller_frame(machine, given.program.component)
    path = given.the_toolpath().transformed(frame)
    angles = AB.angles(path.axes)
    if np.abs(angles).max() > 90.0:
        raise InputError(
            "a tool axis is beyond the horizontal, where pentakins cannot follow", key="toolpath",
            value=float(np.abs(angles).max()), expected="A and B within ±90°", remedy="play the setpoints instead",
        )  # fmt: skip
    limits = machine.legs
    upright = frame.inverse().rotate([0.0, 0.0, 1.0])
    tip = frame.inverse().apply([0.0, 0.0, 0.0])
    home = 1e3 * machine.robot.leg_lengths(tip + machine.tool_length * upright, -upright)
    velocity, acceleration = 1e3 * limits.max_velocity, 1e3 * limits.max_acceleration
    rate, gain = 1e3 * machine.rapid_velocity, _SHARE * float(acceleration.min())
    turn = np.degrees(1e-3 / machine.tool_length)
    low = np.minimum(0.0, 1e3 * path.tips.min(axis=0)) - _ROOM_MM
    high = np.maximum(0.0, 1e3 * path.tips.max(axis=0)) + _ROOM_MM
    axes = [Axis(letter, 0.0, low[k], high[k], rate, gain) for k, letter in enumerate("XYZ")]
    axes += [
        Axis(letter, 0.0, min(0.0, angles[:, k].min()) - _ROOM_DEG, max(0.0, angles[:, k].max()) + _ROOM_DEG,
             _SHARE * float(velocity.min()) * turn, gain * turn)
        for k, letter in enumerate("AB")
    ]  # fmt: skip
    ini = ini_text(
        f"{machine.name} (pentakins)",
        "pentakins",
        FILE,
        axes,
        joint_words(home, 1e3 * limits.min_length, 1e3 * limits.max_length, velocity, acceleration),
        {
            "DEFAULT_LINEAR_VELOCITY": number(0.1 * rate),
            "MAX_LINEAR_VELOCITY": number(rate),
            "MAX_LINEAR_ACCELERATION": number(gain),
            "DEFAULT_ANGULAR_VELOCITY": number(0.1 * float(axes[3].velocity)),
            "MAX_ANGULAR_VELOCITY": number(axes[3].velocity),
        },
        servo_period_ns(given.program.period),
    )
    hal = hal_text(parameters(machine, frame))
    return files_of(ini, hal, FILE, _code(_within(path, machine.rapid_velocity)))


def controller_frame(machine: Machine, component: Branch) -> RigidTransform:
    """Return the transform machine frame → the controller's: z along the upright tool, zero in the work volume."""
    # Where the direction points to +z the tool comes from −z: half a turn about x puts it upright.
    turned = np.diag([1.0, -1.0, -1.0]) if component.w > 0 else np.eye(3)
    return RigidTransform(turned, -turned @ machine.work.centre)


def parameters(machine: Machine, frame: RigidTransform) -> dict[str, float]:
    """Return pentakins' parameters, mm; legs are numbered from 0. Raises MachineError."""
    robot = machine.robot
    if not isinstance(robot, FiveLegs | AsBuiltPentapod) or robot.zeros.any():
        raise MachineError(
            "pentakins has no such kinematics", key="robot", value=type(robot).__name__,
            expected="a linear pentapod whose scales read the lengths of the legs", remedy="play the setpoints instead",
        )  # fmt: skip
    base = 1e3 * frame.apply(robot.base_joints)
    joints = 1e3 * (machine.tool_length - robot.offsets)
    found: dict[str, float] = {}
    for k in range(robot.n_legs):
        found |= {f"pentakins.base.{k}.{letter}": float(base[k, j]) for j, letter in enumerate("xyz")}
        found |= {
            f"pentakins.effector.{k}.r": 1e3 * float(robot.radii[k]),
            f"pentakins.effector.{k}.z": float(joints[k]),
        }
    # At the default of 100 nearly every start of the forward kinematics fails.
    return {**found, "pentakins.max-error": 1e6}


def _code(path: Toolpath) -> bytes:
    """Return the toolpath as G-code, controller's frame, with a bound on how far the planner may round corners."""
    head, separator, moves = FORMATS["xyzab"].write(path).partition(b"G94\n")
    # Without P the planner rounds corners as far as speed wants it: 0.3 mm on a path of gentle turns.
    return head + separator + f"G64 P{_ROUNDING_MM:g}\n".encode() + moves


def _within(path: Toolpath, rapid: float) -> Toolpath:
    """Return the toolpath with no feed beyond the machine's rapid rate; rapids stay rapids."""
    segments = (s if np.isinf(s.feed) else dataclasses.replace(s, feed=min(s.feed, rapid)) for s in path.segments)
    return dataclasses.replace(path, segments=tuple(segments))
