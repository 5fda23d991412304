"""Every shipped machine plans the dome of 150 mm; its program is proven, and MuJoCo plays it within 20 µm."""

from pathlib import Path

import numpy as np
import pytest

from pentapod import Job, Program, run
from pentapod.geometry.directions import angle_between
from pentapod.machine import shipped_machines
from pentapod.simulate import Reference, plant, simulate_mujoco

TOOLPATHS = Path(__file__).parents[2] / "toolpaths"
COARSE = (("diameter_mm = 6", "diameter_mm = 12"), ("stepover_mm = 3", "stepover_mm = 8"))
"""Few passes of a larger ball: the machine is judged here, not the surface, whose ridges may be high."""


@pytest.mark.slow
@pytest.mark.parametrize("name", shipped_machines())
def test_machine_plans_the_dome_and_plays_it(name, tmp_path):
    pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    text = (TOOLPATHS / "dome.toml").read_text(encoding="utf-8")
    # The machines have their work volumes at different heights.
    for old, new in (*COARSE, ('name = "desk"', f'name = "{name}"'), ('"table"', '"free"'), ("table_z_mm", "# ")):
        assert old in text
        text = text.replace(old, new)
    text = text.replace("[tolerance]", "[tolerance]\nleft_mm = 2")
    (tmp_path / "dome.stl").write_bytes((TOOLPATHS / "dome.stl").read_bytes())
    (tmp_path / "job.toml").write_text(text, encoding="utf-8")
    outcome = run(Job.load(tmp_path / "job.toml"), tmp_path / "out")
    assert outcome.unwrap().passed, [c for c in outcome.verdict.certificates if not c.passed]
    reference = Reference(outcome.find(Program), outcome.machine)
    physics = simulate_mujoco(reference, plant(reference)).unwrap()
    tip = np.linalg.norm(physics.played.tips - reference.tips[::2], axis=1)
    assert tip.max() <= 20e-6
    assert angle_between(physics.played.directions, reference.directions[::2]).max() <= 1e-4
