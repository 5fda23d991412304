"""The LinuxCNC player: with any override the legs keep their limits, by differences of what it plays, and the path."""

from __future__ import annotations

import dataclasses
import json
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

from compiled_kinematics import COMPILER, STRICT, compiled
from linuxcnc_runs import built, play
from pentapod.base.errors import ProgramError
from pentapod.cli.main import run
from pentapod.machine import Machine
from pentapod.program import read_csv, write_csv
from pentapod.program.posts import PostInput, read_post
from pentapod.program.posts.linuxcnc.player import COEFFICIENTS, player_files, spline_coefficients
from pentapod.program.posts.motion import lengths_at
from pentapod.simulate.paced import Player
from played_overrides import fast_program, off_path, played, random_overrides, shares, there_and_back
from short_motion import given, motion, post

pytestmark = compiled


@pytest.fixture(scope="module")
def fast():
    """A program at 98 % of the accelerations, forth and back, on a machine that hardly limits the jerk."""
    program, machine = fast_program()
    return program, machine, Player(program, machine)


@pytest.fixture(scope="module")
def jerky():
    """A program that uses 97 % of its jerk, forth and back."""
    program, machine = motion(1.0)
    jerk = np.abs(np.diff(program.legs, 3, axis=0)).max() / program.period**3 / 0.97
    machine = dataclasses.replace(machine, legs=dataclasses.replace(machine.legs, max_jerk=np.full(5, jerk)))
    source = dataclasses.replace(program.provenance, machine_digest=machine.digest)
    program = there_and_back(dataclasses.replace(program, provenance=source), 6)
    return program, machine, Player(program, machine)


@pytest.fixture(params=["fast", "jerky"])
def case(request):
    return request.getfixturevalue(request.param)


def test_coefficients_are_those_of_the_spline() -> None:
    program, _ = motion(0.3)
    c = spline_coefficients(program)
    assert (c[:-2] + 4.0 * c[1:-1] + c[2:]) / 6.0 == pytest.approx(program.legs, abs=1e-15)
    half = (c[:-3] + 23.0 * c[1:-2] + 23.0 * c[2:-1] + c[3:]) / 48.0
    assert half == pytest.approx(lengths_at(program, program.times[:-1] + 0.5 * program.period), abs=1e-14)


def test_at_full_override_the_program_is_played(case) -> None:
    program, machine, player = case
    legs, places, paces, states = played(player, np.ones(2 * len(program.legs)))
    assert not states.any()
    assert off_path(program, legs, places) < 1e-9
    assert (paces[60:] == 1.0).all()
    assert len(legs) < len(program.legs) + 60
    assert max(shares(machine, legs, program.period)) < 1.0
    assert np.abs(legs[-1] - program.legs[-1]).max() < 1e-9


@pytest.mark.parametrize("seed", range(6))
def test_random_overrides_keep_limits_and_path(case, seed) -> None:
    program, machine, player = case
    wanted = random_overrides(6 * len(program.legs), seed)
    legs, places, paces, states = played(player, wanted)
    assert not states.any()
    assert max(shares(machine, legs, program.period)[:2]) <= 1.0
    # Lengths in the file have ten decimals of a millimetre, whose third differences are small.
    assert shares(machine, legs, program.period)[2] <= 1.0 + 1e-5
    assert off_path(program, legs, places) < 1e-9
    assert (np.diff(places) >= 0.0).all()
    assert 0.0 <= paces.min() <= paces.max() <= 1.2
    assert np.unique(np.round(paces, 6)).size > 50
    # It is where it is wanted for most of the time.
    wanted = wanted[: len(paces)]
    assert (np.abs(paces - wanted)[wanted <= 1.0] < 1e-9).mean() > 0.6


