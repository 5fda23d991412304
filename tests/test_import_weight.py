"""What is heavy is loaded when it is used, not before."""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

HEAVY = (
    "casadi",
    "pandas",
    "toppra",
    "matplotlib",
    "trimesh",
    "scipy",
    "pydantic",
    "rich",
    "jinja2",
    "numba",
    "dask",
    "distributed",
)

FIND = "import json, sys; print(json.dumps([m for m in {heavy!r} if m in sys.modules]))"


def loaded_after(code: str, heavy: tuple[str, ...]) -> list[str]:
    program = f"{code}\n{FIND.format(heavy=heavy)}"
    answer = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    return json.loads(answer.stdout.splitlines()[-1])


def test_import_pentapod_is_light() -> None:
    assert loaded_after("import pentapod", (*HEAVY, "numpy", "click")) == []


@pytest.mark.parametrize("arguments", [["--help"], ["--version"], ["plan", "--help"], ["machine", "check", "--help"]])
def test_help_is_light(arguments: list[str]) -> None:
    code = f"from pentapod.cli.main import run\nassert run({arguments!r}) == 0"
    assert loaded_after(code, (*HEAVY, "numpy")) == []


def test_every_name_loads_without_the_solvers() -> None:
    code = "import pentapod\nfor name in pentapod.__all__: getattr(pentapod, name)"
    assert loaded_after(code, ("casadi", "toppra", "matplotlib", "trimesh", "numba", "distributed")) == []


def test_the_check_can_fail() -> None:
    assert loaded_after("import rich", HEAVY) == ["rich"]


def test_a_part_that_cannot_fit_is_refused_before_the_solvers_are_loaded(make_job: Callable[..., Path]) -> None:
    path = make_job(('unit = "mm"', 'unit = "inch"'))
    code = f"from pentapod.cli.main import run\nassert run(['plan', {str(path)!r}, '-o', {str(path.parent)!r}]) == 2"
    ours = tuple(f"pentapod.{name}" for name in ("planning", "timing", "verify", "simulate", "report"))
    libraries = ("casadi", "numba", "rich", "toppra", "scipy.optimize", "scipy.ndimage", "scipy.interpolate")
    assert loaded_after(code, (*ours, *libraries, "pentapod.machine.identification")) == []


def test_a_mistyped_key_is_told_before_machine_and_mesh_are_loaded(make_job: Callable[..., Path]) -> None:
    path = make_job(("cut_mm_min", "cut_mm_mim"))
    code = f"from pentapod.cli.main import run\nassert run(['plan', {str(path)!r}]) == 2"
    assert loaded_after(code, ("pentapod.machine.machine", "pentapod.planning", "pentapod.job.pipeline.run")) == []
