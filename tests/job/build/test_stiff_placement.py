"""A job that prefers stiff places: its key, and what the verdict then says of the deflection."""

import json
from importlib import resources

import pytest

from pentapod.base.errors import JobError
from pentapod.cli.main import run
from pentapod.job.build.values import job_machine
from pentapod.job.schema.job import Job
from usual_job import job_text

DESK = (resources.files("pentapod.machine") / "library" / "desk.toml").read_text(encoding="utf-8")
SOFT = DESK.replace("min_length_mm", "stiffness_n_um = 20\nmin_length_mm", 1)


def test_a_machine_without_stiffness_has_no_stiff_places(make_job):
    desk = Job.load(make_job())
    assert desk.with_(**{"placement.weight_stiffness": 2.0}).digest != desk.digest
    with pytest.raises(
        JobError, match=r"placement\.weight_stiffness: how stiff this machine is at the tip is not known"
    ):
        job_machine(desk.with_(**{"placement.weight_stiffness": 2.0}))


def test_the_tip_deflects_less_where_the_job_prefers_stiff_places(make_job, tmp_path):
    place = job_text().split("[placement]\n")[1]
    job = make_job(
        ('name = "desk"', 'file = "soft.toml"'), ("[feed]\n", "[feed]\ncutting_force_n = 50\n"),
        (place, 'mode = "free"\n'),
    )  # fmt: skip
    (tmp_path / "soft.toml").write_text(SOFT, encoding="utf-8")
    deflections = []
    for name, more in (("plain", ()), ("stiff", ("--set", "placement.weight_stiffness=10"))):
        assert run(["plan", str(job), "-o", str(tmp_path / name), *more]) == 0
        verdict = json.loads((tmp_path / name / "verdict.json").read_text(encoding="utf-8"))
        deflections += [claim["value"] for claim in verdict["certificates"] if claim["claim"] == "deflection"]
    assert deflections[1] < 0.9 * deflections[0]