def test_the_override_is_reached_and_held(case) -> None:
    program, machine, player = case
    for share in (0.25, 0.6, 0.9):
        wanted = np.full(6 * len(program.legs), share)
        wanted[:1500] = 1.0
        legs, _, paces, _ = played(player, wanted)
        assert (paces[2600:] == share).all()
        assert len(legs) == pytest.approx(1500 + (len(program.legs) - 1500) / share, rel=0.05)
        assert max(shares(machine, legs, program.period)) <= 1.0 + 1e-5


def test_above_one_where_the_limits_leave_room() -> None:
    program, machine = motion(4.0)
    player = Player(program, machine)
    legs, places, paces, _ = played(player, np.full(6000, 1.2))
    assert len(legs) < 3500
    assert (paces[100:] == 1.2).all()
    assert max(shares(machine, legs, program.period)) < 0.5
    assert off_path(program, legs, places) < 1e-9


def test_above_one_falls_back_where_they_leave_none(fast) -> None:
    program, machine, player = fast
    legs, _, paces, _ = played(player, np.full(2 * len(program.legs), 1.2))
    assert paces.max() > 1.0
    assert (paces[100:] <= 1.0).any()
    assert max(shares(machine, legs, program.period)[:2]) <= 1.0
    assert np.abs(legs[-1] - program.legs[-1]).max() < 1e-9


def test_a_hold_stands_on_the_path_and_goes_on(case) -> None:
    program, machine, player = case
    for begun in range(700, 1500, 57):
        wanted = np.ones(4 * len(program.legs))
        wanted[begun : begun + 2500] = 0.0
        legs, _, paces, _ = played(player, wanted)
        standing = np.flatnonzero(paces == 0.0)
        standing = standing[standing > 100]
        assert standing[0] - begun < 1000
        assert (paces[standing[0] : begun + 2500] == 0.0).all()
        assert (legs[standing[0] : begun + 2500] == legs[standing[0]]).all()
        assert max(shares(machine, legs, program.period)) <= 1.0 + 1e-5
        assert np.abs(legs[-1] - program.legs[-1]).max() < 1e-9


def test_rows_that_stop_coming_stop_the_player_in_time(jerky) -> None:
    program, machine, player = jerky
    legs, places, paces, states = played(player, np.ones(12_000), fed=1200)
    assert (states[-1] == 1) & (paces[-1] == 0.0)
    assert places[-1] < 1200 + 2048
    assert max(shares(machine, legs, program.period)) <= 1.0 + 1e-5


@pytest.mark.parametrize("wrong", [np.nan, -1.0, np.inf])
def test_overrides_that_are_none_count_as_the_nearest(fast, wrong) -> None:
    program, machine, player = fast
    wanted = np.ones(3 * len(program.legs))
    wanted[1000:2000] = wrong
    legs, _, paces, _ = played(player, wanted)
    assert max(shares(machine, legs, program.period)[:2]) <= 1.0
    assert paces[1900] == 0.0 if wrong != np.inf else paces[1000:2000].max() <= 1.2


def test_programs_with_a_laser_have_no_player() -> None:
    what = given(duration=0.2)
    power = np.zeros(len(what.program.legs))
    program = dataclasses.replace(what.program, laser_power=power)
    assert player_files(PostInput(program, what.machine)) == {}


def test_coefficients_of_another_program_are_refused_when_read_back(tmp_path) -> None:
    post(given(duration=0.2), "linuxcnc", tmp_path)
    file = tmp_path / "player" / COEFFICIENTS
    text = file.read_text()
    file.write_text(text.replace("\n4 6", "\n4 7"))
    with pytest.raises(ProgramError, match=r"the player's coefficients are not those of the program"):
        read_post(tmp_path, "linuxcnc")


