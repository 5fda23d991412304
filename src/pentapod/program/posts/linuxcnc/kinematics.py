"""LinuxCNC with a kinematics module of this machine: driven by hand, and the toolpath as XYZAB for its own planner.

XYZ is the tip, in a frame with z along the upright tool and zero in the middle of the work volume: home is machine
zero. Joints are what the legs' scales read. The module refuses poses beyond the machine's limits, and its guard, in the
servo thread, stops jogs and programs before them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import InputError, MachineError
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.component import Component
from pentapod.kinematics.families.as_built import AsBuiltPentapod
from pentapod.kinematics.robot import Branch, own_branch
from pentapod.machine.machine import Machine
from pentapod.planning.limits.margins import Margins
from pentapod.program.posts.files import write_files
from pentapod.program.posts.linuxcnc.config import (
    axis_words,
    files_of,
    hal_text,
    ini_text,
    joint_words,
    number,
    servo_period_ns,
)
from pentapod.program.posts.linuxcnc.contour import contour_files, ini_table, joint_lines
from pentapod.program.posts.linuxcnc.module import Module, module_files, nominal_robot
from pentapod.toolpath.formats import FORMATS
from pentapod.toolpath.formats.rotary import AB
from pentapod.toolpath.toolpath import Toolpath

FILE = "toolpath.ngc"
NO_PATH = b"(no toolpath was given: jog, or type moves)\nG21 G90\nM2\n"


@dataclass(frozen=True)
class KinematicsOptions:
    """Limits of the ini and of the G-code.

    blend_mm: tolerance of G64 at corners. share: limits of the axes as a share of those of the legs, because inclined
    legs and several axes at a time move faster than one axis. tilt_deg: largest A and B; the module refuses earlier.
    """

    blend_mm: float = 0.01
    share: float = 0.2
    tilt_deg: float = 89.0


OPTIONS = KinematicsOptions()


def kinematics_files(
    machine: Machine, component: Branch, period: float, toolpath: Toolpath | None = None
) -> dict[str, bytes]:
    """Return the files of the folder. period: of the servo thread, seconds; toolpath: as placed, machine frame.

    Raises MachineError where the machine can have no module, InputError where the toolpath cannot be written.
    """
    nominal_robot(machine)
    frame = controller_frame(machine, component)
    limits, robot = machine.legs, machine.robot
    velocity, acceleration = 1e3 * limits.max_velocity, 1e3 * limits.max_acceleration
    rate, gain = 1e3 * machine.rapid_velocity, OPTIONS.share * float(acceleration.min())
    turn = float(np.degrees(1e-3 / machine.tool_length))
    turn_rate = OPTIONS.share * float(velocity.min()) * turn
    low, high = _reach(machine, frame)
    axes = {letter: axis_words(0.0, low[k], high[k], rate, gain) for k, letter in enumerate("XYZ")}
    for letter in "AB":
        axes[letter] = axis_words(0.0, -OPTIONS.tilt_deg, OPTIONS.tilt_deg, turn_rate, gain * turn)
    ini = ini_text(
        f"{machine.name} (kinematics)",
        "pentapod_kins",
        FILE,
        axes,
        joint_words(_home(machine, component, frame), 1e3 * limits.min_length, 1e3 * limits.max_length,
                    velocity, acceleration),
        {
            "DEFAULT_LINEAR_VELOCITY": number(0.1 * rate),
            "MAX_LINEAR_VELOCITY": number(rate),
            "MAX_LINEAR_ACCELERATION": number(gain),
            "DEFAULT_ANGULAR_VELOCITY": number(0.1 * turn_rate),
            "MAX_ANGULAR_VELOCITY": number(turn_rate),
        },
        servo_period_ns(period),
    )  # fmt: skip
    code = NO_PATH if toolpath is None else _code(_checked(_within(toolpath, machine.rapid_velocity), frame))
    module = Module(machine, component, frame, (gain, gain, gain, gain * turn, gain * turn))
    correction = contour_files(module, period)
    hal = hal_text(robot.n_legs, driven=not correction) + _guard_text(robot.n_legs)
    if correction:
        hal, ini = hal + "\n".join(joint_lines(robot.n_legs)) + "\n", ini + ini_table()
    return {**files_of(ini, hal, FILE, code, robot.n_legs), **module_files(module), **correction}


def write_kinematics(machine: Machine, component: Branch, folder: Path) -> list[Path]:
    """Write the folder without a program, at the machine's own period, and return its files. Raises as above."""
    return write_files(kinematics_files(machine, component, machine.controller.period), folder)


def upright_component(machine: Machine) -> Branch:
    """Return the component in which the machine stands in the middle of its work volume with the tool upright."""
    upright = np.array([0.0, 0.0, 1.0])
    signs = nominal_robot(machine).branch(machine.work.centre - machine.tool_length * upright, upright)
    return Component(*signs.tolist())


