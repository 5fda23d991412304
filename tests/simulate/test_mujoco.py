"""MuJoCo plays programs on a model that knows nothing of our kinematics: it judges them, and us."""

import sys
from dataclasses import replace

import numpy as np
import pytest

from pentapod.base.errors import ArrayError, InputError, MachineError
from pentapod.base.refusal import Refusal
from pentapod.geometry.directions import angle_between
from pentapod.kinematics.component import COMPONENTS
from pentapod.kinematics.families.as_built import AsBuiltPentapod
from pentapod.kinematics.families.as_built_forward import as_built_pose
from pentapod.kinematics.forces import leg_force_map
from pentapod.program import Program
from pentapod.simulate import Reference, cutting_forces, load_mujoco, plant, simulate_mujoco
from pentapod.simulate.forces import leg_loads
from short_motion import motion

mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed")


def reference_of(duration=1.2, interpolation="cubic", **masses):
    program, machine = motion(duration, interpolation)
    return Reference(program, replace(machine, masses=replace(machine.masses, **masses)))


def play(reference, tip_forces=0.0, **errors):
    return simulate_mujoco(reference, plant(reference, **errors), tip_forces=tip_forces)


def off(physics, reference):
    """Tip error, metres, and axis error, radians, at each row."""
    return (
        np.linalg.norm(physics.played.tips - reference.tips[::2], axis=1),
        angle_between(physics.played.directions, reference.directions[::2]),
    )


@pytest.mark.parametrize(("duration", "interpolation"), [(1.2, "cubic"), (1.2, "linear"), (3.0, "cubic")])
def test_mujoco_tracks_nominal_programs(duration, interpolation):
    """Loops closed by constraints, driven by forces, under gravity: 20 µm and 0.1 mrad are asked."""
    reference = reference_of(duration, interpolation)
    physics = play(reference)
    tip, axis = off(physics, reference)
    assert tip.max() <= 20e-6
    assert axis.max() <= 1e-4
    assert physics.closure.max() <= 20e-6
    assert np.ptp(reference.tips, axis=0).max() > 0.05


@pytest.mark.parametrize("leg", range(5))
def test_mujoco_shows_a_base_joint_off_by_a_millimetre(leg):
    """Along its leg, where it counts in full; and our own forward kinematics as built says what MuJoCo finds."""
    reference = reference_of(0.8)
    machine, program = reference.machine, reference.program
    position, direction = machine.robot.pose(program.legs[400], program.component)
    along = machine.robot.leg_vectors(position, direction)[leg]
    errors = np.zeros((5, 3))
    errors[leg] = 1e-3 * along / np.linalg.norm(along)
    physics = play(reference, base_errors=errors)
    tip, _ = off(physics, reference)
    assert tip.max() >= 0.5e-3
    real = AsBuiltPentapod.of(machine.robot, base_errors=errors)
    foretold = as_built_pose(real, machine.robot, program.legs[::50], program.component)
    tips = foretold.position + machine.tool_length * foretold.direction
    assert foretold.proven.all()
    assert np.linalg.norm(physics.played.tips[::50] - tips, axis=1).max() <= 20e-6


def test_mujoco_shows_a_platform_joint_off_by_a_millimetre():
    reference = reference_of(0.8)
    tip, _ = off(play(reference, offset_errors=[0.0, 1e-3, 0.0, 0.0, 0.0]), reference)
    assert tip.max() >= 0.5e-3


