"""Programs of general and as-built machines: written, read back and judged by the general proofs, and by no other."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import replay_cases as cases

from pentapod import Job, Machine, Provenance, leg_path, plan, read_csv, retime, sample, write_csv
from pentapod.job.build.specification import job_specification
from pentapod.job.build.toolpath import job_toolpath
from pentapod.job.build.values import job_machine, job_mesh
from pentapod.kinematics import AsBuiltPentapod, GeneralPentapod
from pentapod.verify import judged, verify

JOBS = Path(__file__).parents[2] / "toolpaths"


def general(machine: Machine) -> Machine:
    """Offsets that are not proportional to anything."""
    off = 1e-3 * np.array([4.0, -6.0, 0.0, 5.0, -3.0])
    robot = GeneralPentapod(machine.robot.base_joints[:, :2], machine.robot.offsets + off)
    return dataclasses.replace(machine, robot=robot)


def as_built(machine: Machine) -> Machine:
    """Joints off by 0.2 mm, zeros by 0.5 mm, rings on some legs."""
    signs = np.random.default_rng(0).choice([-1.0, 1.0], size=(5, 4))
    radii = [0.0, 0.004, 0.0, 0.006, 0.0]
    robot = AsBuiltPentapod.of(machine.robot, base_errors=2e-4 * signs[:, :3], zeros=5e-4 * signs[:, 3], radii=radii)
    return dataclasses.replace(machine, robot=robot)


@pytest.mark.parametrize("changed", [general, as_built])
def test_program_of_another_machine_passes_on_that_and_fails_on_the_nominal_one(changed, tmp_path: Path) -> None:
    """The first stroke of the hand-made program: without a planner."""
    stand = cases.good_case().machine
    machine, parts = changed(stand), cases.strokes()[:3]
    program = cases.program_of(machine, *cases.timed(parts))
    path = tmp_path / "program.csv"
    write_csv(program, path)
    np.testing.assert_array_equal(read_csv(path).legs, program.legs)
    asked = {**cases.ASKED, "cutting": cases.cutting_of(*cases.hill())}
    verdict = verify(path, machine, cases.toolpath_of(parts), **asked)
    failed = {c.claim for c in verdict.certificates if not c.passed}
    assert failed <= {"starts at the toolpath's start", "ends at the toolpath's end"}, failed
    found = {c.claim: c for c in verdict.certificates}
    assert found["component kept"].method.startswith("proven; component ")
    assert found["component kept"].value > 0.0
    nominal = verify(path, stand, cases.toolpath_of(parts), **asked)
    assert {"machine", "tip deviation"} <= {c.claim for c in nominal.certificates if not c.passed}


@pytest.mark.slow
@pytest.mark.parametrize("changed", [general, as_built])
def test_shipped_job_is_planned_timed_written_and_judged_on_every_robot(changed, tmp_path: Path) -> None:
    job = Job.load(JOBS / "seam.toml")
    nominal, mesh = job_machine(job), job_mesh(job)
    machine, toolpath = changed(nominal), job_toolpath(job, mesh)[0]
    asked = job_specification(job, machine, mesh, lambda: toolpath)
    assert asked.constraints is not None
    assert asked.collision_world is not None
    placed = plan(
        toolpath, machine, tilt=asked.tilt, constraints=asked.constraints, collision_world=asked.collision_world
    ).unwrap()
    legs = leg_path(placed, machine, path_tolerance=asked.path_tolerance, axis_tolerance=asked.axis_tolerance).unwrap()
    trajectory = retime(legs, machine).unwrap()
    source = Provenance(machine.name, machine.digest, job.digest, "0")
    path = tmp_path / "program.csv"
    write_csv(sample(trajectory, machine, placed.placement.transform, placed.component, source), path)
    verdict = judged(path, asked)
    assert verdict.passed, verdict.answer
    on_nominal = judged(path, dataclasses.replace(asked, machine=nominal))
    assert {"machine", "tip deviation"} <= {c.claim for c in on_nominal.certificates if not c.passed}


def test_digests_tell_geometries_apart() -> None:
    stand = cases.good_case().machine
    machines = [stand, general(stand), as_built(stand)]
    assert len({machine.digest for machine in machines}) == len(machines)
