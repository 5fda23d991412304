"""A machine file of one's own, as the recipe says: copied, changed, checked, planned on and judged."""

import re

from pentapod import Job, Program, judge, run
from pentapod.cli.main import run as command
from pentapod.machine import Machine
from pentapod.machine.reader import machine_bytes

CHANGES = {"name": '"workshop"', "max_velocity_mm_s": "400", "leg_diameter_mm": "14", "length_mm": "205"}


def own_machine_file(folder):
    """The file of a shipped machine with other numbers."""
    text = machine_bytes("desk").decode()
    for key, value in CHANGES.items():
        text, count = re.subn(rf"(?m)^{key} = .*$", f"{key} = {value}", text)
        assert count == 1, key
    (folder / "workshop.toml").write_text(text, encoding="utf-8")
    return folder / "workshop.toml"


def test_own_machine_file_is_checked_planned_on_and_judged(make_job, tmp_path, capsys):
    file = own_machine_file(tmp_path)
    assert command(["machine", "check", str(file)]) == 0
    assert "machine workshop" in capsys.readouterr().out
    job = Job.load(make_job(('name = "desk"', 'file = "workshop.toml"')))
    outcome = run(job, tmp_path / "out")
    assert outcome.unwrap().passed, [c for c in outcome.verdict.certificates if not c.passed]
    machine = Machine.load(file)
    assert outcome.find(Program).provenance.machine_digest == machine.digest != Machine.load("desk").digest
    assert judge(job, tmp_path / "out" / "program.csv").passed


def test_own_machine_that_cannot_keep_its_limits_fails_the_check(tmp_path, capsys):
    file = own_machine_file(tmp_path)
    text = re.sub(r"(?m)^max_length_mm = .*$", "max_length_mm = 800", file.read_text(encoding="utf-8"))
    file.write_text(text, encoding="utf-8")
    assert command(["machine", "check", str(file)]) == 1
    assert "longest" in capsys.readouterr().out
