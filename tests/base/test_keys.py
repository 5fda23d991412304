"""Keys that dataclass fields declare: file values, defaults, bounds and sizes from one statement."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

import pentapod
from pentapod.base.errors import ToolpathError
from pentapod.base.keys import Key, check_fields, check_size, declared, fields_from, file_key
from pentapod.base.tables import TomlTable, table_of
from pentapod.base.units import from_si, split_key, to_si
from pentapod.cutters import CUTTERS
from pentapod.job.schema.tables import JobTables, table_model
from pentapod.machine.tables import PARTS
from pentapod.toolpath import STRATEGIES, GougeOptions, Orientation, Region


class Colour(StrEnum):
    RED = "red"
    BLUE = "blue"


@dataclass(frozen=True)
class Sample:
    """A sample. More of it."""

    radius: Annotated[float, Key("mm", "of the ball", name="diameter", share=0.5, gt=0.0, le=100.0)]
    step: Annotated[float, Key("mm", "between lines", gt=0.0, of_part=1.0)] = 2e-3
    turn: Annotated[float | None, Key("deg", "of the lines", ge=-90.0, lt=90.0)] = None
    colour: Annotated[Colour | str, Key("", "of the lines")] = Colour.RED
    inner: float = 1.0

    def __post_init__(self) -> None:
        check_fields(self, ToolpathError)


TABLE = table_of(Sample, TomlTable)


def test_a_table_has_the_declared_keys_in_the_unit_of_files():
    table = TABLE.model_validate({"diameter_mm": 6})
    assert table.model_dump() == {"diameter_mm": 6.0, "step_mm": 2.0, "turn_deg": None, "colour": "red"}
    assert TABLE.__doc__ == "A sample."
    assert Sample(**fields_from(Sample, table)) == Sample(radius=3e-3)
    assert table.si.step == 2e-3
    assert file_key(Sample, "radius") == "diameter_mm"
    assert file_key(Sample, "inner") is None


@pytest.mark.parametrize(
    "values", [{}, {"diameter_mm": 0.0}, {"colour": "green"}, {"turn_deg": 90.0}, {"step": 1.0}, {"step_mm": "2"}]
)
def test_a_table_keeps_the_declared_bounds(values):
    with pytest.raises(ValidationError):
        TABLE.model_validate({"diameter_mm": 1.0, **values} if values else {})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"step": 0.0}, "step: must be positive"),
        ({"step": np.nan}, "step: must be finite"),
        ({"turn": 2.0}, r"turn: out of range \(got 2.0\); expected at least -1.5708 and less than 1.5708"),
        ({"radius": 0.051}, "radius: out of range"),
        ({"colour": "bleu"}, 'colour: unknown colour .*did you mean "blue"'),
    ],
)
def test_fields_keep_the_declared_bounds_in_si(change, message):
    with pytest.raises(ToolpathError, match=message):
        Sample(**{"radius": 1e-3, **change})


def test_lengths_are_checked_against_the_part():
    check_size(Sample(1e-3, step=0.2), 0.2, ToolpathError)
    check_size(Sample(1e-3), 1e-4, ToolpathError)  # a default is never refused
    message = r"step: 3 m is larger than the part \(0.2 m\); lengths are in metres"
    with pytest.raises(ToolpathError, match=message):
        check_size(Sample(1e-3, step=3.0), 0.2, ToolpathError)
    with pytest.raises(ToolpathError, match="more than 10 times as large as the part"):
        check_size(Sample(0.05, step=1e-4), 1e-3, ToolpathError)


def test_every_default_is_the_same_in_si_and_in_the_unit_of_files():
    parts = {
        "region": Region,
        "axis": Orientation,
        "gouge": GougeOptions,
        **{part.__name__: part for parts in PARTS.values() for part in parts},
        **CUTTERS,
        **{name: strategy.options for name, strategy in STRATEGIES.items()},
        **{cls.__name__: cls for name in JobTables.model_fields for cls in table_model(name).declared_by},
    }
    for cls in parts.values():
        for item in declared(cls):
            assert item.key.meaning
            if not item.is_needed and item.file_default is not None and isinstance(item.default, float | np.ndarray):
                np.testing.assert_array_equal(item.key.si(item.file_default), item.default, item.file_key)


@given(st.floats(-1e6, 1e6), st.sampled_from(["mm", "mm_min", "deg", "deg_mm", "ms", "per_mm", "s", ""]))
def test_units_convert_there_and_back(value, unit):
    assert from_si(to_si(value, unit), unit) == pytest.approx(value, rel=1e-14, abs=1e-300)
    np.testing.assert_array_equal(
        to_si([value, 1.0], unit) if unit else [value, 1.0], [to_si(value, unit), to_si(1.0, unit)]
    )


def test_the_unit_of_a_key_is_its_end():
    assert split_key("max_tip_jerk_mm_s3") == ("max_tip_jerk", "mm_s3")
    assert split_key("rate_deg_mm") == ("rate", "deg_mm")
    assert split_key("levels") == ("levels", "")
    assert to_si(None, "mm") is None
    assert to_si(1800.0, "mm_min") == 1800.0 * (1e-3 / 60.0)


def test_jobs_and_machine_files_convert_units_in_one_module():
    source = Path(pentapod.__file__).parent
    files = [*(source / "job").rglob("*.py"), source / "machine" / "reader.py", source / "machine" / "tables.py"]
    conversion = re.compile(r"\b1e-?3\b|/ ?1000\b|np\.radians|math\.radians")
    assert [str(file) for file in files if conversion.search(file.read_text(encoding="utf-8"))] == []
