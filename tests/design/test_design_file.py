"""Design files: one clear error for whatever is wrong, with line, key and remedy."""

from pathlib import Path

import numpy as np
import pytest

from pentapod.base.errors import InputError
from pentapod.design.design_file import DesignFile
from pentapod.design.evaluation import evaluate, first_sample, shortfalls
from pentapod.design.part_poses import PartPoses
from pentapod.design.unknowns import Unknowns
from pentapod.machine import Machine


def test_content(design_file):
    file = DesignFile.load(design_file())
    assert file.machine == Machine.load("desk")
    assert file.objectives == (("amplification", 1), ("footprint", 1))
    assert [(n.quantity, n.sense, n.bound) for n in file.needs] == [("amplification", 1, 5.3), ("clearance", -1, 2e-3)]
    assert file.leg_stiffness == 50e6
    assert len(file.unknowns.names) == 12


def test_the_vector_of_the_start_is_the_start(design_file):
    unknowns = DesignFile.load(design_file()).unknowns
    made = unknowns.design(unknowns.vector())
    assert made.tool_length == pytest.approx(unknowns.start.tool_length, abs=1e-9)
    assert made.offsets == pytest.approx(unknowns.start.offsets)
    assert (made.base == unknowns.start.base).all()


def test_a_general_machine_of_a_quadratic_start():
    unknowns = Unknowns.of(Machine.load("desk"), {"platform": [-0.25, 0.25]})
    assert unknowns.start.delta is None
    assert len(unknowns.names) == 5


@pytest.mark.parametrize(
    ("replaced", "message"),
    [
        (("beyond_mm", "beyond"), r'design.toml:8: unknowns.beyond: unknown key; did you mean "beyond_mm"\?'),
        (("beyond_mm = [80, 250]", "beyond_mm = [250, 80]"), "design.toml:8: unknowns.beyond_mm: not a range"),
        (("[at_most]", "[atmost]"), r'atmost: unknown table; did you mean "at_most"\?'),
        (('"footprint_mm"', '"footprint"'), 'no such quantity .*footprint.*did you mean "footprint_mm"'),
        (('"desk"', '"dekc"'), "no such machine"),
        (('"desk"', '"hexa"'), "start.machine: not a machine that the search can vary"),
        (('["amplification", "footprint_mm"]', "[]"), "there is no objective"),
        (("population = 8", "population = 2"), "search.population: out of range"),
        (("amplification = 5.3", "amplification = true"), "at_most.amplification: wrong value"),
        (("beyond_mm = [80, 250]", "delta = [0.1, 0.2]\nplatform_mm = [-10, 10]"), "a general machine has no delta"),
        (("[search]", '[parts]\njobs = ["nowhere.toml"]\n\n[search]'), "nowhere.toml"),
    ],
)  # fmt: skip
def test_errors_name_the_place(design_file, replaced, message):
    with pytest.raises(InputError, match=message):
        DesignFile.load(design_file(replaced))


def test_a_stiffness_that_is_asked_needs_that_of_a_leg(design_file):
    path = design_file(("leg_stiffness_n_um = 50", ""), ("clearance_mm = 2", "stiffness_n_um = 2"))
    with pytest.raises(InputError, match=r"start\.leg_stiffness_n_um: the key is missing"):
        DesignFile.load(path)


@pytest.mark.parametrize("name", ["desk", "steep", "bench-general"])
def test_shipped_design_files_start_where_needs_are_kept_but_for_what_shall_get_better(name):
    """Clearances and lengths of the start keep the needs of its file; forces and tilt are what the search is for."""
    file = DesignFile.load(Path(__file__).parents[2] / "examples" / f"design_{name}.toml")
    values = evaluate(first_sample(file, PartPoses.of((), 4)), file.unknowns.vector())
    missed = shortfalls(file.needs, values[None])[0]
    names = np.array([need.quantity for need in file.needs])
    assert set(names[missed > 1e-9]) <= {"amplification"}
