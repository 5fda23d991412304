"""Nothing unjudged reaches a controller: posts want a verdict that passed for exactly this file, or say so."""

from __future__ import annotations

import dataclasses
import json
import shutil
from hashlib import sha256
from textwrap import dedent

import numpy as np
import pytest

from pentapod.base.errors import InputError, ProgramError
from pentapod.cli.main import run
from pentapod.program import Program, read_csv, write_csv
from pentapod.program.posts import POSTS, PostInput, read_post, write_post
from plugins import install
from short_motion import given, passed, post

MARK = "UNVERIFIED: no verdict has passed this program"
WITHOUT_COMMENTS = ("cam", "robodk")


def jumping(program):
    """The program with a jump of 228 mm amid a cut."""
    legs = program.legs.copy()
    legs[len(legs) // 2 :, 2] += 0.228
    return dataclasses.replace(program, legs=legs)


@pytest.fixture
def folder(tmp_path):
    """A program that jumps, and what says that it failed."""
    write_csv(jumping(given(duration=0.3).program), tmp_path / "program.csv")
    write_verdict(tmp_path, passed=False, certificates=[{"claim": "leg 3 velocity", "passed": False}])
    return tmp_path


def write_verdict(folder, **changes):
    content = passed(read_csv(folder / "program.csv")) | changes
    (folder / "verdict.json").write_text(json.dumps(content), encoding="utf-8")


def command(folder, *more, to="linuxcnc"):
    return run(["post", str(folder / "program.csv"), "--to", to, "-o", str(folder / "posted"), *more])


@pytest.mark.parametrize("name", POSTS)
def test_a_failed_program_is_refused(name, folder, capsys):
    assert command(folder, to=name) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"error: {folder / 'program.csv'}: the verdict on this program failed: leg 3 velocity")
    assert "--unverified" in said
    assert said.count("\n") == 1
    assert not (folder / "posted").exists()


@pytest.mark.parametrize(
    ("verdict", "words"),
    [
        (None, "there is no verdict on this program"),
        (b"{", "not a verdict, or a broken one"),
        (b"[" * 100_000, "not a verdict, or a broken one"),
        (b"[1]", "not a verdict"),
        (b"{}", "has not passed"),
        (b'{"passed": 1, "sha256": {}}', "has not passed"),
        (b'{"passed": "true", "certificates": [3, {"claim": 3}]}', "failed: 3"),
        (b'{"passed": true}', "does not say which file"),
        (b'{"passed": true, "sha256": "all"}', "does not say which file"),
        (b'{"passed": true, "sha256": {"program": "00"}}', "about another file"),
    ],
)
def test_what_is_no_passed_verdict(verdict, words, folder, capsys):
    (folder / "verdict.json").unlink()
    if verdict is not None:
        (folder / "verdict.json").write_bytes(verdict)
    assert command(folder) == 2
    assert words in capsys.readouterr().err
    assert not (folder / "posted").exists()


def test_one_byte_of_the_program_undoes_its_verdict(folder, capsys):
    write_verdict(folder, passed=True)
    assert command(folder) == 0
    content = bytearray((folder / "program.csv").read_bytes())
    content[-3] ^= 1  # the last digits
    (folder / "program.csv").write_bytes(content)
    assert command(folder, "-o", str(folder / "again")) == 2
    assert "about another file: the program was changed" in capsys.readouterr().err
    assert not (folder / "again").exists()


def test_a_run_is_posted_as_it_was_planned(usual_run, tmp_path, capsys):
    """A program that its own run judged; not when its verdict or itself is of another run."""
    job, out = usual_run[0].path, shutil.copytree(usual_run[1], tmp_path / "out")
    assert run(["post", str(out / "program.csv"), "--to", "linuxcnc", "-o", str(tmp_path / "posted")]) == 0
    assert (tmp_path / "posted" / "kinematics" / "play.sh").is_file()
    # Alone, it is judged anew.
    program = read_csv(out / "program.csv")
    (alone := tmp_path / "alone").mkdir()
    write_csv(program, alone / "program.csv")
    capsys.readouterr()
    assert run(["verify", str(alone / "program.csv"), "--job", str(job), "--json"]) == 0
    (alone / "verdict.json").write_text(capsys.readouterr().out, encoding="utf-8")
    assert run(["post", str(alone / "program.csv"), "--to", "pvt", "-o", str(alone)]) == 0
    write_csv(jumping(program), out / "program.csv")
    capsys.readouterr()
    assert run(["post", str(out / "program.csv"), "--to", "linuxcnc", "-o", str(tmp_path / "jumps")]) == 2
    assert "about another file" in capsys.readouterr().err
    assert run(["verify", str(out / "program.csv"), "--job", str(job), "--json"]) == 1
    said = capsys.readouterr()
    (out / "verdict.json").write_text(said.out, encoding="utf-8")
    assert "note: " in said.err
    assert "program.csv" in said.err
    assert run(["post", str(out / "program.csv"), "--to", "linuxcnc", "-o", str(tmp_path / "jumps")]) == 2
    assert "the verdict on this program failed" in capsys.readouterr().err
    assert not (tmp_path / "jumps").exists()


def test_the_run_tells_the_machine_that_has_another_tool(make_job, tmp_path, capsys):
    coarse = "stepover_mm = 15\nspacing_mm = 4", "stepover_mm = 30\nspacing_mm = 8"
    job, out = make_job(("diameter_mm = 10", "diameter_mm = 10\nlength_mm = 205"), coarse), tmp_path / "out"
    assert run(["plan", str(job), "-o", str(out), "--quiet"]) == 0
    words = ["post", str(out / "program.csv"), "--to", "linuxcnc", "-o", str(tmp_path / "posted")]
    assert run(words) == 0
    job.rename(tmp_path / "elsewhere.toml")
    capsys.readouterr()
    assert run(words) == 2
    assert "not the machine that the program was made for" in capsys.readouterr().err
    assert run([*words, "--job", str(tmp_path / "elsewhere.toml")]) == 0


