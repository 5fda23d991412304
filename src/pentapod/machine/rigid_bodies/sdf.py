"""The machine as SDF, the model format of Gazebo and Drake: links, joints and closed loops.

Each leg is a cylinder on a universal joint at the base and a rod that slides out of it and ends in a ball joint on the
platform. So the platform is the child of several joints: that is how SDF closes loops. Where a leg hangs by a hinge, on
the platform or on a ring, it stands on a ball joint, and the hinge is a revolute joint. A passive limb is a carriage on
its rail, a strut of two links that turns about the rail, and a universal joint.

A joint of SDF is at zero where the file draws it. So the position of a leg's joint is its reading less that of the pose
in the file. Lengths in metres, masses in kilograms, angles in radians.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from xml.etree import ElementTree as Xml

import numpy as np

from pentapod.base.arrays import Floats
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

VERSION = "1.7"
"""Of the format: the first with poses relative to the child link, and read by every later one."""
_STEEL, _ROD, _SPINDLE = (0.55, 0.58, 0.62, 1.0), (0.85, 0.86, 0.88, 1.0), (0.25, 0.45, 0.75, 1.0)
_X, _Y, _Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class SdfModelOptions:
    """Options of the model in SDF."""

    small_mass: float = 0.02
    """Mass of a ring on which a leg ends, and of the carriage of a passive limb, kg."""
    small_radius: float = 0.03
    """Radius of the ball whose inertia they have, m."""


DEFAULTS = SdfModelOptions()


def sdf(
    machine: Machine,
    real: Robot,
    position: Floats,
    direction: Floats,
    *,
    period: float,
    model: SdfModelOptions = DEFAULTS,
) -> str:
    """Return a world with the machine as XML, standing at a pose: position p and direction i (3,), machine frame.

    real: the geometry as built. period: of the controller, seconds, which the world's step divides.
    """
    vectors = real.leg_vectors(position, direction)
    lengths = np.linalg.norm(vectors, axis=1)
    root = Xml.Element("sdf", version=VERSION)
    world = add(root, "world", name=machine.name)
    _values(world, gravity=machine.masses.gravity)
    _values(add(world, "physics", name="rigid bodies", type="ode"), max_step_size=[period / steps_in(period)])
    drawn = _Model(add(world, "model", name=machine.name), model)
    _base(drawn, machine, real)
    upright = _turn(direction)
    platform = drawn.link("platform", position, upright)
    hinges, radii = leg_hinges(real, position, direction), ring_radii(real)
    _limb(drawn, machine, real, position, direction)
    for leg in np.flatnonzero(radii).tolist():
        name, at = f"ring{leg + 1}", position + real.offsets[leg] * direction
        drawn.small(drawn.link(name, at, upright))
        drawn.joint(f"{name}_about_line", "revolute", "platform", name, axes=[_Z])
    stroke = np.stack([machine.legs.min_length, machine.legs.max_length], axis=1)
    for leg in range(real.n_legs):
        number, turn = leg + 1, _turn(vectors[leg] / lengths[leg])
        base = real.base_joints[leg]
        drawn.capsule(drawn.link(f"cylinder{number}", base, turn), leg_cylinder(machine, leg), _STEEL)
        drawn.capsule(drawn.link(f"rod{number}", base + vectors[leg], turn), leg_rod(machine, leg), _ROD)
        if leg in hinges:
            drawn.joint(f"base{number}", "ball", "base", f"cylinder{number}")
        else:
            drawn.joint(f"base{number}", "universal", "base", f"cylinder{number}", axes=[_X, _Y])
        ends = stroke[leg] - lengths[leg] - robot_zeros(real)[leg]
        drawn.joint(f"leg{number}", "prismatic", f"cylinder{number}", f"rod{number}", axes=[_Z], limits=ends)
        holder = "platform" if radii[leg] == 0.0 else f"ring{number}"
        joint = real.platform_joints(position, direction)[leg]
        centre = position if radii[leg] == 0.0 else position + real.offsets[leg] * direction
        at = upright.T @ (joint - centre)
        if leg in hinges:
            hinge = upright.T @ hinges[leg]
            drawn.joint(f"platform{number}", "revolute", f"rod{number}", holder, at=at, axes=[hinge])
        else:
            drawn.joint(f"platform{number}", "ball", f"rod{number}", holder, at=at)
    shaft, tool = spindle(machine, machine.line_top), machine.tool_length
    drawn.capsule(platform, shaft, _SPINDLE)
    drawn.visual(platform, "tool", Capsule(shaft.high, tool, 0.2 * shaft.radius, 0.0), _STEEL)
    add(drawn.model, "frame", name="tip", attached_to="platform").append(_pose(np.array([0.0, 0.0, tool]), np.eye(3)))
    return written(root)


def _base(drawn: _Model, machine: Machine, real: Robot) -> None:
    """Add the frame on which the legs stand, fixed to the world; it is drawn as a ball at each joint."""
    base = drawn.link("base", np.zeros(3), np.eye(3))
    for leg, joint in enumerate(real.base_joints):
        visual = add(base, "visual", name=f"joint{leg + 1}")
        visual.append(_pose(joint, np.eye(3)))
        _values(add(add(visual, "geometry"), "sphere"), radius=[1.5 * machine.bodies.leg_radius])
    drawn.joint("ground", "fixed", "world", "base")


def _limb(drawn: _Model, machine: Machine, real: Robot, position: Floats, direction: Floats) -> None:
    """Add the passive limb: z of its links along the strut, x along the rail."""
    limb = machine.limb
    if limb is None:
        return
    foot, end = limb.ends(position, direction)
    place, length, _ = limb.at(position, direction)
    along = (end - foot) / length
    turn = np.column_stack([limb.rail, np.cross(along, limb.rail), along]).astype(np.float64)
    cylinder, slider = limb_strut(machine, limb)
    drawn.small(drawn.link("carriage", foot, turn))
    drawn.capsule(drawn.link("limb", foot, turn), cylinder, _STEEL)
    drawn.capsule(drawn.link("strut", end, turn), slider, _ROD)
    drawn.joint("carriage_on_rail", "prismatic", "base", "carriage", axes=[_X], limits=limb.carriage - place)
    drawn.joint("limb_about_rail", "revolute", "carriage", "limb", axes=[_X])
    drawn.joint("strut_in_limb", "prismatic", "limb", "strut", axes=[_Z], limits=limb.strut - length)
    upright, hinge = _turn(direction), limb_hinge(real, limb.rail, position, direction)
    at, axes = np.array([0.0, 0.0, limb.joint]), [upright.T @ limb.rail, upright.T @ hinge]
    drawn.joint("platform_on_strut", "universal", "strut", "platform", at=at, axes=axes)


@dataclass(frozen=True)
class _Model:
    """The element to which links and joints are added."""

    model: Xml.Element
    options: SdfModelOptions

    def link(self, name: str, at: Floats, turn: Floats) -> Xml.Element:
        """Add a link whose frame is at a point (3,), turned by a matrix (3, 3)."""
        link = add(self.model, "link", name=name)
        link.append(_pose(at, turn))
        return link

    def joint(
        self,
        name: str,
        kind: str,
        parent: str,
        child: str,
        *,
        at: Floats | None = None,
        axes: Iterable[Iterable[float]] = (),
        limits: Floats | None = None,
    ) -> None:
        """Add a joint at a point of the child (3,), its axes in the child's frame; limits (2,) of its position."""
        joint = add(self.model, "joint", name=name, type=kind)
        if at is not None:
            joint.append(_pose(at, np.eye(3)))
        add(joint, "parent").text = parent
        add(joint, "child").text = child
        for tag, vector in zip(("axis", "axis2"), axes, strict=False):
            element = add(joint, tag)
            _values(element, xyz=vector)
            if limits is not None:
                _values(add(element, "limit"), lower=limits[:1], upper=limits[1:])

    def capsule(self, link: Xml.Element, capsule: Capsule, colour: tuple[float, ...]) -> None:
        """Give a link the mass and the look of a capsule along its z axis."""
        across, along = capsule.inertia, capsule.axial_inertia
        self._inertial(link, capsule.mass, 0.5 * (capsule.low + capsule.high), (across, across, along))
        self.visual(link, "body", capsule, colour)

    def small(self, link: Xml.Element) -> None:
        """Give a link the inertia of a small ball."""
        mass = self.options.small_mass
        self._inertial(link, mass, 0.0, (0.4 * mass * self.options.small_radius**2,) * 3)

    def visual(self, link: Xml.Element, name: str, capsule: Capsule, colour: tuple[float, ...]) -> None:
        """Draw a cylinder along a link's z axis."""
        visual = add(link, "visual", name=name)
        visual.append(_pose(np.array([0.0, 0.0, 0.5 * (capsule.low + capsule.high)]), np.eye(3)))
        cylinder = add(add(visual, "geometry"), "cylinder")
        _values(cylinder, radius=[capsule.radius], length=[capsule.high - capsule.low])
        _values(add(visual, "material"), ambient=colour, diffuse=colour)

    def _inertial(self, link: Xml.Element, mass: float, middle: float, moments: tuple[float, ...]) -> None:
        inertial = add(link, "inertial")
        inertial.append(_pose(np.array([0.0, 0.0, middle]), np.eye(3)))
        _values(inertial, mass=[mass])
        ixx, iyy, izz = ([moment] for moment in moments)
        none = [0.0]
        _values(add(inertial, "inertia"), ixx=ixx, ixy=none, ixz=none, iyy=iyy, iyz=none, izz=izz)


def _values(parent: Xml.Element, **values: Iterable[float]) -> None:
    """Add an element with numbers for each name."""
    for name, numbers in values.items():
        add(parent, name).text = text(numbers)


def _pose(at: Floats, turn: Floats) -> Xml.Element:
    """Return a pose: point (3,), then roll, pitch and yaw of a rotation matrix (3, 3)."""
    roll = np.arctan2(turn[2, 1], turn[2, 2])
    pitch = np.arctan2(-turn[2, 0], np.hypot(turn[0, 0], turn[1, 0]))
    yaw = np.arctan2(turn[1, 0], turn[0, 0])
    pose = Xml.Element("pose")
    pose.text = text([*at, roll, pitch, yaw])
    return pose


def _turn(direction: Floats) -> Floats:
    """Return the matrix (3, 3) of the shortest rotation from the z axis to a unit direction (3,)."""
    quaternion = rotation_from_z(direction)
    return np.array([turned_back(quaternion, axis) for axis in np.eye(3)])
