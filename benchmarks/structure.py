"""How the source is built: lines, files, folders, arrows between rooms; what was asked and what is reached.

python benchmarks/structure.py
"""

from __future__ import annotations

import ast
import re
import statistics
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "pentapod"
FIVES = ("kinematics", "theory")
"""Rooms where a five may mean five legs."""


def files() -> list[Path]:
    """Return the modules of the package but those of `theory/`."""
    return [path for path in sorted(SOURCE.rglob("*.py")) if path.relative_to(SOURCE).parts[0] != "theory"]


def tree_of(path: Path) -> ast.Module:
    """Return the syntax tree of a file."""
    return ast.parse(path.read_text(encoding="utf-8"))


def room_of(path: Path) -> str:
    """Return the top-level room in which a file stands."""
    return path.relative_to(SOURCE).parts[0]


def imports(tree: ast.Module) -> Iterator[tuple[str, str]]:
    """Yield module and name of what a file imports from the package; imports within functions count as well."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("pentapod."):
            yield from ((str(node.module), alias.name) for alias in node.names)


def arrows() -> set[tuple[str, str]]:
    """Return file → module imports that go from one room to another, each once."""
    found: set[tuple[str, str]] = set()
    for path in files():
        for module, _ in imports(tree_of(path)):
            if module.split(".")[1] != room_of(path):
                found.add((room_of(path), module))
    return found


def fives() -> list[str]:
    """Return places above kinematics with a literal 5 or 10 that stands for legs: in shapes, ranges and products."""
    pattern = re.compile(r"(range\(5\)|, 5\)|\(5,|\* 5\b|== 5\b|!= 5\b|, 10\)\))")
    found: list[str] = []
    for path in files():
        if room_of(path) in FIVES:
            continue
        docs = {
            line
            for node in ast.walk(tree_of(path))
            if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
            for line in range(node.lineno, (node.end_lineno or node.lineno) + 1)
        }
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
            code = line.split("#")[0]
            if number not in docs and pattern.search(code):
                found.append(f"{path.relative_to(SOURCE)}:{number}: {code.strip()}")
    return found


def private_constants() -> int:
    """Return how many private constants stand at the top of modules with a number as their value."""
    return sum(
        isinstance(target, ast.Name) and bool(re.fullmatch(r"_[A-Z][A-Z0-9_]*", target.id))
        for path in files()
        for node in tree_of(path).body
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Constant | ast.UnaryOp | ast.BinOp)
        for target in node.targets
    )


def main() -> None:
    """Print the measures."""
    lengths = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in files()}
    folders = {folder: len(list(folder.glob("*.py"))) for folder in {path.parent for path in lengths}}
    longest = max(lengths, key=lengths.__getitem__)
    fullest = max(folders, key=folders.__getitem__)
    rows = (
        ("lines without theory/", "<= 34,500", f"{sum(lengths.values()):,}"),
        ("files without theory/", "", f"{len(lengths)}"),
        ("median of lines a file", "<= 130", f"{statistics.median(lengths.values()):.0f}"),
        ("longest file", "<= 300", f"{lengths[longest]} ({longest.relative_to(SOURCE)})"),
        ("files above 300 lines", "0", f"{sum(n > 300 for n in lengths.values())}"),
        ("folders above 15 files", "0", f"{sum(n > 15 for n in folders.values())}"),
        ("fullest folder", "<= 15", f"{folders[fullest]} ({fullest.relative_to(SOURCE)})"),
        ("arrows from room to room", "<= 160", f"{len({(a, b.split('.')[1]) for a, b in arrows()})}"),
        ("arrows from a room to a module of another", "", f"{len(arrows())}"),
        ("cycles of files or folders", "0", "0 (tests/test_floors.py)"),
        ("literal fives above kinematics/", "0", f"{len(fives())}"),
        ("private constants that are numbers", "", f"{private_constants()}"),
    )
    for what, asked, reached in rows:
        print(f"{what:<42} {asked:<10} {reached}")
    for place in fives():
        print(f"  {place}")


if __name__ == "__main__":
    main()