def test_the_verdict_may_lie_elsewhere(folder, capsys):
    write_verdict(folder, passed=True)
    (folder / "verdict.json").rename(folder / "mine.json")
    assert command(folder) == 2
    assert command(folder, "--verdict", str(folder / "mine.json")) == 0
    assert "UNVERIFIED" not in (folder / "posted" / "README.md").read_text()
    capsys.readouterr()


@pytest.mark.parametrize("name", [name for name in POSTS if name not in WITHOUT_COMMENTS])
def test_who_insists_gets_files_that_say_so(name, tmp_path):
    if name == "hdf5":
        pytest.importorskip("h5py")
    what = given(duration=0.1)
    files = write_post(what, name, tmp_path, unverified=True)
    assert {file.suffix for file in files} != set()
    for file in files:
        if file.suffix in (".npz", ".h5"):
            continue  # read back below
        first, second = [*file.read_text(encoding="utf-8").splitlines(), ""][:2]
        assert MARK in (second if first.startswith(("#!", "%")) else first), file
    back = read_post(tmp_path, name)
    if isinstance(back, Program):
        assert back.provenance.unverified
        assert back.legs.tobytes() == what.program.legs.tobytes()
    else:
        assert np.abs(back.tips - what.toolpath.tips).max() < 1e-10


@pytest.mark.parametrize("name", WITHOUT_COMMENTS)
def test_what_has_no_comments_is_not_written_unverified(name, tmp_path):
    with pytest.raises(InputError, match="no comments to say that the program is unverified"):
        write_post(given(duration=0.1), name, tmp_path / "x", unverified=True)
    assert not (tmp_path / "x").exists()


def test_archives_say_so_in_their_header(tmp_path):
    what = given(duration=0.1)
    write_post(what, "npz", tmp_path, unverified=True)
    with np.load(tmp_path / "program.npz") as archive:
        assert str(archive["header"]).splitlines()[0] == f"# {MARK}"
    h5py = pytest.importorskip("h5py")
    write_post(what, "hdf5", tmp_path, unverified=True)
    with h5py.File(tmp_path / "program.h5") as archive:
        assert archive.attrs["header"].splitlines()[0] == f"# {MARK}"


def test_the_command_insists(folder, capsys):
    for name in POSTS:
        if name in ("hdf5", "apt", *WITHOUT_COMMENTS):
            continue
        assert command(folder, "--unverified", to=name) == 0, name
    for file in folder.glob("posted/**/*.hal"):
        assert file.read_text().startswith(f"# {MARK}\n")
    assert (folder / "posted" / "stream" / "play.sh").read_text().startswith(f"#!/bin/sh\n# {MARK}\n")
    capsys.readouterr()
    assert command(folder, "--unverified", "--json", to="pvt") == 0
    assert json.loads(capsys.readouterr().out)["verified"] is False


def test_the_mark_comes_and_goes_with_the_post(tmp_path):
    """A program that was read from an unverified post and then judged is posted without the mark, and the reverse."""
    what = given(duration=0.1)
    write_post(what, "csv", tmp_path, unverified=True)
    back = read_post(tmp_path, "csv")
    (file,) = post(PostInput(back), "csv", tmp_path / "judged")
    assert MARK not in file.read_text()
    write_csv(what.program, tmp_path / "plain.csv")
    assert file.read_bytes() == (tmp_path / "plain.csv").read_bytes()


def test_the_mark_is_nowhere_else(tmp_path):
    (file,) = write_post(given(duration=0.1), "csv", tmp_path, unverified=True)
    lines = file.read_text().splitlines()
    for wrong in (["", *lines], [lines[1], lines[0], *lines[2:]], [lines[0], *lines], [lines[0].lower(), *lines[1:]]):
        file.write_text("\n".join(wrong) + "\n")
        with pytest.raises(ProgramError):
            read_csv(file)


def test_python_says_it_by_an_argument(tmp_path):
    what = given(duration=0.1)
    with pytest.raises(InputError, match=r"verdict: there is no verdict.*unverified=True"):
        write_post(what, "pvt", tmp_path / "x")
    with pytest.raises(InputError, match="about another file"):
        write_post(what, "pvt", tmp_path / "x", verdict=passed(jumping(what.program)))
    with pytest.raises(InputError, match="has not passed"):
        write_post(what, "pvt", tmp_path / "x", verdict=passed(what.program) | {"passed": False})
    assert not (tmp_path / "x").exists()
    # Of a file that is not as pentapod writes it its own bytes count.
    other = PostInput(what.program, sha256=sha256(b"other").hexdigest())
    with pytest.raises(InputError, match="about another file"):
        write_post(other, "pvt", tmp_path / "x", verdict=passed(what.program))
    write_post(other, "pvt", tmp_path / "x", verdict={"passed": True, "sha256": {"program": other.sha256}})


def test_a_post_of_ones_own_says_so_as_well(tmp_path, monkeypatch):
    code = """
    from pentapod.program.posts import Table, leg_columns, table_post

    MINE = table_post("mine", "", Table({"legs.txt": leg_columns("L{leg}", "length", "mm", 8)}, comment="%"))
    """
    install(tmp_path / "site", monkeypatch, {"pentapod.posts": {"mine": "mine:MINE"}}, mine=dedent(code))
    (file,) = write_post(given(duration=0.1), "mine", tmp_path, unverified=True)
    assert file.read_text().splitlines()[0] == f"% {MARK}"
    assert read_post(tmp_path, "mine").provenance.unverified
