"""Forces of the drives by MuJoCo's inverse dynamics, and random states of machines whose masses are all felt."""

from dataclasses import replace

import numpy as np

from pentapod.kinematics import AsBuiltPentapod
from pentapod.kinematics.jacobian import pose_jacobian
from pentapod.machine import Machine
from pentapod.machine.rigid_bodies.mjcf import MujocoModelOptions, mjcf

MASSLESS = MujocoModelOptions(ring_mass=1e-10)
"""Rings have no mass, as in our terms."""

MACHINES = ("desk", "bench-general", "steep", "desk on rings")
STEPS = np.array([-3.0, -2.0, -1.0, 1.0, 2.0, 3.0])
ONCE, TWICE = (
    np.array([-1.0, 9.0, -45.0, 45.0, -9.0, 1.0]) / 60.0,
    np.array([2.0, -27.0, 270.0, 270.0, -27.0, 2.0]) / 180.0,
)


def loaded(name: str) -> Machine:
    """A machine with masses that are all felt, gravity along no axis."""
    machine = Machine.load(name.removesuffix(" on rings"))
    if name.endswith(" on rings"):
        errors = np.random.default_rng(1).uniform(-2e-4, 2e-4, (5, 3))
        rings = AsBuiltPentapod.of(machine.robot, base_errors=errors, radii=[0.0, 1e-4, 5e-4, 4e-3, 12e-3])
        machine = replace(machine, robot=rings)
    masses = replace(machine.masses, cylinder=4.0, rod=2.0, platform=12.0, gravity=np.array([2.0, -3.0, 9.0]))
    drives = replace(machine.drives, moving_mass=[5.0, 20.0, 40.0, 80.0, 100.0])
    return replace(machine, masses=masses, drives=drives)


def curves(machine: Machine, count: int, seed: int):
    """Tips and axes in the work volume and two derivatives, of unit tip speed about; random x and u."""
    rng, work = np.random.default_rng(seed), machine.work
    tips = work.centre + (rng.random((count, 3)) - 0.5) * [0.7 * work.diameter, 0.7 * work.diameter, work.height]
    axes = np.array([0.0, 0.0, -1.0]) + 0.6 * np.tan(work.tilt) * (rng.random((count, 3)) - 0.5)
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    one = np.cross(axes, rng.normal(size=(count, 3))) * 4.0
    two = np.cross(axes, rng.normal(size=(count, 3))) * 20.0 - np.sum(one * one, axis=1, keepdims=True) * axes
    curve = [(tips, axes), (rng.normal(size=(count, 3)), one), (10.0 * rng.normal(size=(count, 3)), two)]
    return curve, rng.uniform(0.0, 0.3, count) ** 2, rng.uniform(-5.0, 5.0, count)


def moved_ends(robot, p, i, dp, di, ddp, ddi) -> tuple[np.ndarray, np.ndarray]:
    """First and second derivatives (5, 3) of where the legs end, by differences: rings turn as the base joints ask."""
    h = 1e-3
    way = h * STEPS[:, None]
    axes = i + way * di + 0.5 * way**2 * ddi
    ends = robot.platform_joints(p + way * dp + 0.5 * way**2 * ddp, axes / np.linalg.norm(axes, axis=1, keepdims=True))
    middle = robot.platform_joints(p, i) * TWICE.sum()
    return np.tensordot(ONCE, ends, 1) / h, (np.tensordot(TWICE, ends, 1) - middle) / h**2


def by_mujoco(mujoco, machine: Machine, curve, x: float, u: float) -> np.ndarray:
    """Forces (5,) of the drives at one state: inverse dynamics of the open tree, projected on the legs.

    The model stands at the pose, hinges at 0, so that velocities of the joints are plain.
    """
    robot, length = machine.robot, machine.tool_length
    (p, i), (p1, i1), (p2, i2) = ((tip + length * axis, -axis) for tip, axis in curve)
    model = mujoco.MjModel.from_xml_string(mjcf(machine, robot, p, i, period=1e-3, model=MASSLESS))
    data = mujoco.MjData(model)
    turn = np.empty(9)

    def frame(name: str) -> np.ndarray:
        mujoco.mju_quat2Mat(turn, model.body(name).quat)
        return turn.reshape(3, 3).copy()

    def coordinates(dp, di, ddp, ddi):
        """Velocities and accelerations (nv,) of the joints."""
        rate, second = np.zeros((2, model.nv))
        ends = moved_ends(robot, p, i, dp, di, ddp, ddi)
        for leg in range(5):
            z, d = robot.offsets[leg], robot.leg_vectors(p, i)[leg]
            on_ring = isinstance(robot, AsBuiltPentapod) and robot.radii[leg] > 0.0
            d1, d2 = (one[leg] for one in ends) if on_ring else (dp + z * di, ddp + z * ddi)
            n = np.linalg.norm(d)
            e = d / n
            n1 = e @ d1
            e1 = (d1 - n1 * e) / n
            n2 = e1 @ d1 + e @ d2
            e2 = (d2 - n2 * e - 2.0 * n1 * e1) / n
            w1, w2 = frame(f"leg{leg + 1}").T @ e1, frame(f"leg{leg + 1}").T @ e2
            ways = {"base%du": (-w1[1], -w2[1]), "base%dv": (w1[0], w2[0]), "leg%d": (n1, n2)}
            for name, (first, then) in ways.items():
                at = model.joint(name % (leg + 1)).dofadr[0]
                rate[at], second[at] = first, then
        at = model.joint("platform").dofadr[0]
        rate[at : at + 3], second[at : at + 3] = dp, ddp
        for values, turning in ((rate, np.cross(i, di)), (second, np.cross(i, ddi))):
            values[at + 3 : at + 6] = frame("platform").T @ turning
        return rate, second

    v, none = np.sqrt(x), np.zeros(3)
    rate, second = coordinates(p1 * v, i1 * v, p1 * u + p2 * x, i1 * u + i2 * x)
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT  # the tree without its closed loops
    data.qpos[:], data.qvel[:], data.qacc[:] = model.qpos0, rate, second
    mujoco.mj_inverse(model, data)
    wanted = data.qfrc_inverse
    ways = pose_jacobian(robot, p, i)
    return np.array([coordinates(ways[:3, leg], ways[3:, leg], none, none)[0] @ wanted for leg in range(5)])
