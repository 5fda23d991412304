"""Value: short `repr`, equality by content, pickles."""

import pickle
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import pytest

from pentapod.base import Value
from pentapod.base.arrays import Floats, frozen, set_frozen


@dataclass(frozen=True, eq=False)
class Path(Value):
    summary = ("count",)

    tips: Floats
    name: str = "a path"
    parts: tuple[object, ...] = ()
    limits: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        set_frozen(self, tips=frozen(self.tips, "tips", (None, 3)))

    @property
    def count(self) -> int:
        return len(self.tips)

    @cached_property
    def total(self) -> float:
        return float(self.tips.sum())


TIPS = np.linspace(-0.5, 1.0, 30).reshape(10, 3)


def test_repr_says_what_a_value_holds():
    assert repr(Path(TIPS, "x", (1, 0.25), {"feed": 1.0})) == (
        "Path(count=10, tips=[10×3] -0.5…1 m, name='x', parts=(1, 0.25), limits={feed})"
    )
    assert repr(Path(TIPS, parts=(Path(TIPS),))).startswith("Path(count=10, tips=[10×3]")
    assert "parts=7 × Path" in repr(Path(TIPS, parts=(Path(TIPS),) * 7))
    assert "parts=(Path(count=10))" in repr(Path(TIPS, parts=(Path(TIPS),)))
    assert "[3] 2 true" in repr(Path(TIPS, parts=(np.array([True, True, False]),)))


@pytest.mark.parametrize("length", [0, 10, 100, 10_000])
def test_repr_has_at_most_300_characters(length):
    words = "word " * length
    value = Path(TIPS, words, (words,) * 5, {words: 1.0, words + "1": 2.0})
    assert len(repr(value)) <= 300
    assert repr(value).startswith("Path(count=10")
    assert repr(value).endswith(")")


def test_values_are_equal_where_their_fields_are():
    hole = TIPS.copy()
    assert Path(TIPS) == Path(hole)
    assert hash(Path(TIPS)) == hash(Path(hole))
    hole[3, 1] += 1e-15
    assert Path(TIPS) != Path(hole)
    assert Path(TIPS) != Path(TIPS, "other")
    assert Path(TIPS, parts=(Path(TIPS),)) == Path(TIPS, parts=(Path(TIPS),))
    assert Path(TIPS, parts=(Path(TIPS),)) != Path(TIPS, parts=(Path(hole),))
    assert Path(TIPS, limits={"a": np.nan}) == Path(TIPS, limits={"a": np.nan})
    assert Path(TIPS) != "a path"
    missing = np.array([1.0, np.nan])
    assert Path(TIPS, parts=(missing,)) == Path(TIPS, parts=(missing.copy(),))


def test_pickles_come_back_equal_read_only_and_without_caches():
    value = Path(TIPS, parts=(frozen([1.0], "x"),))
    assert value.total == TIPS.sum()
    again = pickle.loads(pickle.dumps(value))
    assert again == value
    assert "total" not in vars(again)
    assert not again.tips.flags.writeable
    assert not again.parts[0].flags.writeable
    assert again.total == value.total


def test_frozen_arrays_are_copied_once():
    """What is read-only and owns its numbers is shared; a view may change with the array it looks at."""
    given = np.array([1.0, 2.0])
    once = frozen(given, "x")
    assert once is not given
    assert frozen(once, "x") is once
    view = given[:]
    view.flags.writeable = False
    copied = frozen(view, "x")
    given[0] = 3.0
    assert (once[0], copied[0]) == (1.0, 1.0)
    assert replace(Path(TIPS), name="other").tips is not TIPS
    first = Path(TIPS)
    assert replace(first, name="other").tips is first.tips
