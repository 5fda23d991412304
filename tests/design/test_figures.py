"""Figures of a design are those of the library, in the same poses."""

import numpy as np
import pytest

from designs import geometry_of
from pentapod.design.design_file import DesignFile
from pentapod.design.evaluation import evaluate, first_sample
from pentapod.design.figures import in_poses
from pentapod.design.geometry import rim
from pentapod.design.part_poses import PartPoses
from pentapod.design.quantities import QUANTITIES
from pentapod.geometry.directions import angle_between
from pentapod.kinematics import tip_force_amplification
from pentapod.kinematics.arithmetic import NUMPY
from pentapod.kinematics.forces import leg_force_map, tip_compliance
from pentapod.machine import Machine, clearances


@pytest.mark.parametrize("name", ["desk", "steep", "bench-general"])
def test_figures_in_poses(name):
    machine, design = Machine.load(name), geometry_of(name)
    tips, i = design.poses(rim(5, 2, 6))
    p, axes = tips - machine.tool_length * i, design.base_axes()
    vectors, gaps = machine.robot.leg_vectors(p, i), clearances(machine, p, i)
    length, platform = np.linalg.norm(vectors, axis=2), angle_between(vectors, i[:, None, :])
    force = leg_force_map(machine.robot, p, i, machine.tool_length)
    expected = {
        "shortest_leg": length.min(axis=1),
        "longest_leg": length.max(axis=1),
        "base_cone": angle_between(vectors, axes).max(axis=1),
        "platform_least": platform.min(axis=1),
        "platform_most": platform.max(axis=1),
        "leg_clearance": gaps[:, :10].min(axis=1),
        "shaft_clearance": gaps[:, 10:].min(axis=1),
        "amplification": tip_force_amplification(machine.robot, p, i, machine.tool_length),
        "sensitivity": np.linalg.norm(force, axis=2).max(axis=1),
    }
    if name != "bench-general":
        margins = machine.robot.singularity_margins(list(p.T), list(i.T), machine.robot.branches[0], NUMPY)
        expected["singular_distance"] = margins[1]
    found = in_poses(design, axes, tips, i)
    for key, value in expected.items():
        assert found[key] == pytest.approx(value, rel=1e-7, abs=1e-9), key


def test_stiffness_is_that_of_equal_legs(design_file):
    """The softest direction of the softest pose, from the library's compliance."""
    file, machine = DesignFile.load(design_file()), Machine.load("desk")
    sample = first_sample(file, PartPoses.of((), 4))
    values = evaluate(sample, file.unknowns.vector())
    design = file.unknowns.design(file.unknowns.vector())
    tips, i = design.poses(sample.unit)
    compliance = tip_compliance(machine.robot, tips - machine.tool_length * i, i, [50e6] * 5, machine.tool_length)
    softest = 1.0 / np.linalg.eigvalsh(compliance[:, :3, :3])[:, -1].max()
    assert values[list(QUANTITIES).index("stiffness")] == pytest.approx(softest, rel=1e-6)
