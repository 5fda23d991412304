"""The usual job on the shipped machine with a park pose."""

from __future__ import annotations

from importlib import resources

from pentapod.cli.commands.new import dome_stl
from pentapod.job import Job
from usual_job import job_text

DESK = (resources.files("pentapod.machine") / "library" / "desk.toml").read_text(encoding="utf-8")
PARK = "\n[park]\ntip_mm = [85, -17, 430]\n"


def parked_job(folder, park=PARK):
    (folder / "part.stl").write_bytes(dome_stl(cells=12))
    (folder / "parked.toml").write_text(DESK + park, encoding="utf-8")
    (folder / "job.toml").write_text(job_text().replace('name = "desk"', 'file = "parked.toml"'), encoding="utf-8")
    return Job.load(folder / "job.toml")
