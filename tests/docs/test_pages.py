"""The documentation: a reference that the code agrees with, commands that run, a site that builds without a warning."""

import datetime
import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import numpy as np
import pytest

from pentapod.base.files import sha256_of
from pentapod.batch import Store, Sweep
from pentapod.cli.main import run
from pentapod.design.design_file import DesignFile
from pentapod.geometry import RigidTransform
from pentapod.job import Job
from pentapod.kinematics import Component
from pentapod.machine import CalibrationRecord, Machine, MeasuredGeometry, geometry_digest, write_calibration
from pentapod.program import Program, Provenance, read_csv, write_csv

ROOT = Path(__file__).parents[2]
MACHINE_TABLES = ["calibration", "drives", "guard", "guides", "leg_model", "legs", "park"]
LONG = (
    "setups",
    "register",
    "many-jobs",
    "design",
    "quickstart",
    "override",
    "view",
    "tutorial",
    "sheet",
    "calibrate",
    "engraving",
)
GUIDES = [*sorted(ROOT.glob("docs/howto/*.md")), ROOT / "docs" / "tutorial.md", ROOT / "docs" / "quickstart.md"]
RUN = [page for page in GUIDES if "```sh\n" in page.read_text(encoding="utf-8")]


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


def expected_seconds(page):
    """What a guide says that its commands take, on one core."""
    text = page.read_text(encoding="utf-8")
    stated = re.search(r"^Expected time: (\d+) (s|min) of one core", text, re.M)
    assert stated, "a guide with commands says how long they take"
    return int(stated[1]) * (60 if stated[2] == "min" else 1)


@pytest.mark.parametrize("page", [pytest.param(p, marks=[pytest.mark.slow] * (p.stem in LONG), id=p.stem) for p in RUN])
def test_every_command_runs_as_written(page, tmp_path, monkeypatch, capsys):
    """In about the time that the guide states; where it shows an output, that is what is printed."""
    shutil.copytree(ROOT / "toolpaths", tmp_path / "toolpaths")
    monkeypatch.chdir(tmp_path)
    for block in blocks(page, "toml"):
        if block.startswith("[start]"):
            (tmp_path / "design.toml").write_text(block, encoding="utf-8")
    began, shown = time.process_time(), re.compile(r"```sh\n(.*?)```(?:\s*```text\n(.*?)```)?", re.S)
    for commands, output in shown.findall(page.read_text(encoding="utf-8")):
        for line in commands.splitlines():
            words = shlex.split(line)
            assert words[0] == "pentapod"
            if words[1] == "view":
                serve_and_interrupt(words[1:])
            else:
                assert run(words[1:]) == 0, line
        printed = capsys.readouterr().out
        for line in output.splitlines():
            assert all(part in printed for part in line.split("…")), f"{commands}prints\n{printed}"
    assert time.process_time() - began < 60.0 + 4.0 * expected_seconds(page)
    if page.stem == "tutorial":
        program = read_csv(tmp_path / "first" / "out" / "program.csv")
        rows = len(program.legs)
        played = f"playing {rows} setpoints, which takes {rows * program.period:.3f} s"
        assert played in page.read_text(encoding="utf-8")


def test_pages_can_be_followed_one_after_the_other_in_one_folder():
    """What one page makes is not in the way of another page, which would end there or replace the run."""
    made: dict[str, set[str]] = {}
    for page in RUN:
        for line in "".join(blocks(page, "sh")).splitlines():
            words = shlex.split(line)
            targets = [words[k + 1] for k, word in enumerate(words) if word in ("-o", "new") and words[k + 1] != "new"]
            for target in targets:
                made.setdefault(Path(target).parts[0], set()).add(page.stem)
    assert made["first"] == {"tutorial"}
    assert [(folder, sorted(pages)) for folder, pages in made.items() if len(pages) > 1] == []