def test_leg_loads_equal_the_power_of_the_bodies():
    """What the drives give beside their own inertia is what MuJoCo's bodies gain on the way, at all times.

    Energies of rigid bodies, their masses and inertias taken from the compiled model; virtual work knows none of them.
    """
    reference = reference_of(1.2)
    machine, program = reference.machine, reference.program
    model, h = mujoco.MjModel.from_xml_string(plant(reference).xml), program.period
    gravity = machine.masses.gravity
    direction = reference.directions[::2]
    position = reference.tips[::2] - machine.tool_length * direction
    vectors = machine.robot.leg_vectors(position, direction)
    lengths = np.linalg.norm(vectors, axis=2)

    def energy(name, points, axes):
        """Of a body whose origin is at points (N, 3), its z axis along axes (N, 3)."""
        body = model.body(name)
        centre = points + body.ipos[2] * axes
        v, w = (np.diff(x, axis=0) / h for x in (centre, axes))
        moving = 0.5 * body.mass * (v * v).sum(axis=1) + 0.5 * body.inertia[0] * (w * w).sum(axis=1)
        return moving - body.mass * (0.5 * (centre[1:] + centre[:-1]) @ gravity)

    total = energy("platform", position, direction)
    for leg in range(5):
        along, base = vectors[:, leg] / lengths[:, leg, None], np.append(machine.robot.base[leg], 0.0)
        total = total + energy(f"leg{leg + 1}", np.tile(base, (len(along), 1)), along)
        total = total + energy(f"rod{leg + 1}", base + vectors[:, leg], along)
    power = np.diff(total) / h
    rates = (program.legs[2:] - program.legs[:-2]) / (2.0 * h)
    given = (leg_loads(reference)[1:-1] * rates).sum(axis=1)
    assert np.abs(given).max() > 1.0
    np.testing.assert_allclose(given, power, atol=2e-3 * np.abs(given).max())


def test_load_feedforward_lowers_the_error():
    errors = []
    for share in (0.0, 1.0):
        reference = reference_of(1.2)
        drives = replace(reference.machine.drives, load_feedforward=share)
        errors.append(off(play(Reference(reference.program, replace(reference.machine, drives=drives))), reference))
    (without, turned), (with_it, turned_less) = errors
    assert with_it.max() < 0.7 * without.max()
    assert turned_less.max() < 0.7 * turned.max()


def still(rows=300, **masses):
    reference = reference_of(0.8, **masses)
    program = reference.program
    legs = np.tile(program.legs[400], (rows, 1))
    held = Program(program.period, legs, "cubic", COMPONENTS[0], program.placement, program.provenance)
    return Reference(held, reference.machine)


def test_leg_forces_are_those_of_statics():
    reference = still(gravity=np.zeros(3))
    push = np.array([30.0, -20.0, 50.0])
    physics = play(reference, tip_forces=push)
    position, direction = reference.machine.robot.pose(reference.program.legs[0], COMPONENTS[0])
    foretold = leg_force_map(reference.machine.robot, position, direction, reference.machine.tool_length) @ push
    np.testing.assert_allclose(physics.leg_forces[-1], foretold, rtol=1e-3, atol=0.05)
    assert np.abs(foretold).max() > 50.0
    # At rest the drives push as the legs do.
    np.testing.assert_allclose(physics.played.forces[-1], physics.leg_forces[-1], rtol=1e-3, atol=0.05)


def test_leg_forces_at_rest_carry_the_weight_alone():
    weightless, heavy = (play(still(**m)) for m in ({"gravity": np.zeros(3)}, {}))
    assert np.abs(weightless.leg_forces[-1]).max() < 1e-3
    # The base is above, +z down: the five legs' pull along z is the weight of the platform and part of the legs'.
    reference = still()
    position, direction = reference.machine.robot.pose(reference.program.legs[0], COMPONENTS[0])
    vectors = reference.machine.robot.leg_vectors(position, direction)
    unit = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    pull = -float(unit[:, 2] @ heavy.leg_forces[-1])
    assert 3.0 * 9.81 < pull < (3.0 + 5 * 2.2) * 9.81


def test_cutting_force_displaces_the_tip():
    reference = reference_of(1.2)
    forces = cutting_forces(reference, np.ones(len(reference.program.legs), dtype=bool), 60.0)
    speed = np.linalg.norm(np.gradient(reference.tips[::2], 1e-3, axis=0), axis=1)
    assert np.linalg.norm(forces, axis=1)[speed > 0.01] == pytest.approx(60.0, rel=0.01)
    free, loaded = play(reference), play(reference, tip_forces=forces)
    assert np.linalg.norm(loaded.played.tips - free.played.tips, axis=1).max() > 10e-6
    assert np.abs(loaded.leg_forces).max() > np.abs(free.leg_forces).max()
    assert not cutting_forces(reference, np.zeros(len(forces), dtype=bool), 60.0).any()
    with pytest.raises(InputError, match="cutting force"):
        cutting_forces(reference, np.ones(len(forces), dtype=bool), -1.0)


