"""Machine files: TOML to the parts of a machine, with one clear error for whatever is wrong.

What is made of the parts is given (`Machine`): the errors that it raises are told by key and line, too.
"""

from __future__ import annotations

from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, Protocol, TypeVar

import numpy as np
from pydantic import BaseModel, ValidationError

from pentapod.base.errors import InputError, MachineError, nearest
from pentapod.base.keys import fields_from
from pentapod.base.tables import problem_of
from pentapod.base.toml import line_of, parsed, read_toml
from pentapod.kinematics.families.quadratic import LinearPentapod
from pentapod.kinematics.families.reconfigurable import ReconfigurablePentapod
from pentapod.kinematics.robot import Robot
from pentapod.machine.drives import Drives, Masses
from pentapod.machine.families import FAMILIES
from pentapod.machine.parts import Bodies, ControllerSettings, JointLimits, LegLimits, WorkVolume
from pentapod.machine.tables import FILE_KEYS, PARTS, GuidesTable, MachineTables
from pentapod.machine.tool_limits import ToolLimits

_Made_co = TypeVar("_Made_co", covariant=True)


class Maker(Protocol[_Made_co]):
    """What a machine is made by: the class `Machine`. Raises MachineError where the parts make no machine."""

    def __call__(
        self,
        *,
        name: str,
        robot: Any,
        legs: LegLimits,
        joints: JointLimits,
        bodies: Bodies,
        tool_length: float,
        rapid_velocity: float,
        controller: ControllerSettings,
        work: WorkVolume,
        drives: Drives,
        masses: Masses,
        tool_limits: ToolLimits,
        guides: ReconfigurablePentapod | None,
    ) -> _Made_co:
        """Return what the parts make, all in SI units."""
        ...


def shipped_machines() -> tuple[str, ...]:
    """Return the names of the machines that come with pentapod, sorted."""
    return tuple(
        sorted(entry.name.removesuffix(".toml") for entry in _library().iterdir() if entry.name.endswith(".toml"))
    )


def load(name_or_path: str | Path, make: Maker[_Made_co]) -> _Made_co:
    """Return what is made of a shipped machine's file, by the machine's name, or of another TOML file.

    A text without folder and suffix is taken for a name first. Raises MachineError: one line with file, line,
    key, value and remedy.
    """
    name = str(name_or_path)
    if name in shipped_machines():
        return read(machine_bytes(name).decode("utf-8"), f"{name}.toml", make)
    path = Path(name_or_path)
    try:
        missing = not path.exists()
    except OSError:  # a name too long, or a folder that may not be searched: what reads the file says so
        missing = False
    if missing:
        known = ", ".join(shipped_machines())
        hint = nearest(name, shipped_machines()) if name else ""
        remedy = f"shipped machines: {known}" + (f"; {hint}" if hint.startswith("did") else "")
        raise MachineError("no such machine or machine file", file=name or '""', remedy=remedy)
    text = read_toml(path, "machine", MachineError, start='"pentapod machine list" names those that ship')
    return read(text, path, make)


def machine_bytes(name_or_path: str | Path) -> bytes:
    """Return the bytes of the file that `load` reads. Raises MachineError where it cannot be read."""
    name = str(name_or_path)
    try:
        if name in shipped_machines():
            return (_library() / f"{name}.toml").read_bytes()
        return Path(name_or_path).read_bytes()
    except OSError as error:
        raise MachineError("the machine file cannot be read", file=name) from error


def read(text: str, file: str | Path, make: Maker[_Made_co]) -> _Made_co:
    """Return what is made of the machine that TOML text describes; `file` is named in errors. Raises MachineError."""
    content = parsed(text, file, MachineError)
    try:
        return _made(MachineTables.model_validate(content), make)
    except ValidationError as error:
        where, details = problem_of(error, MachineTables, _table)
        raise MachineError(file=file, line=line_of(text, where), **details) from error
    except InputError as error:
        key = FILE_KEYS.get(error.key or "", error.key)
        raise MachineError(
            error.what,
            file=file,
            key=key,
            line=line_of(text, (key or "").split(".")),
            value=error.value,
            expected=error.expected,
            remedy=error.remedy,
        ) from error


def _library() -> Traversable:
    return resources.files("pentapod.machine") / "library"


def _made(tables: Any, make: Maker[_Made_co]) -> _Made_co:
    """Return what is made of the parts; tables: a `MachineTables`."""
    robot, joints = FAMILIES[tables.geometry.family].robot(tables.geometry), tables.joints
    parts = {name: fields_from(part, getattr(tables, name)) for name, part in PARTS.items()}
    return make(
        name=tables.name,
        robot=robot,
        legs=LegLimits(**parts["legs"]),
        joints=JointLimits(
            platform_range=np.stack([joints.si.platform_min, joints.si.platform_max], axis=1), **parts["joints"]
        ),
        bodies=Bodies(**parts["bodies"]),
        tool_length=tables.tool.si.length,
        rapid_velocity=tables.tool.si.rapid,
        controller=ControllerSettings(**parts["controller"]),
        work=WorkVolume(**parts["work"]),
        drives=Drives(**parts["drives"]),
        masses=Masses(**parts["masses"]),
        tool_limits=ToolLimits(**parts["tool"]),
        guides=_guides(tables.guides, robot),
    )


def _guides(table: GuidesTable, robot: Robot) -> ReconfigurablePentapod | None:
    travel = np.stack([table.si.least, table.si.greatest], axis=1)
    if not travel.any():
        return None
    if not isinstance(robot, LinearPentapod):
        family = type(robot).__name__
        raise MachineError("guides are for the quadratic family alone", key="guides.direction", value=family)
    if ((travel[:, 0] > 0.0) | (travel[:, 1] < 0.0)).any():
        raise MachineError(
            "base_mm is not within the travel of the guides",
            key="travel",
            value=travel.tolist(),
            expected="least_mm at most 0, greatest_mm at least 0",
        )
    return ReconfigurablePentapod(robot, np.asarray(table.direction), travel)


def _table(name: str) -> type[BaseModel] | None:
    """Return the model of a table; None for a key outside the tables."""
    field = MachineTables.model_fields.get(name)
    kind = field.annotation if field else None
    return kind if isinstance(kind, type) and issubclass(kind, BaseModel) else None
