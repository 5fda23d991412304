"""Values of a program's header: numbers, text, matrices and boxes from and to TOML, each number rounded once."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from decimal import Decimal
from typing import Any, cast

from pentapod.base.errors import InputError
from pentapod.geometry.rigid import RigidTransform
from pentapod.program.program import Switch
from pentapod.toolpath.linking.partition import Piece


def number_of(value: Any, shift: int = 0) -> float:
    """Return a TOML number times 10^shift, rounded once; NaN for anything else, and for what no double holds."""
    if type(value) is not int and not isinstance(value, Decimal):
        return math.nan
    exact = Decimal(value)
    # Beyond this a double overflows anyway, and Decimal's own arithmetic would raise.
    if not exact.is_finite() or exact.adjusted() > 400:
        return math.nan
    return float(exact.scaleb(shift)) if exact.adjusted() > -400 else 0.0


def list_of(value: Any) -> list[Any]:
    """Return a list as it is, and an empty one for anything else."""
    return cast("list[Any]", value) if isinstance(value, list) else []


def bound_of(value: Any) -> float:
    """Return millimetres, or ±inf, as metres; NaN for anything else."""
    if isinstance(value, Decimal) and value.is_infinite():
        return float(value)
    return number_of(value, shift=-3)


def string_text(text: str) -> str:
    """Return a TOML basic string; JSON's escapes are TOML's, but for DEL."""
    try:
        text.encode()
    except UnicodeEncodeError as error:
        raise InputError("a name in the header is not text that UTF-8 can hold", value=text) from error
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def matrix_text(placement: RigidTransform) -> str:
    """Return a rigid transform as a TOML 4×4 matrix, translation in millimetres."""
    shifts = [[3 if j == 3 and k < 3 else 0 for j in range(4)] for k in range(4)]
    rows = (
        ", ".join(map(decimal_text, row.tolist(), shift)) for row, shift in zip(placement.matrix, shifts, strict=True)
    )
    return "[" + ", ".join(f"[{row}]" for row in rows) + "]"


def box_text(piece: Piece) -> str:
    """Return the two corners of a piece as a TOML list, millimetres."""
    corners = (
        ", ".join(decimal_text(x, 3) if math.isfinite(x) else str(x) for x in c) for c in (piece.low, piece.high)
    )
    return "[" + ", ".join(f"[{corner}]" for corner in corners) + "]"


def decimal_text(value: float, shift: int) -> str:
    """Return the shortest digits that give `value` back, times 10^shift, as a TOML float."""
    text = format(Decimal(repr(value)).scaleb(shift), "f")
    return text if "." in text else text + ".0"


def switches_text(switches: Iterable[Switch]) -> str:
    """Return switches as a TOML list of lists: the row, then its words."""
    each = (", ".join([str(switch.row), *map(string_text, switch.words)]) for switch in switches)
    return "[" + ", ".join(f"[{switch}]" for switch in each) + "]"


def switches_of(value: Any, rows: int) -> tuple[Switch, ...]:
    """Return the switches of a TOML list of lists, in a program of so many rows; none for anything else."""
    lists = [list_of(item) for item in list_of(value)]
    if not all(len(item) > 1 and type(item[0]) is int for item in lists):
        return ()
    switches = tuple(Switch(item[0], tuple(item[1:])) for item in lists)
    at = [switch.row for switch in switches]
    words: list[Any] = [word for switch in switches for word in switch.words]
    good = at == sorted(set(at)) and all(0 <= row < rows for row in at)
    return (
        switches
        if good and all(isinstance(word, str) and word.strip() and word.isprintable() for word in words)
        else ()
    )


def pairs_text(pairs: Iterable[tuple[int, int]]) -> str:
    """Return pairs of counts as [[first, last], ...]."""
    return f"[{', '.join(f'[{first}, {last}]' for first, last in pairs)}]"
