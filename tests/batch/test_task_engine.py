"""Tasks on Dask's workers: each once, whatever dies."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
import stub_tasks

from pentapod.base.errors import InputError
from pentapod.batch import Engine, EngineOptions, Store, Task
from pentapod.batch.table import csv_text, lines_text
from pentapod.batch.tasks.engine import LOG, _Rounds

HERE = Path(__file__).parent


def table(rows):
    return csv_text(rows, ["status"]) + lines_text(rows, ["status"])


def in_order(made, found):
    by_name = {done.task.name: done.columns for done in found}
    return [by_name[task.name] for task in made]


def test_task_names_follow_from_function_arguments_files_and_inputs_alone(tmp_path):
    (tmp_path / "a.bin").write_bytes(b"one")
    (tmp_path / "b.bin").write_bytes(b"two")
    store = Store(tmp_path / "runs")
    a, b = (store.keep(tmp_path / name) for name in ("a.bin", "b.bin"))
    (tmp_path / "a.bin").write_bytes(b"changed later")
    assert (tmp_path / "runs" / "inputs" / a.name).read_bytes() == b"one"
    assert store.keep(tmp_path / "a.bin") != a
    (store.folder / ".0123456789ab").write_bytes(b"cut off by a kill")
    with Engine(tmp_path / "runs"):
        assert sorted(path.stem[0] for path in store.folder.iterdir()) == ["a", "a", "b"]

    def name(**other):
        given = {"arguments": {"x": 1}, "files": {"job.toml": "a"}, "inputs": (a,), **other}
        return Task.of("t", stub_tasks.work, **given).name

    names = [name(), name(arguments={"x": 2}), name(files={"job.toml": "b"}), name(inputs=(b,)), name(inputs=(a, b))]
    assert len(set(names)) == len(names)
    assert name(known={"column": 1}) == names[0]
    with pytest.raises(InputError, match="cannot be imported"):
        Task.of("t", lambda folder: {"status": "passed"})


def test_engine_does_each_task_once_and_tells_what_crashed(tmp_path):
    how = {1: "no number", 2: "segfault", 3: "large", 4: "error"}
    log, out, options = tmp_path / "log", tmp_path / "runs", EngineOptions(memory=4e8, tries=1, alone=1)
    made = stub_tasks.tasks(6, log, how=how)
    with Engine(out, workers=1, options=options) as engine:
        found = list(engine.run([*made, made[0]]))
        with pytest.raises(InputError, match="another run is writing into this folder"), Engine(out):
            pass
    rows = in_order(made, found)
    assert [row["status"] for row in rows] == ["passed", *["crashed"] * 4, "passed"]
    assert rows[1]["cause"].startswith("ValueError: Out of range float values")
    assert "SIGSEGV" in rows[2]["cause"]
    assert rows[3]["cause"] == "out of memory: more than 400 MB"
    assert rows[4]["cause"] == "KeyError: 4"
    assert sorted(path.name for path in out.iterdir()) == sorted(
        [LOG, *(task.name for task in made if task.arguments["number"] not in how)]
    )
    log_lines = [json.loads(line) for line in (out / LOG).read_text(encoding="utf-8").splitlines()]
    assert any("stub_tasks.py" in line.get("trace", "") for line in log_lines)
    before = stub_tasks.begun(log)
    finished = [task for task in made if task.arguments["number"] not in how]
    with Engine(out) as engine:  # nothing is missing: no worker is started
        again = list(engine.run(finished))
    assert table(in_order(finished, again)) == table([rows[task.arguments["number"]] for task in finished])
    assert stub_tasks.begun(log) == before
    assert not any(done.new for done in again)


def test_engine_asks_for_what_is_missing(tmp_path, monkeypatch):
    made = stub_tasks.tasks(2, tmp_path / "log")
    with Engine(tmp_path / "a", options=EngineOptions(most=1)) as engine, pytest.raises(InputError, match="at most 1"):
        list(engine.run(made))
    (tmp_path / "b" / made[0].name).mkdir(parents=True)
    with Engine(tmp_path / "b") as engine, pytest.raises(InputError, match=r"expected row\.json; remove it"):
        list(engine.run(made))
    wrong = pytest.raises(InputError, match=r"not the address of a scheduler \(got 'nonsense'\)")
    with Engine(tmp_path / "c", scheduler="nonsense") as engine, wrong:
        list(engine.run(made))
    monkeypatch.setitem(sys.modules, "distributed", None)
    with Engine(tmp_path / "c") as engine, pytest.raises(InputError, match=r'pip install "pentapod\[batch\]"'):
        list(engine.run(made))
    assert not (tmp_path / "c").exists()


@pytest.mark.slow
def test_a_task_that_kills_its_worker_does_not_condemn_others(tmp_path, monkeypatch):
    waits, most, submit, answer = [], [], Engine.submit, _Rounds._answer
    monkeypatch.setattr(Engine, "submit", lambda *given: (waits.append(1), most.append(len(waits)), submit(*given))[2])
    monkeypatch.setattr(_Rounds, "_answer", lambda *given: (waits.pop(), answer(*given))[1])
    made = stub_tasks.tasks(12, tmp_path / "log", seconds=0.1, how={3: "kills its worker", 7: "kills its worker"})
    with Engine(tmp_path / "runs", workers=2) as engine:
        rows = in_order(made, list(engine.run(made)))
    assert [row["status"] for row in rows] == ["crashed" if k in (3, 7) else "passed" for k in range(12)]
    kept = [task for task in made if task.arguments["number"] not in (3, 7)]
    assert stub_tasks.done_twice(kept, tmp_path / "runs", tmp_path / "log") == []
    assert max(most) == 2  # as many as there are workers: none waits at one that dies


@pytest.mark.slow
def test_workers_of_another_file_system_get_inputs_and_send_folders_by_content(tmp_path):
    (tmp_path / "large.bin").write_bytes(bytes(range(256)) * 4000)
    store = Store(tmp_path / "runs")
    made = stub_tasks.tasks(8, tmp_path / "log", seconds=0.2, how=dict.fromkeys(range(8), "reads"),
                            inputs=(store.keep(tmp_path / "large.bin"),))  # fmt: skip
    with elsewhere(tmp_path) as address, Engine(tmp_path / "runs", scheduler=address) as engine:
        rows = in_order(made, list(engine.run(made)))
    assert {row["read"] for row in rows} == {1_024_000}
    for task in made:
        number = task.arguments["number"]
        assert (tmp_path / "runs" / task.name / "result.txt").read_text() == f"{number}\n"
    assert stub_tasks.done_twice(made, tmp_path / "runs", tmp_path / "log") == []


class elsewhere:  # noqa: N801  used like a function
    """A scheduler, and two workers that do not see the folder of the batch."""

    def __init__(self, folder, workers=2):
        self.folder, self.count, self.started = folder, workers, []

    def __enter__(self):
        script = "import sys; sys.path.insert(0, {!r}); from far_workers import {}; {}"
        start = script.format(str(HERE), "scheduler", "scheduler()")
        self._start(start)
        address = self.started[0].stdout.readline().strip()
        for k in range(self.count):
            self._start(script.format(str(HERE), "worker", f"worker({address!r}, {str(self.folder / f'far-{k}')!r})"))
        return address

    def __exit__(self, *failure):
        for process in reversed(self.started):
            process.kill()
            process.wait()
            process.stdout.close()

    def _start(self, code):
        self.started.append(subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True))
