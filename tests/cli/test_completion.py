"""What shells ask of pentapod when a word is to be completed."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from types import SimpleNamespace

import click
import pytest

from pentapod.cli.main import run
from pentapod.cli.verbs import VERBS, cli
from pentapod.program.posts import post_names

PENTAPOD = [sys.executable, "-c", "from pentapod.cli.main import main; main()"]


def completed(*words):
    """The answers to words on the line, the last of them incomplete."""
    asked = {"_PENTAPOD_COMPLETE": "bash_complete", "COMP_WORDS": " ".join(words), "COMP_CWORD": str(len(words) - 1)}
    answer = subprocess.run(PENTAPOD, env={**os.environ, **asked}, capture_output=True, text=True, check=True)
    return [line.split(",")[1] for line in answer.stdout.splitlines()]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_scripts_name_the_command(shell, capsys):
    assert run(["--completion", shell]) == 0
    said = capsys.readouterr().out
    assert "_PENTAPOD_COMPLETE" in said
    assert "pentapod" in said
    assert run(["--completion", "tcsh"]) == 2


def test_verbs_options_and_formats():
    assert completed("pentapod", "p") == [verb for verb in VERBS if verb.startswith("p")]
    assert completed("pentapod", "simulate", "--eng") == ["--engine"]
    assert completed("pentapod", "post", "--to", "l") == [name for name in post_names() if name.startswith("l")]


def test_a_traceback_is_shown_when_asked_for(tmp_path, capsys):
    missing = str(tmp_path / "none.toml")
    assert run(["plan", missing]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    with pytest.raises(ValueError, match="no such job file"):
        run(["plan", missing, "--debug"])
    assert run(["--help"]) == 0
    assert "--debug" in capsys.readouterr().out


def commands():
    """Every command with the words that call it."""
    context = click.Context(cli)
    for verb in VERBS:
        command = cli.get_command(context, verb)
        yield from leaves(verb, command)


def leaves(words, command):
    """The commands of a group, and of groups in it; or the command itself."""
    if not isinstance(command, click.Group):
        yield words, command
        return
    for name, inner in command.commands.items():
        yield from leaves(f"{words} {name}", inner)


@pytest.mark.parametrize(
    ("words", "command"), list(commands()), ids=lambda value: value if isinstance(value, str) else ""
)
def test_every_command_can_be_quiet_and_tell_scripts(words, command):
    options = {option for parameter in command.params for option in parameter.opts}
    assert {"--quiet", "--json"} <= options, words


def test_progress_tells_stage_share_and_time_left(monkeypatch, capfd):
    """On a terminal; elsewhere nothing is said of what is done at once."""
    from rich.progress import Progress

    from pentapod.cli.progress import progress_bar

    with progress_bar(quiet=False) as progress:
        progress("tracing", 0.5, "half")
    assert capfd.readouterr() == ("", ""), "stderr is no terminal here"
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    shown = {}
    monkeypatch.setattr(
        Progress, "stop", lambda self: shown.update({t.description: dict(t.fields) for t in self.tasks})
    )
    now = [0.0]
    monkeypatch.setattr("pentapod.cli.progress.time", SimpleNamespace(monotonic=lambda: now[0]))
    with progress_bar(quiet=False) as progress:
        for tenths in (0, 1, 2, 3, 4):
            now[0] = 10.0 * tenths
            progress("verify", 0.1 * tenths, "rows")
    assert shown["verify"]["note"] == "rows"
    assert shown["verify"]["share"] == "40 %"
    assert shown["verify"]["left"] == "about 60 s left"


def test_progress_in_a_file_says_that_a_silent_stage_goes_on():
    """A stage that reports nothing for long is not taken for one that hangs; by the clock and by the thread."""
    from pentapod.cli.progress import LINE_EVERY_S, SILENT_S, Lines
    from pentapod.cli.silence import Silence

    now, lines = [0.0], []
    told = Lines(lines.append, lambda: now[0])
    now[0] = SILENT_S
    told.silence.look()
    told("tool axis", 0.25)
    now[0] += LINE_EVERY_S
    told("tool axis", 0.5, "piece 3 of 4")
    for _ in range(2):
        now[0] += 0.6 * SILENT_S
        told.silence.look()
    told.silence.look()
    assert lines == [
        "getting ready, 15 s so far", "tool axis 50 %, about 20 s left: piece 3 of 4", "tool axis 50 %, 38 s so far",
    ]  # fmt: skip
    said = threading.Event()
    with Silence(said.set, 0.01):
        assert said.wait(60.0)


def test_progress_in_a_file_says_at_once_that_ctrl_c_ended_a_search():
    """The command goes on with the best placement so far: one who is not told so presses it again."""
    from pentapod.cli.progress import Lines

    lines = []
    told = Lines(lines.append, lambda: 1.0)
    told("placement", 0.4, "component ++")
    told("placement", 1.0, "interrupted: the best so far is kept")
    assert lines == ["placement 100 %, 0 s so far: interrupted: the best so far is kept"]


def test_progress_in_a_file_is_a_line_every_few_seconds():
    from pentapod.cli.progress import LINE_EVERY_S, Lines

    now, lines = [0.0], []
    told = Lines(lines.append, lambda: now[0])
    told("toolpath", 0.0)
    now[0] = LINE_EVERY_S
    told("toolpath", 0.0)
    told("toolpath", 0.1)
    now[0] += 1.0
    told("verify", 0.0, "reading")
    now[0] += LINE_EVERY_S
    told("verify", 0.25, "between the rows")
    now[0] += 10.0
    told("verify", 0.26, "material")
    now[0] += LINE_EVERY_S
    told("verify", 0.8)
    assert lines == [
        "toolpath, 5 s so far", "verify 25 %, about 18 s left: between the rows", "verify 26 %, 16 s so far: material",
        "verify 80 %, about 5 s left",
    ], "a stage begins where the one before was last heard of; a time left that grows is not told"  # fmt: skip
