"""pentapod batch and sweep: what their command says while it waits."""

import time
from types import SimpleNamespace

import pentapod.cli.many.batch
from pentapod.cli.main import run


class SlowJob:
    """A batch of one job, which takes a while."""

    def __len__(self):
        return 1

    def __iter__(self):
        time.sleep(0.2)
        task = SimpleNamespace(name="dome-1", known={})
        yield SimpleNamespace(new=True, status="passed", row={}, task=task, seconds=0.2)

    def close(self):
        """End: nothing is left."""


def test_a_batch_says_that_its_first_jobs_go_on(tmp_path, monkeypatch, capsys):
    """Jobs take minutes, and nothing is known of them before the first one is done."""
    monkeypatch.setattr("pentapod.batch.run.batch", lambda *given, **options: SlowJob())
    monkeypatch.setattr(pentapod.cli.many.batch, "SILENT_S", 0.02)
    assert run(["batch", "dome.toml", "-o", str(tmp_path)]) == 0
    first, *waits, last = capsys.readouterr().err.splitlines()
    assert first.startswith("1 job in ")
    assert "[0 of 1] 0 s so far" in waits
    assert last.endswith("dome-1: passed, 0.2 s")
    assert run(["batch", "dome.toml", "-o", str(tmp_path), "--quiet"]) == 0
    assert capsys.readouterr().err == ""
