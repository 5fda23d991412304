"""Where the machine stands at a time, and the bodies that are drawn."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from pentapod.cutters.ball import BallCutter
from pentapod.cutters.bull_nose import BullNose
from pentapod.geometry import RigidTransform
from pentapod.geometry.solids import Solid
from pentapod.kinematics import RingedPentapod
from pentapod.machine import Machine
from pentapod.machine.leg_ends import arms_beside, base_rim, leg_ends
from pentapod.view import ToolMotion
from pentapod.view.shapes import along, quaternion, revolved, rotation_of, solid_profile, tool_mesh

UNITS = st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1)


def test_motion_at_the_time_of_a_row_has_its_legs(opened):
    motion, program = ToolMotion.of(opened), opened.program
    assert motion.duration == pytest.approx(program.duration)
    for row in (0, 1, len(program.legs) // 3, len(program.legs) - 1):
        machine_pose = motion.machine_pose(program.times[row], opened.machine, program.placement)
        assert machine_pose.legs == pytest.approx(program.legs[row], abs=1e-9)
        assert all(machine_pose.within)
        assert np.linalg.norm(machine_pose.joints - machine_pose.bases, axis=1) == pytest.approx(machine_pose.legs)
        # The joints lie on the tool's axis.
        assert np.linalg.norm(np.cross(machine_pose.joints - machine_pose.tip, machine_pose.axis), axis=1).max() < 1e-12
    between = motion.machine_pose(0.5 * (program.times[40] + program.times[41]), opened.machine, program.placement)
    assert between.legs == pytest.approx(program.legs[40:42].mean(axis=0), abs=1e-6)
    assert motion.pose(1e9)[0] == pytest.approx(motion.tips[-1]), "after the end it stands"


@pytest.mark.parametrize("name", ["desk", "hexa", "spr", "prpu"])
def test_arms_lead_from_the_axis_to_the_joints_beside_it(name):
    machine = Machine.load(name)
    tip, axis = machine.work.centre, np.array([0.0, 0.6, -0.8])
    _, joints = leg_ends(machine, tip, axis)
    beside, heights = arms_beside(machine)
    arms = joints[beside] - tip - heights[:, None] * axis
    assert beside.tolist() == {"desk": [], "hexa": [5], "spr": [0, 1, 2, 3], "prpu": [0, 1, 2, 3, 4]}[name]
    np.testing.assert_allclose(arms @ axis, 0.0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(arms, axis=1), machine.robot.arms[beside])


def test_base_is_drawn_in_the_plane_of_its_joints():
    desk = Machine.load("desk")
    wall = [[-418, -500, 226], [418, -500, 226], [0, -500, 396], [418, -500, -424], [-418, -500, -424]]  # LinuxCNC's
    offsets = 1e-3 * np.array([111, 83.5, 57.5, -34.5, -60.5])
    robot = RingedPentapod(1e-3 * np.array(wall), offsets, np.full(5, 0.0803), [0.0, 0.0, -0.112])
    for machine, normal in ((desk, [0.0, 0.0, 1.0]), (dataclasses.replace(desk, robot=robot), [0.0, 1.0, 0.0])):
        rim = base_rim(machine, 33)
        np.testing.assert_allclose((rim - machine.robot.base_joints.mean(axis=0)) @ normal, 0.0, atol=1e-12)
        assert np.linalg.norm(rim - rim.mean(axis=0), axis=1).min() > 0.5


def test_motion_moves_with_the_part(opened):
    motion, seconds = ToolMotion.of(opened), 0.4 * opened.program.duration
    before = motion.machine_pose(seconds, opened.machine, opened.placement)
    shift = np.array([0.3, 0.0, 0.2])
    after = motion.machine_pose(
        seconds, opened.machine, RigidTransform(opened.placement.rotation, opened.placement.translation + shift)
    )
    assert after.tip - before.tip == pytest.approx(shift)
    assert after.axis == pytest.approx(before.axis)
    limits = opened.machine.legs
    fits = (after.legs >= limits.min_length) & (after.legs <= limits.max_length)
    assert list(after.within) == fits.tolist()
    assert not all(after.within), "so far out no leg reaches"


def test_motion_without_a_program_follows_the_feeds(opened):
    motion, toolpath = ToolMotion.of_toolpath(opened.toolpath, opened.machine), opened.toolpath
    seconds = 0.0
    for segment in toolpath.segments:
        way = sum(float(np.linalg.norm(b - a)) for a, b in zip(segment.tips, segment.tips[1:], strict=False))
        seconds += way / min(segment.feed, opened.machine.rapid_velocity)
    assert motion.duration == pytest.approx(seconds, rel=1e-3)
    assert (np.diff(motion.times) > 0.0).all()


@given(UNITS)
def test_quaternions_are_rotations(q):
    given_ = Rotation.from_quat(q, scalar_first=True)
    assert rotation_of(np.array(q)) == pytest.approx(given_.as_matrix(), abs=1e-12)
    again = quaternion(given_.as_matrix())
    assert again[0] >= 0.0
    assert Rotation.from_quat(again, scalar_first=True).as_matrix() == pytest.approx(given_.as_matrix(), abs=1e-12)
    direction = given_.as_matrix()[:, 2]
    frame = along(direction)
    assert frame @ [0.0, 0.0, 1.0] == pytest.approx(direction)
    assert np.linalg.det(frame) == pytest.approx(1.0)


def volume(vertices, faces):
    """Of a closed mesh; positive where its facets face outwards."""
    a, b, c = vertices[faces[:, 0]], vertices[faces[:, 1]], vertices[faces[:, 2]]
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


@pytest.mark.parametrize(
    ("solid", "expected"),
    [
        (Solid("cutter", 2.0, 2.0, 0.0, 0.0, 2.0), 4.0 / 3.0 * np.pi * 8.0),  # a ball
        (Solid("shank", 1.0, 4.0, 2.0, 2.0), np.pi * 4.0 * 3.0),  # a cylinder
        (Solid("holder", 0.0, 3.0, 1.0, 2.0), np.pi * 3.0 * (1.0 + 2.0 + 4.0) / 3.0),  # a frustum
        (Solid("cutter", 0.0, 3.0, 0.0, 0.0, 1.0), np.pi * 3.0 + 4.0 / 3.0 * np.pi),  # a capsule
    ],
)  # fmt: skip
def test_solids_of_revolution_have_their_volume(solid, expected):
    # A polygon of 32 corners and arcs of 7 points are a little less than the round.
    assert volume(*revolved(solid_profile(solid))) == pytest.approx(expected, rel=0.03)


def test_solid_profiles_have_the_rounding_of_the_frustum():
    solid = Solid("cutter", 1.0, 3.0, 2.0, 0.5, 0.4)
    corners = np.array([[2.0, 1.0], [0.5, 3.0]])
    profile = solid_profile(solid)[1:-1]
    distance = np.linalg.norm(profile[:, None] - corners, axis=2).min(axis=1)
    assert distance == pytest.approx(np.full(len(profile), 0.4))


def test_tool_meshes_begin_at_the_tip():
    for tool in (BallCutter(3e-3, 8e-3), BullNose(4e-3, 1e-3)):
        vertices, faces = tool_mesh(tool.solids)
        assert vertices[:, 2].min() == pytest.approx(0.0, abs=1e-12)
        assert faces.max() == len(vertices) - 1
        assert volume(vertices, faces) > 0.0
