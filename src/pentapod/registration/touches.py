"""Touches of a probe: leg readings at the trip, read from and written to touches.csv; the ball's centres.

    # probe_length_mm = 130.0
    # tip_diameter_mm = 4.0
    # component = "++"
    leg1_mm,leg2_mm,leg3_mm,leg4_mm,leg5_mm
    702.114907,...

The first lines are TOML behind the comment mark. Poses come from the legs by the machine's own forward kinematics, so
that its calibration applies; where drives count something else than lengths, its leg model is undone, but for backlash.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal, cast

import numpy as np
from pydantic import ValidationError

from pentapod.base.arrays import Floats, frozen, set_frozen
from pentapod.base.errors import InputError, MachineError
from pentapod.base.files import number_in, read_bytes
from pentapod.base.keys import VECTOR, Key
from pentapod.base.tables import problem_of, table_of
from pentapod.base.toml import parsed
from pentapod.base.units import from_si, to_si
from pentapod.base.values import Value
from pentapod.kinematics.component import Component
from pentapod.kinematics.robot import Branch
from pentapod.machine.dynamics.deflection import loaded_poses
from pentapod.machine.machine import Machine
from pentapod.planning.limits.margins import Margins

MOST_BYTES = 10_000_000
_START = '"pentapod register plan" writes one to fill'


@dataclass(frozen=True, kw_only=True)
class TouchKeys:
    """Head of a list of touches."""

    probe_length: Annotated[
        float, Key("mm", "from the platform's origin to the end of the probe's tip", gt=0.0, le=10_000.0)
    ]
    tip_diameter: Annotated[float, Key("mm", "diameter of the probe's ball", gt=0.0, le=100.0)]
    component: Annotated[
        Literal["++", "+-", "-+", "--"] | None, Key("", "signs of w and S in which the machine touches")
    ] = None
    machine: Annotated[str | None, Key("", "name of the machine")] = None
    position: Annotated[VECTOR | None, Key("mm", "planned placement: where the mesh's origin is")] = None
    rotation: Annotated[VECTOR | None, Key("deg", "planned placement: rotations about the fixed x, y, z")] = None


TouchTable = table_of(TouchKeys)


@dataclass(frozen=True, eq=False)
class Touches(Value):
    """Leg readings (N, n_legs) at the trip, metres. lines (N,): where they are in their file.

    probe_length: from the platform's origin to the end of the tip; tip_radius: of the ball; metres. component, machine:
    in which the machine touched, and its name, where they are known. position_mm, rotation_deg: of the planned
    placement.
    """

    legs: Floats
    probe_length: float
    tip_radius: float
    lines: tuple[int, ...]
    component: Branch | None = None
    machine: str | None = None
    position_mm: VECTOR | None = None
    rotation_deg: VECTOR | None = None

    def __post_init__(self) -> None:
        set_frozen(self, legs=frozen(self.legs, "legs", (None, None)))

    def centres(self, machine: Machine, file: str | Path | None = None, *, loaded: bool = False) -> Floats:
        """Return the centres (N, 3) of the ball at the trip, machine frame, metres. file: named in errors.

        loaded: whether legs, by the machine's weight, are shorter than their drives count.

        Without a component it is the one in which all touches keep the machine's limits. Raises InputError: legs beyond
        their strokes, without a pose, or with poses in several components.
        """
        try:
            own = replace(machine.with_tool(self.probe_length), leg_model=machine.leg_model.without_backlash)
        except MachineError as error:
            value = float(from_si(self.probe_length, "mm"))
            expected = "from the platform's origin to the end of the tip"
            raise InputError(error.what, file=file, key="probe_length_mm", value=value, expected=expected) from error
        self._check_strokes(own, file)
        branches = own.robot.branches if self.component is None else (self.component,)
        read = {branch: own.readings(self.legs, np.array(branch)) for branch in branches}
        poses = {branch: own.robot.pose(read[branch], np.array(branch)) for branch in branches}
        if self.component is None:
            fitting = [branch for branch in branches if _within(own, branch, *poses[branch])]
            if len(fitting) != 1:
                raise InputError(
                    "the legs do not tell the component of the machine", file=file, key="component",
                    value=[str(branch) for branch in fitting] or None,
                    expected='one in which all touches keep the limits', remedy='say it: # component = "++"',
                )  # fmt: skip
            branches = (fitting[0],)
        position, direction = poses[branches[0]]
        if loaded:
            position, direction = loaded_poses(own, read[branches[0]], branches[0])
        lost = np.flatnonzero(~np.isfinite(position).all(axis=1))
        if len(lost):
            row = int(lost[0])
            raise InputError(
                f"no pose in component {branches[0]} has these legs", file=file, line=self.lines[row],
                value=from_si(self.legs[row], "mm").tolist(), remedy="check the order of the legs and the machine",
            )  # fmt: skip
        return np.asarray(position + (self.probe_length - self.tip_radius) * direction)

    def _check_strokes(self, machine: Machine, file: str | Path | None) -> None:
        low, high = machine.legs.min_length, machine.legs.max_length
        if self.legs.shape[1] != len(low):
            expected = f"{len(low)} legs"
            raise InputError("wrong count of legs", file=file, value=self.legs.shape[1], expected=expected)
        beyond = (self.legs < low) | (self.legs > high)
        if beyond.any():
            row, leg = (int(k) for k in np.argwhere(beyond)[0])
            strokes = f"{from_si(low[leg], 'mm'):g} to {from_si(high[leg], 'mm'):g}, its stroke"
            raise InputError(
                "a leg beyond its stroke", file=file, line=self.lines[row], key=f"leg{leg + 1}_mm",
                value=float(from_si(self.legs[row, leg], "mm")), expected=strokes,
                remedy="lengths in mm, from base joint to platform joint, legs in their order",
            )  # fmt: skip


def _within(machine: Machine, branch: Branch, position: Floats, direction: Floats) -> bool:
    """Return whether all poses (N, 3) exist and keep the machine's limits in a branch."""
    if not np.isfinite(position).all():
        return False
    tips = position + machine.tool_length * direction
    return bool((Margins.of(machine, branch).own(tips, -direction) >= 0.0).all())