def serve_and_interrupt(words):
    """Run `pentapod view`, where no browser opens, until it says its address; then press Ctrl-C."""
    command = [sys.executable, "-c", "from pentapod.cli.main import main; main()", *words, "--no-open"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as serving:
        try:
            assert serving.stdout.readline().startswith("http://127.0.0.1:")
            serving.send_signal(signal.SIGINT)
            assert serving.wait(60) == 0
        finally:
            serving.kill()


@pytest.mark.parametrize("page", GUIDES, ids=lambda page: page.stem)
def test_every_table_of_a_job_is_one(page, tmp_path):
    """The tables that a guide shows, in a job that needs nothing else; those of a machine file in one."""
    shutil.copy(ROOT / "toolpaths" / "dome.stl", tmp_path)
    (tmp_path / "part.nc").write_text("", encoding="utf-8")
    library = ROOT / "src" / "pentapod" / "machine" / "library"
    shutil.copy(library / "desk.toml", tmp_path / "my_machine.toml")
    desk = Machine.load("desk").robot
    joints = MeasuredGeometry(desk.base_joints + 1e-4, desk.offsets, np.zeros(5), np.zeros(5))
    measured = CalibrationRecord("desk", geometry_digest(desk), datetime.date(2026, 1, 31), joints)
    write_calibration(measured, tmp_path / "desk-0117.toml")
    usual = {
        "part": 'mesh = "dome.stl"\nunit = "mm"\n',
        "tool": 'type = "ball"\ndiameter_mm = 6\n',
        "toolpath": "stepover_mm = 3\n",
        "feed": "cut_mm_min = 1500\n",
    }
    for block in blocks(page, "toml"):
        if block.startswith("job ="):
            shutil.copy(ROOT / "toolpaths" / "dome.toml", tmp_path)
            (tmp_path / "sweep.toml").write_text(block, encoding="utf-8")
            assert Sweep.load(tmp_path / "sweep.toml").tasks(Store(tmp_path))
            continue
        table = re.match(r"\[([^\]]+)\]\n", block)
        if table[1].startswith("project."):
            continue
        if table[1] == "start":
            shutil.copytree(ROOT / "toolpaths", tmp_path / "toolpaths")
            (tmp_path / "design.toml").write_text(block, encoding="utf-8")
            assert DesignFile.load(tmp_path / "design.toml").jobs
            continue
        if table[1] in MACHINE_TABLES:
            own = tmp_path / "own_machine.toml"
            text = (library / "desk.toml").read_text(encoding="utf-8")
            _, *parts = re.split(r"(?m)^\[(\w+)\].*\n", block)
            for name, keys in zip(parts[::2], parts[1::2], strict=True):
                head = re.search(rf"(?m)^\[{name}\].*\n", text)  # more keys of a table that desk has, or a new table
                text = text.replace(head[0], head[0] + keys) if head else f"{text}\n[{name}]\n{keys}"
            own.write_text(text, encoding="utf-8")
            assert Machine.load(own) != Machine.load("desk")
            continue
        tables = {**usual, table[1]: block[table.end() :]}
        job = tmp_path / "job.toml"
        job.write_text("".join(f"[{name}]\n{keys}\n" for name, keys in tables.items()), encoding="utf-8")
        Job.load(job)


def test_the_post_of_ones_own_is_one(tmp_path):
    """The package of the guide, installed as pip would leave it; in a process of its own."""
    guide = ROOT / "docs" / "howto" / "post.md"
    (code,), (entry,) = blocks(guide, "python"), blocks(guide, "toml")
    package, marks = tmp_path / "site" / "my_package", tmp_path / "site" / "my_package-1.0.dist-info"
    package.mkdir(parents=True)
    marks.mkdir()
    (package / "__init__.py").write_text("", encoding="utf-8")
    (package / "posts.py").write_text(code, encoding="utf-8")
    (marks / "METADATA").write_text("Metadata-Version: 2.1\nName: my_package\nVersion: 1.0\n", encoding="utf-8")
    points = entry.replace('[project.entry-points."pentapod.posts"]', "[pentapod.posts]").replace('"', "")
    (marks / "entry_points.txt").write_text(points, encoding="utf-8")
    legs = np.linspace([0.6, 0.65, 0.7, 0.75, 0.8], [0.61, 0.64, 0.72, 0.74, 0.79], 40)
    machine = Machine.load("desk")
    source = Provenance(machine.name, machine.digest, "", "1")
    program = Program(1e-3, legs, "cubic", Component(1, 1), RigidTransform.identity(), source)
    write_csv(program, tmp_path / "program.csv")
    verdict = {"passed": True, "sha256": {"program": sha256_of(tmp_path / "program.csv")}}
    (tmp_path / "verdict.json").write_text(json.dumps(verdict), encoding="utf-8")
    path = os.pathsep.join([str(tmp_path / "site"), str(ROOT / "src")])
    pentapod = [sys.executable, "-c", "from pentapod.cli.main import main; main()", "post"]

    def said(*words):
        done = subprocess.run([*pentapod, *words], env={**os.environ, "PYTHONPATH": path}, cwd=tmp_path,
                              capture_output=True, text=True, check=False)  # fmt: skip
        assert done.returncode == 0, done.stderr
        return done.stdout

    assert "the drives of my machine" in said("--formats")
    said("program.csv", "--to", "mine", "-o", "written")
    rows = [line for line in (tmp_path / "written" / "legs.txt").read_text().splitlines() if line[0].isdigit()]
    table = np.array([[float(value) for value in row.split(";")] for row in rows])
    assert table[:, 0] == pytest.approx(np.arange(40.0))
    assert table[:, 1:] == pytest.approx(1e6 * program.legs, abs=1e-3)


def test_the_site_builds_without_a_warning(tmp_path):
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "-f", str(ROOT / "mkdocs.yml"), "-d", str(tmp_path)]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    built = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT, env=environment)
    assert built.returncode == 0, built.stderr[-3000:]
    assert (tmp_path / "reference" / "job" / "index.html").is_file()
