"""What holds of every value that the verdict is made of: frozen, and no comparison that stumbles over arrays."""

import dataclasses
import importlib
import inspect
import pkgutil

import pytest

import pentapod.verify
from pentapod.base.values import Value
from pentapod.verify.judge import CLAIMS, write_verdict
from pentapod.verify.verdict.verdict import Certificate, Place, Verdict

PROVEN_MOTION = {
    *("base joint cones", "platform joints not too closed", "platform joints not too open"),
    *("tip deviation", "axis deviation", "toolpath covered", "clearance between legs and shaft"),
    *("feed on cuts", "feed on links", "rapid rate", "gouge on cuts and links", "gouge on rapids"),
    "surface left on the region",
}
WITHOUT_POSES = {
    *("machine", "job", "guides within their travel", "component kept, w", "component kept, S"),
    *("component kept, roll", "component kept"),
    *("legs not too short", "legs not too long", "leg rates", "leg accelerations", "leg jerks"),
    *("starts at rest", "ends at rest", "legs, spindle and tool clear of the surroundings"),
    *("placement as the job asks", "component as asked", "controller", "every cut is made in one set-up"),
}
BEING_FILLED = {"IntervalBounds", "ComponentFindings"}  # while the walk along the program goes on


def values():
    for info in pkgutil.walk_packages(pentapod.verify.__path__, "pentapod.verify."):
        module = importlib.import_module(info.name)
        for value in vars(module).values():
            if inspect.isclass(value) and value.__module__ == module.__name__ and dataclasses.is_dataclass(value):
                yield value


def test_claims_about_all_times_need_a_proven_motion():
    assert {claim.name for claim in CLAIMS if claim.needs_proof} == PROVEN_MOTION


def test_what_is_said_of_legs_and_header_needs_no_pose():
    assert {claim.name for claim in CLAIMS if not claim.needs_pose} == WITHOUT_POSES


def test_a_written_verdict_reads_well(tmp_path):
    """Indented by two, and signs as they are: a degree is a degree in any editor."""
    certificate = Certificate("axis", True, 0.5, 1.0, "°", Place(), "2 ± 1 µm")
    text = write_verdict(Verdict((certificate,)), tmp_path / "verdict.json").read_text(encoding="utf-8")
    assert text.startswith('{\n  "')
    assert '"°"' in text
    assert "2 ± 1 µm" in text


@pytest.mark.parametrize("value", list(values()), ids=lambda value: value.__name__)
def test_values_are_frozen_and_those_with_arrays_compare_by_identity_or_as_public_values(value):
    empty = object.__new__(value)
    name = dataclasses.fields(value)[0].name
    if value.__name__ in BEING_FILLED:
        setattr(empty, name, 0)
    else:
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(empty, name, 0)
    heavy = ("Floats", "Ints", "Bools", "RunningMaximum", "MeshDistance", "Program", "Machine")
    holds_arrays = any(part in str(field.type) for field in dataclasses.fields(value) for part in heavy)
    assert (value.__eq__ in (object.__eq__, Value.__eq__)) == holds_arrays or issubclass(value, Value)


@pytest.mark.parametrize(
    ("passed", "value", "bound", "allowed", "told"),
    [
        (True, 2.0, 1.0, 3.0, True),
        (False, 2.0, 1.0, 1.5, False),
        (True, None, 1.0, 3.0, False),
        (True, 2.0, None, 3.0, False),
        (True, 2.0, 1.0, None, False),
    ],
)
def test_what_is_allowed_is_told_where_a_value_beyond_its_bound_passes(passed, value, bound, allowed, told):
    certificate = Certificate("claim", passed, value, bound, "mm", Place(), "", allowed)
    assert certificate.is_lenient == told
