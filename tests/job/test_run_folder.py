"""The folder of a run: killed at any moment, run twice at once, full disk; never files of two runs in it."""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from pentapod.base.errors import InputError
from pentapod.base.files import atomic_write, sha256_of
from pentapod.job.artefacts import write_json
from pentapod.job.run_folder import check_run, staged

posix = pytest.mark.skipif(os.name != "posix", reason="signals and locks of POSIX")
OLD = ("program.csv", "plan.npz", "report.html", "verdict.json")
SET_UPS = ("setup-1/program.csv", "setup-1/verdict.json", "setup-2/program.csv", "verdict.json", "report.html")


def fill(folder: Path, mark: str, names: tuple[str, ...]) -> None:
    """A run that writes these files, each with the mark of the run."""
    with staged(folder) as staging:
        for name in names:
            (staging / name).parent.mkdir(exist_ok=True)
            (staging / name).write_text(f"{mark} {name}")


def content(folder: Path) -> dict[str, str]:
    """Every file but manifests, by its name within the folder."""
    files = (path for path in folder.rglob("*") if path.is_file() and path.name != "manifest.json")
    return {path.relative_to(folder).as_posix(): path.read_text() for path in files}


def marks(folder: Path) -> set[str]:
    """The runs that the files which can be seen are of."""
    return {text.split()[0] for name, text in content(folder).items() if not name.startswith(".")} - {"mine"}


def test_the_manifest_names_every_file(tmp_path):
    fill(tmp_path, "old", (*SET_UPS, "plan.npz"))
    entries = json.loads((tmp_path / "manifest.json").read_text())["files"]
    assert set(entries) == {*SET_UPS, "plan.npz", "setup-1/manifest.json", "setup-2/manifest.json"}
    for name, entry in entries.items():
        assert entry == {"sha256": sha256_of(tmp_path / name), "bytes": (tmp_path / name).stat().st_size}
    for folder in (tmp_path, tmp_path / "setup-1", tmp_path / "setup-2"):
        check_run(folder)


def test_the_manifest_is_the_same_for_the_same_files(tmp_path):
    for name in ("a", "b"):
        fill(tmp_path / name, "same", SET_UPS)
    assert (tmp_path / "a" / "manifest.json").read_bytes() == (tmp_path / "b" / "manifest.json").read_bytes()


@pytest.mark.parametrize("name", ["report.html", "setup-2/program.csv"])
@pytest.mark.parametrize("how", ["changed", "gone"])
def test_run_folder_with_mixed_or_missing_files_is_an_error(name, how, tmp_path):
    fill(tmp_path, "old", SET_UPS)
    if how == "gone":
        (tmp_path / name).unlink()
    else:
        (tmp_path / name).write_text("other " + name)
    with pytest.raises(InputError, match="of different runs") as caught:
        check_run(tmp_path)
    assert name in str(caught.value)


def test_run_folder_keeps_files_of_the_user(tmp_path):
    fill(tmp_path, "old", SET_UPS)
    own = ("notes.txt", "setup-1/notes.txt", "setup-2/replanned/program.csv", ".unfinished-mine/a", "posts/program.csv")
    for name in own:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("mine " + name)
    fill(tmp_path, "new", OLD)
    assert content(tmp_path) == {name: f"new {name}" for name in OLD} | {name: f"mine {name}" for name in own}
    check_run(tmp_path)


def test_a_folder_with_a_name_of_the_run_is_told_and_nothing_changes(tmp_path):
    fill(tmp_path, "old", ("program.csv",))
    (tmp_path / "report.html").mkdir()
    with pytest.raises(InputError, match=r"report\.html.*a folder has its name"):
        fill(tmp_path, "new", OLD)
    assert content(tmp_path) == {"program.csv": "old program.csv"}


