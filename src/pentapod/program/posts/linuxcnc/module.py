"""The kinematics module for LinuxCNC: C with the numbers of one machine, for the quadratic family, nominal or as built.

The mathematics is a header of its own, without HAL: other controllers and simulators can include it, and the tests call
it through ctypes. Numbers are hexadecimal, so that the compiler reads them exactly.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.errors import MachineError
from pentapod.base.version import __version__
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.component import Component
from pentapod.kinematics.families.as_built import AsBuiltPentapod
from pentapod.kinematics.families.quadratic import LinearPentapod
from pentapod.kinematics.forward.quadratic import LinearPart
from pentapod.kinematics.robot import Branch, own_branch
from pentapod.machine.clearance.collision_world import spindle_ends
from pentapod.machine.machine import Machine
from pentapod.machine.rigid_bodies.frames import ring_radii
from pentapod.planning.limits.leg_pairs import LegPairClearance
from pentapod.planning.limits.limit import Scene
from pentapod.planning.limits.platform_joints import PlatformJointAngle
from pentapod.program.posts.linuxcnc.config import packaged

SOURCES = ("pentapod_kinematics.h", "pentapod_kins.c", "pins_2.9.h", "pins_dev.h", "install.sh", "README.md")
"""Files of the module."""


@dataclass(frozen=True)
class GuardOptions:
    """How the guard foresees where a motion stops.

    jog_share, path_share: of the axes' accelerations, with which jogs and programs slow down; LinuxCNC's planner does
    so with 0.6 of them on blended blocks. lead_periods: servo periods from a command to what is done about it.
    slack: of cosines, by which a pose of another component may be beyond the cones and still count as possible.
    """

    jog_share: float = 0.9
    path_share: float = 0.45
    lead_periods: float = 4.0
    slack: float = 0.01


GUARD = GuardOptions()


@dataclass(frozen=True, eq=False)
class Module:
    """What the module is made for. frame: machine → controller. accelerations: of X Y Z A B, mm/s² and deg/s²."""

    machine: Machine
    component: Branch
    frame: RigidTransform
    accelerations: tuple[float, ...]


def module_files(given: Module, names: tuple[str, ...] = SOURCES) -> dict[str, bytes]:
    """Return files of the module by name. Raises MachineError where the machine can have none."""
    values: dict[str, ArrayLike] = {**module_values(given), "ACCELERATION": given.accelerations}
    values |= {item.name.upper(): getattr(GUARD, item.name) for item in fields(GUARD)}
    words = {**module_names(given), **{name: c_numbers(value) for name, value in values.items()}}
    return {name: filled(packaged(f"kinematics/{name}").decode(), words).encode() for name in names}


def module_values(given: Module) -> dict[str, ArrayLike]:
    """Return the numbers of the mathematics by name, mm. Raises MachineError where the machine can have no module."""
    guard = given.machine.guard
    # In the order of the module's margins; those of the cones are differences of cosines.
    least = [guard.w, *(1e3 * np.array([guard.surface, guard.stroke, 0.0, 0.0, guard.leg_gap, guard.shaft_gap]))]
    return {**_design(given), **_as_it_is(given.machine), **_limits(given.machine), **_pairs(given), "LEAST": least}


def nominal_robot(machine: Machine) -> LinearPentapod:
    """Return the design of a machine that can have the module. Raises MachineError."""
    robot = machine.robot
    nominal = robot.nominal if isinstance(robot, AsBuiltPentapod) else robot
    remedy = "play the setpoints (stream/), or the legs as axes (trivkins/)"
    if not isinstance(nominal, LinearPentapod) or machine.limb is not None:
        raise MachineError(
            "there is no kinematics module for such a machine", key="family", value=type(nominal).__name__,
            expected="the quadratic family, as designed or as measured: delta in [geometry]", remedy=remedy,
        )  # fmt: skip
    if machine.leg_model.is_needed:
        raise MachineError(
            "the kinematics module commands lengths of legs, but these drives are told something else", key="leg_model",
            expected="drives without screw coupling, expansion, pitch errors and backlash", remedy=remedy,
        )  # fmt: skip
    return nominal


def module_names(given: Module) -> dict[str, str]:
    """Return what the sources say of machine and version, as text."""
    machine, component = given.machine, _component(given)
    name = (
        "".join(letter for letter in machine.name if letter.isprintable())
        .replace("*/", "")
        .replace("*)", "")
        .replace("@", "")
    )
    return {
        "NAME": name.replace("\\", ""), "DIGEST": machine.digest, "COMPONENT": str(component), "VERSION": __version__,
        "DIGEST_HIGH": machine.digest[:8], "DIGEST_LOW": machine.digest[8:],
        "AS_BUILT": str(int(isinstance(machine.robot, AsBuiltPentapod))),
        "RINGS": str(int(ring_radii(machine.robot).any())),
    }  # fmt: skip


def _component(given: Module) -> Component:
    return Component(*own_branch(nominal_robot(given.machine), given.component))


def _design(given: Module) -> dict[str, ArrayLike]:
    nominal, component = nominal_robot(given.machine), _component(given)
    # In millimetres from the start: exact numbers of this geometry, rounded once.
    base = 1e3 * nominal.base
    linear = LinearPart.of(base, nominal.delta)
    return {
        "TOOL_LENGTH": 1e3 * given.machine.tool_length, "TURN": np.diag(given.frame.rotation),
        "SHIFT": 1e3 * given.frame.translation, "X3": base[2, 0], "Y3": base[2, 1], "Z3": 1e3 * nominal.offsets[2],
        "DELTA": nominal.delta, "SIGN_W": component.w, "SIGN_S": component.s,
        "LINEAR": np.column_stack([linear.linear_map, linear.constant]),
    }  # fmt: skip


def _as_it_is(machine: Machine) -> dict[str, ArrayLike]:
    robot = machine.robot if isinstance(machine.robot, AsBuiltPentapod) else nominal_robot(machine)
    base, offsets = 1e3 * robot.base_joints, 1e3 * robot.offsets
    # Half a squared length is q/2 - b . p + o p . i - o b . i + (b . b + o o)/2.
    known = np.column_stack([np.ones_like(offsets), -base[:, :2], -offsets[:, None] * base[:, :2]])
    rest = np.column_stack([-offsets, base[:, 2], offsets * base[:, 2]])
    constant = -0.5 * ((base**2).sum(axis=1) + offsets**2)
    inverse = np.linalg.inv(known)
    return {
        "OF_SQUARES": np.column_stack([inverse, inverse @ constant]), "OF_THREE": inverse @ rest,
        "BASE": base.T, "OFFSET": offsets, "RING": 1e3 * robot.radii, "ZERO": 1e3 * robot.zeros,
    }  # fmt: skip


def _limits(machine: Machine) -> dict[str, ArrayLike]:
    legs, joints, bodies = machine.legs, machine.joints, machine.bodies
    return {
        "SHORTEST": 1e3 * legs.min_length, "LONGEST": 1e3 * legs.max_length,
        "RATE": 1e3 * legs.max_velocity, "CONE_AXIS": joints.base_axes.T,
        "CONE_COSINE": np.cos(joints.base_cone), "LEG_DIAMETER": 2e3 * bodies.leg_radius,
        "SHAFT_AND_LEG": 1e3 * (bodies.shaft_radius + bodies.leg_radius),
        "JOINED": 1e3 * bodies.joint_radius, "SHAFT": 1e3 * np.array(spindle_ends(machine)),
    }  # fmt: skip


def _pairs(given: Module) -> dict[str, ArrayLike]:
    scene = Scene(given.machine, own_branch(given.machine.robot, given.component))
    pairs, base = LegPairClearance.of(scene), 1e3 * given.machine.robot.base_joints
    ends = PlatformJointAngle.of(scene)
    edges = [[limit.edge for limit in ends if limit.widest == widest] for widest in (True, False)]
    return {
        "BETWEEN": np.transpose([base[pair.second] - base[pair.first] for pair in pairs]),
        "SIDE": [pair.side for pair in pairs], "JOINT_COSINE": edges,
    }  # fmt: skip


def c_numbers(value: ArrayLike) -> str:
    """Return a number, or nested lists of them, as C: small whole numbers as they are, others hexadecimal."""
    array = np.asarray(value, dtype=np.float64)
    if array.ndim:
        return "{" + ", ".join(c_numbers(one) for one in array) + "}"
    number = float(array)
    if not math.isfinite(number):
        raise MachineError("not a number of a machine", key="kinematics module", value=number)
    return f"{number:.1f}" if number == int(number) and abs(number) < 1e6 else number.hex()


def filled(text: str, words: Mapping[str, str]) -> str:
    """Return a source with its names replaced."""
    for name, value in words.items():
        text = text.replace(f"@{name}@", value)
    return text
