"""Batches that are interrupted, and jobs end to end."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import killed_batch
import pytest
import stub_tasks
from test_task_engine import table

from pentapod.batch import Store, batch
from pentapod.batch.jobs import RESULTS, job_task, plan_in
from pentapod.batch.table import CSV, LINES, csv_text, lines_text
from pentapod.cli.main import run
from pentapod.job import Job

HERE = Path(__file__).parent
MAIN = "from pentapod.cli.main import main; main()"


@pytest.mark.slow
def test_hundred_tasks_with_drivers_and_workers_killed_at_random(tmp_path):
    count, seconds = 100, 0.4
    command = [sys.executable, str(HERE / "killed_batch.py"), str(tmp_path / "runs"), str(tmp_path / "log")]
    killed = killed_batch.run_and_kill([*command, str(count), str(seconds)], tmp_path / "log", 1, 12, 1800.0)
    made = stub_tasks.tasks(count, tmp_path / "log", seconds)
    assert killed["drivers"] > 0
    assert killed["workers"] > 0
    assert stub_tasks.done_twice(made, tmp_path / "runs", tmp_path / "log") == []
    rows = killed_batch.rows_of(made, tmp_path / "runs", 2)
    serial = [
        {**task.known, **dict(sorted(stub_tasks.work(_folder(tmp_path / "serial", task), **task.arguments).items()))}
        for task in made
    ]
    assert table([rows[task.name] for task in made]) == table(
        [{**row, "task": task.name} for row, task in zip(serial, made, strict=True)]
    )


def _folder(out, task):
    (out / task.name).mkdir(parents=True)
    return out / task.name


@pytest.mark.slow
def test_jobs_on_workers_give_the_table_of_a_serial_run(make_job, tmp_path):
    path = make_job(("spacing_mm = 4", "spacing_mm = 8"))
    jobs = [Job.load(path).with_(feed={"cut_mm_min": feed}) for feed in (2000, 2500, 3000)]
    jobs.append(jobs[0].with_(tool={"length_mm": 90}))  # the spindle would end above a platform joint
    running = batch([*jobs, jobs[0]], tmp_path / "runs", workers=2)
    assert len(running) == 5
    found = list(running)
    assert sorted(done.status for done in found) == ["invalid", *["passed"] * 4]
    assert sum(done.new for done in found) == 4  # what is given twice is planned once
    store, rows = Store(tmp_path / "serial"), []
    for job in jobs:
        task = job_task(job, store)
        folder = _folder(tmp_path / "serial", task)
        (folder / "job.toml").write_text(task.files["job.toml"], encoding="utf-8")
        rows.append({**task.known, **plan_in(folder, "job.toml"), "task": task.name})
    assert (tmp_path / "runs" / CSV).read_text(encoding="utf-8") == csv_text(rows, RESULTS)
    assert (tmp_path / "runs" / LINES).read_text(encoding="utf-8") == lines_text(rows, RESULTS)
    assert "tool.length_mm" in rows[3]["cause"]
    page = (tmp_path / "runs" / "index.html").read_text(encoding="utf-8")
    assert f'href="{rows[0]["task"]}/report.html"' in page
    verified = tmp_path / "runs" / rows[0]["task"]
    assert run(["verify", str(verified / "program.csv"), "--job", str(verified / "job.toml")]) == 0


@pytest.mark.slow
def test_an_interrupted_sweep_keeps_what_is_done_and_goes_on(make_job, tmp_path):
    make_job(("spacing_mm = 4", "spacing_mm = 8"))
    lengths = '"tool.length_mm" = { from = 190, to = 200, steps = 6 }'
    (tmp_path / "sweep.toml").write_text(f'job = "job.toml"\n[sweep]\n{lengths}\n', encoding="utf-8")
    command = [sys.executable, "-c", MAIN, "sweep", "sweep.toml", "-o", "runs", "-j", "2"]
    with subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True, start_new_session=True) as going:
        assert going.stderr.readline() == "6 jobs in runs; Ctrl-C keeps what is done\n"
        first = going.stderr.readline()
        os.killpg(going.pid, signal.SIGINT)  # as a terminal does: all processes get it
        rest = going.stderr.read()
        assert going.wait(60) == 130
    assert first.startswith("[1 of 6, ")
    assert "the same command goes on from there" in rest
    rows = [json.loads(line) for line in (tmp_path / "runs" / LINES).read_text(encoding="utf-8").splitlines()]
    assert 1 <= len(rows) < 6
    assert not list((tmp_path / "runs").glob(".unfinished-*"))
    start = time.time()
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    for row in rows:
        assert (tmp_path / "runs" / row["task"] / "row.json").stat().st_mtime < start
    assert len((tmp_path / "runs" / LINES).read_text(encoding="utf-8").splitlines()) == 6
