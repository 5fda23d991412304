"""pentapod monitor: a log against its program, as a user or a script meets it; logs of LinuxCNC among them."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest

from linuxcnc_runs import play, real
from page_arrays import page_data
from pentapod.cli.main import run
from pentapod.program import write_csv
from pentapod.program.posts.motion import lengths_at
from short_motion import given, motion, post

sys.path.append(str(Path(__file__).parents[1] / "simulate" / "recorded"))
from recorded_logs import paced, with_errors, write_log

UM = 1e-6


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A program of two seconds, and a log with a leg that is 50 µm too long."""
    place = tmp_path_factory.mktemp("monitor")
    program, _ = motion(2.0)
    write_csv(program, place / "program.csv")
    due = np.clip(np.arange(-300, 2200) * 1e-3, 0.0, 2.0)
    legs = with_errors(program, due, offset=np.array([50.0, 0.0, 0.0, 0.0, 0.0]) * UM)
    write_log(place / "log.csv", np.arange(len(due)) * 1e-3, legs)
    return place


def test_monitor_as_text_json_and_page(folder, tmp_path, capsys):
    page = tmp_path / "run.html"
    assert run(["monitor", str(folder / "log.csv"), "-o", str(page)]) == 0
    said = capsys.readouterr()
    assert "at the program's pace, from 0.3000 s of the log on" in said.out
    assert "contour error:" in said.out
    assert re.search(r"offset, um +50 ", said.out)
    assert said.err == "not judged: no job says a tolerance; give --tolerance-mm or --job\n"
    rows = page_data(page.read_text(encoding="utf-8"))["plots"]["rows"]
    assert rows[0]["title"] == "contour error, mm"
    assert [len(row["series"]) for row in rows[-2:]] == [5, 5]
    assert run(["monitor", str(folder / "log.csv"), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["passed"]
    assert said["in_time"]
    assert said["legs"]["offset_um"] == pytest.approx([50.0, 0.0, 0.0, 0.0, 0.0], abs=0.2)
    # A leg that is 50 µm too long moves the tip by some tens of micrometres.
    assert 0.02 < said["contour_error_mm"]["largest"] < 0.3
    assert said["expected_forces_n"]["rms"][0] > 1.0


def test_a_tolerance_decides_the_exit_code(folder, capsys):
    log = str(folder / "log.csv")
    assert run(["monitor", log, "--tolerance-mm", "1", "--axis-tolerance-deg", "1", "-q"]) == 0
    assert capsys.readouterr() == ("", "")
    assert run(["monitor", log, "--tolerance-mm", "0.01", "-q"]) == 1
    assert re.fullmatch(r"the contour error, 0\.\d+ mm, exceeds 0\.01 mm\n", capsys.readouterr().err)
    assert run(["monitor", log, "--axis-tolerance-deg", "0.0001", "-q"]) == 1
    assert "the axis error, " in capsys.readouterr().err


def test_held_runs_are_said_to_be_held(folder, tmp_path, capsys):
    program, _ = motion(2.0)
    times, due = paced(program, [(0.0, 1.0), (1.0, 0.0), (2.0, 0.8)], 4.0)
    log = write_log(tmp_path / "log.csv", times, lengths_at(program, due))
    assert run(["monitor", log, "--program", str(folder), "--tolerance-mm", "0.001"]) == 0
    said = capsys.readouterr().out
    assert re.search(r"held or overridden: pace 0\.00 to 1\.\d\d, median 0\.\d\d", said)
    assert re.search(r"hold at 1\.\d+ s of the log, [01]\.\d+ s of the program, for 0\.\d+ s", said)
    assert "in time:" not in said


def test_halsampler_logs_need_no_titles(folder, tmp_path, capsys):
    program, _ = motion(2.0)
    rows = [f"{number} " + " ".join(f"{1e3 * x:.6f}" for x in row) + " " for number, row in enumerate(program.legs)]
    log = tmp_path / "played.txt"
    log.write_text("\n".join([*rows[:500], "overrun", *rows[530:]]) + "\n")
    assert run(["monitor", str(log), "--program", str(folder), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["lost_rows"] == 30
    assert said["contour_error_mm"]["largest"] < 1e-4
    log.write_text("\n".join(row.split(" ", 1)[1] for row in rows))
    assert run(["monitor", str(log), "--program", str(folder), "--json", "--period-ms", "1"]) == 0
    assert json.loads(capsys.readouterr().out)["start_s"] == pytest.approx(0.0, abs=1e-6)


HEAD = "time_s,leg1_mm,leg2_mm,leg3_mm,leg4_mm,leg5_mm\n"
ROW = "{0:.3f},650.1,651.2,660.3,655.4,670.5\n"
GOOD = "".join(ROW.format(1e-3 * k) for k in range(80))
BAD_LOGS = {
    "empty": ("", [], "the columns have no titles"),
    "columns": (GOOD.replace(",655.4,670.5", ""), [], r"say what they are with --columns"),
    "too few names": (GOOD, ["--columns", "legs_mm"], r"expected 5: leg 1, .*; name each by --columns"),
    "unit": (HEAD.replace("leg2_mm", "leg2_miles") + GOOD, [], r"titles: unknown unit \(got 'leg2_miles'\)"),
    "no unit": (HEAD.replace("leg2_mm", "leg2") + GOOD, [], r"titles: unknown column \(got 'leg2'\).*leg2_mm"),
    "misspelt": (GOOD, ["--columns", "time_s,leg_mm"], r'--columns: unknown column .*did you mean "legs_mm"'),
    "twice": (HEAD.replace("leg2", "leg1") + GOOD, [], "a column is named twice"),
    "missing leg": (HEAD.replace("leg2", "other2") + GOOD, [], "no column has the measured legs"),
    "sixth leg": (GOOD, ["--columns", "leg6_mm"], "the machine has no such leg .* expected 1 to 5"),
    "NaN": (HEAD + GOOD + "0.080,650.1,nan,660.3,655.4,670.5\n", [], r":82: leg2_mm: not a finite number"),
    "cut row": (HEAD + GOOD + "0.080,650.1\n", [], r":82: wrong number of columns \(got 2\); expected 6"),
    "few rows": (HEAD + GOOD[:400], [], "too few rows for a run|wrong number of columns"),
    "backwards": (HEAD + GOOD + ROW.format(0.05), [], ":82: the time does not grow"),
    "overrun": ("overrun\n" + GOOD, ["--columns", "-,legs_mm"], r":1: samples were lost .* halsampler -t"),
    "metres": (HEAD + GOOD, ["--columns", "time_s,legs_m"], r"the legs are \d+ times as long as the program's"),
    "other program": (HEAD + GOOD, [], "not a run of this program"),
}


@pytest.mark.parametrize("case", BAD_LOGS.values(), ids=BAD_LOGS)
def test_bad_logs_have_one_line(folder, tmp_path, capsys, case):
    text, options, words = case
    (tmp_path / "log.csv").write_text(text)
    assert run(["monitor", str(tmp_path / "log.csv"), "--program", str(folder / "program.csv"), *options]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1, said
    assert re.search(words, said), said
    assert "log.csv" in said


def test_a_missing_program_or_log_is_named(folder, tmp_path, capsys):
    (tmp_path / "log.csv").write_text(HEAD + GOOD)
    assert run(["monitor", str(tmp_path / "log.csv")]) == 2
    assert "no program is beside the log; name it, or its run, by --program" in capsys.readouterr().err
    assert run(["monitor", str(tmp_path / "none.csv"), "--program", str(folder)]) == 2
    assert "none.csv" in capsys.readouterr().err
    other = ["--program", str(folder), "--machine", "steep"]
    assert run(["monitor", str(folder / "log.csv"), *other]) == 2
    assert "not the machine that the program was made for" in capsys.readouterr().err


@pytest.mark.slow
def test_a_run_takes_job_tolerance_and_cuts_from_its_folder(make_job, tmp_path, capsys):
    job = make_job()
    assert run(["plan", str(job), "-o", str(tmp_path / "out"), "-q"]) == 0
    lines = (tmp_path / "out" / "program.csv").read_text(encoding="utf-8").splitlines()
    (tmp_path / "log.csv").write_text("\n".join(line for line in lines if not line.startswith("#")) + "\n")
    assert run(["monitor", str(tmp_path / "log.csv"), "--program", str(tmp_path / "out"), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["tolerances"]["contour_error"] > 0.0
    assert said["contour_error_mm"]["largest"] < 2e-4
    assert said["contour_error_mm"]["largest_on_cuts"] <= said["contour_error_mm"]["largest"]


@pytest.mark.slow
@real
def test_setpoints_that_linuxcnc_played_are_those_of_the_program(tmp_path, capsys):
    what = given(duration=1.5)
    post(what, "linuxcnc", tmp_path)
    write_csv(what.program, tmp_path / "program.csv")
    play(tmp_path / "stream")
    log, columns = str(tmp_path / "stream" / "played.txt"), "number,commands_mm,legs_mm"
    program = str(tmp_path / "program.csv")
    assert run(["monitor", log, "--program", program, "--columns", columns, "--tolerance-mm", "0.001", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["complete"]
    assert said["in_time"]
    assert said["lost_rows"] == 0
    assert said["following_error_mm"]["largest"] == 0.0
    assert said["contour_error_mm"]["largest"] < 2e-4
    assert said["tip_error_in_time_mm"]["largest"] < 2e-4


@pytest.mark.slow
@real
def test_the_legs_as_axes_in_linuxcnc_keep_the_path(tmp_path, capsys):
    what = given(duration=3.0)
    post(what, "linuxcnc", tmp_path)
    write_csv(what.program, tmp_path / "program.csv")
    play(tmp_path / "trivkins")
    log, columns = str(tmp_path / "trivkins" / "played.txt"), "number,legs_mm,-"
    assert run(["monitor", log, "--program", str(tmp_path / "program.csv"), "--columns", columns, "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["complete"]
    assert said["contour_error_mm"]["largest"] < 0.05
