"""The machine as MJCF, MuJoCo's model format: bodies, joints, closed loops and drives.

Each leg is a cylinder on two hinges at its base joint, and a rod that slides out of it, as long as the slide's
position says; `connect` constraints close the loops at the platform's joints. A leg that ends on a ring hangs on it by
a hinge along the ring's tangent, which keeps it in a plane with the line. A passive limb is a cylinder that slides and
turns on its rail, a rod in it, and a cross that hangs on the platform by a hinge. Where the legs do not hold the spin
of the tool about its own line, a little damping acts on it. The constraints are as stiff as the step allows, solved by
Newton's method to convergence: MuJoCo's defaults, meant for soft contacts, leave millimetres.
"""

from __future__ import annotations

from dataclasses import dataclass
from xml.etree import ElementTree as Xml

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.kinematics.forces import FREEDOMS
from pentapod.kinematics.robot import Robot
from pentapod.machine.leg_model import robot_zeros
from pentapod.machine.machine import Machine
from pentapod.machine.rigid_bodies.capsules import Capsule, leg_cylinder, leg_rod, limb_strut, spindle
from pentapod.machine.rigid_bodies.frames import (
    add,
    leg_hinges,
    limb_hinge,
    ring_radii,
    rotation_from_z,
    steps_in,
    text,
    turned_back,
    written,
)

SOLIMP = "0.9999 0.9999 0.001 0.5 2"
"""Impedance of the constraints, MJCF's `solimp`: almost rigid."""
_STEEL, _ROD, _SPINDLE = "0.55 0.58 0.62 1", "0.85 0.86 0.88 1", "0.25 0.45 0.75 1"


@dataclass(frozen=True)
class MujocoModelOptions:
    """Options of the rigid-body model."""

    constraint_steps: float = 2.0
    """Time constant of the constraints, in steps: the smallest that is stable."""
    spin_damping: float = 0.01
    """Damping of the tool's spin about its own line, and of rings about it, N·m·s."""
    ring_mass: float = 0.02
    """Mass of a ring on which a leg ends, and of the cross of a universal joint, kg."""
    hinge: float = 0.03
    """Half the length of the hinge by which a leg hangs on a ring or in a revolute joint, m."""


DEFAULTS = MujocoModelOptions()


def mjcf(
    machine: Machine,
    real: Robot,
    position: Floats,
    direction: Floats,
    *,
    period: float,
    model: MujocoModelOptions = DEFAULTS,
) -> str:
    """Return the model as XML, standing at a pose: position p and direction i (3,), machine frame.

    real: the geometry as built; a slide's position, and a drive's control, is the reading of the leg's scale in metres.
    period: of the controller, seconds. Lengths in metres, masses in kilograms.
    """
    step = period / steps_in(period)
    vectors = real.leg_vectors(position, direction)
    lengths = np.linalg.norm(vectors, axis=1)
    readings = lengths + robot_zeros(real)
    hinges = leg_hinges(real, position, direction)
    root = Xml.Element("mujoco", model=machine.name)
    add(root, "compiler", angle="radian", autolimits="true")
    option = add(root, "option", timestep=[step], gravity=machine.masses.gravity, integrator="implicitfast")
    option.attrib |= {"solver": "Newton", "iterations": "100", "tolerance": "1e-12"}
    add(option, "flag", contact="disable")
    defaults = add(root, "default")
    stiff = [model.constraint_steps * step, 1.0]
    add(defaults, "equality", solref=stiff, solimp=SOLIMP)
    add(defaults, "joint", solreflimit=stiff, solimplimit=SOLIMP)
    world = add(root, "worldbody")
    for leg in range(real.n_legs):
        pose = (real.base_joints[leg], vectors[leg] / lengths[leg], lengths[leg])
        rod = _leg(world, machine, leg, *pose, reading=readings[leg])
        if leg in hinges:  # the rod may turn in itself, and hangs on the platform or its ring by a hinge
            add(rod, "joint", name=f"turn{leg + 1}", type="hinge", axis="0 0 1")
            aside = turned_back(rotation_from_z(pose[1]), model.hinge * hinges[leg])
            add(rod, "site", name=f"rod{leg + 1}side", pos=aside)
    platform = _platform(world, machine, real, position, direction, model)
    loops = add(root, "equality")
    actuators = add(root, "actuator")
    drives = machine.drives
    for leg in range(real.n_legs):
        add(loops, "connect", name=f"loop{leg + 1}", site1=f"rod{leg + 1}", site2=f"platform{leg + 1}")
        damping = drives.moving_mass[leg] * drives.velocity_gain[leg]
        stiffness = damping * drives.position_gain[leg]
        add(actuators, "position", name=f"drive{leg + 1}", joint=f"leg{leg + 1}", kp=[stiffness], kv=[damping])
    for leg in hinges:  # after all loops, whose forces are read by their places
        name = f"{leg + 1}side"
        add(loops, "connect", name=f"hinge{leg + 1}", site1=f"rod{name}", site2=f"platform{name}")
    _limb(world, platform, loops, machine, real, (position, direction), model)
    free = real.n_legs + real.passive_wrenches(position, direction).shape[-2] < FREEDOMS
    if free:
        add(actuators, "velocity", name="spin", site="origin", gear="0 0 0 0 0 1", kv=[model.spin_damping])
    add(add(root, "keyframe"), "key", name="start", ctrl=[*readings, *([0.0] if free else [])])
    return written(root)


