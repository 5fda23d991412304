from dataclasses import replace

import numpy as np
import pytest

from pentapod.base.errors import JobError
from pentapod.job import Job, run
from pentapod.job.build.process import continued, with_process
from pentapod.job.build.toolpath import job_toolpath
from pentapod.job.build.values import job_mesh
from pentapod.program import Switch, read_csv
from pentapod.toolpath import Segment, SegmentKind, Toolpath
from pentapod.toolpath.formats import read_toolpath, write_toolpath

FEED = "[feed]\ncut_mm_min = 3000"
SAID = (("T1", "M6", "S9000", "M4", "M0"), ("M8",), (), (), ("M9", "M5"))


def path(said=((),) * 5, powers=(1.0, 0.5)):
    """A rapid, a cut, a link and a cut; said: words of each, and after the last."""
    kinds = (SegmentKind.RAPID, SegmentKind.CUT, SegmentKind.LINK, SegmentKind.CUT)
    up, each = np.tile([0.0, 0.0, 1.0], (2, 1)), (1.0, powers[0], 1.0, powers[1])
    segments = [
        Segment(kind, np.array([[k, 0.0, 0.0], [k + 1, 0.0, 0.0]]), up, 0.02 if k else np.inf, each[k], None, said[k])
        for k, kind in enumerate(kinds)
    ]
    return Toolpath(tuple(segments), end_words=said[4])


def words(toolpath):
    return [*(segment.words for segment in toolpath.segments), toolpath.end_words]


@pytest.fixture
def job(make_job):
    def asked(**keys):
        return Job.load(make_job()).with_(process=keys)

    return asked


def test_a_job_without_process_leaves_the_words_and_its_digest(job):
    plain = job()
    assert plain.digest == "f904ba64074e1e5e"  # as before there was such a table
    assert with_process(plain, whole := path(SAID)) is whole
    assert job(coolant="mist").digest != plain.digest


def test_keys_say_what_holds_from_start_to_end(job):
    told = with_process(job(tool_number=7, spindle_rpm=12000, coolant="both"), path())
    assert words(told) == [("T7", "M6", "S12000", "M3", "M7", "M8"), (), (), (), ("M9", "M5")]


def test_a_key_overrides_its_own_words_of_a_file_alone(job):
    told = with_process(job(spindle_rpm=12000), path(SAID))
    assert words(told) == [("S12000", "M4", "T1", "M6", "M0"), ("M8",), (), (), ("M9", "M5")]
    dry = with_process(job(coolant="off"), path(SAID))
    assert words(dry) == [("T1", "M6", "S9000", "M4", "M0"), (), (), (), ("M5",)]


def test_the_laser_is_on_in_cuts_alone_with_the_power_of_each(job):
    asked = job(laser_power=0.8)
    told = with_process(asked, path())
    on, half, off = ("M67 E0 Q0.8",), ("M67 E0 Q0.4",), ("M67 E0 Q0",)
    assert words(told) == [off, on, off, half, off]
    assert words(with_process(asked, told)) == words(told)


def test_a_set_up_begins_with_what_was_said_before_its_first_cut():
    whole = path(SAID)
    part = replace(whole, segments=whole.segments[2:])
    assert words(continued(whole, part, 3))[0] == ("T1", "M6", "S9000", "M4", "M8")


@pytest.mark.parametrize(
    ("line", "what"),
    [
        ("spindle_rpm = -1", "process.spindle_rpm"),
        ('coolant = "on"', "process.coolant"),
        ("laser_power = 80", "process.laser_power"),
        ("tool_number = 1.5", "process.tool_number"),
        ("spindle = 3", "unknown key"),
    ],
)
def test_bad_keys_are_refused_with_their_line(make_job, line, what):
    with pytest.raises(JobError, match=what):
        Job.load(make_job((FEED, f"[process]\n{line}\n\n{FEED}")))


@pytest.mark.slow
def test_words_of_a_cam_file_and_keys_of_a_job_reach_the_program_and_its_verdict(make_job, tmp_path):
    plain = Job.load(make_job())
    made = with_process(
        plain.with_(process={"tool_number": 7, "spindle_rpm": 8000}), job_toolpath(plain, job_mesh(plain))[0]
    )
    write_toolpath(made, tmp_path / "a.ngc")
    keys = 'strategy = "file"\nfile = "a.ngc"'
    job = Job.load(make_job(("stepover_mm = 15\nspacing_mm = 4", keys))).with_(process={"laser_power": 0.5})
    outcome = run(job, tmp_path / "out", advice=None)
    names = {each.claim: each for each in outcome.verdict.certificates}
    assert names["process data"].passed, names["process data"].method
    program = read_csv(tmp_path / "out" / "program.csv")
    assert program.switches[0] == Switch(0, ("T7", "M6", "S8000", "M3"))
    assert program.switches[-1] == Switch(len(program.legs) - 1, ("M5",))
    assert set(np.unique(program.laser_power)) == {0.0, 0.5}
    assert program.laser_power[0] == program.laser_power[-1] == 0.0


def test_analog_outputs_are_read_with_their_values(tmp_path):
    text = "G21 G90 G94\nG0 X0 Y0 Z5\nM67 E0 Q0.5\nG1 X5 F100\nM67 E0 Q0\nG0 X9\nM2\n"
    (tmp_path / "a.ngc").write_text(text)
    assert [s.words for s in read_toolpath(tmp_path / "a.ngc").segments] == [("M67 E0 Q0.5",), ("M67 E0 Q0",)]