def test_the_component_compiles_without_a_warning(tmp_path) -> None:
    """For 2.9 against LinuxCNC's own headers where they are, for the development branch against a stand-in."""
    what = given(duration=0.2)
    for name, content in player_files(what).items():
        (tmp_path / name).write_bytes(content)
    own, stand_in = Path("/usr/include/linuxcnc"), Path(__file__).parents[2] / "linuxcnc_headers"
    ways = [("pins_dev.h", stand_in), *([("pins_2.9.h", own)] if (own / "hal.h").exists() else [])]
    for pins, headers in ways:
        (tmp_path / "pentapod_pins.h").write_bytes((tmp_path / pins).read_bytes())
        words = [COMPILER, "-std=gnu99", *STRICT[1:], "-D_GNU_SOURCE", "-DRTAPI", "-DUSPACE", "-isystem", str(headers)]
        done = subprocess.run(
            [*words, "-c", "pentapod_player.c"], cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False
        )
        assert done.returncode == 0, (pins, done.stderr)


@pytest.mark.slow
@pytest.mark.parametrize("stepover", ["15", "9"])
def test_planned_programs_keep_limits_with_random_overrides(make_job, tmp_path, stepover) -> None:
    job = make_job(("stepover_mm = 15", f"stepover_mm = {stepover}"))
    assert run(["plan", str(job), "-o", str(tmp_path / "out"), "-q"]) == 0
    program, machine = read_csv(tmp_path / "out" / "program.csv"), Machine.load("desk")
    player = Player(program, machine)
    for seed in range(4):
        legs, places, paces, states = played(player, random_overrides(5 * len(program.legs), seed))
        assert not states.any()
        assert max(shares(machine, legs, program.period)) <= 1.0 + 1e-5
        assert off_path(program, legs, places) < 1e-9
        assert paces.max() > 1.0


@pytest.mark.slow
@built
def test_linuxcnc_plays_with_override_hold_and_resume(tmp_path, capsys) -> None:
    what = given(duration=3.0)
    post(what, "linuxcnc", tmp_path)
    table = play(tmp_path / "player", seconds=40.0, words=("0.6:50", "1.2:hold", "2.0:resume", "2.6:120"))
    played, limited, row, pace = table[:, :5], table[:, 5:10], table[:, 10], table[:, 11]
    assert np.array_equal(played, limited)
    assert {0.0, 0.5, 1.0, 1.2} <= set(np.round(pace, 6))
    assert np.abs(played - 1e3 * lengths_at(what.program, row * what.program.period)).max() < 1e-4
    assert np.abs(played[-1] - 1e3 * what.program.legs[-1]).max() < 1e-6
    # halsampler prints six decimals.
    velocity, acceleration, _ = shares(what.machine, 1e-3 * played, what.program.period)
    assert max(velocity, acceleration) < 1.0
    held = np.flatnonzero((pace == 0.0) & (row > 10.0) & (row < len(what.program.legs) - 10))
    assert 500 < len(held) < 900
    said = (tmp_path / "player" / "test.log").read_text()
    assert "played to the end" in said
    assert re.search(r"the limits changed the lengths by at most 0 mm", said)
    write_csv(what.program, tmp_path / "program.csv")
    log, columns = str(tmp_path / "player" / "played.txt"), "number,commands_mm,legs_mm,-,-"
    judged = ["--program", str(tmp_path / "program.csv"), "--columns", columns, "--tolerance-mm", "0.001", "--json"]
    capsys.readouterr()
    assert run(["monitor", log, *judged]) == 0
    run_of_it = json.loads(capsys.readouterr().out)
    assert [round(hold["duration_s"], 1) for hold in run_of_it["holds"]] == [pytest.approx(0.8, abs=0.15)]
    assert not run_of_it["in_time"]
    assert run_of_it["complete"]


@pytest.mark.slow
@built
def test_linuxcnc_stops_on_the_path_at_an_abort(tmp_path) -> None:
    what = given(duration=3.0)
    post(what, "linuxcnc", tmp_path)
    table = play(tmp_path / "player", words=("1.0:abort",))
    assert "aborted, standing on the path" in (tmp_path / "player" / "test.log").read_text()
    assert table[-1, 11] == 0.0
    assert 800.0 < table[-1, 10] < 2000.0
    assert np.array_equal(table[:, :5], table[:, 5:10])
