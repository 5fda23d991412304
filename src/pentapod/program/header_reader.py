"""Reader of the header of a program file: every line is checked, and errors name file and line."""

from __future__ import annotations

import math
import re
import tomllib
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Any, get_args

import numpy as np

from pentapod.base.errors import ArrayError, ProgramError, ToolpathError
from pentapod.geometry.interpolant import Interpolation
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.component import Component
from pentapod.kinematics.five_legs import FiveLegs
from pentapod.program.header import (
    BOX,
    CALIBRATION,
    COMMANDS,
    COMPENSATION,
    CUT_ROWS,
    FORCE_KEYS,
    GUIDES,
    KEYS,
    LASER_POWER,
    LEFT_OUT,
    LEGS,
    MADE_ON,
    MAGIC,
    OPTIONAL_KEYS,
    PROCESS_FORCE,
    SETUP_KEYS,
    STEPOVER_SHARE,
    SWITCHES,
    UNVERIFIED,
    UPRIGHT,
    WAYPOINTS,
    Header,
)
from pentapod.program.header_values import bound_of, list_of, number_of, switches_of
from pentapod.program.program import COMPENSATIONS, FORMAT_VERSION, ProcessForce, Provenance, Switch
from pentapod.toolpath.linking.partition import Piece

LARGEST_COUNT = 2**63 - 1
MOST_LEGS = 64
LEAST_SHARE = 0.1
"""Least distance between passes, as a share of a job's, that a header may state."""
_LINE = re.compile(r"# ([a-z0-9_]+) = (\S.*)")


def parse_header(lines: list[str], file: Path) -> Header:
    """Return the header from its lines, which all begin with "#". Raises ProgramError with file and line."""
    values, places = dict[str, Any](), dict[str, int]()
    unverified = lines[:1] == [f"# {UNVERIFIED}"]
    first = 2 if unverified else 1
    for number, line in enumerate(lines[first - 1 :], start=first):
        entry = _entry(line)
        if number == first and (entry is None or entry[0] != MAGIC):
            expected = f"# {MAGIC} = {FORMAT_VERSION}"
            raise ProgramError("not a pentapod program", file=file, line=number, expected=expected)
        if entry is None:
            value, expected = line.strip()[:80], "# key = value, with one key and nothing else"
            raise ProgramError("cannot read this header line", file=file, line=number, value=value, expected=expected)
        key, value = entry
        if key in values:
            raise ProgramError("this key is in the header twice", file=file, line=number, key=key)
        values[key], places[key] = value, number
        # True and 1.0 equal 1, but no version is written like that.
        if key == MAGIC and (type(value) is not int or value != FORMAT_VERSION):
            shown, known = str(value)[:80], str(FORMAT_VERSION)
            raise ProgramError("unknown format version", file=file, line=number, key=key, value=shown, expected=known)
        if key not in (*KEYS, *OPTIONAL_KEYS):
            remedy = "not a key of this format version: a newer pentapod wrote the file, or it was edited"
            raise ProgramError("unknown key in the header", file=file, line=number, key=key, remedy=remedy)
    together = [key for keys in (SETUP_KEYS, FORCE_KEYS) for key in keys if any(each in values for each in keys)]
    for key in (*KEYS, *together):
        if key not in values:
            raise ProgramError("the header lacks this key", file=file, key=key, remedy="plan the job again")
    return _Reader(values, places, file, unverified).header()


