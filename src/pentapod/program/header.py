"""The header of a program file: `# key = value` lines, each value in TOML syntax."""

from __future__ import annotations

import json
import math
import re
import tomllib
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Any, cast

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ArrayError, InputError, ProgramError, ToolpathError
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.component import Component
from pentapod.kinematics.five_legs import FiveLegs
from pentapod.program.program import FORMAT_VERSION, Program, Provenance
from pentapod.toolpath.linking.partition import Piece

MAGIC = "pentapod_program"
KEYS = (
    MAGIC,
    "pentapod_version",
    "machine",
    "machine_digest",
    "job_digest",
    "period_s",
    "interpolation",
    "component",
    "placement_mm",
    "rows",
)
GUIDES = "guides_mm"
"""A key that only the programs of reconfigurable machines have."""
WAYPOINTS, BOX = "setup_waypoints", "setup_box_mm"
UNVERIFIED = "UNVERIFIED: no verdict has passed this program"
"""The first line, behind the mark of a comment, of what was written for a controller without a passed verdict."""
SETUP_KEYS = (WAYPOINTS, BOX)
"""Keys that only the programs of several set-ups have."""
MADE_ON = ("processor", "libraries")
"""Keys that a program has which was planned: on another kind of processor or with other libraries bits may differ."""
OPTIONAL_KEYS = (GUIDES, *SETUP_KEYS, *MADE_ON)
_MOST_COUNTED = 2**63
_LINE = re.compile(r"# ([a-z0-9_]+) = (\S.*)")


@dataclass(frozen=True)
class Header:
    """What stands in front of the rows."""

    period: float
    interpolation: Any
    component: Component
    placement: RigidTransform
    provenance: Provenance
    rows: int
    rail_positions: tuple[float, ...] | None = None

    def program(self, legs: Floats) -> Program:
        """Return the program of this header and its rows (N, n_legs), metres."""
        return Program(
            period=self.period,
            legs=legs,
            interpolation=self.interpolation,
            component=self.component,
            placement=self.placement,
            provenance=self.provenance,
            rail_positions=self.rail_positions,
        )


def header_text(program: Program) -> str:
    """Return the header lines of a program, each ended by a newline."""
    source = program.provenance
    values = (
        str(FORMAT_VERSION),
        _string(source.pentapod_version),
        _string(source.machine),
        _string(source.machine_digest),
        _string(source.job_digest),
        repr(float(program.period)),
        _string(program.interpolation),
        _string(str(program.component)),
        _matrix(program.placement),
        str(len(program.legs)),
    )
    lines = [f"# {UNVERIFIED}\n"] if source.unverified else []
    lines += [f"# {key} = {value}\n" for key, value in zip(KEYS, values, strict=True)]
    if program.rail_positions is not None:
        lines.append(f"# {GUIDES} = [{', '.join(_decimal(x, 3) for x in program.rail_positions)}]\n")
    if source.piece is not None:
        lines += [f"# {WAYPOINTS} = [{source.piece.first}, {source.piece.last}]\n", f"# {BOX} = {_box(source.piece)}\n"]
    made_on = zip(MADE_ON, (source.processor, source.libraries), strict=True)
    lines += [f"# {key} = {_string(value)}\n" for key, value in made_on if value]
    return "".join(lines)