def column_names(n_legs: int) -> tuple[str, ...]:
    """Return the names of the columns."""
    return tuple(f"leg{k + 1}_mm" for k in range(n_legs))


def read_touches(path: str | Path) -> Touches:
    """Return the touches of a file. Raises InputError with file, line and key."""
    file = Path(path)
    raw = read_bytes(file, InputError, "a list of touches", MOST_BYTES, _START)
    try:
        lines = [line.rstrip() for line in raw.decode("utf-8-sig").split("\n")]
    except UnicodeDecodeError as error:
        raise InputError("not a text file in UTF-8", file=file, expected="a list of touches") from error
    head = [line.removeprefix("#").strip() if line.startswith("#") else "" for line in lines]
    table: Any = _head("\n".join(head), file)
    rows = [(k, line) for k, line in enumerate(lines, start=1) if line.strip() and not line.startswith("#")]
    if not rows:
        raise InputError("there are no columns", file=file, expected="leg1_mm,leg2_mm,...", remedy=_START)
    names = tuple(name.strip() for name in rows[0][1].split(","))
    if names != column_names(len(names)) or len(names) < 2:
        expected = "leg1_mm,leg2_mm,... in their order"
        if ";" in rows[0][1]:
            expected += ", with commas between the columns, and decimal points"
        raise InputError("wrong column names", file=file, line=rows[0][0], value=rows[0][1][:80], expected=expected)
    legs = np.array([_row(line, names, k, file) for k, line in rows[1:]]).reshape(-1, len(names))
    return Touches(
        to_si(legs, "mm"), table.si.probe_length, 0.5 * table.si.tip_diameter, tuple(k for k, _ in rows[1:]),
        None if table.component is None else Component.parse(table.component), table.machine,
        table.position_mm, table.rotation_deg,
    )  # fmt: skip


def touches_text(touches: Touches) -> str:
    """Return the text of a list of touches, as `read_touches` reads it; with none, one for the controller to fill."""
    head: dict[str, object] = {
        "probe_length_mm": round(float(from_si(touches.probe_length, "mm")), 9),
        "tip_diameter_mm": round(2.0 * float(from_si(touches.tip_radius, "mm")), 9),
        "component": None if touches.component is None else f'"{touches.component}"',
        "machine": None if touches.machine is None else f'"{touches.machine}"',
        "position_mm": None if touches.position_mm is None else list(touches.position_mm),
        "rotation_deg": None if touches.rotation_deg is None else list(touches.rotation_deg),
    }
    lines = [f"# {key} = {value}" for key, value in head.items() if value is not None]
    lines.append(",".join(column_names(touches.legs.shape[1])))
    lines += [",".join(f"{value:.6f}" for value in row) for row in from_si(touches.legs, "mm").tolist()]
    return "\n".join(lines) + "\n"


def has_touches(path: str | Path) -> bool:
    """Whether there is a list of touches with at least one row below its head and its column names."""
    file = Path(path)
    if not file.is_file():
        return False
    lines = file.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    return sum(bool(line.strip()) and not line.startswith("#") for line in lines) > 1


def _head(text: str, file: Path) -> Any:
    found = parsed(text, file, InputError)
    content = {key: tuple(cast("list[Any]", v)) if isinstance(v, list) else v for key, v in found.items()}
    try:
        return TouchTable.model_validate(content)
    except ValidationError as error:
        where, details = problem_of(error, TouchTable, lambda _: None)
        line = next((k for k, row in enumerate(text.split("\n"), start=1) if where and row.startswith(where[0])), None)
        raise InputError(details.pop("what"), file=file, line=line, **details) from error


def _row(line: str, names: Sequence[str], number: int, file: Path) -> list[float]:
    cells = line.split(",")
    values = [value for cell in cells if (value := number_in(cell.strip())) is not None]
    if len(cells) == len(names) == len(values):
        return values
    what = "not a row of finite numbers" if len(cells) == len(names) else "wrong count of numbers"
    raise InputError(what, file=file, line=number, value=line[:80], expected=",".join(names))
