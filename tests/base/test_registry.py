"""Registry: things by name, pentapod's own and those of other packages."""

import importlib.metadata

import pytest

from pentapod.base import InputError, MeshError, Registry
from plugins import install

GROUP = "pentapod.test_things"
CODE = """
THING = "spoon"
NUMBER = 3

def make():
    return "ladle"

def broken():
    return 1 / 0
"""


@pytest.fixture
def things(tmp_path, monkeypatch):
    names = {
        n: f"others:{c}"
        for n, c in {
            "spoon": "THING",
            "ladle": "make",
            "three": "NUMBER",
            "torn": "broken",
            "gone": "nothing",
            "fork": "THING",
        }.items()
    }
    install(tmp_path, monkeypatch, {GROUP: names}, others=CODE)
    registry = Registry("thing", GROUP, str)
    assert registry.register("fork", "FORK") == "FORK"
    return registry


def test_own_things_come_before_those_of_packages(things):
    assert next(iter(things)) == "fork"
    assert things.find("fork") == things["fork"] == "FORK"
    assert set(things) == {"fork", "spoon", "ladle", "three", "torn", "gone"}
    assert dict(things.own) == {"fork": "FORK"}


def test_a_package_names_a_thing_or_what_makes_it(things):
    assert things["spoon"] == "spoon"
    assert things["ladle"] == "ladle"


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("three", 'three: the entry point names no thing .*others:NUMBER.*expected a pentapod str.*package "others"'),
        ("torn", 'torn: this thing cannot be loaded: ZeroDivisionError.*repair or remove the package "others"'),
        ("gone", 'gone: this thing cannot be loaded: AttributeError.*repair or remove the package "others"'),
        ("spon", 'unknown thing.*did you mean "spoon"'),
    ],
)
def test_registry_errors_name_the_package(things, name, said):
    with pytest.raises(InputError, match=said) as caught:
        things.find(name)
    assert "\n" not in str(caught.value)


def test_registry_names_the_nearest_for_an_unknown_name(things):
    assert "knife" not in things
    with pytest.raises(KeyError):
        things["knife"]
    with pytest.raises(MeshError, match="strategy: unknown thing"):
        Registry("thing", GROUP, str, MeshError).find("knife", key="strategy")


def test_packages_are_not_looked_for_where_the_thing_is_ours(things, monkeypatch):
    def never(**query):
        raise AssertionError(query)

    monkeypatch.setattr(importlib.metadata, "entry_points", never)
    assert things.find("fork") == "FORK"
    assert "fork" in things
    with pytest.raises(AssertionError):
        things.find("spoon")
