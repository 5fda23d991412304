"""`__all__`: there, true, without doubles, and documented."""

import ast
import importlib
import inspect
import pkgutil
from pathlib import Path

import pytest

import pentapod

PACKAGES = sorted(f"pentapod.{m.name}" for m in pkgutil.iter_modules(pentapod.__path__) if m.ispkg)


def test_packages_export_what_they_say_and_document_it() -> None:
    for name in PACKAGES:
        package = importlib.import_module(name)
        assert package.__doc__, name
        assert len(set(package.__all__)) == len(package.__all__), name
        for exported in package.__all__:
            value = getattr(package, exported)
            if inspect.isclass(value) or inspect.isroutine(value):
                assert value.__doc__, f"{name}.{exported}"


@pytest.mark.parametrize(
    "room", ["pentapod", *(f"pentapod.{name}" for name in ("job", "kinematics", "machine", "toolpath"))]
)
def test_the_imports_for_type_checkers_are_the_names_that_load(room: str) -> None:
    package = importlib.import_module(room)
    tree = ast.parse(Path(str(package.__file__)).read_text(encoding="utf-8"))
    guard = next(node for node in tree.body if isinstance(node, ast.If))
    typed = {}
    for node in guard.body:
        assert isinstance(node, ast.ImportFrom)
        typed |= {alias.asname: node.module for alias in node.names}
    assert sorted(typed) == sorted(package.__all__)
    inner = {entry.name for entry in pkgutil.iter_modules(package.__path__)} if room != "pentapod" else set()
    assert inner.isdisjoint(typed), "a module hides the name once it is loaded"
    for name, home in typed.items():
        value = getattr(package, name)
        assert value is getattr(importlib.import_module(home), name) or name in ("verify", "batch"), name
    assert set(package.__all__) <= set(dir(package))


def test_unknown_names_are_attribute_errors() -> None:
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        _ = pentapod.nonsense


def test_verify_is_the_package_and_can_be_called() -> None:
    from pentapod.verify import Verdict
    from pentapod.verify import verify as function

    assert pentapod.verify.Verdict is Verdict
    assert inspect.signature(function).parameters.keys() >= {"program", "machine", "toolpath", "asked"}
    refusal = pentapod.Refusal("placement", "it does not fit")
    assert pentapod.verify(refusal) is function(refusal) is refusal
