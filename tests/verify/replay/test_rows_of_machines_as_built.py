"""All rows of programs for machines as built are proven, and the motion between them: 20 random machines.

Joints off by up to 0.2 mm, zeros by up to 0.5 mm, rings of 0 to 30 mm on every second machine.
"""

import dataclasses
import sys
from pathlib import Path

import numpy as np
import pytest

from pentapod import Job, Program, run
from pentapod.job.outcome import SetUps
from pentapod.kinematics import AsBuiltPentapod
from pentapod.program import quantised
from pentapod.verify.replay.interval_bounds import interval_bounds

sys.path.append(str(Path(__file__).parents[2] / "program"))
from short_motion import motion

REFUSED = "oversize"
JOBS = sorted({path.stem for path in (Path(__file__).parents[3] / "toolpaths").glob("*.toml")} - {REFUSED})


def built(nominal, seed):
    rng = np.random.default_rng(seed)
    errors = {"base_errors": rng.uniform(-2e-4, 2e-4, (5, 3)), "offset_errors": rng.uniform(-2e-4, 2e-4, 5)}
    radii = rng.uniform(0.0, 0.03, 5) if seed % 2 else 0.0
    return AsBuiltPentapod.of(nominal, **errors, zeros=rng.uniform(-5e-4, 5e-4, 5), radii=radii)


def check_rows(program, machine, seeds):
    poses = machine.robot.pose(program.legs, program.component)
    for seed in seeds:
        real = built(machine.robot, seed)
        own = dataclasses.replace(program, legs=quantised(real.leg_lengths(*poses)))
        found = interval_bounds(own, dataclasses.replace(machine, robot=real), 0.0, 1e-6, lambda _share: None)
        assert np.isfinite(found.position).all(), seed
        assert found.component.refuted == found.component.undecided == len(found.unproven) == 0, seed
        assert np.abs(found.position[::2] - poses[0]).max() < 1e-8
        assert float(-found.component.lower.values[0]) > 0.0


def test_every_row_of_a_short_program_is_proven_on_20_machines():
    check_rows(*motion(0.6), range(20))


@pytest.mark.slow
@pytest.mark.parametrize("job", JOBS)
def test_every_row_of_a_shipped_job_is_proven_on_20_machines(job, tmp_path):
    outcome = run(Job.load(Path(__file__).parents[3] / "toolpaths" / f"{job}.toml"), tmp_path / "out")
    setups = outcome.find(SetUps)
    for part in [outcome] if setups is None else [each.outcome for each in setups.parts]:
        program = part.find(Program)
        assert program is not None
        check_rows(program, program.machine(part.machine), range(20))
