"""Probing: touches that can be made, and a program that LinuxCNC's interpreter takes; ways clear of the part."""

import re
import shutil
import subprocess

import numpy as np
import pytest
from forged_touches import sheet

from pentapod.base import Refusal
from pentapod.cutters import Lollipop
from pentapod.geometry import RigidTransform
from pentapod.kinematics import Component
from pentapod.machine import CollisionWorld, Machine
from pentapod.mesh.query.distance import MeshDistance
from pentapod.registration import CutSurface, Touches, plan_probing, read_touches, touches_text

RADIUS = 2e-3


def waves(x, y):
    return 3e-3 * np.sin(120.0 * x) * np.cos(90.0 * y) + 0.1 * x * y


@pytest.fixture(scope="module")
def planned():
    machine, mesh = Machine.load("desk"), sheet(waves, cells=24)
    placement = RigidTransform(np.diag([1.0, -1.0, -1.0]), machine.work.centre)
    world = CollisionWorld.of(machine, Lollipop(RADIUS, 0.5 * RADIUS, 0.04), mesh, allowance=0.0)
    head = Touches(np.zeros((0, 5)), machine.tool_length, RADIUS, (), Component(1, 1), machine.name)
    cut = CutSurface(mesh.vertices[mesh.faces].mean(axis=1), mesh.facet_normals)
    given = (machine, Component(1, 1), MeshDistance.of(mesh), placement, cut, world, head)
    return machine, mesh, placement, given, plan_probing(*given, 16)


def test_the_ball_touches_where_it_should(planned) -> None:
    machine, _, placement, _, found = planned
    robot = machine.robot
    p, i = robot.pose(found.legs, np.array([1, 1]))
    centres = p + (machine.tool_length - RADIUS) * i
    assert centres == pytest.approx(placement.apply(found.points + RADIUS * found.normals), abs=1e-9)
    assert len(np.unique(found.points.round(6), axis=0)) == 16
    ends = np.array([way[-1] for way in found.ways])
    p, i = robot.pose(ends, np.array([1, 1]))
    away = p + (machine.tool_length - RADIUS) * i - centres
    assert away == pytest.approx(5e-3 * placement.rotate(found.normals), abs=1e-8)


@pytest.mark.slow
def test_touches_stay_off_edges_by_as_much_as_the_part_may_be_misplaced(planned) -> None:
    given, found = planned[3], planned[4]
    assert np.abs(found.points[:, :2]).max() <= 0.03 - 2.5e-3  # 3 mm along the surface
    near = plan_probing(*given, 16, 0.1e-3)
    assert np.abs(near.points[:, :2]).max() > 0.03 - 1.5e-3


def test_the_ways_are_clear_of_the_part_and_within_the_strokes(planned) -> None:
    machine, mesh, placement, _, found = planned
    legs = np.concatenate(found.ways)
    assert (legs >= machine.legs.min_length).all()
    assert (legs <= machine.legs.max_length).all()
    p, i = machine.robot.pose(legs, np.array([1, 1]))
    centres = placement.inverse().apply(p + (machine.tool_length - RADIUS) * i)
    nearest = [np.linalg.norm(mesh.vertices - centre, axis=1).min() for centre in centres]
    assert min(nearest) > RADIUS + 0.5e-3
    for way in found.ways[1:]:
        assert np.abs(np.diff(way, axis=0)).max() < 3e-3


def test_chosen_touches_tell_more_than_random_ones(planned) -> None:
    _, mesh, _, _, found = planned
    rng, size = np.random.default_rng(0), 0.03

    def spread(points, normals):
        rows = np.hstack([normals, np.cross(points, normals) / size])
        cut = np.hstack(
            [mesh.facet_normals, np.cross(mesh.vertices[mesh.faces].mean(axis=1), mesh.facet_normals) / size]
        )
        return np.einsum("pi,ij,pj->p", cut, np.linalg.pinv(rows.T @ rows), cut).mean()

    facets = [rng.choice(len(mesh.faces), 16) for _ in range(20)]
    others = [spread(mesh.vertices[mesh.faces[f]].mean(axis=1), mesh.facet_normals[f]) for f in facets]
    assert spread(found.points, found.normals) < 0.7 * np.median(others)


def test_more_touches_than_can_be_made_are_refused(planned) -> None:
    _, _, placement, given, _ = planned
    far = RigidTransform(placement.rotation, placement.translation + np.array([0.5, 0.0, 0.0]))
    answer = plan_probing(*given[:3], far, *given[4:], 16)
    assert isinstance(answer, Refusal)
    assert "only 0 of the points tried" in str(answer)


def test_lists_are_read_back(planned, tmp_path) -> None:
    found = planned[-1]
    file = tmp_path / "expected.csv"
    file.write_text(touches_text(found.expected), encoding="utf-8")
    read = read_touches(file)
    assert read.legs == pytest.approx(found.legs, abs=1e-9)
    assert (read.component, read.machine, read.tip_radius) == (Component(1, 1), "desk", RADIUS)


def test_the_program_has_a_probing_move_for_each_touch(planned) -> None:
    found = planned[-1]
    moves = re.findall(r"G38\.2 X([\d.]+) Y([\d.]+) Z([\d.]+) U([\d.]+) V([\d.]+) F([\d.]+)\n\(LOG,(\S+)\)",
                       found.gcode("touches.csv"))  # fmt: skip
    assert np.array(moves)[:, :5].astype(float) == pytest.approx(1e3 * found.beyond, abs=1e-6)
    assert {log for *_, log in moves} == {"#5061,#5062,#5063,#5067,#5068"}


@pytest.mark.skipif(shutil.which("rs274") is None, reason="LinuxCNC is not installed")
def test_linuxcnc_takes_the_program(planned, tmp_path) -> None:
    """rs274 by itself has no U and V: A and B stand for them."""
    found, program = planned[-1], tmp_path / "probing.ngc"
    text = re.sub(r" U([\d.]+) V", r" A\1 B", found.gcode("touches.csv"))
    program.write_text(text, encoding="utf-8")
    command = ["rs274", "-g", str(program)]
    done = subprocess.run(
        command, capture_output=True, text=True, check=False, cwd=tmp_path, stdin=subprocess.DEVNULL, timeout=60
    )
    assert done.returncode == 0, done.stdout[-500:] + done.stderr[-500:]
    assert done.stdout.count("STRAIGHT_PROBE") == len(found.legs)
