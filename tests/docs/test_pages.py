"""The documentation: a reference that the code agrees with, commands that run, a site that builds without a warning."""

import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import pytest

from pentapod.cli.main import run
from pentapod.job import Job

ROOT = Path(__file__).parents[2]
GUIDES = [*sorted(ROOT.glob("docs/howto/*.md")), ROOT / "docs" / "tutorial.md"]


def made_pages():
    spec = spec_from_file_location("make_reference", ROOT / "docs" / "make_reference.py")
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.pages()


def blocks(page, language):
    return re.findall(rf"```{language}\n(.*?)```", page.read_text(encoding="utf-8"), re.S)


def test_the_reference_is_what_the_code_says():
    for name, text in made_pages().items():
        written = (ROOT / "docs" / "reference" / name).read_text(encoding="utf-8")
        assert written == text, f"docs/reference/{name} is out of date: run `make reference`"


@pytest.mark.parametrize("page", GUIDES, ids=lambda page: page.stem)
def test_every_command_runs_as_written(page, tmp_path, monkeypatch):
    shutil.copytree(ROOT / "toolpaths", tmp_path / "toolpaths")
    monkeypatch.chdir(tmp_path)
    for line in "".join(blocks(page, "sh")).splitlines():
        words = shlex.split(line)
        assert words[0] == "pentapod"
        if words[1] == "view":
            serve_and_interrupt(words[1:])
        else:
            assert run(words[1:]) == 0, line


def serve_and_interrupt(words):
    """Run `pentapod view`, where no browser opens, until it says its address; then press Ctrl-C."""
    command = [sys.executable, "-c", "from pentapod.cli.main import main; main()", *words, "--no-open"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as serving:
        assert serving.stdout.readline().startswith("http://127.0.0.1:")
        serving.send_signal(signal.SIGINT)
        assert serving.wait(60) == 0


@pytest.mark.parametrize("page", GUIDES, ids=lambda page: page.stem)
def test_every_table_of_a_job_is_one(page, tmp_path):
    """The tables that a guide shows, in a job that needs nothing else."""
    shutil.copy(ROOT / "toolpaths" / "dome.stl", tmp_path)
    (tmp_path / "part.apt").write_text("", encoding="utf-8")
    library = ROOT / "src" / "pentapod" / "machine" / "library"
    shutil.copy(library / "desk.toml", tmp_path / "my_machine.toml")
    usual = {
        "part": 'mesh = "dome.stl"\nunit = "mm"\n',
        "tool": 'type = "ball"\ndiameter_mm = 6\n',
        "toolpath": "stepover_mm = 3\n",
        "feed": "cut_mm_min = 1500\n",
    }
    for block in blocks(page, "toml"):
        table = re.match(r"\[([^\]]+)\]\n", block)
        if table[1].startswith("project."):
            continue
        tables = {**usual, table[1]: block[table.end() :]}
        job = tmp_path / "job.toml"
        job.write_text("".join(f"[{name}]\n{keys}\n" for name, keys in tables.items()), encoding="utf-8")
        Job.load(job)


def test_the_site_builds_without_a_warning(tmp_path):
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "-f", str(ROOT / "mkdocs.yml"), "-d", str(tmp_path)]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    built = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT, env=environment)
    assert built.returncode == 0, built.stderr[-3000:]
    assert (tmp_path / "reference" / "job" / "index.html").is_file()
