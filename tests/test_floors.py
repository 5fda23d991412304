"""The floors of docs/architecture.md: a package imports from lower floors only, siblings never each other."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import pentapod

SOURCE = Path(pentapod.__file__).parent

FLOORS: tuple[tuple[tuple[str, ...], ...], ...] = (
    # Each floor is a tuple of rooms; the modules within a room may import each other.
    (
        (
            "errors",
            "arrays",
            "refusal",
            "progress",
            "files",
            "input_files",
            "archives",
            "toml_files",
            "version",
            "compiled",
            "kernel_cache",
        ),
    ),
    (("geometry",),),
    (("kinematics",), ("toolpath",)),
    (("machine",),),
    (("planning",),),
    (("timing",),),
    (("program",),),
    (("verify",),),
    (("simulate",),),
    (
        (
            "table",
            "strategy_tables",
            "placement_table",
            "job_tables",
            "job",
            "job_coverage",
            "job_cutting",
            "job_placement",
            "job_sources",
            "job_specification",
            "job_strategy",
            "job_surroundings",
            "job_tool",
            "job_values",
            "job_verdict",
            "outcome",
            "clock",
            "plan_arrays",
            "artefacts",
            "manifest",
            "run_folder",
            "pipeline",
        ),
    ),
    (("report",),),
    (("view",),),
    (("cli",),),
)
PLACES = {
    module: (floor, room) for floor, rooms in enumerate(FLOORS) for room, names in enumerate(rooms) for module in names
}


def top(path: Path) -> str:
    return path.relative_to(SOURCE).parts[0].removesuffix(".py")


def modules() -> list[Path]:
    return sorted(p for p in SOURCE.rglob("*.py") if p != SOURCE / "__init__.py")


def module_name(path: Path) -> str:
    parts = path.relative_to(SOURCE).with_suffix("").parts
    return ".".join(("pentapod", *(parts[:-1] if parts[-1] == "__init__" else parts)))


MODULES = {module_name(path) for path in modules()}


def imported(tree: ast.AST) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "relative imports hide the floor"
            assert node.module is not None
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                yield inner if inner in MODULES else node.module


@pytest.mark.parametrize("path", modules(), ids=lambda p: str(p.relative_to(SOURCE)))
def test_imports_point_down(path: Path) -> None:
    here = top(path)
    assert here in PLACES, f"{here} stands on no floor"
    for name in imported(ast.parse(path.read_text(encoding="utf-8"))):
        parts = name.split(".")
        if parts[0] != "pentapod":
            continue
        assert len(parts) > 1, "import from where a name lives, not from the package that re-exports it"
        there = parts[1]
        if there == here:
            continue
        assert there in PLACES, f"{name} stands on no floor"
        same_room = PLACES[there] == PLACES[here]
        assert same_room or PLACES[there][0] < PLACES[here][0], f"{module_name(path)} must not import {name}"


def test_no_cycles_between_modules() -> None:
    """Imports within functions count as well: a cycle hidden by a late import is a cycle."""
    names = {module_name(path): path for path in modules()}
    graph: dict[str, set[str]] = {}
    for name, path in names.items():
        tree = ast.parse(path.read_text(encoding="utf-8"))
        targets = {target for target in imported(tree) if target in names}
        # A package's __init__ imports its modules; a module that names its own package would close the circle.
        graph[name] = targets - {name}
    done: set[str] = set()

    def visit(name: str, above: tuple[str, ...]) -> None:
        assert name not in above, " → ".join((*above[above.index(name) :], name))
        if name in done:
            return
        for target in sorted(graph[name]):
            visit(target, (*above, name))
        done.add(name)

    for name in graph:
        visit(name, ())


def test_every_floor_exists() -> None:
    assert {top(path) for path in modules()} == set(PLACES)


def test_the_check_can_fail() -> None:
    found = set(
        imported(ast.parse("import pentapod.cli\nfrom pentapod import planning\nfrom pentapod.verify import x"))
    )
    assert found == {"pentapod.cli", "pentapod.planning", "pentapod.verify"}
