"""What shells ask of pentapod when a word is to be completed."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from pentapod.cli.main import VERBS, run
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
