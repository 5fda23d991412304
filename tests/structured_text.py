"""Structured Text of one function block, translated to C line by line, compiled, and called through ctypes.

Only what the generated file uses is known: a line of another form is an error. Names are told apart without regard to
upper and lower case, as controllers do.
"""

from __future__ import annotations

import ctypes
import re
import subprocess
from pathlib import Path

import numpy as np

from compiled_kinematics import COMPILER, STRICT

TYPES = {"LREAL": "double", "INT": "int", "BOOL": "int"}
FUNCTIONS = {
    "SQRT": "sqrt", "ABS": "fabs", "SIN": "sin", "COS": "cos", "ASIN": "asin", "ATAN": "atan", "MAX": "fmax",
    "MIN": "fmin", "INT_TO_LREAL": "(double)", "AND": "&&", "OR": "||", "NOT": "!", "TRUE": "1", "FALSE": "0",
}  # fmt: skip
RESERVED = frozenset(
    re.findall(
        r"\w+",
        """action at by case configuration do else exit for function if in interval jmp len mod of on program read_only
        real repeat resource retain return round step task then to transition trunc until var while with xor""",
    )
)
"""Words that the language keeps: no name may be one of them."""

HEAD = "#include <math.h>\n"
CALLS = """
void inverses(long n, const double *world, double *legs, double *margins, int *good)
{
    long k, c;
    for (k = 0; k < n; k++) {
        for (c = 0; c < 5; c++)
            cartesian_io[c] = world[5 * k + c];
        good[k] = cartesiantoaxes(cartesian_io, axes_io);
        for (c = 0; c < 5; c++)
            legs[5 * k + c] = axes_io[c];
        for (c = 0; c < 7; c++)
            margins[7 * k + c] = margin[c];
    }
}

void worlds(long n, const double *legs, double *world, int *good)
{
    long k, c;
    for (k = 0; k < n; k++) {
        for (c = 0; c < 5; c++) {
            axes_io[c] = legs[5 * k + c];
            cartesian_io[c] = NAN;
        }
        good[k] = axestocartesian(axes_io, cartesian_io);
        for (c = 0; c < 5; c++)
            world[5 * k + c] = cartesian_io[c];
    }
}
"""


def translated(text: str) -> str:
    """The block as C: its variables are static, its methods are functions, in-out variables are parameters."""
    text = re.sub(r"\(\*.*?\*\)", "", text, flags=re.S)
    body = re.fullmatch(r"\s*FUNCTION_BLOCK \w+\n(.*)END_FUNCTION_BLOCK\s*", text, re.S)[1]
    block, *methods = re.split(r"^METHOD ", body, flags=re.M)
    heads = [re.match(r"(?:PUBLIC|PRIVATE) (\w+) : (\w+)\n", method) for method in methods]
    names = {head[1].lower() for head in heads}
    declared, inside = _variables(block)
    assert not inside.strip()
    _check(name for name, _ in declared)
    made = ["".join(f"static {code}" for _, code in declared)]
    made.append("static double cartesian_io[5], axes_io[5];\n")
    bodies: list[str] = []
    for head, method in zip(heads, methods, strict=True):
        name, kind = head[1].lower(), TYPES[head[2]]
        content = re.fullmatch(r"(.*)END_METHOD\s*", method[head.end() :], re.S)[1]
        given = re.search(r"VAR_IN_OUT\n(.*?)END_VAR\n", content, re.S)
        parameters = [] if given is None else re.findall(r"(\w+) : ARRAY\[0\.\.4\] OF LREAL;", given[1])
        content = content if given is None else content.replace(given[0], "")
        own, statements = _variables(content)
        _check([name, *(n for n, _ in declared), *names - {name}, *(n for n, _ in own), *map(str.lower, parameters)])
        signature = ", ".join(f"double {parameter.lower()}[5]" for parameter in parameters) or "void"
        made.append(f"static {kind} {name}({signature});\n")
        lines = [_statement(line, name, names) for line in statements.splitlines() if line.strip()]
        local = "".join(f"    {code}" for _, code in own)
        bodies.append(
            f"static {kind} {name}({signature})\n{{\n    {kind} {name}_result = 0;\n{local}"
            + "\n".join(lines)
            + f"\n    return {name}_result;\n}}\n"
        )
    return HEAD + "".join(made) + "".join(bodies) + CALLS


def _check(names) -> None:
    """No name twice, whatever its case, and none that the language keeps."""
    names = list(names)
    assert len(set(names)) == len(names), sorted(name for name in names if names.count(name) > 1)
    assert not set(names) & RESERVED