def nearer_than_least(machine: Machine, component: Branch, path: Toolpath) -> str:
    """Return what the module would refuse of a toolpath in the machine frame, a sentence; "" where it takes all.

    A program that was judged keeps the machine's limits, but may be nearer to singular surfaces than its guard allows.
    """
    margins, guard = Margins.of(machine, component), machine.guard
    left = margins.own(path.tips, path.axes).min(axis=0)
    found: list[str] = []
    for limit, margin in zip(margins.own_limits, left.tolist(), strict=True):
        room = margin * getattr(limit, "comfort", 1.0)
        for words, pin, least, unit in (
            ("w = 0", "w", guard.w, 1.0), ("S = 0", "surface", 1e3 * guard.surface, 1e3),
            ("legs", "leg-gap", 1e3 * guard.leg_gap, 1e3), ("spindle", "shaft-gap", 1e3 * guard.shaft_gap, 1e3),
        ):  # fmt: skip
            if words in limit.name and unit * room < least:
                found.append(f"`pentapod.least.{pin}` (it has {unit * room:.4g}, {least:g} is asked)")
    if not found:
        return ""
    return f"LinuxCNC refuses blocks of this toolpath until you lower {', '.join(dict.fromkeys(found))}.\n"


def controller_frame(machine: Machine, component: Branch) -> RigidTransform:
    """Return the transform machine frame → the controller's: z along the upright tool, zero in the work volume."""
    # Where the direction points to +z, half a turn about x puts the tool upright.
    turned = np.diag([1.0, -1.0, -1.0]) if own_branch(machine.robot, component).w > 0 else np.eye(3)
    return RigidTransform(turned, -turned @ machine.work.centre)


def _reach(machine: Machine, frame: RigidTransform) -> tuple[Floats, Floats]:
    """Return the corners (3,) in mm of a box, controller's frame, that holds every tip that the strokes allow."""
    base = frame.apply(machine.robot.base_joints)
    far = (machine.legs.max_length + np.abs(machine.tool_length - machine.robot.offsets))[:, None]
    if isinstance(machine.robot, AsBuiltPentapod):
        far = far + (machine.robot.radii + np.abs(machine.robot.zeros))[:, None]
    return 1e3 * (base - far).max(axis=0), 1e3 * (base + far).min(axis=0)


def _home(machine: Machine, component: Branch, frame: RigidTransform) -> Floats:
    """Return the legs at machine zero, mm. Raises MachineError where the machine cannot stand there."""
    tip, upright = frame.inverse().apply([0.0, 0.0, 0.0]), frame.inverse().rotate([0.0, 0.0, 1.0])
    margins = Margins.of(machine, component)
    left = margins.own(tip, upright)
    if left.min() < 0.0:
        raise MachineError(
            "the machine cannot stand upright in the middle of its work volume, where LinuxCNC has its zero",
            key="work.centre", value=margins.own_limits[int(np.argmin(left))].name, remedy="move the work volume",
        )  # fmt: skip
    return 1e3 * machine.robot.leg_lengths(tip + machine.tool_length * upright, -upright)


def _guard_text(legs: int) -> str:
    """Return the HAL of the module: the guard in the servo thread, and what it stops."""
    lines = [
        "addf pentapod.guard servo-thread",
        *(f"net command{k + 1} joint.{k}.pos-cmd => pentapod.command.{k}" for k in range(legs)),
        *(f"net feedback{k + 1} joint.{k}.pos-fb => pentapod.feedback.{k}" for k in range(legs)),
        "net kind-of-motion motion.motion-type => pentapod.motion-type",
        "net asked-speed motion.requested-vel => pentapod.requested-vel",
        "net path-speed motion.current-vel => pentapod.current-vel",
        "net jog-stop pentapod.stop => motion.jog-stop",
        # M53 P0 masks the first, overrides that are switched off mask the second.
        "net hold pentapod.hold => motion.feed-hold motion.feed-inhibit",
        "net leg-rates pentapod.feed => motion.adaptive-feed",
    ]
    return "\n".join(lines) + "\n"


def _checked(path: Toolpath, frame: RigidTransform) -> Toolpath:
    """Return a toolpath in the controller's frame. Raises InputError where A or B would be beyond its axes."""
    turned = path.transformed(frame)
    steepest = float(np.abs(AB.angles(turned.axes)).max())
    if steepest > OPTIONS.tilt_deg:
        raise InputError(
            "a tool axis is as good as horizontal", key="toolpath", value=steepest,
            expected=f"A and B within ±{OPTIONS.tilt_deg:g}°", remedy="play the setpoints instead",
        )  # fmt: skip
    return turned


def _code(path: Toolpath) -> bytes:
    """Return the toolpath as G-code, controller's frame, with a tolerance for blended corners."""
    head, separator, moves = FORMATS["xyzab"].write(path).partition(b"G94\n")
    # Without P the planner blends corners for speed: by 0.3 mm on a path of gentle turns. M52 lets the legs' rates
    # slow it down; as a startup code of the ini it has no effect.
    return head + separator + f"G64 P{OPTIONS.blend_mm:g}\nM52 P1\n".encode() + moves


def _within(path: Toolpath, rapid: float) -> Toolpath:
    """Return the toolpath with feeds limited to the machine's rapid rate; rapids stay rapids."""
    segments = (s if np.isinf(s.feed) else replace(s, feed=min(s.feed, rapid)) for s in path.segments)
    return replace(path, segments=tuple(segments))
