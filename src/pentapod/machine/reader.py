"""Machine files: TOML to the parts of a machine, with one clear error for whatever is wrong.

The class of the machine is given (`Machine`); the errors that it raises name key and line, too.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from pydantic import BaseModel, ValidationError

from pentapod.base.errors import InputError, MachineError, nearest
from pentapod.base.keys import fields_from
from pentapod.base.tables import problem_of
from pentapod.base.toml import line_of, parsed, read_toml
from pentapod.kinematics.families.quadratic import LinearPentapod
from pentapod.kinematics.families.reconfigurable import ReconfigurablePentapod
from pentapod.kinematics.robot import Robot
from pentapod.machine.drives import DriveForces, Drives, Masses
from pentapod.machine.families import FAMILIES, legs_of
from pentapod.machine.leg_model import LegModel
from pentapod.machine.parts import (
    Bodies,
    ControllerSettings,
    Guard,
    JointLimits,
    JointStiffness,
    LegLimits,
    LegStiffness,
    Park,
    Stiffness,
    ToolLimits,
    WorkVolume,
)
from pentapod.machine.tables import FILE_KEYS, GuideKeys, MachineTables, MachineToolKeys, PlatformJointKeys

if TYPE_CHECKING:
    from pentapod.machine.calibration.record import CalibrationRecord

Made = TypeVar("Made")


def shipped_machines() -> tuple[str, ...]:
    """Return the names of the machines that come with pentapod, sorted."""
    return tuple(sorted(entry.name.removesuffix(".toml") for entry in _library().iterdir() if ".toml" in entry.name))


def load(name_or_path: str | Path, make: Callable[..., Made]) -> Made:
    """Return what `make` makes of a shipped machine's file, by the machine's name, or of another TOML file.

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
        return (_library() / f"{name}.toml" if name in shipped_machines() else Path(name)).read_bytes()
    except OSError as error:
        raise MachineError("the machine file cannot be read", file=name) from error


def calibration_bytes(name_or_path: str | Path) -> bytes | None:
    """Return the bytes of the calibration file that a machine's file names; None where it names none.

    Raises MachineError where one of the two cannot be read.
    """
    content = parsed(machine_bytes(name_or_path).decode("utf-8-sig"), name_or_path, MachineError)
    name = content.get("calibration", {}).get("file")
    if name is None:
        return None
    path = Path(name_or_path).parent / name
    try:
        return path.read_bytes()
    except OSError as error:
        raise MachineError("the calibration file cannot be read", file=path) from error


def read(text: str, file: str | Path, make: Callable[..., Made]) -> Made:
    """Return the machine that TOML text describes, made by `make`; `file` is named in errors. Raises MachineError."""
    content = parsed(text, file, MachineError)
    try:
        return make(**_fields(MachineTables.model_validate(content, context={"legs": legs_of(content)}), file))
    except ValidationError as error:
        where, details = problem_of(error, MachineTables, _table)
        raise MachineError(file=file, line=line_of(text, where), **details) from error
    except InputError as error:
        if error.file is not None:  # of the calibration
            raise
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


def _fields(tables: Any, file: str | Path) -> dict[str, Any]:
    """Return the fields of a machine, SI, from the `MachineTables` of a file."""
    family = FAMILIES[tables.geometry.family]
    designed = family.robot(tables.geometry)
    guides = _guides(designed, **fields_from(GuideKeys, tables.guides))
    robot, calibration = _as_built(designed, guides, tables.calibration.file, file)
    platform = fields_from(PlatformJointKeys, tables.joints)
    return {
        "name": tables.name,
        "robot": robot,
        "legs": LegLimits(**fields_from(LegLimits, tables.legs)),
        "joints": JointLimits(
            platform_range=np.stack([platform["platform_min"], platform["platform_max"]], axis=1),
            **fields_from(JointLimits, tables.joints),
        ),
        "stiffness": Stiffness(**fields_from(LegStiffness, tables.legs), **fields_from(JointStiffness, tables.joints)),
        "bodies": Bodies(**fields_from(Bodies, tables.bodies)),
        "controller": ControllerSettings(**fields_from(ControllerSettings, tables.controller)),
        "work": WorkVolume(**fields_from(WorkVolume, tables.work)),
        "park": Park(**fields_from(Park, tables.park)),
        "guard": Guard(**fields_from(Guard, tables.guard)),
        "drives": Drives(**fields_from(Drives, tables.drives)),
        "drive_forces": DriveForces(**fields_from(DriveForces, tables.drives)),
        "masses": Masses(**fields_from(Masses, tables.masses)),
        "tool_limits": ToolLimits(**fields_from(ToolLimits, tables.tool)),
        "limb": None if family.limb is None else family.limb(tables.geometry),
        "guides": guides,
        "calibration": calibration,
        "leg_model": LegModel(**fields_from(LegModel, tables.leg_model)),
        **fields_from(MachineToolKeys, tables.tool),
    }


def _as_built(
    designed: Robot, guides: ReconfigurablePentapod | None, name: str | None, machine_file: str | Path
) -> tuple[Robot, CalibrationRecord | None]:
    """Return the robot as the calibration file has it, and the calibration; as designed where none is named."""
    if name is None:
        return designed, None
    if guides is not None:
        raise MachineError(
            "a machine with guides has no calibration file", key="calibration.file", value=name,
            expected="a geometry that does not change", remedy="describe the machine with its guides where they stand",
        )  # fmt: skip
    from pentapod.machine.calibration.calibration_file import read_calibration  # noqa: PLC0415  few machines have one

    path = Path(machine_file).parent / name
    record = read_calibration(path)
    try:
        return record.as_built(designed), record
    except MachineError as error:
        raise MachineError(
            error.what, file=path, key=error.key, value=error.value, expected=error.expected, remedy=error.remedy
        ) from error


def _guides(robot: Robot, direction: Any, least: Any, greatest: Any) -> ReconfigurablePentapod | None:
    """Return the guides of a robot; None where none of them can move."""
    travel = np.stack(np.broadcast_arrays(least, greatest), axis=1)
    if not travel.any():
        return None
    if not isinstance(robot, LinearPentapod):
        family = type(robot).__name__
        raise MachineError("guides are for the quadratic family alone", key="guides", value=family)
    if ((travel[:, 0] > 0.0) | (travel[:, 1] < 0.0)).any():
        raise MachineError(
            "base_mm is not within the travel of the guides",
            key="travel",
            value=travel.tolist(),
            expected="least_mm at most 0, greatest_mm at least 0",
        )
    return ReconfigurablePentapod(robot, np.broadcast_to(direction, (robot.n_legs, 2)), travel)


def _table(name: str) -> type[BaseModel] | None:
    """Return the model of a table; None for a key outside the tables."""
    field = MachineTables.model_fields.get(name)
    kind = field.annotation if field else None
    return kind if isinstance(kind, type) and issubclass(kind, BaseModel) else None
