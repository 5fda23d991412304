"""Load: the forces with which drives have to push legs, spindle and tool along a program, beside their own inertia.

By virtual work: each body is three masses on its axis, placed so that mass, centre and inertia across the axis are
those of the capsule that MuJoCo has. A mass that is to follow the program needs the force m (ẍ − g), and what each
drive has to give for it is that force along the way that the mass goes per metre of the leg.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.kinematics.jacobian import pose_jacobian
from pentapod.numerics.blocks import blocks
from pentapod.simulate.bodies import Capsule, leg_cylinder, leg_rod, spindle
from pentapod.simulate.reference import Reference

_BLOCK = 1 << 13  # rows


def leg_loads(reference: Reference) -> Floats:
    """Return the forces (N, n_legs) at the rows, newtons, positive where a drive has to push its leg longer.

    Accelerations are second differences of the rows, from rest and to rest.
    """
    rows = reference.program.legs
    loads = np.empty(rows.shape)
    for part in blocks(len(rows), _BLOCK):
        # One row more on each side, where there is one: at the ends the machine stands.
        own = np.clip(np.arange(part.start - 1, part.stop + 1), 0, len(rows) - 1)
        loads[part] = _loads(reference, own)
    return loads


def _loads(reference: Reference, rows: Ints) -> Floats:
    """Return the loads (n, n_legs) at all these rows (n + 2,) but the first and the last."""
    machine, period = reference.machine, reference.program.period
    gravity = machine.masses.gravity
    direction = reference.directions[::2][rows]
    position = reference.tips[::2][rows] - machine.tool_length * direction

    def needed(mass: float, places: Floats) -> Floats:
        """Return m (ẍ − g) for places (n + 2, ..., 3) at the rows."""
        return mass * (np.diff(places, n=2, axis=0) / period**2 - gravity)

    robot = machine.robot
    vectors = robot.leg_vectors(position, direction)
    lengths = np.linalg.norm(vectors, axis=2, keepdims=True)
    along = vectors / lengths
    base = robot.base_joints
    middle = slice(1, -1)
    loads = np.zeros((len(rows) - 2, robot.n_legs))
    # On the line: at offsets z that go with the platform. On the legs: across, as a share of the joint's way.
    at_p, at_i = np.zeros((2, len(loads), 3))
    for mass, z in _masses(spindle(machine, float(robot.offsets.min()))):
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
                at_p, at_i = at_p + across, at_i + robot.offsets[leg] * across
    ways = pose_jacobian(robot, position[middle], direction[middle])
    return loads + np.einsum("ni,nil->nl", at_p, ways[:, :3]) + np.einsum("ni,nil->nl", at_i, ways[:, 3:])


def _masses(capsule: Capsule) -> tuple[tuple[float, float], ...]:
    """Return three masses and their places on the axis that are as heavy and as hard to turn as a capsule."""
    third, middle = capsule.mass / 3.0, 0.5 * (capsule.low + capsule.high)
    apart = float(np.sqrt(1.5 * capsule.inertia / capsule.mass))
    return ((third, middle - apart), (third, middle), (third, middle + apart))