def test_mjcf_model_has_the_geometry_of_the_machine():
    reference = reference_of(0.3)
    stands = plant(reference)
    model = mujoco.MjModel.from_xml_string(stands.xml)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    machine, program = reference.machine, reference.program
    np.testing.assert_allclose(data.ctrl[:5], program.legs[0], atol=1e-12)
    np.testing.assert_allclose(data.site("tip").xpos, reference.tips[0], atol=1e-12)
    for leg in range(5):
        base = np.append(machine.robot.base[leg], 0.0)
        np.testing.assert_allclose(data.body(f"leg{leg + 1}").xpos, base, atol=1e-15)
        ends = [data.site(f"{kind}{leg + 1}").xpos for kind in ("rod", "platform")]
        np.testing.assert_allclose(ends[0], ends[1], atol=1e-12)
        assert np.linalg.norm(ends[0] - base) == pytest.approx(program.legs[0, leg], abs=1e-12)
        np.testing.assert_allclose(model.jnt_range[model.joint(f"leg{leg + 1}").id], [0.489, 0.929])
    # Five legs hold five of the platform's six freedoms: 15 + 6 joints' freedoms less 15 by the loops, and the spin.
    assert (model.nv, model.neq) == (21, 5)


def test_mjcf_model_of_a_flipped_tool_tracks():
    """A machine whose tool points towards its own base plane's other side: the turn from z is half a turn."""
    reference = reference_of(0.3)
    program, machine = reference.program, reference.machine
    _, direction = machine.robot.pose(program.legs[0], (-1, 1))
    assert direction[2] < -0.9
    flipped = Program(
        program.period, np.tile(program.legs[0], (50, 1)), "cubic", COMPONENTS[2], program.placement, program.provenance
    )
    other = Reference(flipped, machine)
    physics = play(other)
    tip, axis = off(physics, other)
    assert tip.max() < 20e-6
    assert axis.max() < 1e-4


def test_mjcf_slides_end_at_stops():
    """A program beyond the longest leg runs against the stop, and does not get there."""
    reference = reference_of(0.4)
    limits = replace(reference.machine.legs, max_length=float(reference.program.legs.max()) - 2e-3)
    short = Reference(reference.program, replace(reference.machine, legs=limits))
    physics = play(short)
    assert physics.played.legs.max() < limits.max_length[0] + 2e-4
    assert off(physics, short)[0].max() > 1e-3


def test_plant_with_errors_too_large_is_refused():
    reference = reference_of(0.3)
    found = plant(reference, base_errors=np.array([[0.9, 0, 0], [-0.9, 0, 0], [0, 0.9, 0], [0, 0, 0], [0, 0, 0]]))
    assert isinstance(found, Refusal)
    assert "no proven pose" in str(found)


def test_mujoco_divergence_is_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    reference = reference_of(0.3)
    wild = replace(reference.machine, drives=replace(reference.machine.drives, position_gain=1e5))
    found = play(Reference(reference.program, wild))
    assert isinstance(found, Refusal)
    assert "fly apart" in str(found)
    assert not list(tmp_path.iterdir())


def test_mujoco_bad_input_is_named():
    reference = reference_of(0.3)
    with pytest.raises(ArrayError, match="tip_forces"):
        play(reference, tip_forces=np.zeros((7, 3)))
    with pytest.raises(MachineError, match="base_errors"):
        plant(reference, base_errors=np.zeros((4, 3)))


def test_missing_mujoco_is_an_error_with_the_remedy(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(InputError, match=r'pip install "pentapod\[sim\]"'):
        load_mujoco()
