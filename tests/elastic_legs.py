"""The tip of a machine whose legs are springs, by MuJoCo: it knows nothing of our statics."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from pentapod.geometry import RigidTransform
from pentapod.kinematics.families.as_built import AsBuiltPentapod
from pentapod.kinematics.forces import leg_force_map
from pentapod.machine import Machine, Stiffness, mjcf
from pentapod.machine.dynamics.deflection import Yielding, leg_pushes
from pentapod.machine.rigid_bodies.mjcf import MujocoModelOptions
from pentapod.program import Program, Provenance
from pentapod.program.commands import commanded
from pentapod.program.program import ProcessForce

SPRING = 20e6
LIGHT = MujocoModelOptions(ring_mass=0.005)
NO_RINGS = (0.0,) * 5


def tip_at_rest(machine, p, i, force, longer=0.0, spring=SPRING):
    """The tip, metres, after two seconds with springs in the legs, under gravity and a force on the tip.

    longer: than the pose's lengths, that the drives are told.
    """
    import mujoco

    xml = mjcf(machine, AsBuiltPentapod.of(machine.robot), p, i, period=1e-3, model=LIGHT)
    xml = re.sub(r'kp="[^"]*" kv="[^"]*"', f'kp="{spring}" kv="{0.01 * spring}"', xml)
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    data.qpos[:] = model.qpos0
    data.ctrl[: machine.robot.n_legs] += longer
    mujoco.mj_forward(model, data)
    body, tip = model.body("platform").id, model.site("tip").id
    for _ in range(round(2.0 / model.opt.timestep)):
        data.xfrc_applied[body] = np.r_[force, np.cross(data.site_xpos[tip] - data.xipos[body], force)]
        mujoco.mj_step(model, data)
    mujoco.mj_kinematics(model, data)
    return data.site_xpos[tip].copy()


def deflections(seed: int, radii: Sequence[float] = NO_RINGS) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield how far the tip is moved in MuJoCo, and by our statics, (3,) metres: by weight, and by a force on it."""
    rng, machine = np.random.default_rng(seed), Machine.load("desk")
    robot = AsBuiltPentapod.of(machine.robot, radii=radii)
    machine = replace(machine, robot=robot, stiffness=Stiffness(leg_stiffness=np.full(5, SPRING)))
    lean = 0.25 * rng.uniform(-1.0, 1.0, 2)
    i = np.array([*lean, np.sqrt(1.0 - lean @ lean)])
    p = machine.work.centre + 0.02 * rng.uniform(-1.0, 1.0, 3) - machine.tool_length * i
    force = 100.0 * (way := rng.normal(size=3)) / np.linalg.norm(way)
    weightless = replace(machine, masses=replace(machine.masses, gravity=np.zeros(3)))
    free, still, one = tip_at_rest(weightless, p, i, np.zeros(3)), np.zeros((1, 5)), (p[None], i[None])
    weight = leg_pushes(machine, *one, still, still)
    # A force on the tip is held by legs that push against it.
    held = leg_force_map(machine.robot, *one, machine.tool_length) @ force
    for moved, push in (
        (tip_at_rest(machine, p, i, np.zeros(3)), weight),
        (tip_at_rest(weightless, p, i, force), held),
    ):
        yield moved - free, Yielding.of(machine, *one, push).shift[0]


def left(seed: int) -> Iterator[tuple[str, float, float, float]]:
    """Yield what loads the tip, by which share legs are softer than told, the sag, and what commands leave of it, m."""
    rng, machine = np.random.default_rng(seed), Machine.load("desk")
    masses = replace(machine.masses, platform=8.0, gravity=np.array([*rng.uniform(-2.0, 2.0, 2), 9.5]))
    machine = replace(machine, stiffness=Stiffness(leg_stiffness=np.full(5, SPRING)), masses=masses)
    lean = 0.25 * rng.uniform(-1.0, 1.0, 2)
    i = np.array([*lean, np.sqrt(1.0 - lean @ lean)])
    way = 1e-3 * rng.normal(size=3)
    p = machine.work.centre + 0.02 * rng.uniform(-1.0, 1.0, 3) - machine.tool_length * i
    moving = p + np.arange(-150, 151)[:, None] * 1e-3 * 25.0 * way  # a straight cut, in whose middle is p
    legs = machine.robot.leg_lengths(moving, np.tile(i, (len(moving), 1)))
    source = Provenance(machine.name, machine.digest, "", "1", compensation="gravity")
    program = Program(1e-3, legs, "linear", machine.robot.branch(p, i), RigidTransform.identity(), source)
    pushed, none = -50.0 * way / np.linalg.norm(way), np.zeros(3)
    weightless = replace(machine, masses=replace(masses, gravity=np.zeros(3)))
    free = tip_at_rest(weightless, p, i, none)
    for name, force, softer in (("weight", none, 0.0), ("weight and force", pushed, 0.0), ("weight", none, 0.2)):
        process = ProcessForce(50.0, ((0, len(legs) - 1),)) if force is pushed else None
        told, spring = commanded(replace(program, process_force=process), machine).legs[150], (1.0 - softer) * SPRING
        sag = tip_at_rest(machine, p, i, force, spring=spring) - free
        rest = tip_at_rest(machine, p, i, force, told - legs[150], spring) - free
        yield name, softer, float(np.linalg.norm(sag)), float(np.linalg.norm(rest))