def _entry(line: str) -> tuple[str, Any] | None:
    """Return key and value of a header line; None where it is not `# key = value`, one plain key and one value."""
    parts = _LINE.fullmatch(line.rstrip("\r"))
    if not parts:
        return None
    try:
        # As an entry of a list, so that a second key, a comment or a second value is not read as a part of the value.
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
            interpolation=self._one_of("interpolation", get_args(Interpolation)),
            component=Component.parse(self._one_of("component", ("++", "+-", "-+", "--"))),
            placement=self._placement(),
            provenance=Provenance(
                machine=self._text("machine"),
                machine_digest=self._text("machine_digest"),
                job_digest=self._text("job_digest"),
                pentapod_version=self._text("pentapod_version"),
                piece=self._piece(),
                left_out=self._left_out(),
                upright=self._true(UPRIGHT),
                stepover_share=self._stepover_share(),
                unverified=self.unverified,
                compensation=self._one_of(COMPENSATION, COMPENSATIONS) if COMPENSATION in self.values else "",
                **{key: self._text(key) for key in (*MADE_ON, CALIBRATION, COMMANDS) if key in self.values},
            ),
            rows=self._rows(),
            rail_positions=self._rail_positions(),
            legs=self._legs(),
            switches=self._switches(),
            powered=self._true(LASER_POWER),
            process_force=self._process_force(),
        )

    def _check(self, key: str, holds: bool, expected: str) -> None:
        if not holds:
            value = self.values[key]
            shown = float(value) if isinstance(value, Decimal) else value
            line = self.places[key]
            raise ProgramError("bad value", file=self.file, line=line, key=key, value=shown, expected=expected)

    def _text(self, key: str) -> str:
        self._check(key, isinstance(self.values[key], str), "a string")
        return self.values[key]

    def _one_of(self, key: str, known: tuple[str, ...]) -> str:
        self._check(key, self.values[key] in known, " or ".join(f'"{name}"' for name in known))
        return self.values[key]

    def _period(self) -> float:
        period = number_of(self.values["period_s"])
        self._check("period_s", 0.0 < period < math.inf, "a positive number of seconds")
        return period

    def _rail_positions(self) -> tuple[float, ...] | None:
        if GUIDES not in self.values:
            return None
        positions = tuple(number_of(entry, shift=-3) for entry in list_of(self.values[GUIDES]))
        good = len(positions) == self._legs() and all(map(math.isfinite, positions))
        self._check(GUIDES, good, f"{self._legs()} numbers of mm, one for each guide")
        return positions

    def _legs(self) -> int:
        if LEGS not in self.values:
            return FiveLegs.n_legs
        legs = self.values[LEGS]
        self._check(LEGS, type(legs) is int and 1 <= legs <= MOST_LEGS, f"a count of 1 to {MOST_LEGS}")
        return legs

    def _piece(self) -> Piece | None:
        if WAYPOINTS not in self.values:
            return None
        pair, corners = list_of(self.values[WAYPOINTS]), list_of(self.values[BOX])
        good = [type(k) for k in pair] == [int, int] and max(map(abs, pair)) <= LARGEST_COUNT
        self._check(WAYPOINTS, good, "the first and the last waypoint")
        expected = "two opposite corners, [[x, y, z], [x, y, z]]"
        self._check(BOX, [len(list_of(corner)) for corner in corners] == [3, 3], expected)
        low, high = ((bound_of(x), bound_of(y), bound_of(z)) for x, y, z in corners)
        try:
            return Piece(pair[0], pair[1], low, high)
        except ToolpathError:
            self._check(BOX, False, f"{expected}, and increasing waypoints")
            raise

    def _left_out(self) -> tuple[tuple[int, int], ...]:
        if LEFT_OUT not in self.values:
            return ()
        return self._pairs(LEFT_OUT, "waypoints", LARGEST_COUNT)

    def _stepover_share(self) -> float:
        if STEPOVER_SHARE not in self.values:
            return 1.0
        share = number_of(self.values[STEPOVER_SHARE])
        self._check(STEPOVER_SHARE, LEAST_SHARE <= share < 1.0, f"a share of {LEAST_SHARE:g} to less than 1")
        return share

    def _process_force(self) -> ProcessForce | None:
        if PROCESS_FORCE not in self.values:
            return None
        newtons = number_of(self.values[PROCESS_FORCE])
        self._check(PROCESS_FORCE, 0.0 < newtons < math.inf, "a positive number of newtons")
        self._check(PROCESS_FORCE, COMPENSATION in self.values, f"only where there is the key {COMPENSATION}")
        return ProcessForce(newtons, self._pairs(CUT_ROWS, "rows of this file", self._rows() - 1))

    def _pairs(self, key: str, what: str, most: int) -> tuple[tuple[int, int], ...]:
        pairs = [list_of(pair) for pair in list_of(self.values[key])]
        good = bool(pairs) and all([type(k) for k in pair] == [int, int] for pair in pairs)
        flat = [k for pair in pairs for k in pair]
        good = good and flat == sorted(set(flat)) and flat[0] >= 0 and flat[-1] <= most
        self._check(key, good, f"pairs of increasing {what}, [[first, last], ...]")
        return tuple((first, last) for first, last in pairs)

    def _true(self, key: str) -> bool:
        if key in self.values:
            self._check(key, self.values[key] is True, "true, or no such line")
        return key in self.values

    def _switches(self) -> tuple[Switch, ...]:
        if SWITCHES not in self.values:
            return ()
        found = switches_of(self.values[SWITCHES], self._rows())
        self._check(SWITCHES, bool(found), 'rising rows of this file, each with its words: [[0, "S12000", "M3"], ...]')
        return found

    def _rows(self) -> int:
        rows = self.values["rows"]
        self._check("rows", type(rows) is int and 2 <= rows <= LARGEST_COUNT, "a count of at least 2")
        return rows

    def _placement(self) -> RigidTransform:
        expected = "a rigid 4x4 matrix, translation in mm"
        rows = [list_of(row) for row in list_of(self.values["placement_mm"])]
        self._check("placement_mm", [len(row) for row in rows] == [4, 4, 4, 4], expected)
        shift = [[-3 if j == 3 and k < 3 else 0 for j in range(4)] for k in range(4)]
        matrix = [[number_of(x, n) for x, n in zip(row, by, strict=True)] for row, by in zip(rows, shift, strict=True)]
        try:
            return RigidTransform.from_matrix(np.array(matrix))
        except ArrayError as error:
            key, line = "placement_mm", self.places["placement_mm"]
            raise ProgramError(error.what, file=self.file, line=line, key=key, expected=expected) from error
