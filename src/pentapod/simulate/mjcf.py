"""The machine as MJCF, MuJoCo's model format: bodies, joints, closed loops and drives.

Each leg is a cylinder on two hinges at its base joint, and a rod that slides out of it, as long as the slide's
position says; `connect` constraints close the loops at the platform's joints. A leg that ends on a ring hangs on it by
a hinge along the ring's tangent, which keeps it in a plane with the line. A passive limb is a cylinder that slides and
turns on its rail, a rod in it, and a cross that hangs on the platform by a hinge. Where the legs do not hold the spin
of the tool about its own line, a little damping acts on it. The constraints are as stiff as the step allows, solved by
Newton's method to convergence: MuJoCo's defaults, meant for soft contacts, leave millimetres.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from xml.etree import ElementTree as Xml

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.kinematics.forces import FREEDOMS
from pentapod.kinematics.legs_on_rings import LegsOnRings
from pentapod.kinematics.robot import Robot
from pentapod.machine.leg_model import robot_zeros
from pentapod.machine.machine import Machine
from pentapod.simulate.bodies import Capsule, leg_cylinder, leg_rod, limb_strut, spindle

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
    step: float,
    model: MujocoModelOptions = DEFAULTS,
) -> str:
    """Return the model as XML, standing at a pose: position p and direction i (3,), machine frame.

    real: the geometry as built; a slide's position, and a drive's control, is the reading of the leg's scale in metres.
    step: seconds. Lengths in metres, masses in kilograms.
    """
    vectors = real.leg_vectors(position, direction)
    lengths = np.linalg.norm(vectors, axis=1)
    readings = lengths + robot_zeros(real)
    hinges = _hinges(real, position, direction)
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
        pose = (real.base_joints[leg], vectors[leg] / lengths[leg], lengths[leg])
        rod = _leg(world, machine, leg, *pose, reading=readings[leg])
        if leg in hinges:  # the rod may turn in itself, and hangs on the platform or its ring by a hinge
            _add(rod, "joint", name=f"turn{leg + 1}", type="hinge", axis="0 0 1")
            aside = _turned_back(_rotation_from_z(pose[1]), model.hinge * hinges[leg])
            _add(rod, "site", name=f"rod{leg + 1}side", pos=aside)
    platform = _platform(world, machine, real, position, direction, model)
    loops = _add(root, "equality")
    actuators = _add(root, "actuator")
    drives = machine.drives
    for leg in range(real.n_legs):
        _add(loops, "connect", name=f"loop{leg + 1}", site1=f"rod{leg + 1}", site2=f"platform{leg + 1}")
        damping = drives.moving_mass[leg] * drives.velocity_gain[leg]
        stiffness = damping * drives.position_gain[leg]
        _add(actuators, "position", name=f"drive{leg + 1}", joint=f"leg{leg + 1}", kp=[stiffness], kv=[damping])
    for leg in hinges:  # after all loops, whose forces are read by their places
        name = f"{leg + 1}side"
        _add(loops, "connect", name=f"hinge{leg + 1}", site1=f"rod{name}", site2=f"platform{name}")
    _limb(world, platform, loops, machine, real, (position, direction), model)
    free = real.n_legs + real.passive_wrenches(position, direction).shape[-2] < FREEDOMS
    if free:
        _add(actuators, "velocity", name="spin", site="origin", gear="0 0 0 0 0 1", kv=[model.spin_damping])
    _add(_add(root, "keyframe"), "key", name="start", ctrl=[*readings, *([0.0] if free else [])])
    Xml.indent(root)
    return Xml.tostring(root, encoding="unicode") + "\n"


def _leg(
    world: Xml.Element, machine: Machine, leg: int, base: Floats, along: Floats, length: float, *, reading: float
) -> Xml.Element:
    """Add a leg: a cylinder that turns about its base joint, and the rod that slides in it; return the rod."""
    name, limits = str(leg + 1), machine.legs
    stroke = [float(limits.min_length[leg]), float(limits.max_length[leg])]
    body = _add(world, "body", name=f"leg{name}", pos=base, quat=_rotation_from_z(along))
    for axis, letter in (("1 0 0", "u"), ("0 1 0", "v")):
        _add(body, "joint", name=f"base{name}{letter}", type="hinge", axis=axis)
    _capsule(body, leg_cylinder(machine, leg), _STEEL)
    rod = _add(body, "body", name=f"rod{name}", pos=[0.0, 0.0, length])
    slide = _add(rod, "joint", name=f"leg{name}", type="slide", axis="0 0 1", ref=[reading], range=stroke)
    slide.set("armature", _text([machine.drives.moving_mass[leg]]))
    _capsule(rod, leg_rod(machine, leg), _ROD)
    _add(rod, "site", name=f"rod{name}", size=[1.2 * machine.bodies.leg_radius])
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
    """Add the passive limb: z of its bodies along the strut, x along the rail, the hinge of its cross along y.

    The robot's passive joint holds a moment along rail × y.
    """
    limb = machine.limb
    if limb is None:
        return
    foot, end = limb.ends(*pose)
    length = float(np.linalg.norm(end - foot))
    along = (end - foot) / length
    moment = real.passive_wrenches(*pose)[0, 3:]
    hinge = np.cross(moment, limb.rail)  # y, as it is perpendicular to the rail
    hinge *= model.hinge / np.linalg.norm(hinge)
    frame = np.stack([limb.rail, np.cross(along, limb.rail), along], axis=1)
    body = _add(world, "body", name="limb", pos=foot, xyaxes=[*frame[:, 0], *frame[:, 1]])
    for name, kind in (("carriage", "slide"), ("rail", "hinge")):
        _add(body, "joint", name=name, type=kind, axis="1 0 0")
    cylinder, slider = limb_strut(machine, limb)
    _capsule(body, cylinder, _STEEL)
    rod = _add(body, "body", name="strut", pos=[0.0, 0.0, length])
    _add(rod, "joint", name="strut", type="slide", axis="0 0 1")
    _capsule(rod, slider, _ROD)
    cross = _add(rod, "body", name="cross")
    _add(cross, "joint", name="cross", type="hinge", axis="1 0 0")
    _inertia(cross, model.hinge, model)
    quaternion = _rotation_from_z(pose[1])
    for name, off in (("limb", 0.0 * hinge), ("limbside", hinge)):
        at = np.array([0.0, 0.0, limb.joint]) + _turned_back(quaternion, off)
        _add(cross, "site", name=f"cross{name}", pos=off @ frame)
        _add(platform, "site", name=f"platform{name}", pos=at)
        _add(loops, "connect", name=name, site1=f"cross{name}", site2=f"platform{name}")


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
    body = _add(world, "body", name="platform", pos=position, quat=_rotation_from_z(direction))
    _add(body, "freejoint", name="platform")
    _capsule(body, shaft, _SPINDLE)
    _capsule(body, Capsule(shaft.high, tool, 0.2 * shaft.radius, 0.0), _STEEL)
    _add(body, "site", name="origin")
    _add(body, "site", name="tip", pos=[0.0, 0.0, tool])
    off = real.platform_joints(position, direction) - position - real.offsets[:, None] * direction
    hinges, radii = _hinges(real, position, direction), _radii(real)
    for leg in range(real.n_legs):
        height, name = np.array([0.0, 0.0, float(real.offsets[leg])]), f"platform{leg + 1}"
        if radii[leg] == 0.0:
            turn = _rotation_from_z(direction)
            at = height + (_turned_back(turn, off[leg]) if real.arms[leg] > 0.0 else 0.0)
            _add(body, "site", name=name, pos=at)
            if leg in hinges:
                _add(body, "site", name=f"{name}side", pos=at + _turned_back(turn, model.hinge * hinges[leg]))
            continue
        ring = _add(body, "body", name=f"ring{leg + 1}", pos=height)
        _add(ring, "joint", name=f"ring{leg + 1}", type="hinge", axis="0 0 1", damping=[model.spin_damping])
        _inertia(ring, max(float(radii[leg]), model.hinge), model)  # a speck would not be simulated
        for at, place in ((name, off[leg]), (f"{name}side", off[leg] + model.hinge * hinges[leg])):
            _add(ring, "site", name=at, pos=_turned_back(_rotation_from_z(direction), place))
    return body


def _inertia(body: Xml.Element, radius: float, model: MujocoModelOptions) -> None:
    """Give a body the mass of a ring, as far from its origin as `radius`, metres."""
    inertia = model.ring_mass * radius**2
    _add(body, "inertial", pos=[0.0, 0.0, 0.0], mass=[model.ring_mass], diaginertia=[inertia] * 3)


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


def _radii(real: Robot) -> Floats:
    """Return the radii (n_legs,) of rings on which legs end, which turn freely about the line; 0 for others."""
    return real.radii if isinstance(real, LegsOnRings) else np.zeros(real.n_legs)


def _hinges(real: Robot, position: Floats, direction: Floats) -> dict[int, Floats]:
    """Return the axes (3,) of hinges in which legs hang on the platform or, along the tangent, on their ring."""
    radii = _radii(real)
    if not radii.any():
        return dict(real.hinges(position, direction))
    across = np.cross(direction, real.base_joints - position)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    return {leg: across[leg] for leg in np.flatnonzero(radii).tolist()}


def _turned_back(quaternion: Floats, vector: Floats) -> Floats:
    """Return a vector (3,) in the frame that a quaternion (4,), scalar first, turns to the world."""
    scalar, axis = quaternion[0], -quaternion[1:]
    turned = vector + 2.0 * np.cross(axis, np.cross(axis, vector) + scalar * vector)
    return np.asarray(turned, dtype=np.float64)


def _add(parent: Xml.Element, tag: str, **attributes: str | Iterable[float]) -> Xml.Element:
    """Add an element; numbers are written as MJCF takes them."""
    words = {name: value if isinstance(value, str) else _text(value) for name, value in attributes.items()}
    return Xml.SubElement(parent, tag, words)


def _text(values: Iterable[float]) -> str:
    """Return numbers separated by blanks, with all digits."""
    return " ".join(repr(float(value)) for value in values)
