"""Forces along a program: what legs, spindle and tool demand of the drives (inverse dynamics), and the cutting force.

By virtual work: each body is replaced by three masses on its axis with the mass, centre and transverse inertia of its
capsule in MuJoCo. A mass that follows the program needs the force m (ẍ − g); each drive contributes that force times
the displacement of the mass for each metre of the leg.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.base.errors import InputError
from pentapod.kinematics.forces import FREEDOMS, held_wrenches
from pentapod.kinematics.jacobian import pose_jacobian
from pentapod.kinematics.legs_on_rings import LegsOnRings
from pentapod.machine.bars import PassiveLimb
from pentapod.machine.machine import Machine
from pentapod.machine.rigid_bodies.capsules import Capsule, leg_cylinder, leg_rod, limb_strut, spindle
from pentapod.numerics.blocks import blocks
from pentapod.simulate.reference import Reference


def leg_loads(reference: Reference, block: int = 1 << 13) -> Floats:
    """Return the drives' forces (N, n_legs) at the rows without their own inertia, newtons; a push is positive.

    Accelerations are second differences of the rows, from rest and to rest. block: rows at once, which bounds memory.
    """
    rows = reference.program.legs
    loads = np.empty(rows.shape)
    for part in blocks(len(rows), block):
        # One row more on each side; at the ends the machine stands.
        own = np.clip(np.arange(part.start - 1, part.stop + 1), 0, len(rows) - 1)
        loads[part] = _loads(reference, own)
    return loads


def _loads(reference: Reference, rows: Ints) -> Floats:
    """Return the loads (n, n_legs) at rows (n + 2,) without the first and the last."""
    machine, period = reference.machine, reference.program.period
    gravity = machine.masses.gravity
    direction = reference.directions[::2][rows]
    position = reference.tips[::2][rows] - machine.tool_length * direction

    def needed(mass: float, places: Floats) -> Floats:
        """Return m (ẍ − g) for places (n + 2, ..., 3) at the rows."""
        return mass * (np.diff(places, n=2, axis=0) / period**2 - gravity)

    robot = machine.robot
    vectors, joints = robot.leg_vectors(position, direction), robot.platform_joints(position, direction)
    lengths = np.linalg.norm(vectors, axis=2, keepdims=True)
    along = vectors / lengths
    base = robot.base_joints
    middle = slice(1, -1)
    loads = np.zeros((len(rows) - 2, robot.n_legs))
    # Masses on the platform line at offsets z; masses of legs, across the leg, as a share of the joint's motion.
    at_p, at_i = np.zeros((2, len(loads), 3))
    held = robot.n_legs + robot.passive_wrenches(position[:1], direction[:1]).shape[-2] == FREEDOMS
    turning = np.zeros((len(loads), 3))  # moment about p of forces beside the line
    for mass, z in _masses(spindle(machine, machine.line_top)):
        force = needed(mass, position + z * direction)
        at_p, at_i = at_p + force, at_i + z * force
    for leg in range(robot.n_legs):
        u, length = along[:, leg], lengths[:, leg]
        for capsule, slides in ((leg_cylinder(machine, leg), False), (leg_rod(machine, leg), True)):
            for mass, s in _masses(capsule):
                out = s + length * float(slides)
                force = needed(mass, base[leg] + out * u)
                push = np.einsum("ni,ni->n", force, u[middle])
                loads[:, leg] += push * float(slides)
                across = (out / length)[middle] * (force - push[:, None] * u[middle])
                if held:
                    lever = joints[middle, leg] - position[middle]
                    at_p, turning = at_p + across, turning + np.cross(lever, across)
                    continue
                on_p, on_i = across, robot.offsets[leg] * across
                if isinstance(robot, LegsOnRings):
                    on_p, on_i = robot.pose_loads(position[middle], direction[middle], leg, across)
                at_p, at_i = at_p + on_p, at_i + on_i
    if machine.limb is not None:
        force = _limb_force(machine, machine.limb, position, direction, needed)
        at_p, at_i = at_p + force, at_i + machine.limb.joint * force
    if held:
        turning += np.cross(direction[middle], at_i)
        wrenches = held_wrenches(robot, position[middle], direction[middle])
        wrench = np.concatenate([at_p, turning], axis=1)[..., None]
        held_by = np.linalg.solve(np.swapaxes(wrenches, 1, 2), wrench)[:, : robot.n_legs, 0]
        return loads + np.asarray(held_by, dtype=np.float64)
    jacobian = pose_jacobian(robot, position[middle], direction[middle])
    return loads + np.einsum("ni,nil->nl", at_p, jacobian[:, :3]) + np.einsum("ni,nil->nl", at_i, jacobian[:, 3:])


def _limb_force(
    machine: Machine, limb: PassiveLimb, position: Floats, direction: Floats, needed: Callable[[float, Floats], Floats]
) -> Floats:
    """Return what the passive limb's masses need at its universal joint (n, 3), in poses (n + 2, 3).

    The joint carries the carriage along the rail, and across it turns the strut about its foot. So a mass at the share
    s of the strut takes up the joint's way along the rail, s of that across the strut, and all along it if it slides.
    """
    (foot, end), middle = limb.ends(position, direction), slice(1, -1)
    length = np.linalg.norm(end - foot, axis=1, keepdims=True)
    along, total = (end - foot) / length, np.zeros((len(position) - 2, 3))
    for capsule, slides in zip(limb_strut(machine, limb), (0.0, 1.0), strict=True):
        for mass, s in _masses(capsule):
            out = s + length * slides
            force, u = needed(mass, foot + out * along), along[middle]
            by_rail, by_strut = ((force * v).sum(axis=1, keepdims=True) * v for v in (limb.rail, u))
            across = force - by_rail - by_strut
            total += by_rail + slides * by_strut + (out / length)[middle] * across
    return total


def _masses(capsule: Capsule) -> tuple[tuple[float, float], ...]:
    """Return three masses and their positions on the axis with the mass and inertia of a capsule."""
    third, middle = capsule.mass / 3.0, 0.5 * (capsule.low + capsule.high)
    apart = float(np.sqrt(1.5 * capsule.inertia / capsule.mass))
    return ((third, middle - apart), (third, middle), (third, middle + apart))


def cutting_forces(reference: Reference, cutting: Bools, newtons: float, slow: float = 1e-3) -> Floats:
    """Return forces (N, 3) on the tip, machine frame, against its motion at the rows that cut, `cutting` (N,).

    slow: m/s, the speed below which the force fades, so that it reverses without a step. Raises InputError for a force
    that is negative or not finite.
    """
    if not (np.isfinite(newtons) and newtons >= 0.0):
        raise InputError("must not be negative", key="cutting force", value=newtons, expected="newtons")
    velocity = np.gradient(reference.tips[::2], reference.program.period, axis=0)
    speed = np.linalg.norm(velocity, axis=1, keepdims=True)
    return np.where(cutting[:, None], -newtons * velocity / np.hypot(speed, slow), 0.0)
