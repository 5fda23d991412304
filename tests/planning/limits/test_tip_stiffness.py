"""Tip stiffness as a margin: against the eigenvalues of the compliance, and what it is for, a stiffer placement."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from domes import dome

from pentapod.kinematics import AsBuiltPentapod
from pentapod.machine import Machine, Stiffness
from pentapod.machine.dynamics.deflection import Yielding
from pentapod.planning import PlacedPath, Weights, plan
from pentapod.planning.limits.margins import Margins
from pentapod.planning.limits.tip_stiffness import STIFFNESS

SPRINGS = Stiffness(leg_stiffness=np.array([15e6, 20e6, 25e6, 30e6, 35e6]), joint_stiffness=60e6, leg_rigidity=9e6)
"""N/m, and newtons for each metre in a metre."""


def springy(name: str) -> Machine:
    return replace(Machine.load(name), stiffness=SPRINGS)


def poses(machine: Machine, count: int = 400) -> tuple[np.ndarray, np.ndarray]:
    """Return tips and axes (tip → spindle) around the work volume, in any direction of its half."""
    rng = np.random.default_rng(5)
    tips = machine.work.centre + rng.uniform(-0.1, 0.1, (count, 3))
    axes = rng.normal(size=(count, 3)) * [0.4, 0.4, 0.2] - [0.0, 0.0, 1.0]
    return tips, axes / np.linalg.norm(axes, axis=1, keepdims=True)


def softest(machine: Machine, tips: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Return how far 1 N moves each tip in the direction in which it yields most, by the leg forces, m/N."""
    return Yielding.of(machine, tips + machine.tool_length * axes, -axes).softest


def by_name(margins: Margins) -> int:
    return [limit.name for limit in margins.limits].index("tip stiffness")


@pytest.mark.parametrize("name", ["desk", "steep", "guide", "bench-general", "as built", "on rings"])
def test_it_is_the_stiffness_in_the_softest_direction_or_at_most_24_percent_less(name: str) -> None:
    calibrated = name in ("as built", "on rings")
    machine = springy("desk" if calibrated else name)
    if calibrated:
        robot = machine.robot
        rng = np.random.default_rng(3)
        errors = rng.uniform(-2e-3, 2e-3, (5, 3)), rng.uniform(-1e-3, 1e-3, 5)
        built = AsBuiltPentapod.of(
            robot,
            base_errors=errors[0],
            offset_errors=errors[1],
            radii=[0.0, 5e-4, 4e-3, 8e-3, 2e-2] if name == "on rings" else 0.0,
        )
        machine = replace(machine, robot=built)
    tips, axes = poses(machine)
    margins = Margins.of(machine, (1, 1), limits=[STIFFNESS])
    limit = margins.limits[by_name(margins)]
    found = margins.own(tips, axes)[:, by_name(margins)] * limit.comfort * softest(machine, tips, axes)
    assert (found <= 1.0 + 1e-9).all()
    assert (found >= 3.0**-0.25 - 1e-9).all()
    assert np.ptp(found) > 0.01, "the poses are too much alike to tell"
    middle = machine.work.centre[None], np.array([[0.0, 0.0, -1.0]])
    assert margins.own(*middle)[0, by_name(margins)] == pytest.approx(1.0)


def test_symbols_say_the_same() -> None:
    machine = springy("desk")
    tips, axes = poses(machine, 20)
    margins = Margins.of(machine, (1, 1), limits=[STIFFNESS])
    tip, axis = ca.SX.sym("tip", 3), ca.SX.sym("axis", 3)
    formula = ca.Function("margins", [tip, axis], [margins.symbolic(tip, axis)[by_name(margins)]])
    told = [float(formula(*pose)) for pose in zip(tips, axes, strict=True)]
    np.testing.assert_allclose(told, margins.own(tips, axes)[:, by_name(margins)], rtol=1e-9)


def test_a_machine_that_says_nothing_of_it_has_none() -> None:
    assert "tip stiffness" not in {
        limit.name for limit in Margins.of(Machine.load("desk"), (1, 1), limits=[STIFFNESS]).limits
    }


def test_the_planner_finds_a_stiffer_place() -> None:
    machine, path = springy("desk"), dome(0.06, 20.0, 40)
    plain = plan(path, machine)
    stiff = plan(path, machine, weights=Weights(stiffness=10.0), limits=[STIFFNESS])
    assert isinstance(plain, PlacedPath)
    assert isinstance(stiff, PlacedPath), str(stiff)
    worst = [softest(machine, found.tips, found.axes).max() for found in (plain, stiff)]
    assert worst[1] < 0.85 * worst[0]
    assert stiff.margins.min() > 0.1, "the other margins count, too"
