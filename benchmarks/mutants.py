"""Mutants of a source file by cosmic-ray's operators, and how one takes the place of the code that is loaded."""

from __future__ import annotations

import ast
import difflib
import functools
import inspect
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator

OPERATORS = (
    "NumberReplacer",
    "AddNot",
    "ReplaceAndWithOr",
    "ReplaceOrWithAnd",
    "ReplaceTrueWithFalse",
    "ReplaceFalseWithTrue",
    "ReplaceUnaryOperator_Delete_Not",
    "ReplaceUnaryOperator_Delete_USub",
    "ZeroIterationForLoop",
    *(f"ReplaceComparisonOperator_{a}_{b}" for a, b in (("Lt", "GtE"), ("LtE", "Gt"), ("Gt", "LtE"), ("GtE", "Lt"))),
    *(f"ReplaceComparisonOperator_{a}_{b}" for a, b in (("Eq", "NotEq"), ("Is", "IsNot"), ("IsNot", "Is"))),
    *(f"ReplaceBinaryOperator_{a}_{b}" for a, b in (("Add", "Sub"), ("Sub", "Add"), ("Mul", "Div"), ("Div", "Mul"))),
)
_MEANINGLESS = re.compile(r"[+-]_(BLOCK|AT_ONCE|CHUNK|LOOKED_AT)\b|\+.*[(\s]/,")
"""Constants that decide how much is done in one go, and nothing else; the star before arguments by name, divided."""


@dataclass(frozen=True)
class Mutant:
    """A changed source of a file; lines: of the statement that changed. told: what changed, for people."""

    file: Path
    source: str
    lines: range
    told: str


def places(file: Path) -> Iterator[tuple[str, int]]:
    """Yield operator and occurrence of every mutant of a file."""
    nodes = list(ast_nodes(get_ast(file.read_text(encoding="utf-8"))))
    for name in OPERATORS:
        operator = get_operator(f"core/{name}")()
        yield from ((name, k) for k in range(sum(len(list(operator.mutation_positions(node))) for node in nodes)))


def mutant(file: Path, name: str, occurrence: int) -> Mutant | None:
    """Return a mutant; None where the change means nothing."""
    source = file.read_text(encoding="utf-8")
    mutated = mutate_code(source, get_operator(f"core/{name}")(), occurrence)
    if mutated is None:
        raise SystemExit(f"{file.name} has no mutant {name} {occurrence}")
    before, after = source.splitlines(), mutated.splitlines()
    changed = [line for line in difflib.unified_diff(before, after, lineterm="", n=0) if line[:3] not in ("+++", "---")]
    if any(_MEANINGLESS.match(line) for line in changed):
        return None
    first = next(k for k, (old, new) in enumerate(zip(before, after, strict=False), start=1) if old != new)
    return Mutant(file, mutated, statement(source, first), f"{file.name} {name}: {'  '.join(changed)}")


@functools.cache
def _spans(source: str) -> tuple[range, ...]:
    """Return the lines of each statement, of those with a body only the head; the inner ones last."""
    spans: list[range] = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.stmt) and node.end_lineno is not None:
            body = getattr(node, "body", None)
            spans.append(range(node.lineno, body[0].lineno if body else node.end_lineno + 1))
    return tuple(spans)


def statement(source: str, line: int) -> range:
    """Return the lines of the innermost statement that this line belongs to."""
    return min((span for span in _spans(source) if line in span), key=len, default=range(line, line + 1))


# In place of what was loaded.


def _parts(code: CodeType) -> tuple[object, ...]:
    """Return what a code object is made of, but for the code objects in it."""
    return code.co_code, tuple(c for c in code.co_consts if not isinstance(c, CodeType)), code.co_names


def changed_functions(old: CodeType, new: CodeType) -> list[CodeType] | None:
    """Return the functions of `new` that differ from those of `old`; None where anything else differs, too."""
    if repr(_parts(old)) != repr(_parts(new)):
        return [new] if new.co_flags & inspect.CO_OPTIMIZED else None
    pairs = zip(*([c for c in code.co_consts if isinstance(c, CodeType)] for code in (old, new)), strict=True)
    if new.co_flags & inspect.CO_OPTIMIZED:
        return [new] if any(changed_functions(*pair) != [] for pair in pairs) else []
    found = [changed_functions(*pair) for pair in pairs]
    return None if None in found else [code for codes in found if codes for code in codes]


def function(module: ModuleType, name: str) -> FunctionType | None:
    """Return the function of a module that has this qualified name, from within what wraps it."""
    value: Any = module
    for part in name.split("."):
        value = inspect.getattr_static(value, part, None)
    for wrapped in ("func", "fget", "__func__"):
        value = getattr(value, wrapped, value)
    return value if isinstance(value, FunctionType) else None


def put(it: Mutant) -> bool:
    """Change the functions that are loaded to those of a mutant. False where that is not enough to make it."""
    name = ".".join(it.file.with_suffix("").parts).rpartition(".src.")[2]
    module = sys.modules[name]
    sources = it.file.read_text(encoding="utf-8"), it.source
    changed = changed_functions(*(compile(source, str(it.file), "exec", dont_inherit=True) for source in sources))
    found = [(function(module, code.co_qualname), code) for code in changed or ()]
    if not found or any(old is None for old, _ in found):
        return False
    for old, code in found:
        old.__code__ = code  # pyright: ignore[reportOptionalMemberAccess]
    return True
