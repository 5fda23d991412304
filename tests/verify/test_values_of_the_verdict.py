"""What holds of every value that the verdict is made of: frozen, and compared by identity where it holds arrays."""

import dataclasses
import importlib
import inspect
import pkgutil

import pytest

import pentapod.verify

BEING_FILLED = {"Survey", "ComponentFindings"}  # while the walk along the program goes on


def values():
    for info in pkgutil.iter_modules(pentapod.verify.__path__):
        module = importlib.import_module(f"pentapod.verify.{info.name}")
        for value in vars(module).values():
            if inspect.isclass(value) and value.__module__ == module.__name__ and dataclasses.is_dataclass(value):
                yield value


@pytest.mark.parametrize("value", list(values()), ids=lambda value: value.__name__)
def test_values_are_frozen_and_those_with_arrays_are_equal_to_nothing_but_themselves(value):
    empty = object.__new__(value)
    name = dataclasses.fields(value)[0].name
    if value.__name__ in BEING_FILLED:
        setattr(empty, name, 0)
    else:
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(empty, name, 0)
    heavy = ("Floats", "Ints", "Bools", "Extreme", "Course", "MeshDistance", "Program")
    holds_arrays = any(part in str(field.type) for field in dataclasses.fields(value) for part in heavy)
    assert (value.__eq__ is object.__eq__) == holds_arrays