def _variables(text: str) -> tuple[list[tuple[str, str]], str]:
    """Names and declarations in C, and the text that is left."""
    found: list[tuple[str, str]] = []
    sections = re.findall(r"^VAR(?:_INPUT|_OUTPUT| CONSTANT)?\n(.*?)^END_VAR\n", text, re.S | re.M)
    for declaration in re.findall(r"[^;]+;", "".join(sections)):
        names, kind, value = re.fullmatch(r"\s*([\w, ]+?) : (.*?)(?: := (.*))?;", declaration, re.S).groups()
        shape = re.fullmatch(r"ARRAY\[(.*)\] OF (\w+)", kind)
        sizes = re.findall(r"0\.\.(\d+)", shape[1]) if shape else []
        size = "".join(f"[{int(last) + 1}]" for last in sizes)
        kind = TYPES[shape[2] if shape else kind]
        text_of = ""
        if value is not None:
            values = [_expression(v, "", set()) for v in value.strip("[]").split(",")]
            cells = np.prod([int(last) + 1 for last in sizes]) if sizes else 1
            assert len(values) == cells, names
            flat = "{" + ", ".join(values) + "}"
            rows = np.array(values, dtype=object).reshape([int(last) + 1 for last in sizes]) if len(sizes) == 2 else []
            nested = "{" + ", ".join("{" + ", ".join(row) + "}" for row in rows) + "}"
            text_of = f" = {nested if len(sizes) == 2 else flat if sizes else values[0]}"
        for name in names.lower().split(", "):
            found.append((name, f"{kind} {name}{size}{text_of};\n"))
    return found, re.sub(r"^VAR(?:_INPUT|_OUTPUT| CONSTANT)?\n.*?^END_VAR\n", "", text, flags=re.S | re.M)


def _expression(text: str, method: str, names: set[str]) -> str:
    def word(match: re.Match[str]) -> str:
        name = match[0]
        if name in FUNCTIONS:
            return FUNCTIONS[name]
        lower = name.lower()
        if lower == method:
            return f"{lower}_result"
        return f"{lower}()" if lower in names and match.string[match.end() : match.end() + 1] == "(" else lower

    text = re.sub(r"\[(\w[^\],]*), ([^\]]*)\]", r"[\1][\2]", text.strip())
    assert not re.search(r"[^<>:]=|<>", text), text
    return re.sub(r"(?<![\d.\w])[A-Za-z_]\w*", word, text).replace("()()", "()")


def _statement(line: str, method: str, names: set[str]) -> str:
    text = line.strip()
    if loop := re.fullmatch(r"FOR (\w+) := (.*?) TO (.*?)(?: BY (-1))? DO", text):
        k, (a, b) = loop[1].lower(), (_expression(loop[part], method, names) for part in (2, 3))
        return f"for ({k} = {a}; {k} {'>=' if loop[4] else '<='} {b}; {k}{'--' if loop[4] else '++'}) {{"
    if condition := re.fullmatch(r"IF (.*) THEN", text):
        return f"if ({_expression(condition[1], method, names)}) {{"
    fixed = {"END_IF;": "}", "END_FOR;": "}", "ELSE": "} else {", "RETURN;": f"return {method}_result;"}
    if text in fixed:
        return fixed[text]
    if call := re.fullmatch(r"(\w+)\(\);", text):
        return f"(void){call[1].lower()}();"
    place, value = re.fullmatch(r"(\w+(?:\[[^\]]*\])?) := ([^;]*);", text).groups()
    return f"{_expression(place, method, names)} = {_expression(value, method, names)};"


class Translated:
    """The function block of a machine: millimetres and degrees, as its methods take them."""

    def __init__(self, text: str, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "block.c").write_text(translated(text), encoding="utf-8")
        flags = ["-O2", "-fPIC", "-shared", "block.c", "-o", "block.so", "-lm", "-Wno-unused-function"]
        subprocess.run([COMPILER, *STRICT, *flags], cwd=folder, check=True, timeout=60)
        self.library = ctypes.CDLL(str(folder / "block.so"))

    def inverses(self, worlds: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Legs (N, 5), margins (N, 7), and whether all margins are kept (N,)."""
        legs, margins = np.empty((len(worlds), 5)), np.empty((len(worlds), 7))
        good = np.empty(len(worlds), dtype=np.intc)
        given = [np.ascontiguousarray(worlds), legs, margins, good]
        self.library.inverses(len(worlds), *(array.ctypes.data_as(ctypes.c_void_p) for array in given))
        return legs, margins, good.astype(bool)

    def worlds(self, legs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """XYZAB (N, 5), and whether there is such a pose (N,)."""
        world, good = np.empty((len(legs), 5)), np.empty(len(legs), dtype=np.intc)
        given = [np.ascontiguousarray(legs), world, good]
        self.library.worlds(len(legs), *(array.ctypes.data_as(ctypes.c_void_p) for array in given))
        return world, good.astype(bool)
