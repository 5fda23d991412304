"""Touches of a machine whose legs yield: drives count more or less than the legs' lengths, where programs know that."""

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
from pentapod.machine import Dynamics, Machine, Stiffness
from pentapod.mesh import load_mesh
from pentapod.registration import Touches
from usual_job import job_text

SPRING = 5e6


@pytest.mark.parametrize(("compensation", "least", "most"), [(None, 0.0, 1e-7), ("none", 10e-6, 1e-3)])
def test_touches_are_taken_as_the_program_will_be_played(tmp_path, compensation, least, most) -> None:
    """Commands that compensate for the weight bring the tip to its place: touches must say where the part truly is."""
    (tmp_path / "part.stl").write_bytes(dome_stl(cells=16))
    (tmp_path / "job.toml").write_text(job_text(), encoding="utf-8")
    job, desk = Job.load(tmp_path / "job.toml"), Machine.load("desk")
    job = job if compensation is None else job.with_(**{"output.compensation": compensation})
    machine = replace(
        desk, stiffness=Stiffness(leg_stiffness=np.full(5, SPRING)), masses=replace(desk.masses, platform=10.0)
    )
    mesh = load_mesh(tmp_path / "part.stl", "mm")
    planned = RigidTransform(np.diag([1.0, -1.0, -1.0]), machine.work.centre)
    truth = moved(2, 0.1, 3e-4)
    truth = RigidTransform(truth.rotation @ planned.rotation, planned.translation + truth.translation)
    axes = np.tile([0.0, 0.0, -1.0], (60, 1))
    centres = truth.apply(touched(mesh, np.ones(len(mesh.faces)), 60, 4))
    legs, still = legs_at(machine.robot, centres, axes), np.zeros((60, 5))
    weight = (
        Dynamics.of(machine.with_tool(PROBE)).of_rows(centres + (PROBE - RADIUS) * axes, -axes, still, still).weight
    )
    given = Touches(legs + weight / SPRING, PROBE, RADIUS, tuple(range(60)))
    found = register_part(job, given, near=planned, hold=True, machine=machine).registration
    points, normals = mesh.vertices[mesh.faces].mean(axis=1), mesh.facet_normals
    off = np.abs(((found.placement.apply(points) - truth.apply(points)) * truth.rotate(normals)).sum(axis=1)).max()
    assert least <= off <= most