def _leg(
    world: Xml.Element, machine: Machine, leg: int, base: Floats, along: Floats, length: float, *, reading: float
) -> Xml.Element:
    """Add a leg: a cylinder that turns about its base joint, and the rod that slides in it; return the rod."""
    name, limits = str(leg + 1), machine.legs
    stroke = [float(limits.min_length[leg]), float(limits.max_length[leg])]
    body = add(world, "body", name=f"leg{name}", pos=base, quat=rotation_from_z(along))
    for axis, letter in (("1 0 0", "u"), ("0 1 0", "v")):
        add(body, "joint", name=f"base{name}{letter}", type="hinge", axis=axis)
    _capsule(body, leg_cylinder(machine, leg), _STEEL)
    rod = add(body, "body", name=f"rod{name}", pos=[0.0, 0.0, length])
    slide = add(rod, "joint", name=f"leg{name}", type="slide", axis="0 0 1", ref=[reading], range=stroke)
    slide.set("armature", text([machine.drives.moving_mass[leg]]))
    _capsule(rod, leg_rod(machine, leg), _ROD)
    add(rod, "site", name=f"rod{name}", size=[1.2 * machine.bodies.leg_radius])
    return rod


def _limb(
    world: Xml.Element,
    platform: Xml.Element,
    loops: Xml.Element,
    machine: Machine,
    real: Robot,
    pose: tuple[Floats, Floats],
    model: MujocoModelOptions,
) -> None:
    """Add the passive limb: z of its bodies along the strut, x along the rail, the hinge of its cross along y."""
    limb = machine.limb
    if limb is None:
        return
    foot, end = limb.ends(*pose)
    length = float(np.linalg.norm(end - foot))
    along = (end - foot) / length
    hinge = model.hinge * limb_hinge(real, limb.rail, *pose)
    frame = np.stack([limb.rail, np.cross(along, limb.rail), along], axis=1)
    body = add(world, "body", name="limb", pos=foot, xyaxes=[*frame[:, 0], *frame[:, 1]])
    for name, kind in (("carriage", "slide"), ("rail", "hinge")):
        add(body, "joint", name=name, type=kind, axis="1 0 0")
    cylinder, slider = limb_strut(machine, limb)
    _capsule(body, cylinder, _STEEL)
    rod = add(body, "body", name="strut", pos=[0.0, 0.0, length])
    add(rod, "joint", name="strut", type="slide", axis="0 0 1")
    _capsule(rod, slider, _ROD)
    cross = add(rod, "body", name="cross")
    add(cross, "joint", name="cross", type="hinge", axis="1 0 0")
    _inertia(cross, model.hinge, model)
    quaternion = rotation_from_z(pose[1])
    for name, off in (("limb", 0.0 * hinge), ("limbside", hinge)):
        at = np.array([0.0, 0.0, limb.joint]) + turned_back(quaternion, off)
        add(cross, "site", name=f"cross{name}", pos=off @ frame)
        add(platform, "site", name=f"platform{name}", pos=at)
        add(loops, "connect", name=name, site1=f"cross{name}", site2=f"platform{name}")


def _platform(
    world: Xml.Element,
    machine: Machine,
    real: Robot,
    position: Floats,
    direction: Floats,
    model: MujocoModelOptions,
) -> Xml.Element:
    """Add the platform: a free body whose z axis is the platform line, its origin p; rings turn about that line."""
    top = float(real.offsets.min()) if machine.limb is None else machine.line_top
    shaft, tool = spindle(machine, top), machine.tool_length
    body = add(world, "body", name="platform", pos=position, quat=rotation_from_z(direction))
    add(body, "freejoint", name="platform")
    _capsule(body, shaft, _SPINDLE)
    _capsule(body, Capsule(shaft.high, tool, 0.2 * shaft.radius, 0.0), _STEEL)
    add(body, "site", name="origin")
    add(body, "site", name="tip", pos=[0.0, 0.0, tool])
    off = real.platform_joints(position, direction) - position - real.offsets[:, None] * direction
    hinges, radii = leg_hinges(real, position, direction), ring_radii(real)
    for leg in range(real.n_legs):
        height, name = np.array([0.0, 0.0, float(real.offsets[leg])]), f"platform{leg + 1}"
        if radii[leg] == 0.0:
            turn = rotation_from_z(direction)
            at = height + (turned_back(turn, off[leg]) if real.arms[leg] > 0.0 else 0.0)
            add(body, "site", name=name, pos=at)
            if leg in hinges:
                add(body, "site", name=f"{name}side", pos=at + turned_back(turn, model.hinge * hinges[leg]))
            continue
        ring = add(body, "body", name=f"ring{leg + 1}", pos=height)
        add(ring, "joint", name=f"ring{leg + 1}", type="hinge", axis="0 0 1", damping=[model.spin_damping])
        _inertia(ring, max(float(radii[leg]), model.hinge), model)  # a speck would not be simulated
        for at, place in ((name, off[leg]), (f"{name}side", off[leg] + model.hinge * hinges[leg])):
            add(ring, "site", name=at, pos=turned_back(rotation_from_z(direction), place))
    return body


def _inertia(body: Xml.Element, radius: float, model: MujocoModelOptions) -> None:
    """Give a body the mass of a ring, as far from its origin as `radius`, metres."""
    inertia = model.ring_mass * radius**2
    add(body, "inertial", pos=[0.0, 0.0, 0.0], mass=[model.ring_mass], diaginertia=[inertia] * 3)


def _capsule(body: Xml.Element, capsule: Capsule, colour: str) -> None:
    """Add a capsule along the body's z axis."""
    ends = [0.0, 0.0, capsule.low, 0.0, 0.0, capsule.high]
    add(body, "geom", type="capsule", fromto=ends, size=[capsule.radius], mass=[capsule.mass], rgba=colour)
