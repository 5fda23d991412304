"""Sweep files: values by the path of a key, combined; bad ones told in one line before anything is run."""

import csv
import datetime
import io
import json
import re
import sys
import tomllib

import numpy as np
import pytest

from pentapod.base.errors import InputError
from pentapod.batch import Store, Sweep
from pentapod.batch.jobs import RESULTS, job_task, plan_in
from pentapod.batch.pace import Pace
from pentapod.batch.table import csv_text, lines_text, write_tables
from pentapod.cli.main import run
from pentapod.job import Job
from pentapod.machine import CalibrationRecord, Machine, MeasuredGeometry, geometry_digest, write_calibration
from pentapod.machine.reader import machine_bytes

MOST = 1000


@pytest.fixture
def sweep(make_job, tmp_path):
    """Write a sweep of the small job and load it."""
    make_job()

    def load(text, head=""):
        path = tmp_path / "sweep.toml"
        path.write_text(f'job = "job.toml"\n{head}\n[sweep]\n{text}\n', encoding="utf-8")
        return Sweep.load(path, MOST)

    return load


def test_sweep_combines_as_product_zip_and_sample(sweep):
    lists = '"tool.length_mm" = [190, 198]\nfeed.cut_mm_min = { from = 1000, to = 3000, steps = 3 }'
    product = sweep(lists)
    assert product.keys == ("tool.length_mm", "feed.cut_mm_min")
    assert [tuple(change.values()) for change in product.changes] == [
        (190, 1000), (190, 2000), (190, 3000), (198, 1000), (198, 2000), (198, 3000),
    ]  # fmt: skip
    both = '"tool.length_mm" = [190, 198]\n"feed.cut_mm_min" = [1000, 1500.5]'
    zipped = sweep(both, 'combine = "zip"')
    assert [tuple(change.values()) for change in zipped.changes] == [(190, 1000), (198, 1500.5)]
    ranges = '"tool.length_mm" = { from = 190, to = 206 }\n"toolpath.pattern" = ["zigzag", "one-way"]'
    sampled = sweep(ranges, 'combine = "sample"\nsamples = 16')
    lengths = sorted(change["tool.length_mm"] for change in sampled.changes)
    assert [int((length - 190) // 1) for length in lengths] == list(range(16))  # a Sobol sequence has one in each
    assert sum(change["toolpath.pattern"] == "one-way" for change in sampled.changes) == 8
    assert sweep(ranges, 'combine = "sample"\nsamples = 16') == sampled
    assert sweep(ranges, 'combine = "sample"\nsamples = 16\nseed = 1').changes != sampled.changes


@pytest.mark.parametrize(
    ("text", "head", "said"),
    [
        ('"tool.lenght_mm" = [190]', "", 'sweep.toml:4: tool.lenght_mm: no such key .* did you mean "tool.length_mm"'),
        ('"machine.geometry.dleta" = [0.2]', "", 'did you mean "machine.geometry.delta"'),
        ('"tool.length_mm" = []', "", "tool.length_mm: the list is empty"),
        ('"tool.length_mm" = 190', "", r"no values to take \(got 190\); expected a list, or \{ from"),
        ('"tool.length_mm" = { from = 1, to = 1, steps = 2 }', "", "two numbers that differ"),
        ('"tool.length_mm" = { from = 1, to = 9, steps = 1 }', "", "expected a whole number, 2 to 1000"),
        ('"tool.length_mm" = [1, 2]\n"feed.cut_mm_min" = [1]', 'combine = "zip"', 'as many as "tool.length_mm" has'),
        ('"tool.length_mm" = { from = 1, to = 9 }', 'combine = "sample"', "samples: how many points"),
        ('"tool.length_mm" = [1]', 'combine = "all"', "combine: wrong value"),
        ('"tool.length_mm" = [1]', "smaples = 3", 'unknown key; did you mean "samples"'),
        ("", "", "no key is swept"),
        ('"tool.length_mm" = { from = 1, to = 9, steps = 900 }\n"axis.tilt_deg" = [1, 2]', "", r"\(got 1800\)"),
    ],
)
def test_bad_sweeps_are_one_error_that_names_the_remedy(text, head, said, sweep):
    with pytest.raises(InputError) as caught:
        sweep(text, head)
    assert re.search(said, str(caught.value)), str(caught.value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('"tool.length_mm" = [190, -3]', r"sweep.toml:4: tool.length_mm: out of range \(got -3\)"),
        ('"machine.legs.max_length_mm" = ["long"]', r"machine.legs.max_length_mm: .*\(got 'long'\)"),
        (
            '"axis.tilt_deg" = [10]\n"tool.type" = ["flat"]',
            "4: axis.tilt_deg: .* cannot tilt .*; with tool.type = 'flat'",
        ),
    ],
)
def test_a_combination_that_makes_no_job_is_told_before_any_is_run(text, said, sweep, tmp_path):
    with pytest.raises(InputError) as caught:
        sweep(text).tasks(Store(tmp_path / "runs"))
    assert re.search(said, str(caught.value)), str(caught.value)
    assert run(["sweep", str(tmp_path / "sweep.toml"), "-o", str(tmp_path / "out")]) == 2
    assert not (tmp_path / "out").exists()


def test_tasks_of_a_sweep_have_all_that_their_jobs_name(sweep, tmp_path):
    made = sweep('"machine.geometry.delta" = [0.185, 0.19]\n"tool.length_mm" = [190]').tasks(Store(tmp_path / "runs"))
    assert len({task.name for task in made}) == 2
    for task, delta in zip(made, (0.185, 0.19), strict=True):
        folder = tmp_path / "runs" / task.name
        folder.mkdir()
        for name, text in task.files.items():
            (folder / name).write_text(text, encoding="utf-8")
        (tmp_path / "part.stl").rename(tmp_path / "gone.stl")  # the job needs what was kept alone
        job = Job.load(folder / "job.toml")
        (tmp_path / "gone.stl").rename(tmp_path / "part.stl")
        machine = Machine.load(job.machine_file)
        assert job.tool.length_mm == 190
        assert machine.robot.delta == delta
        assert (machine.digest == Machine.load("desk").digest) == (delta == 0.185)
    again = sweep('"machine.geometry.delta" = [0.19, 0.185]\n"tool.length_mm" = [190]').tasks(Store(tmp_path / "runs"))
    assert [task.name for task in again] == [task.name for task in reversed(made)]


def test_a_calibrated_machine_goes_with_its_calibration(make_job, tmp_path):
    desk = Machine.load("desk").robot
    joints = MeasuredGeometry(desk.base_joints + 1e-4, desk.offsets, np.zeros(5), np.zeros(5))
    record = CalibrationRecord("desk", geometry_digest(desk), datetime.date(2026, 1, 31), joints)
    write_calibration(record, tmp_path / "measured.toml")
    text = machine_bytes("desk").decode() + '\n[calibration]\nfile = "measured.toml"\n'
    (tmp_path / "built.toml").write_text(text, encoding="utf-8")
    job = Job.load(make_job(('name = "desk"', 'file = "built.toml"')))
    task = job_task(job, Store(tmp_path / "runs"))
    (tmp_path / "measured.toml").unlink()
    kept = tmp_path / "runs" / "inputs" / task.inputs[-1].name
    assert Machine.load(kept).digest != Machine.load("desk").digest


def test_a_row_tells_what_became_of_a_job(make_job, tmp_path):
    task = job_task(Job.load(make_job()), Store(tmp_path / "runs"), {"feed.cut_mm_min": 3000})
    folder = tmp_path / "runs" / task.name
    folder.mkdir()
    (folder / "job.toml").write_text(task.files["job.toml"].replace("cut_mm_min = 3000.0", "cut_mm_min = 3000"))
    row = plan_in(folder, "job.toml")
    verdict = json.loads((folder / "verdict.json").read_text(encoding="utf-8"))
    assert row["status"] == "passed"
    assert 'href="sheet.html"' in (folder / "report.html").read_text(encoding="utf-8")
    assert (folder / "sheet.html").is_file()
    assert row["program_sha256"] == verdict["sha256"]["program"]
    assert row["margin"] == row["margins"][row["margin_limit"]] == min(row["margins"].values()) > 0
    assert row["cycle_time_s"] > 1
    assert row["limiting_cause"]
    text = csv_text([{**task.known, **row, "task": task.name}], RESULTS)
    assert text.splitlines()[0].startswith("job,feed.cut_mm_min,status,cause,margin,margin_limit,cycle_time_s")


@pytest.mark.slow
def test_a_row_tells_why_a_job_is_refused(make_job, tmp_path):
    task = job_task(Job.load(make_job()), Store(tmp_path / "runs"))
    folder = tmp_path / "runs" / task.name
    folder.mkdir()
    (folder / "job.toml").write_text(task.files["job.toml"], encoding="utf-8")
    content = tomllib.loads(task.files["job.toml"])
    content["placement"]["position_mm"][2] += 500
    far = Job.load(folder / "job.toml").with_(placement=content["placement"])
    far_task = job_task(far, Store(tmp_path / "runs"))
    (tmp_path / "runs" / far_task.name).mkdir()
    (tmp_path / "runs" / far_task.name / "job.toml").write_text(far_task.files["job.toml"], encoding="utf-8")
    refused = plan_in(tmp_path / "runs" / far_task.name, "job.toml")
    assert refused["status"] == "refused"
    assert refused["cause"].startswith("placement: ")
    assert refused["margin"] < 0
    assert refused["program_sha256"] is None


def test_the_commands_tell_what_is_wrong(make_job, tmp_path, capsys, monkeypatch):
    job = make_job()
    monkeypatch.chdir(tmp_path)
    assert run(["batch", str(job), "--workers", "2", "--scheduler", "tcp://127.0.0.1:1"]) == 2
    assert "--workers and --scheduler are both given" in capsys.readouterr().err
    assert run(["batch", str(job), str(tmp_path / "none.toml")]) == 2
    assert "none.toml: no such job file" in capsys.readouterr().err
    assert not (tmp_path / "runs").exists()
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert run(["batch", str(job)]) == 2
    assert 'pip install "pentapod[batch]"' in capsys.readouterr().err


def test_tables_of_one_batch_hold_the_same(tmp_path):
    rows = [
        {"job": "a", "tool.length_mm": 190, "status": "passed", "margin": 0.1 + 0.2, "margins": {"b": 1.0, "a": 2.0}},
        {
            "job": "b",
            "tool.length_mm": 198.5,
            "status": "refused",
            "margin": None,
            "points": [[1, 2]],
            "cause": 'a, "b"',
        },
    ]
    last = ("status", "cause", "margin")
    text = csv_text(rows, last)
    assert list(csv.reader(io.StringIO(text))) == [
        ["job", "tool.length_mm", "points", "status", "cause", "margin"],
        ["a", "190", "", "passed", "", "0.30000000000000004"],
        ["b", "198.5", "[[1, 2]]", "refused", 'a, "b"', ""],
    ]
    first, second = (json.loads(line) for line in lines_text(rows, last).splitlines())
    assert first == {**rows[0], "points": None, "cause": None}
    assert list(first["margins"]) == ["a", "b"]
    assert second == rows[1]
    parquet = pytest.importorskip("pyarrow.parquet")
    written = write_tables(rows, last, tmp_path, parquet=True)
    assert parquet.read_table(written[2]).to_pylist()[1]["tool.length_mm"] == 198.5


def test_without_pyarrow_the_error_says_what_to_install(make_job, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    assert run(["batch", str(make_job()), "--parquet"]) == 2
    assert 'pip install "pentapod[parquet]"' in capsys.readouterr().err


def test_pace_tells_rate_and_time_left():
    now = [0.0]
    pace = Pace(10, lambda: now[0])
    pace.count(new=False)
    assert str(pace) == "1 of 10"  # how long one takes is not known yet
    now[0] = 30.0
    pace.count(new=True)
    pace.count(new=True)
    assert str(pace) == "3 of 10, 4 a minute, 2 min left"
