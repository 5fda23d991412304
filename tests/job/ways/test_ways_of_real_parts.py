"""Ways around a clamp beside a part that others made."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from parked_jobs import DESK
from pentapod.job import Job, run
from pentapod.job.build.values import job_mesh
from pentapod.job.restart.restart import Restart, restart
from pentapod.program import read_csv

pytestmark = pytest.mark.parts

TORUS = """\
[part]
mesh = "${{PENTAPOD_PARTS}}/torus.STL"
unit = "mm"
scale = 20
region_angle_deg = 40
[machine]
file = "parked.toml"
[tool]
type = "ball"
diameter_mm = 6
[toolpath]
stepover_mm = 3
[feed]
cut_mm_min = 3000
{fixture}"""


@pytest.mark.slow
def test_ways_and_a_restart_around_a_clamp(tmp_path, parts):
    assert (parts / "torus.STL").is_file()
    (tmp_path / "parked.toml").write_text(DESK + "\n[park]\ntip_mm = [85, -17, 400]\n", encoding="utf-8")
    file = tmp_path / "job.toml"
    file.write_text(TORUS.format(fixture=""), encoding="utf-8")
    low, high = 1e3 * job_mesh(Job.load(file)).bounds
    # A block along the side of the part, higher than it by 5 mm.
    size = np.array([10.0, high[1] - low[1], high[2] - low[2] + 5.0])
    middle = np.array([high[0] + 9.0 + 5.0, 0.5 * (low[1] + high[1]), low[2] + 0.5 * size[2]])
    block = trimesh.creation.box(size, trimesh.transformations.translation_matrix(middle))
    block.export(tmp_path / "block.stl")
    file.write_text(TORUS.format(fixture='[fixture]\nmesh = "block.stl"\nunit = "mm"\n'), encoding="utf-8")
    job = Job.load(file)
    outcome = run(job, tmp_path / "out", advice=None)
    assert outcome.passed, outcome.refusal
    claims = {each.claim: each for each in outcome.verdict.certificates}
    assert {"way in", "way out", "spindle clear of the fixture"} <= set(claims)
    whole = read_csv(tmp_path / "out" / "program.csv")
    found = restart(job, tmp_path / "out" / "program.csv", 0.5 * whole.duration)
    assert isinstance(found, Restart), found
    assert found.verdict.passed
    assert found.program.duration < whole.duration
