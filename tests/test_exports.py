"""`__all__`: there, true, sorted, and documented."""

import ast
import importlib
import inspect
import pkgutil
from pathlib import Path

import pytest

import pentapod

PACKAGES = sorted(f"pentapod.{m.name}" for m in pkgutil.iter_modules(pentapod.__path__) if m.ispkg)


@pytest.mark.parametrize("name", PACKAGES)
def test_packages_export_what_they_say(name: str) -> None:
    package = importlib.import_module(name)
    assert package.__doc__
    assert "TODO" not in package.__doc__
    assert len(set(package.__all__)) == len(package.__all__)
    for exported in package.__all__:
        assert hasattr(package, exported), exported


@pytest.mark.parametrize("name", PACKAGES)
def test_public_functions_and_classes_have_docstrings(name: str) -> None:
    package = importlib.import_module(name)
    for exported in package.__all__:
        value = getattr(package, exported)
        if inspect.isclass(value) or inspect.isroutine(value):
            assert value.__doc__, f"{name}.{exported}"


@pytest.mark.parametrize("name", pentapod.__all__)
def test_top_level_names_load(name: str) -> None:
    value = getattr(pentapod, name)
    if callable(value):
        home = importlib.import_module(f"pentapod.{pentapod._HOMES[name]}")
        assert getattr(home, name) is value


def test_the_three_lists_of_the_top_level_agree() -> None:
    tree = ast.parse(Path(pentapod.__file__).read_text(encoding="utf-8"))
    guard = next(node for node in tree.body if isinstance(node, ast.If))
    typed = {}
    for node in guard.body:
        assert isinstance(node, ast.ImportFrom)
        assert node.module is not None
        typed |= {alias.asname: node.module.removeprefix("pentapod.") for alias in node.names}
    assert typed == pentapod._HOMES
    assert list(pentapod._HOMES) == pentapod.__all__


def test_unknown_names_are_attribute_errors() -> None:
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        _ = pentapod.nonsense
    assert set(pentapod.__all__) <= set(dir(pentapod))