def parse_header(lines: list[str], file: Path) -> Header:
    """Return the header from its lines, which all begin with "#". Raises ProgramError with file and line."""
    values, places = dict[str, Any](), dict[str, int]()
    unverified = lines[:1] == [f"# {UNVERIFIED}"]
    first = 2 if unverified else 1
    for number, line in enumerate(lines[first - 1 :], start=first):
        entry = _entry(line)
        if number == first and (entry is None or entry[0] != MAGIC):
            raise ProgramError(
                "not a pentapod program", file=file, line=number, expected=f"# {MAGIC} = {FORMAT_VERSION}"
            )
        if entry is None:
            value = line.strip()[:80]
            expected = "# key = value, with one key and nothing else"
            raise ProgramError("cannot read this header line", file=file, line=number, value=value, expected=expected)
        key, value = entry
        if key in values:
            raise ProgramError("this key stands in the header twice", file=file, line=number, key=key)
        values[key], places[key] = value, number
        # True and 1.0 equal 1, but no version is written like that.
        if key == MAGIC and (type(value) is not int or value != FORMAT_VERSION):
            shown, known = str(value)[:80], str(FORMAT_VERSION)
            raise ProgramError("unknown format version", file=file, line=number, key=key, value=shown, expected=known)
        if key not in (*KEYS, *OPTIONAL_KEYS):
            remedy = "it is no key of this format version: a newer pentapod wrote the file, or it was edited"
            raise ProgramError("unknown key in the header", file=file, line=number, key=key, remedy=remedy)
    for key in KEYS:
        if key not in values:
            raise ProgramError("the header lacks this key", file=file, key=key, remedy="plan the job again")
    return _Reader(values, places, file, unverified).header()


def _entry(line: str) -> tuple[str, Any] | None:
    """Return key and value of a header line; None where it is not `# key = value`, one plain key and one value."""
    parts = _LINE.fullmatch(line.rstrip("\r"))
    if not parts:
        return None
    try:
        # In brackets that end behind it a second key, a comment and a second value do not pass for a part of the value.
        alone = tomllib.loads(f"x = {parts[2]}", parse_float=Decimal)
        between = tomllib.loads(f"x = [{parts[2]}]", parse_float=Decimal)["x"]
    except (ValueError, ArithmeticError, RecursionError):  # not TOML, a number too large, nested too deep
        return None
    return (parts[1], alone["x"]) if len(between) == 1 else None


@dataclass(frozen=True)
class _Reader:
    values: dict[str, Any]
    places: dict[str, int]
    file: Path
    unverified: bool

    def header(self) -> Header:
        return Header(
            period=self._period(),
            interpolation=self._one_of("interpolation", ("linear", "cubic")),
            component=Component.parse(self._one_of("component", ("++", "+-", "-+", "--"))),
            placement=self._placement(),
            provenance=Provenance(
                machine=self._text("machine"),
                machine_digest=self._text("machine_digest"),
                job_digest=self._text("job_digest"),
                pentapod_version=self._text("pentapod_version"),
                piece=self._piece(),
                unverified=self.unverified,
                **{key: self._text(key) for key in MADE_ON if key in self.values},
            ),
            rows=self._rows(),
            rail_positions=self._rail_positions(),
        )

    def _wrong(self, key: str, expected: str) -> ProgramError:
        value = self.values[key]
        shown = float(value) if isinstance(value, Decimal) else value
        return ProgramError("bad value", file=self.file, line=self.places[key], key=key, value=shown, expected=expected)

    def _text(self, key: str) -> str:
        if not isinstance(self.values[key], str):
            raise self._wrong(key, "a string")
        return self.values[key]

    def _one_of(self, key: str, known: tuple[str, ...]) -> str:
        if self.values[key] not in known:
            raise self._wrong(key, " or ".join(f'"{name}"' for name in known))
        return self.values[key]

    def _period(self) -> float:
        period = _number(self.values["period_s"])
        if not (period > 0.0 and math.isfinite(period)):
            raise self._wrong("period_s", "a positive number of seconds")
        return period

    def _rail_positions(self) -> tuple[float, ...] | None:
        if GUIDES not in self.values:
            return None
        given = self.values[GUIDES]
        rail_positions = (
            [_number(entry, shift=-3) for entry in cast("list[Any]", given)] if isinstance(given, list) else []
        )
        if len(rail_positions) != FiveLegs.n_legs or not all(map(math.isfinite, rail_positions)):
            raise self._wrong(GUIDES, "five numbers of mm, one for each guide")
        return tuple(rail_positions)

    def _piece(self) -> Piece | None:
        present = [key for key in SETUP_KEYS if key in self.values]
        if not present:
            return None
        if len(present) < len(SETUP_KEYS):
            missing = next(key for key in SETUP_KEYS if key not in self.values)
            raise ProgramError("the header lacks this key", file=self.file, key=missing, remedy="plan the job again")
        pair, corners = self.values[WAYPOINTS], self.values[BOX]
        if not isinstance(pair, list) or [type(k) for k in cast("list[Any]", pair)] != [int, int]:
            raise self._wrong(WAYPOINTS, "the first and the last waypoint")
        if max(map(abs, cast("list[int]", pair))) >= _MOST_COUNTED:
            raise self._wrong(WAYPOINTS, "the first and the last waypoint")
        expected = "two opposite corners, [[x, y, z], [x, y, z]]"
        if not isinstance(corners, list) or [_length(c) for c in cast("list[Any]", corners)] != [3, 3]:
            raise self._wrong(BOX, expected)
        low, high = ([_bound(entry) for entry in corner] for corner in corners)
        try:
            return Piece(pair[0], pair[1], (low[0], low[1], low[2]), (high[0], high[1], high[2]))
        except ToolpathError as error:
            raise self._wrong(BOX, f"{expected}, and waypoints that rise") from error

    def _rows(self) -> int:
        rows = self.values["rows"]
        if type(rows) is not int or not 2 <= rows < _MOST_COUNTED:
            raise self._wrong("rows", "a count of at least 2")
        return rows

    def _placement(self) -> RigidTransform:
        expected = "a rigid 4x4 matrix, translation in mm"
        matrix = np.full((4, 4), np.nan)
        rows: Any = self.values["placement_mm"]
        if not isinstance(rows, list) or [len(r) if isinstance(r, list) else 0 for r in rows] != [4, 4, 4, 4]:
            raise self._wrong("placement_mm", expected)
        for k, row in enumerate(rows):
            for j, entry in enumerate(row):
                matrix[k, j] = _number(entry, shift=-3 if j == 3 and k < 3 else 0)
        try:
            return RigidTransform.from_matrix(matrix)
        except ArrayError as error:
            raise ProgramError(
                error.what,
                file=self.file,
                line=self.places["placement_mm"],
                key="placement_mm",
                expected=expected,
            ) from error


