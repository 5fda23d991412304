"""LegModel: readings to commands and back, to a nanometre; turns of universal joints against rotation matrices."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pentapod.base.errors import MachineError
from pentapod.kinematics import AsBuiltPentapod, Component
from pentapod.machine import LegModel, Machine
from pentapod.machine.machine import read_machine
from pentapod.machine.reader import machine_bytes
from true_machine import MACHINE, TOOL, poses

BRANCH = Component(1, 1)
AXES = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
AT = np.linspace(0.4, 1.0, 13)
ERRORS = 20e-6 * np.sin(np.arange(65).reshape(5, 13))
EVERY = {
    "screws": {"lead": [5e-3, -5e-3, 10e-3, 5e-3, 0.0], "first_axes": AXES},
    "temperature": {"expansion": 11.5e-6, "temperature": [25.0, 31.0, 18.0, 20.0, 22.5]},
    "pitch": {"pitch_at": AT, "pitch_errors": ERRORS},
    "backlash": {"backlash": [8e-6, 0.0, 12e-6, 5e-6, 3e-6]},
}
EVERY["all"] = {key: value for part in list(EVERY.values()) for key, value in part.items()}


def with_model(robot=MACHINE.robot, **keys) -> Machine:
    return replace(MACHINE, robot=robot, leg_model=LegModel(**keys))


def there_and_back(n: int = 60) -> tuple[np.ndarray, np.ndarray]:
    """Tips and axes on a way that reverses, and rests where it does."""
    (a, b), (i, j) = (array[:2] for array in poses(2, 3))
    share = 0.5 - 0.5 * np.cos(np.linspace(0.0, 4.0 * np.pi, n))[:, None]
    share[20:24] = share[20]
    axes = i + share * (j - i)
    return a + share * (b - a), axes / np.linalg.norm(axes, axis=1)[:, None]


def legs_of(machine: Machine) -> np.ndarray:
    tips, axes = there_and_back()
    return machine.robot.leg_lengths(tips + TOOL * axes, -axes)


@pytest.mark.parametrize("name", EVERY)
def test_commands_are_undone_to_a_nanometre(name):
    machine = with_model(**EVERY[name])
    legs = legs_of(machine)
    told = machine.commands(legs, BRANCH)
    assert np.abs(told - legs).max() > 1e-6
    assert np.abs(machine.readings(told, BRANCH) - legs).max() < 1e-12


def test_commands_of_a_machine_as_built_are_undone():
    built = AsBuiltPentapod.of(MACHINE.robot, base_errors=2e-4, zeros=[0.5e-3, -1e-3, 0.0, 2e-3, 1e-3], radii=5e-3)
    machine = with_model(built, **EVERY["all"])
    legs = legs_of(machine)[:12]
    assert np.abs(machine.readings(machine.commands(legs, BRANCH), BRANCH) - legs).max() < 1e-12


def test_turns_are_those_of_rotation_matrices():
    model, (tips, axes) = LegModel(**EVERY["screws"]), poses(30, 4)
    p, i = tips + TOOL * axes, -axes
    found, vectors = model.turns(MACHINE.robot, (p, i)), MACHINE.robot.leg_vectors(p, i)
    for pose in range(30):
        for leg in range(5):
            e = vectors[pose, leg] / np.linalg.norm(vectors[pose, leg])
            frames = []
            for fixed in (AXES[leg], i[pose]):
                x = np.cross(fixed, e)
                x /= np.linalg.norm(x)
                frames.append(np.column_stack([x, np.cross(e, x), e]))
            turn = Rotation.from_matrix(frames[1] @ frames[0].T).as_rotvec() @ e
            assert np.exp(1j * found[pose, leg]) == pytest.approx(np.exp(1j * turn), abs=1e-9)


def test_a_turn_of_the_nut_adds_its_share_of_the_lead():
    keys, machine = EVERY["screws"], with_model(**EVERY["screws"])
    tips, axes = there_and_back()
    p, i = tips + TOOL * axes, -axes
    turns = np.unwrap(machine.leg_model.turns(machine.robot, (p, i)), axis=0)
    added = legs_of(machine) - machine.commands(legs_of(machine), BRANCH)
    expected = np.asarray(keys["lead"]) / (2.0 * np.pi) * (turns - turns[0])
    assert np.abs(added - added[0] - expected).max() < 1e-12
    assert np.abs(expected).max() > 50e-6


def test_warm_screws_pitch_and_backlash_by_hand():
    legs = np.array([[0.6] * 5, [0.7] * 5, [0.65] * 5, [0.65] * 5, [0.66] * 5])
    warm = with_model(expansion=1e-5, temperature=30.0).commands(legs, BRANCH)
    assert warm == pytest.approx(legs / 1.0001, abs=1e-15)
    table = {"pitch_at": [0.5, 0.8], "pitch_errors": [[0.0, 30e-6]] * 5}
    pitch = with_model(**table).commands(legs, BRANCH)
    assert pitch + 1e-4 * (pitch - 0.5) == pytest.approx(legs, abs=1e-15)
    play = with_model(backlash=10e-6).commands(legs, BRANCH)
    assert (play - legs)[:, 0] == pytest.approx([5e-6, 5e-6, -5e-6, -5e-6, 5e-6], abs=1e-15)


def test_machines_without_a_model_are_told_what_they_read():
    assert not MACHINE.leg_model.is_needed
    assert MACHINE.leg_model.digest == ""
    legs = legs_of(MACHINE)
    assert np.array_equal(MACHINE.commands(legs, BRANCH), legs)


def test_the_table_of_a_machine_file():
    text = machine_bytes("desk").decode()
    more = f"""
[leg_model]
screw_lead_mm = 5
first_axis = {AXES.tolist()}
expansion_per_k = 11.5e-6
temperature_c = [25, 31, 18, 20, 22.5]
pitch_at_mm = {(1e3 * AT).round(6).tolist()}
pitch_error_mm = {(1e3 * ERRORS).tolist()}
backlash_mm = 0.01
"""
    machine = read_machine(text + more, "own.toml")
    assert machine.leg_model.is_needed
    assert machine.leg_model.lead == pytest.approx(5e-3)
    assert machine.leg_model.pitch_errors == pytest.approx(ERRORS)
    assert machine.digest == MACHINE.digest, "programs do not depend on it"
    cases = {
        "needs the fixed axis": "[leg_model]\nscrew_lead_mm = 5\n",
        "another shape": "[leg_model]\npitch_at_mm = [500, 600]\npitch_error_mm = [[0, 0.1]]\n",
        "do not ascend": f"[leg_model]\npitch_at_mm = [600, 500]\npitch_error_mm = {[[0, 0]] * 5}\n",
        "too steep": f"[leg_model]\npitch_at_mm = [500, 510]\npitch_error_mm = {[[0, 1]] * 5}\n",
        "backlash_mm": "[leg_model]\nbacklash_mm = -1\n",
    }
    for message, table in cases.items():
        with pytest.raises(MachineError, match=message) as caught:
            read_machine(text + "\n" + table, "own.toml")
        assert "own.toml" in str(caught.value)
