"""From a machine file with forces to a program that MuJoCo plays: the drives' forces are those that the plan kept."""

from importlib import resources

import numpy as np
import pytest

from pentapod.cli.commands.new import dome_stl
from pentapod.geometry.interpolant import clamped_slopes
from pentapod.job import Job, run
from pentapod.machine import Machine
from pentapod.program import Program
from pentapod.simulate import Reference, plant, simulate_mujoco
from pentapod.timing import Explanation
from pentapod.verify.replay.row_forces import RowForces
from usual_job import job_text

PEAK = 300.0


@pytest.mark.slow
def test_a_plan_within_the_peak_force_is_within_it_in_mujoco(tmp_path):
    pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    desk = (resources.files("pentapod.machine") / "library" / "desk.toml").read_text(encoding="utf-8")
    (tmp_path / "machine.toml").write_text(f"{desk}\n[drives]\npeak_force_n = {PEAK}\n", encoding="utf-8")
    (tmp_path / "part.stl").write_bytes(dome_stl(cells=12))
    text = job_text().replace('name = "desk"', 'file = "machine.toml"').replace("= 3000", "= 12000")
    (tmp_path / "job.toml").write_text(text, encoding="utf-8")
    outcome = run(Job.load(tmp_path / "job.toml"), tmp_path / "out")
    assert outcome.passed, str(outcome.verdict)
    (force,) = (c for c in outcome.verdict.certificates if c.claim == "leg forces")
    assert 0.97 * PEAK < force.value <= PEAK * 1.001
    assert any(cause.name.endswith(" force") for cause in outcome.find(Explanation).causes)
    program, machine = outcome.find(Program), Machine.load(tmp_path / "machine.toml")
    reference = Reference(program, machine)
    i = reference.directions[::2]
    p = reference.tips[::2] - machine.tool_length * i
    none = np.zeros(len(p), dtype=bool)
    push = RowForces.of(program, machine, clamped_slopes(program.legs), (p, i), none).push
    played = simulate_mujoco(reference, plant(reference)).unwrap().played.forces
    assert np.abs(played).max() <= 1.01 * PEAK
    # MuJoCo's force at a row is that of half a period earlier, where its last step began.
    np.testing.assert_allclose(played[1:], 0.5 * (push[1:] + push[:-1]), atol=0.01 * np.abs(push).max())
