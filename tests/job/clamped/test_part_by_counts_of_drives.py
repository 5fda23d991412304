"""Touches where drives count something else than the legs' lengths: legs that yield, screws that turn."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "registration"))
from forged_touches import PROBE, RADIUS, legs_at, moved, touched

from pentapod.cli.commands.new import dome_stl
from pentapod.geometry import RigidTransform
from pentapod.job import Job
from pentapod.job.clamped.registration import register_part
from pentapod.kinematics import Component
from pentapod.machine import Dynamics, LegModel, Machine, Stiffness
from pentapod.mesh import load_mesh
from pentapod.registration import Touches
from usual_job import job_text

SPRING, LEAD = 5e6, 10e-3


def clamped(folder, machine):
    """A job in a folder, its mesh, where the part is planned and where it is, and 60 balls that touch it there."""
    (folder / "part.stl").write_bytes(dome_stl(cells=16))
    (folder / "job.toml").write_text(job_text(), encoding="utf-8")
    mesh = load_mesh(folder / "part.stl", "mm")
    planned = RigidTransform(np.diag([1.0, -1.0, -1.0]), machine.work.centre)
    truth = moved(2, 0.1, 3e-4)
    truth = RigidTransform(truth.rotation @ planned.rotation, planned.translation + truth.translation)
    axes = np.tile([0.0, 0.0, -1.0], (60, 1))
    centres = truth.apply(touched(mesh, np.ones(len(mesh.faces)), 60, 4))
    return Job.load(folder / "job.toml"), mesh, planned, truth, centres, axes


def off(mesh, found, truth) -> float:
    """How far a placement puts the facets off their true planes at most, metres."""
    points, normals = mesh.vertices[mesh.faces].mean(axis=1), mesh.facet_normals
    return np.abs(((found.apply(points) - truth.apply(points)) * truth.rotate(normals)).sum(axis=1)).max()


@pytest.mark.parametrize(("compensation", "least", "most"), [(None, 0.0, 1e-7), ("none", 10e-6, 1e-3)])
def test_touches_are_taken_as_the_program_will_be_played(tmp_path, compensation, least, most) -> None:
    """Commands that compensate for the weight bring the tip to its place: touches must say where the part truly is."""
    desk = Machine.load("desk")
    machine = replace(
        desk, stiffness=Stiffness(leg_stiffness=np.full(5, SPRING)), masses=replace(desk.masses, platform=10.0)
    )
    job, mesh, planned, truth, centres, axes = clamped(tmp_path, machine)
    job = job if compensation is None else job.with_(**{"output.compensation": compensation})
    legs, still = legs_at(machine.robot, centres, axes), np.zeros((60, 5))
    weight = (
        Dynamics.of(machine.with_tool(PROBE)).of_rows(centres + (PROBE - RADIUS) * axes, -axes, still, still).weight
    )
    given = Touches(legs + weight / SPRING, PROBE, RADIUS, tuple(range(60)))
    found = register_part(job, given, near=planned, hold=True, machine=machine).registration
    assert least <= off(mesh, found.placement, truth) <= most


def test_touches_are_counts_of_drives_whose_screws_turn(tmp_path) -> None:
    """A nut that turns about its screw: the turn of the leg about itself, times the lead over a whole turn."""
    desk = Machine.load("desk")
    fixed = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    model = LegModel(lead=np.full(5, LEAD), first_axes=fixed)
    machine = replace(desk, leg_model=model)
    job, mesh, planned, truth, centres, axes = clamped(tmp_path, machine)
    legs = legs_at(machine.robot, centres, axes)
    told = machine.commands(legs, Component(1, 1))
    assert np.ptp(told - legs, axis=0).max() > 10e-6, "the screws turn from touch to touch"
    other = machine.with_tool(machine.tool_length + 0.02)
    assert np.array_equal(other.commands(legs, Component(1, 1)), told), "whatever the tool"
    given = Touches(told, PROBE, RADIUS, tuple(range(60)), component=Component(1, 1))
    by_model, without = (
        register_part(job, given, near=planned, hold=True, machine=each).registration for each in (machine, desk)
    )
    assert off(mesh, by_model.placement, truth) < 1e-7
    assert off(mesh, without.placement, truth) > 10e-6
