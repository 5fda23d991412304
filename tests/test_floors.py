"""The floors of docs/architecture.md: a room imports from lower floors only; no cycle of folders, none of files."""

import ast
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path

import pentapod

SOURCE = Path(pentapod.__file__).parent

FLOORS: tuple[tuple[str, ...], ...] = (
    # Each floor is a tuple of rooms, which do not import each other.
    ("base",),
    ("numerics",),
    ("geometry",),
    ("mesh", "cutters", "kinematics"),
    ("toolpath", "machine", "theory"),
    ("planning",),
    ("timing",),
    ("program",),
    ("verify",),
    ("simulate", "registration"),
    ("job",),
    ("report",),
    ("view", "batch"),
    ("design",),
    ("cli",),
)
PLACES = {room: floor for floor, rooms in enumerate(FLOORS) for room in rooms}
FOR_NOBODY = ("theory",)
"""Rooms for those who write scripts: nothing else imports them."""


def modules() -> list[Path]:
    return sorted(p for p in SOURCE.rglob("*.py") if p != SOURCE / "__init__.py")


def module_name(path: Path) -> str:
    parts = path.relative_to(SOURCE).with_suffix("").parts
    return ".".join(("pentapod", *(parts[:-1] if parts[-1] == "__init__" else parts)))


FILES = {module_name(path): path for path in modules()}


def imported(tree: ast.AST) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "relative imports hide the floor"
            assert node.module is not None
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                yield inner if inner in FILES else node.module


@cache
def imports_of(path: Path) -> set[str]:
    """Return what of the package a file imports; imports within functions count as well."""
    found = imported(ast.parse(path.read_text(encoding="utf-8")))
    return {name for name in found if name.split(".")[0] == "pentapod"}


def cycle_in(graph: Mapping[str, set[str]]) -> tuple[str, ...]:
    """Return names that lead back to the first, or nothing."""
    done: set[str] = set()

    def visit(name: str, above: tuple[str, ...]) -> tuple[str, ...]:
        if name in above:
            return (*above[above.index(name) :], name)
        for target in () if name in done else sorted(graph.get(name, ())):
            if found := visit(target, (*above, name)):
                return found
        done.add(name)
        return ()

    return next((found for name in sorted(graph) if (found := visit(name, ()))), ())


def test_the_root_holds_rooms_only() -> None:
    assert {path.relative_to(SOURCE).parts[0] for path in modules()} == set(PLACES)


def test_imports_point_down() -> None:
    for path in modules():
        room = path.relative_to(SOURCE).parts[0]
        for name in imports_of(path):
            parts = name.split(".")
            assert len(parts) > 1, "import from where a name lives, not from the package that re-exports it"
            if parts[1] != room:
                assert parts[1] in PLACES, f"{name} stands on no floor"
                assert PLACES[parts[1]] < PLACES[room], f"{module_name(path)} must not import {name}"
                assert parts[1] not in FOR_NOBODY, f"{module_name(path)} must not import {name}"


def test_no_cycles_of_files() -> None:
    graph = {name: (imports_of(path) & set(FILES)) - {name} for name, path in FILES.items()}
    assert cycle_in(graph) == ()


def test_no_cycles_of_folders() -> None:
    """Sub-folders too. What an `__init__` hands on does not count: it only names what its folder holds."""
    graph: dict[str, set[str]] = {}
    for path in FILES.values():
        if path.name == "__init__.py":
            continue
        targets = graph.setdefault(str(path.parent.relative_to(SOURCE)), set())
        for name in imports_of(path) & set(FILES):
            if FILES[name].name != "__init__.py" and FILES[name].parent != path.parent:
                targets.add(str(FILES[name].parent.relative_to(SOURCE)))
    assert cycle_in(graph) == ()


def test_the_checks_can_fail() -> None:
    code = "import pentapod.cli\nfrom pentapod import planning\nfrom pentapod.verify import x"
    assert set(imported(ast.parse(code))) == {"pentapod.cli", "pentapod.planning", "pentapod.verify"}
    assert cycle_in({"a": {"b"}, "b": {"c"}, "c": {"b"}}) == ("b", "c", "b")
    assert cycle_in({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == ()