def _number(value: Any, shift: int = 0) -> float:
    """Return a TOML number times 10^shift, rounded once; NaN for anything else, and for what no double holds."""
    if type(value) is not int and not isinstance(value, Decimal):
        return math.nan
    exact = Decimal(value)
    # Beyond this a double overflows anyway, and Decimal's own arithmetic would raise.
    if not exact.is_finite() or exact.adjusted() > 400:
        return math.nan
    return float(exact.scaleb(shift)) if exact.adjusted() > -400 else 0.0


def _length(value: Any) -> int:
    return len(cast("list[Any]", value)) if isinstance(value, list) else 0


def _bound(value: Any) -> float:
    """Return millimetres, or ±inf, as metres; NaN for anything else."""
    if isinstance(value, Decimal) and value.is_infinite():
        return float(value)
    return _number(value, shift=-3)


def _string(text: str) -> str:
    """Return a TOML basic string; JSON's escapes are TOML's, but for DEL."""
    try:
        text.encode()
    except UnicodeEncodeError as error:
        raise InputError("a name in the header is not text that UTF-8 can hold", value=text) from error
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _matrix(placement: RigidTransform) -> str:
    shifts = [[3 if j == 3 and k < 3 else 0 for j in range(4)] for k in range(4)]
    rows = (
        "[" + ", ".join(_decimal(float(x), n) for x, n in zip(row, shift, strict=True)) + "]"
        for row, shift in zip(placement.matrix, shifts, strict=True)
    )
    return "[" + ", ".join(rows) + "]"


def _box(piece: Piece) -> str:
    corners = (", ".join(_decimal(x, 3) if math.isfinite(x) else str(x) for x in c) for c in (piece.low, piece.high))
    return "[" + ", ".join(f"[{corner}]" for corner in corners) + "]"


def _decimal(value: float, shift: int) -> str:
    """Return the shortest digits that give `value` back, times 10^shift, as a TOML float."""
    text = format(Decimal(repr(value)).scaleb(shift), "f")
    return text if "." in text else text + ".0"
