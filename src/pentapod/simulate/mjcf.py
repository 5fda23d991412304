"""The machine as MJCF, MuJoCo's model format: bodies, joints, closed loops and drives.

Each leg is a cylinder on two hinges at its base joint, and a rod that slides out of it, as long as the slide's
position says; `connect` constraints close the five loops at the platform's joints. A little damping acts on the one
freedom that legs do not constrain, the spin of the tool about its own line. The constraints are as stiff as the step
allows, solved by Newton's method to convergence: MuJoCo's defaults, meant for soft contacts, leave millimetres.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from xml.etree import ElementTree as Xml

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.kinematics.families.as_built import AsBuiltPentapod
from pentapod.machine.machine import Machine
from pentapod.simulate.bodies import Capsule, leg_cylinder, leg_rod, spindle

SOLIMP = "0.9999 0.9999 0.001 0.5 2"
"""Impedance of the constraints, MJCF's `solimp`: almost rigid."""
_STEEL, _ROD, _SPINDLE = "0.55 0.58 0.62 1", "0.85 0.86 0.88 1", "0.25 0.45 0.75 1"


@dataclass(frozen=True)
class MujocoModelOptions:
    """Options of the rigid-body model."""

    constraint_steps: float = 2.0
    """Time constant of the constraints, in steps: the smallest that is stable."""
    spin_damping: float = 0.01
    """Damping of the tool's spin about its own line, N·m·s."""


DEFAULTS = MujocoModelOptions()


def mjcf(
    machine: Machine,
    real: AsBuiltPentapod,
    position: Floats,
    direction: Floats,
    *,
    step: float,
    model: MujocoModelOptions = DEFAULTS,
) -> str:
    """Return the model as XML, standing at a pose: position p and direction i (3,), machine frame.

    real: the geometry as built; a slide's position, and a drive's control, is the leg's length in metres. step:
    seconds. Lengths in metres, masses in kilograms.
    """
    joints = position + real.offsets[:, None] * direction
    vectors = joints - real.base_joints
    lengths = np.linalg.norm(vectors, axis=1)
    root = Xml.Element("mujoco", model=machine.name)
    _add(root, "compiler", angle="radian", autolimits="true")
    option = _add(root, "option", timestep=[step], gravity=machine.masses.gravity, integrator="implicitfast")
    option.attrib |= {"solver": "Newton", "iterations": "100", "tolerance": "1e-12"}
    _add(option, "flag", contact="disable")
    defaults = _add(root, "default")
    stiff = [model.constraint_steps * step, 1.0]
    _add(defaults, "equality", solref=stiff, solimp=SOLIMP)
    _add(defaults, "joint", solreflimit=stiff, solimplimit=SOLIMP)
    world = _add(root, "worldbody")
    for leg in range(real.n_legs):
        _leg(world, machine, leg, real.base_joints[leg], vectors[leg] / lengths[leg], lengths[leg])
    _platform(world, machine, real, position, direction)
    loops = _add(root, "equality")
    actuators = _add(root, "actuator")
    drives = machine.drives
    for leg in range(real.n_legs):
        _add(loops, "connect", name=f"loop{leg + 1}", site1=f"rod{leg + 1}", site2=f"platform{leg + 1}")
        damping = drives.moving_mass[leg] * drives.velocity_gain[leg]
        stiffness = damping * drives.position_gain[leg]
        _add(actuators, "position", name=f"drive{leg + 1}", joint=f"leg{leg + 1}", kp=[stiffness], kv=[damping])
    _add(actuators, "velocity", name="spin", site="origin", gear="0 0 0 0 0 1", kv=[model.spin_damping])
    _add(_add(root, "keyframe"), "key", name="start", ctrl=[*lengths, 0.0])
    Xml.indent(root)
    return Xml.tostring(root, encoding="unicode") + "\n"


def _leg(world: Xml.Element, machine: Machine, leg: int, base: Floats, along: Floats, length: float) -> None:
    """Add a leg: a cylinder that turns about its base joint, and the rod that slides in it."""
    name, limits = str(leg + 1), machine.legs
    stroke = [float(limits.min_length[leg]), float(limits.max_length[leg])]
    body = _add(world, "body", name=f"leg{name}", pos=base, quat=_rotation_from_z(along))
    for axis, letter in (("1 0 0", "u"), ("0 1 0", "v")):
        _add(body, "joint", name=f"base{name}{letter}", type="hinge", axis=axis)
    _capsule(body, leg_cylinder(machine, leg), _STEEL)
    rod = _add(body, "body", name=f"rod{name}", pos=[0.0, 0.0, length])
    slide = _add(rod, "joint", name=f"leg{name}", type="slide", axis="0 0 1", ref=[length], range=stroke)
    slide.set("armature", _text([machine.drives.moving_mass[leg]]))
    _capsule(rod, leg_rod(machine, leg), _ROD)
    _add(rod, "site", name=f"rod{name}", size=[1.2 * machine.bodies.leg_radius])


def _platform(world: Xml.Element, machine: Machine, real: AsBuiltPentapod, position: Floats, direction: Floats) -> None:
    """Add the platform: a free body whose z axis is the platform line, its origin p."""
    shaft, tool = spindle(machine, float(real.offsets.min())), machine.tool_length
    body = _add(world, "body", name="platform", pos=position, quat=_rotation_from_z(direction))
    _add(body, "freejoint", name="platform")
    _capsule(body, shaft, _SPINDLE)
    _capsule(body, Capsule(shaft.high, tool, 0.2 * shaft.radius, 0.0), _STEEL)
    _add(body, "site", name="origin")
    _add(body, "site", name="tip", pos=[0.0, 0.0, tool])
    for leg in range(real.n_legs):
        _add(body, "site", name=f"platform{leg + 1}", pos=[0.0, 0.0, real.offsets[leg]])


def _capsule(body: Xml.Element, capsule: Capsule, colour: str) -> None:
    """Add a capsule along the body's z axis."""
    ends = [0.0, 0.0, capsule.low, 0.0, 0.0, capsule.high]
    _add(body, "geom", type="capsule", fromto=ends, size=[capsule.radius], mass=[capsule.mass], rgba=colour)


def _rotation_from_z(direction: Floats) -> Floats:
    """Return the quaternion (4,), scalar first, of the shortest rotation from the z axis to a unit direction (3,).

    Near −z, where it is not unique, half a turn about x comes first.
    """
    u, v, w = direction
    quaternion = np.array([1.0 + w, -v, u, 0.0] if w > -0.9 else [-v, 1.0 - w, 0.0, u])
    return quaternion / np.linalg.norm(quaternion)


def _add(parent: Xml.Element, tag: str, **attributes: str | Iterable[float]) -> Xml.Element:
    """Add an element; numbers are written as MJCF takes them."""
    words = {name: value if isinstance(value, str) else _text(value) for name, value in attributes.items()}
    return Xml.SubElement(parent, tag, words)


def _text(values: Iterable[float]) -> str:
    """Return numbers separated by blanks, with all digits."""
    return " ".join(repr(float(value)) for value in values)
