"""The command line as a user or a script meets it: real processes' exit codes, stdout, stderr."""

from __future__ import annotations

import io
import json
import os
import re
import shutil
import signal
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from pentapod.cli import verbs as entry
from pentapod.cli.commands.kinematics import leg_names
from pentapod.cli.main import run
from pentapod.cli.verbs import VERBS
from pentapod.machine import Machine
from pentapod.program import read_csv, write_csv

PENTAPOD = [sys.executable, "-c", "from pentapod.cli.main import main; main()"]
TOO_FAR = ("position_mm = [", "position_mm = [1000.0, 0, 700] # [")


def test_plan_and_verify(make_job, tmp_path, capsys):
    job, out = make_job(), tmp_path / "out"
    assert run(["plan", str(job), "-o", str(out)]) == 0
    said = capsys.readouterr()
    assert "part.stl: 288 facets" in said.out
    assert "verdict: passed" in said.out
    progress = re.compile(r"[a-z ]+( \d+ %)?(, \d+ s so far|, about \d+ s left)?(: .*)?")
    assert all(progress.fullmatch(line) for line in said.err.splitlines()), said.err
    assert {p.name for p in out.iterdir()} == {
        "program.csv",
        "verdict.json",
        "report.html",
        "sheet.html",
        "plan.npz",
        "manifest.json",
    }
    assert run(["verify", str(out / "program.csv"), "--job", str(job)]) == 0
    assert "verdict: passed" in capsys.readouterr().out
    assert run(["verify", str(out / "program.csv"), "--job", str(job), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads((out / "verdict.json").read_text())


def test_verify_fails_a_program_that_was_changed(usual_run, make_job, tmp_path, capsys):
    job, out = usual_run[0].path, shutil.copytree(usual_run[1], tmp_path / "out")
    program = read_csv(out / "program.csv")
    legs = program.legs.copy()
    legs[len(legs) // 2 :, 2] += 1e-4
    write_csv(type(program)(program.period, legs, program.interpolation, program.component, program.placement,
                            program.provenance), out / "program.csv")  # fmt: skip
    assert run(["verify", str(out / "program.csv"), "--job", str(job)]) == 1
    told = capsys.readouterr()
    assert "FAIL  tip deviation" in told.out
    assert "verdict: FAILED" in told.out
    assert "another job" not in told.err
    assert (
        run(["verify", str(out / "program.csv"), "--job", str(make_job(("cut_mm_min = 3000", "cut_mm_min = 2900")))])
        == 1
    )
    told = capsys.readouterr()
    assert "FAIL  job" in told.out
    assert "was made from another job than" in told.err


def test_json(make_job, tmp_path, capsys):
    job, out = make_job(("stepover_mm = 15\nspacing_mm = 4", "stepover_mm = 30\nspacing_mm = 8")), tmp_path / "out"
    assert run(["plan", str(job), "-o", str(out), "--json"]) == 0
    said = capsys.readouterr()
    content = json.loads(said.out)
    assert content["passed"] is True
    assert set(content["seconds"]) >= {"placement", "timing", "verify"}
    assert said.err == ""


def test_a_refusal_is_exit_code_1_with_the_reason(make_job, tmp_path, capsys):
    job, out = make_job(TOO_FAR), tmp_path / "out"
    assert run(["plan", str(job), "-o", str(out), "--advice", "0"]) == 1
    said = capsys.readouterr()
    assert said.err.startswith("refused: placement: ")
    assert said.err.count("\n") == 1
    assert " mm at waypoints " in said.err
    assert not (out / "program.csv").exists()
    assert (out / "report.html").exists()


BAD_MESHES = {
    "empty": b"",
    "text": b"this is a letter, not a mesh\n" * 9,
    "truncated": None,
    "zero area": "flat",
    "NaN": "nan",
}


def mesh(kind: str) -> bytes:
    from pentapod.cli.commands.new import dome_stl

    whole = dome_stl(cells=12)
    if kind == "truncated":
        return whole[: len(whole) // 2]
    facets = np.frombuffer(whole, dtype=[("n", "<f4", 3), ("c", "<f4", (3, 3)), ("s", "<u2")], offset=84).copy()
    if kind == "zero area":
        facets["c"] = 0.0
    elif kind == "NaN":
        facets["c"][5, 1, 1] = np.nan
    else:
        content = BAD_MESHES[kind]
        assert isinstance(content, bytes)
        return content
    return whole[:84] + facets.tobytes()


@pytest.mark.parametrize("kind", BAD_MESHES)
def test_bad_meshes(kind, make_job, tmp_path, capsys):
    bad_input(["plan", str(make_job(mesh=mesh(kind))), "-o", str(tmp_path / "out")], tmp_path, capsys)


BAD_JOBS = [
    ('"part.stl"', '"other.stl"'),
    ('unit = "mm"\n', ""),
    ('unit = "mm"', 'unit = "yard"'),
    ("stepover_mm", "stepovr_mm"),
    ("stepover_mm = 15", "stepover_mm = -15"),
    ("cut_mm_min = 3000", "cut_mm_min = 0"),
    ("path_mm = 0.05", "path_mm = 60"),
    ("[axis]", "[axis"),
    ('"desk"', '"dsek"'),
    ('name = "desk"', 'file = "part.stl"'),
    ("diameter_mm = 10", "diameter_mm = 10\nlength_mm = 1"),
    ("[180, 0, 0]", '[180, 0, "x"]'),
]


@pytest.mark.parametrize("change", BAD_JOBS, ids=lambda c: c[1].strip() or "missing")
def test_bad_jobs(change, make_job, tmp_path, capsys):
    bad_input(["plan", str(make_job(change)), "-o", str(tmp_path / "out")], tmp_path, capsys)


def test_a_machine_with_four_legs(make_job, tmp_path, capsys):
    from importlib import resources

    text = (resources.files("pentapod.machine") / "library" / "desk.toml").read_text()
    start = text.index("base_mm")
    first = text.index("[", text.index("[", start) + 1)
    end = text.index("]", first) + 1
    cut = text[:first] + text[end:].lstrip(", \n")
    (tmp_path / "four.toml").write_text(cut)
    job = make_job(('name = "desk"', 'file = "four.toml"'))
    line = bad_input(["plan", str(job), "-o", str(tmp_path / "out")], tmp_path, capsys)
    assert "base_mm" in line
    assert run(["machine", "check", str(tmp_path / "four.toml")]) == 2


def test_folder_that_cannot_be_written(make_job, tmp_path, capsys):
    (tmp_path / "file").write_text("")
    bad_input(["plan", str(make_job()), "-o", str(tmp_path / "file" / "out")], tmp_path, capsys)


@pytest.mark.parametrize(
    "arguments",
    [
        ["plan", "nowhere.toml"],
        ["verify", "nowhere.csv", "--job", "nowhere.toml"],
        ["verify", "nowhere.csv"],
        ["plan"],
        ["plant", "x"],
        ["plan", "x", "--nonsense"],
        ["ik", "1", "2", "3"],
        ["ik", "1", "2", "3", "0", "0", "0"],
        ["ik", "1", "2", "3", "0", "0", "nan"],
        ["fk", "1", "2", "3", "4", "5", "-c", "+"],
        ["ik", "1_0", "2", "3", "0", "0", "1"],
        ["fk", "1", "2", "3", "4", "x"],
        ["machine", "check", "nowhere"],
        ["plan", "."],
        ["toolpath", "nowhere.toml", "-o", "x.npz"],
    ],
)
def test_bad_arguments(arguments, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    bad_input(arguments, tmp_path, capsys)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["plna", "x"], 'no such verb: "plna"; did you mean "plan"? (pentapod --help)'),
        (["plan"], "JOB"),
        (["plan"], "(pentapod plan --help)"),
        (["post", "x.csv", "--to", "pvt"], "(pentapod post --help)"),
        (["machine", "chek"], "(pentapod machine --help)"),
        (["view", "out", "--port", "80_80"], "'80_80' is not a whole decimal number"),
        (["simulate", "x.csv", "--job", "j.toml", "--within", "1_0"], "'1_0' is not a finite decimal number"),
        (["simulate", "x.csv", "--job", "j.toml", "--seed", "٣"], "is not a whole decimal number"),
        (["simulate", "x.csv", "--job", "j.toml", "--base-error", "1", "0", "1_0", "0"], "'1_0' is not a finite"),
        (["plan", "."], ".: this is a folder; expected a job file"),
    ],
)
def test_mistyped_verbs_and_options_name_the_nearest(arguments, words, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert words in bad_input(arguments, tmp_path, capsys)


def bad_input(arguments: list[str], folder: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """Exit code 2, one line on stderr, nothing on stdout, nothing written."""
    before = {p: p.stat().st_mtime_ns for p in folder.rglob("*")}
    capsys.readouterr()
    assert run(arguments) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("error: ")
    assert said.err.count("\n") == 1
    assert "Traceback" not in said.err
    assert {p: p.stat().st_mtime_ns for p in folder.rglob("*")} == before
    return said.err


def test_exit_code_3_is_an_error_of_pentapod(monkeypatch, capsys):
    def broken() -> None:
        raise ZeroDivisionError("one\ntwo")

    monkeypatch.setattr(entry.cli, "main", lambda **_: broken())
    assert run(["plan"]) == 3
    line = capsys.readouterr().err
    assert line.startswith("error: ZeroDivisionError: one two")
    assert "--debug" in line
    with pytest.raises(ZeroDivisionError):
        run(["plan", "--debug"])


def test_debug_shows_the_traceback_of_bad_input_too():
    from pentapod.base.errors import JobError

    with pytest.raises(JobError):
        run(["plan", "nowhere.toml", "--debug"])


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_has_help(verb, capsys):
    assert run([verb, "--help"]) == 0
    assert f"pentapod {verb}" in capsys.readouterr().out


def test_new_gives_a_job_with_every_key(tmp_path, capsys):
    """The tutorial, whose commands are run as written, plans it."""
    folder = tmp_path / "mine"
    assert run(["new", str(folder)]) == 0
    assert "pentapod plan" in capsys.readouterr().out
    text = (folder / "job.toml").read_text()
    from pentapod.job.schema.tables import JobTables, table_model

    for table in JobTables.model_fields:
        assert f"[{table}]" in text
        for key in table_model(table).model_fields:
            assert f"{key} = " in text
    assert run(["new", str(folder)]) == 2


def test_toolpath(make_job, tmp_path, capsys):
    job, file = make_job(), tmp_path / "path.npz"
    assert run(["toolpath", str(job), "-o", str(file), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    with np.load(file) as arrays:
        assert len(arrays["toolpath.tips_mm"]) == said["waypoints"]
        assert len(arrays["toolpath.segment_kinds"]) == said["segments"]
        steps = np.linalg.norm(np.diff(arrays["toolpath.tips_mm"], axis=0), axis=1)
        assert steps.sum() == pytest.approx(sum(said["length_mm"].values()))
        assert np.allclose(np.linalg.norm(arrays["toolpath.axes"], axis=1), 1.0)
    assert run(["toolpath", str(job), "-o", str(tmp_path / "path.xyz")]) == 2


def test_machine_list_and_check(capsys):
    assert run(["machine", "list", "--json"]) == 0
    assert "desk" in json.loads(capsys.readouterr().out)
    assert run(["machine", "check", "desk"]) == 0
    assert "desk" in capsys.readouterr().out
    assert run(["machine", "check", "desk", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["passed"] is True


def test_fk_undoes_ik(capsys):
    x, y, z = Machine.load("desk").work.centre * 1e3
    pose = [x, y + 10.0, z, 0.1, -0.2, -1.0]
    assert run(["ik", *map(str, pose), "--json"]) == 0
    legs = json.loads(capsys.readouterr().out)
    assert legs["within_strokes"] is True
    numbers = [str(legs[f"leg{k}_mm"]) for k in range(1, 6)]
    assert run(["fk", *numbers, "-c", legs["component"], "--json"]) == 0
    back = json.loads(capsys.readouterr().out)
    assert [back[name] for name in ("x_mm", "y_mm", "z_mm")] == pytest.approx(pose[:3], abs=1e-6)
    axis = np.array(pose[3:]) / np.linalg.norm(pose[3:])
    assert [back[name] for name in "ijk"] == pytest.approx(axis, abs=1e-9)
    assert back["singularity_mm"] > 10
    assert run(["fk", *numbers, "--json"]) == 0
    modes = json.loads(capsys.readouterr().out)
    assert [mode["component"] for mode in modes] == ["++", "+-", "-+", "--"]
    assert run(["fk", "600", "600", "600", "600", "6000"]) == 1


def test_ik_and_fk_as_a_pipe():
    x, y, z = Machine.load("desk").work.centre * 1e3
    poses = "x_mm,y_mm,z_mm,i,j,k\n" + "".join(f"{x + d},{y},{z},0,0,-1\n" for d in range(5))
    ik = subprocess.run([*PENTAPOD, "ik"], input=poses, capture_output=True, text=True, check=True)
    rows = [line.split(",") for line in ik.stdout.splitlines()]
    legs = "\n".join(",".join(row[:5]) for row in rows)
    fk = subprocess.run([*PENTAPOD, "fk", "-c", rows[1][5]], input=legs, capture_output=True, text=True, check=True)
    back = np.array([[float(v) for v in line.split(",")[2:8]] for line in fk.stdout.splitlines()[1:]])
    assert back[:, 0] == pytest.approx(x + np.arange(5), abs=1e-5)
    bad = subprocess.run([*PENTAPOD, "ik"], input="x,y\n1,2\n", capture_output=True, text=True, check=False)
    assert bad.returncode == 2
    assert bad.stderr.startswith("error: stdin:1: wrong header")


@pytest.mark.parametrize(
    ("row", "words"),
    [("600", "wrong count of numbers (got '600')"), ("1,2,3,4", "wrong count"), ("1,2,3,4,5,6", "wrong count"),
     ("1,2,x,4,5", "not a row of finite numbers"), ("1,2,nan,4,5", "not a row"), ("1,,3,4,5", "not a row")],
)  # fmt: skip
def test_bad_rows_in_a_pipe_are_told_by_line(row, words, monkeypatch, capsys):
    """One number alone as well: it is no row of five equal legs."""
    monkeypatch.setattr(
        "sys.stdin", io.StringIO(f"{','.join(leg_names(Machine.load('desk').robot))}\n600,600,600,600,600\n\n{row}\n")
    )
    assert run(["fk"]) == 2
    said = capsys.readouterr()
    assert said.err.startswith("error: stdin:4: ")
    assert words in said.err
    assert not said.out


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_ctrl_c_in_the_search_for_a_placement_goes_on_with_the_best_so_far(make_job, tmp_path, capsys, monkeypatch):
    path = make_job()
    path.write_text(path.read_text().split("[placement]")[0])

    @contextmanager
    def interrupting(**_):
        def progress(stage: str, fraction: float, note: str = "") -> None:
            if "best margin so far" in note:
                signal.raise_signal(signal.SIGINT)

        yield progress

    monkeypatch.setattr("pentapod.cli.commands.plan.progress_bar", interrupting)
    assert run(["plan", str(path), "-o", str(tmp_path / "out"), "--explain"]) == 0
    said = capsys.readouterr().out
    assert "placement: the one with the most room to the limits, the search interrupted after" in said
    assert "verdict: passed" in said
    assert "more limits have larger margins" in said  # the table of limits


EXPLAIN = ["--explain", "--advice", "0"]


@pytest.mark.slow  # in the fast lane: the search that Ctrl-C ends prints the table, too
def test_explain_prints_the_table_of_limits(make_job, tmp_path, capsys):
    out = ["-o", str(tmp_path / "out"), *EXPLAIN]
    assert run(["plan", str(make_job()), *out]) == 0
    table = capsys.readouterr().out
    rows = re.findall(r"^(\S.*?) {2,}(\d\.\d{4}) +([\d.e+]+) (mm|deg) +(\d+) ", table, re.M)
    margins = [float(row[1]) for row in rows]
    assert len(rows) >= 12
    assert margins == sorted(margins)
    assert re.search(r"^limits on the speed, the most costly first\n  leg \d jerk-limited for ", table, re.M)
    rest = int(re.search(r"^(\d+) more limits have larger margins", table, re.M)[1])
    assert run(["plan", str(make_job()), *out, "--json"]) == 0
    limits = json.loads(capsys.readouterr().out)["limits"]
    assert [limit["margin"] for limit in limits][:12] == pytest.approx(margins[:12], abs=1e-4)
    assert len(limits) == len(margins) + rest
    assert all(limit["share"] == 0.0 for limit in limits[len(margins) :])
    assert sum(limit["share"] for limit in limits) == pytest.approx(1.0)


def test_explain_prints_the_limits_that_a_refused_job_exceeds(make_job, tmp_path, capsys):
    assert run(["plan", str(make_job(TOO_FAR)), "-o", str(tmp_path / "out"), *EXPLAIN]) == 1
    refused = capsys.readouterr().out
    assert "limit exceeded" in refused
    assert re.search(r"too long +\d+ mm +\d+", refused)