KILLED = """
import os, shutil, signal, sys
from pathlib import Path
from test_run_folder import OLD, SET_UPS, check_run, content, fill, marks, staged

where, before, after = Path(sys.argv[1]), *(globals()[name] for name in sys.argv[2:4])
EVENTS = ("open", "os.mkdir", "os.rename", "os.remove", "os.rmdir", "os.listdir", "os.scandir", "shutil.rmtree")

def killed_at(count, work):
    '''Do the work in a child that dies just before its file system call of this number; say whether it got there.'''
    child = os.fork()
    if child == 0:
        left = [count]
        def hook(event, arguments):
            if event in EVENTS and arguments and str(arguments[0]).startswith(str(where)):
                left[0] -= 1
                if left[0] == 0:
                    os.kill(os.getpid(), signal.SIGKILL)
        sys.addaudithook(hook)
        work()
        os._exit(0)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == -signal.SIGKILL

count, seen = 0, set()
while True:
    count += 1
    folder = where / str(count)
    fill(folder, "old", before)
    (folder / "notes.txt").write_text("mine")
    dead = killed_at(count, lambda: fill(folder, "new", after))
    there = marks(folder)
    assert len(there) <= 1, (count, sorted(content(folder).items()))
    assert (folder / "notes.txt").exists()
    whole = (folder / "manifest.json").exists()
    seen.add((*there, whole))
    # A second kill, of whoever opens the folder next; then a third start that lives.
    if dead and not whole and count % 5 == 0:
        for again in range(1, 200, 2):
            shutil.copytree(folder, where / "again")
            repeated = killed_at(again, lambda: check_run(where / "again"))
            assert len(marks(where / "again")) <= 1, (count, again)
            check_run(where / "again")
            assert marks(where / "again") == {"new"}, (count, again)
            shutil.rmtree(where / "again")
            if not repeated:
                break
    check_run(folder)
    told = {n: t for n, t in content(folder).items() if not n.startswith(".") and n != "notes.txt"}
    runs = [{n: f"{mark} {n}" for n in names} for mark, names in (("old", before), ("new", after))]
    assert told in runs, (count, told)
    fill(folder, "last", after)
    assert marks(folder) == {"last"}
    assert not [p.name for p in folder.iterdir() if p.name.startswith(".")], count
    if not dead:
        break
assert {("old", True), ("new", True)} <= seen
assert count > 20
print("kills", count)
"""


@posix
@pytest.mark.parametrize(("before", "after"), [
    ("OLD", "OLD"),
    pytest.param("SET_UPS", "OLD", marks=pytest.mark.slow),
    pytest.param("OLD", "SET_UPS", marks=pytest.mark.slow),
])  # fmt: skip
def test_run_folder_killed_at_any_file_system_call(before, after, tmp_path):
    """Old run or new one, never files of both; what is left to do is done by whoever comes next."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), *sys.path])}
    done = subprocess.run(
        [sys.executable, "-c", KILLED, str(tmp_path), before, after], env=environment, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]


@posix
def test_a_second_run_on_the_same_folder_is_refused(tmp_path):
    with staged(tmp_path / "out") as staging:
        (staging / "program.csv").write_text("first")
        with pytest.raises(InputError, match="another run is writing into this folder") as caught:
            fill(tmp_path / "out", "second", OLD)
        assert f"process {os.getpid()}" in str(caught.value)
        assert staging.is_dir()
    assert content(tmp_path / "out") == {"program.csv": "first"}
    fill(tmp_path / "out", "third", OLD)


@posix
def test_remains_of_killed_runs_are_completed_or_removed(tmp_path):
    code = textwrap.dedent(f"""
        import os, signal
        from pathlib import Path
        from pentapod.job.run_folder import staged
        with staged(Path({str(tmp_path)!r})) as staging:
            (staging / "program.csv").write_text("half")
            os.kill(os.getpid(), signal.SIGKILL)
    """)
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == -signal.SIGKILL
    (tmp_path / ".unfinished-ab12cd3_").mkdir()  # as earlier versions named theirs
    assert len(list(tmp_path.glob(".unfinished-*"))) == 2
    fill(tmp_path, "new", OLD)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([*OLD, "manifest.json"])


@pytest.mark.parametrize("error", [KeyboardInterrupt, SystemExit, ValueError])
def test_an_interruption_leaves_no_folder_that_was_not_there(error, tmp_path):
    def stopped():
        with staged(tmp_path / "deep" / "out") as staging:
            (staging / "program.csv").write_text("half")
            raise error

    with pytest.raises(error):
        stopped()
    assert list(tmp_path.iterdir()) == []


@posix
def test_a_full_disk_names_the_file(tmp_path):
    """A file that may not grow is to Python what a full disk is."""
    fill(tmp_path, "old", OLD)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)

    def fails():
        with staged(tmp_path) as staging:
            write_json({"long": "x" * 100_000}, staging / "verdict.json")

    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, limits[1]))
        with pytest.raises(InputError) as caught:
            fails()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, ignored)
    assert str(caught.value).startswith(f"{tmp_path / 'verdict.json'}: cannot be written: file too large")
    assert marks(tmp_path) == {"old"}
    check_run(tmp_path)


def test_no_space_left_names_the_file(tmp_path):
    def fails():
        with atomic_write(tmp_path / "program.csv") as temporary:
            temporary.write_text("half")
            raise OSError(28, "No space left on device")

    with pytest.raises(InputError, match=r"program\.csv: cannot be written: no space left on device; expected room"):
        fails()
    assert list(tmp_path.iterdir()) == []
