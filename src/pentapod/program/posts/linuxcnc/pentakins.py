"""LinuxCNC's pentakins: the toolpath as XYZAB, planned by the controller itself, with its ini and HAL.

In pentakins XYZ is a point on the tool's line, and the joints of the legs are along the line from it towards the
spindle. So the tip is that point, and joint i is at tool_length − z_i. Its joints are lengths of legs; what the
scales of a calibrated machine read beyond them is added behind it (`hal_text`). The controller's frame has z along the
upright tool and its zero in the middle of the work volume: home is then machine zero, where its Newton iteration
converges.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pentapod.base.errors import InputError, MachineError
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.five_legs import FiveLegs
from pentapod.kinematics.legs_on_rings import LegsOnRings
from pentapod.kinematics.robot import Branch, own_branch
from pentapod.machine.machine import Machine
from pentapod.program.posts.linuxcnc.config import (
    axis_words,
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


@dataclass(frozen=True)
class PentakinsOptions:
    """Limits of the ini and of the G-code.

    room_mm, room_deg: of the axes beyond the toolpath. blend_mm: tolerance of G64 at corners. share: limits of the tip
    as a share of those of the legs, because inclined legs move faster than the tip.
    """

    room_mm: float = 5.0
    room_deg: float = 5.0
    blend_mm: float = 0.01
    share: float = 0.2


OPTIONS = PentakinsOptions()


def pentakins_files(given: PostInput) -> dict[str, bytes]:
    """Return the files of the folder. Raises InputError."""
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
    zeros = 1e3 * built_legs(machine).zeros
    home = 1e3 * machine.robot.leg_lengths(tip + machine.tool_length * upright, -upright) - zeros
    velocity, acceleration = 1e3 * limits.max_velocity, 1e3 * limits.max_acceleration
    rate, gain = 1e3 * machine.rapid_velocity, OPTIONS.share * float(acceleration.min())
    turn = np.degrees(1e-3 / machine.tool_length)
    low = np.minimum(0.0, 1e3 * path.tips.min(axis=0)) - OPTIONS.room_mm
    high = np.maximum(0.0, 1e3 * path.tips.max(axis=0)) + OPTIONS.room_mm
    axes = {letter: axis_words(0.0, low[k], high[k], rate, gain) for k, letter in enumerate("XYZ")}
    turn_rate = OPTIONS.share * float(velocity.min()) * turn
    for k, letter in enumerate("AB"):
        ends = min(0.0, angles[:, k].min()) - OPTIONS.room_deg, max(0.0, angles[:, k].max()) + OPTIONS.room_deg
        axes[letter] = axis_words(0.0, *ends, turn_rate, gain * turn)
    ini = ini_text(
        f"{machine.name} (pentakins)",
        "pentakins",
        FILE,
        axes,
        joint_words(home, 1e3 * limits.min_length - zeros, 1e3 * limits.max_length - zeros, velocity, acceleration),
        {
            "DEFAULT_LINEAR_VELOCITY": number(0.1 * rate),
            "MAX_LINEAR_VELOCITY": number(rate),
            "MAX_LINEAR_ACCELERATION": number(gain),
            "DEFAULT_ANGULAR_VELOCITY": number(0.1 * turn_rate),
            "MAX_ANGULAR_VELOCITY": number(turn_rate),
        },
        servo_period_ns(given.program.period),
    )
    hal = hal_text(machine.robot.n_legs, parameters(machine, frame), zeros)
    return files_of(
        ini, hal, FILE, _code(_within(path, machine.rapid_velocity)), machine.robot.n_legs, scales=bool(zeros.any())
    )


def controller_frame(machine: Machine, component: Branch) -> RigidTransform:
    """Return the transform machine frame → the controller's: z along the upright tool, zero in the work volume."""
    # Where the direction points to +z, half a turn about x puts the tool upright.
    turned = np.diag([1.0, -1.0, -1.0]) if own_branch(machine.robot, component).w > 0 else np.eye(3)
    return RigidTransform(turned, -turned @ machine.work.centre)


def built_legs(machine: Machine) -> FiveLegs | LegsOnRings:
    """Return the robot where pentakins can be told of it. Raises MachineError."""
    robot = machine.robot
    if not isinstance(robot, FiveLegs | LegsOnRings):
        raise MachineError(
            "pentakins has no such kinematics", key="robot", value=type(robot).__name__,
            expected="a linear pentapod", remedy="play the setpoints instead",
        )  # fmt: skip
    return robot


def parameters(machine: Machine, frame: RigidTransform) -> dict[str, float]:
    """Return pentakins' parameters, mm; legs are numbered from 0. Raises MachineError."""
    robot = built_legs(machine)
    base = 1e3 * frame.apply(robot.base_joints)
    joints = 1e3 * (machine.tool_length - robot.offsets)
    found: dict[str, float] = {}
    for k in range(robot.n_legs):
        found |= {f"pentakins.base.{k}.{letter}": float(base[k, j]) for j, letter in enumerate("xyz")}
        found |= {
            f"pentakins.effector.{k}.r": 1e3 * float(robot.radii[k]),
            f"pentakins.effector.{k}.z": float(joints[k]),
        }
    # With the default of 100 the forward kinematics fails at nearly every start.
    return {**found, "pentakins.max-error": 1e6}


def _code(path: Toolpath) -> bytes:
    """Return the toolpath as G-code, controller's frame, with a tolerance for blended corners."""
    head, separator, moves = FORMATS["xyzab"].write(path).partition(b"G94\n")
    # Without P the planner blends corners for speed: by 0.3 mm on a path of gentle turns.
    return head + separator + f"G64 P{OPTIONS.blend_mm:g}\n".encode() + moves


def _within(path: Toolpath, rapid: float) -> Toolpath:
    """Return the toolpath with feeds limited to the machine's rapid rate; rapids stay rapids."""
    segments = (s if np.isinf(s.feed) else replace(s, feed=min(s.feed, rapid)) for s in path.segments)
    return replace(path, segments=tuple(segments))
