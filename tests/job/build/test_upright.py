"""A job whose tool may lean, done by an upright one: what it is, who says so, and who takes it back up."""

from dataclasses import replace

import numpy as np
import pytest

from pentapod.base.errors import ProgramError
from pentapod.base.refusal import Refusal, Shortfall
from pentapod.cli.commands.new import dome_stl
from pentapod.job import Job, judge, pipeline, run
from pentapod.job.build.pieces import program_toolpath
from pentapod.job.build.upright import may_stand, upright
from pentapod.job.build.values import job_mesh
from pentapod.program import read_header, write_csv
from short_motion import motion

TABLES = {
    "part": {"mesh": "part.stl", "unit": "mm"},
    "machine": {"name": "desk"},
    "tool": {"type": "ball", "diameter_mm": 6.0},
    "toolpath": {"stepover_mm": 6.0},
    "axis": {"mode": "auto", "tilt_deg": 60.0},
    "feed": {"cut_mm_min": 1500.0},
    "placement": {"mode": "table", "table_z_mm": 471.0},
}


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dome")
    (folder / "part.stl").write_bytes(dome_stl(cells=8))
    return Job.from_dict(TABLES, folder)


def test_an_upright_job_keeps_the_digest_and_stands_along_the_view(job):
    made = upright(job)
    assert made.digest == job.digest
    assert made.asked is job
    assert (made.axis.mode, made.axis.direction, made.axis.tilt_deg) == ("fixed", (0.0, 0.0, 1.0), 0.0)
    assert made.toolpath.under_mm == 0.0
    assert made.with_(feed={"cut_mm_min": 1500.0}).digest != job.digest


def test_an_upright_tool_may_do_jobs_of_balls_whose_axis_is_the_planners(job):
    assert may_stand(job)
    assert not may_stand(upright(job))
    assert not may_stand(job.with_(axis={"mode": "normal"}))
    assert not may_stand(job.with_(toolpath={"strategy": "edges", "stepover_mm": None}))
    assert not may_stand(job.with_(tool={"type": "flat"}, axis={"tilt_deg": None}))


def test_the_header_says_that_the_tool_is_upright_and_the_toolpath_is_made_so(job, tmp_path):
    program, _ = motion(0.1)
    file = write_csv(replace(program, provenance=replace(program.provenance, upright=True)), tmp_path / "a.csv")
    assert read_header(file).provenance.upright
    assert np.array_equal(np.unique(program_toolpath(job, job_mesh(job), file).axes, axis=0), [[0.0, 0.0, 1.0]])
    plain = write_csv(program, tmp_path / "b.csv")
    assert "upright" not in plain.read_text()
    assert len(np.unique(program_toolpath(job, job_mesh(job), plain).axes, axis=0)) > 1


def test_a_header_that_says_neither_is_refused(tmp_path):
    program, _ = motion(0.1)
    file = write_csv(replace(program, provenance=replace(program.provenance, upright=True)), tmp_path / "a.csv")
    file.write_text(file.read_text().replace("# upright = true", "# upright = 1"))
    with pytest.raises(ProgramError, match="upright"):
        read_header(file)


@pytest.mark.slow
def test_where_leaning_makes_the_tool_touch_the_part_it_stays_upright_and_the_output_says_so(
    job, tmp_path, monkeypatch
):
    """The placement with leans is refused, as if the tool touched something there."""
    real = pipeline.Task.program

    def once(self, file):
        if self.job.asked is not None:
            return real(self, file)
        refusal = Refusal("placement", "no", (Shortfall("tool body touches the part", ((0, 9000),), 0.2, "mm"),))
        self.runner.run("placement", lambda: refusal)
        return refusal

    monkeypatch.setattr(pipeline.Task, "program", once)
    done = run(job, tmp_path / "out", advice=None)
    assert done.passed
    assert done.job is job
    assert any("the tool stays upright" in stage.remark for stage in done.stages)
    assert "\n# upright = true\n" in (tmp_path / "out" / "program.csv").read_text()[:4000]
    verdict = judge(job, tmp_path / "out")
    assert {c.claim: c.passed for c in verdict.certificates}["surface left on the region"]
    assert verdict.passed
