"""The search that found the shipped machines: its figures are those of the library, and its starts meet their needs."""

import runpy
from pathlib import Path

import numpy as np
import pytest

from pentapod.geometry.directions import angle_between
from pentapod.kinematics import tip_force_amplification
from pentapod.kinematics.arithmetic import NUMPY
from pentapod.machine import Machine, clearances

SEARCH = runpy.run_path(str(Path(__file__).parents[2] / "examples" / "01_design_a_machine.py"))


def design_of(machine: Machine, general: bool) -> np.ndarray:
    """The unknowns of a shipped machine."""
    base, offsets = machine.robot.base_joints[:, :2], machine.robot.offsets
    along = offsets if general else [np.ptp(offsets) / np.ptp(base[:, 0])]
    return np.concatenate([*base.T, along, [machine.tool_length - offsets.max()], machine.work.centre])


@pytest.mark.parametrize("name", ["desk", "steep", "bench-general"])
def test_figures_are_those_of_the_library(name: str) -> None:
    machine, search = Machine.load(name), SEARCH["MACHINES"][name]
    volume = SEARCH["Volume"](0.15, 0.06, np.radians(search.tilt), np.radians(search.dome_tilt))
    tips, axes = volume.poses(5, 2, 6)
    found = SEARCH["figures"](search, design_of(machine, name == "bench-general")[None], tips, axes)
    p = machine.work.centre + tips - machine.tool_length * axes
    vectors = machine.robot.leg_vectors(p, axes)
    length, gaps = np.linalg.norm(vectors, axis=2), clearances(machine, p, axes)
    branch = next(b for b in machine.robot.branches if tuple(b) == tuple(machine.robot.branch(p[0], axes[0])))
    singular = machine.robot.singularity_margins(list(p.T), list(axes.T), branch, NUMPY)[1]
    expected = {
        "shortest leg": length.min(),
        "longest leg": length.max(),
        "leg clearance": gaps[:, :10].min(),
        "shaft clearance": gaps[:, 10:].min(),
        "joint angle": angle_between(-vectors, -axes[:, None, :]).max(),
        "amplification": tip_force_amplification(machine.robot, p, axes, machine.tool_length).max(),
        "S": singular.min(),
        "base radius": np.linalg.norm(machine.robot.base_joints, axis=1).max(),
        "platform length": np.ptp(machine.robot.offsets),
    }
    for key, value in expected.items():
        assert found[key][0] == pytest.approx(value, rel=1e-6), key


@pytest.mark.parametrize("name", ["desk", "steep", "bench-general"])
def test_the_search_starts_where_all_needs_are_nearly_met(name: str) -> None:
    search = SEARCH["MACHINES"][name]
    volume = SEARCH["Volume"](0.15, 0.06, np.radians(search.tilt), np.radians(search.dome_tilt))
    values = SEARCH["figures"](search, search.start[None], *volume.poses(16, 3, 24))
    for key, (sense, need, _, scale) in search.wanted.items():
        assert sense * (values[key][0] - need) >= -0.3 * scale, key
