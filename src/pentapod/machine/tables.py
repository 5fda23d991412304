"""The tables of a machine file: every key with its unit, meaning and range.

Values are as in the file: millimetre, degree, mm/min, the unit in the key's name.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, cast

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field
from pydantic_core import PydanticCustomError

from pentapod.base.arrays import Floats
from pentapod.machine.drives import Drives, Masses


def _numbers(value: object) -> bool:
    items = cast(list[Any], value) if isinstance(value, list) else [value]
    return all(isinstance(x, int | float) and not isinstance(x, bool) and math.isfinite(x) for x in items)


def _check(ok: bool, what: str, expected: str) -> None:
    if not ok:
        raise PydanticCustomError("rule", "{what}", {"what": what, "expected": expected})


def _one_or_five(value: object) -> list[float]:
    expected = "one finite number, or five (one for each leg)"
    _check(_numbers(value), "not finite numbers", expected)
    if not isinstance(value, list):
        return [float(cast(float, value))] * 5
    items = cast(list[float], value)
    _check(len(items) == 5, f"{len(items)} numbers where there are five legs", expected)
    return [float(x) for x in items]


def _five(value: object) -> list[float]:
    _check(isinstance(value, list), "not a list", "five numbers, one for each leg")
    return _one_or_five(value)


def _rows(value: object, width: int, words: str) -> list[list[float]]:
    _check(isinstance(value, list), "not a list", words)
    rows = cast(list[Any], value)
    _check(len(rows) == 5, f"{len(rows)} entries where there are five legs", words)
    for k, row in enumerate(rows, start=1):
        ok = isinstance(row, list) and len(cast(list[Any], row)) == width and _numbers(cast(object, row))
        _check(ok, f"entry {k} is not {width} finite numbers", words)
    return [[float(x) for x in row] for row in rows]


def _pairs(value: object) -> list[list[float]]:
    return _rows(value, 2, "five pairs [x, y], one for each leg")


def _axes(value: object) -> list[list[float]]:
    words = "one unit vector [x, y, z], or five (one for each leg)"
    single = isinstance(value, list) and len(cast(list[Any], value)) == 3 and _numbers(cast(object, value))
    return _rows([value] * 5 if single else value, 3, words)


PerLeg = Annotated[list[float], BeforeValidator(_one_or_five)]
FiveNumbers = Annotated[list[float], BeforeValidator(_five)]
FivePairs = Annotated[list[list[float]], BeforeValidator(_pairs)]
FiveAxes = Annotated[list[list[float]], BeforeValidator(_axes)]
Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Share = Annotated[float, Field(ge=0.0, le=2.0)]
Vector = Annotated[list[float], Field(min_length=3, max_length=3)]

# Their defaults stand in one place, in SI units.
_DRIVES, _MASSES = Drives(), Masses()


def _five_of(values: Floats, factor: float = 1.0) -> list[float]:
    """Return a default for each leg, in the unit of the file."""
    return [round(factor * value, 12) for value in values.tolist()]


class Table(BaseModel):
    """A table of the machine file: unknown keys, wrong types, NaN and infinity are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class GeometryTable(Table):
    """Where the joints are. Give delta, or platform_mm, or both if they agree."""

    base_mm: FivePairs = Field(description="base joints [x, y] in the base plane z = 0, leg 1 to leg 5")
    delta: float | None = Field(default=None, description="platform joint i is at delta · x_i along the tool axis")
    platform_mm: FiveNumbers | None = Field(
        default=None, description="platform joints along the line towards the tip, leg 1 to leg 5"
    )


class GuidesTable(Table):
    """Guides of a reconfigurable machine: the base joints are set along them before a program runs."""

    direction: FivePairs = Field(
        default=[[0.0, 1.0]] * 5, description="of each guide in the base plane, unit [x, y]; [0, 0] for a fixed joint"
    )
    least_mm: PerLeg = Field(default=[0.0] * 5, description="least slide from base_mm along it")
    greatest_mm: PerLeg = Field(default=[0.0] * 5, description="greatest slide; no guides where none can move")


class LegsTable(Table):
    """What the legs can do; one number for all, or five."""

    min_length_mm: PerLeg = Field(description="shortest leg, base joint to platform joint")
    max_length_mm: PerLeg = Field(description="longest leg")
    max_velocity_mm_s: PerLeg = Field(description="largest rate of a leg")
    max_acceleration_mm_s2: PerLeg = Field(description="largest acceleration of a leg")
    max_jerk_mm_s3: PerLeg = Field(description="largest jerk of a leg")


class JointsTable(Table):
    """How far the joints turn."""

    base_axis: FiveAxes = Field(description="axis of each base joint's cone, unit vectors, from the base into the work")
    base_cone_deg: PerLeg = Field(description="largest angle between leg and that axis")
    platform_min_deg: PerLeg = Field(description="least angle between leg (seen from its platform joint) and tool axis")
    platform_max_deg: PerLeg = Field(description="largest angle between leg and tool axis")


class BodiesTable(Table):
    """How thick things are."""

    leg_diameter_mm: Positive = Field(description="each leg is a cylinder with round ends")
    shaft_diameter_mm: Positive = Field(description="the spindle is one too, along the platform line")
    shaft_end_mm: Positive = Field(description="the spindle ends this far short of the tip")
    joint_radius_mm: Positive = Field(description="so close to its own platform joint a leg may be inside the spindle")


class ToolTable(Table):
    """The tool that the machine comes with."""

    length_mm: Positive = Field(description="from the platform line's origin (offset 0) to the tip")
    rapid_mm_min: Positive = Field(description="largest tip speed on rapids")
    max_tip_acceleration_mm_s2: Positive | None = Field(
        default=None, description="largest acceleration of the tip; no limit when left out"
    )
    max_tip_jerk_mm_s3: Positive | None = Field(
        default=None, description="largest jerk of the tip; no limit when left out"
    )
    max_axis_velocity_deg_s: Positive | None = Field(
        default=None, description="largest angular velocity of the tool axis; no limit when left out"
    )
    max_axis_acceleration_deg_s2: Positive | None = Field(
        default=None, description="largest angular acceleration of the tool axis; no limit when left out"
    )


class ControllerTable(Table):
    """How the controller takes its setpoints."""

    period_ms: Positive = Field(description="time between setpoints")
    interpolation: Literal["linear", "cubic"] = Field(description="how it moves between them")


class DrivesTable(Table):
    """What moves the legs: for `pentapod simulate`; programs do not depend on it. One number for all legs, or five."""

    position_gain_per_s: PerLeg = Field(
        default=_five_of(_DRIVES.position_gain), description="gain of the position loop (Kv)"
    )
    velocity_gain_per_s: PerLeg = Field(
        default=_five_of(_DRIVES.velocity_gain), description="gain of the velocity loop, its bandwidth in rad/s"
    )
    velocity_integral_per_s: PerLeg = Field(
        default=_five_of(_DRIVES.velocity_integral), description="integral share of the velocity loop, 1 / reset time"
    )
    moving_mass_kg: PerLeg = Field(
        default=_five_of(_DRIVES.moving_mass), description="what a drive feels, motor and screw included"
    )
    ripple_n: PerLeg = Field(default=_five_of(_DRIVES.ripple_force), description="amplitude of the force ripple")
    ripple_pitch_mm: PerLeg = Field(
        default=_five_of(_DRIVES.ripple_pitch, 1e3), description="travel of one period of the ripple"
    )
    velocity_feedforward: Share = Field(
        default=_DRIVES.velocity_feedforward, description="share of the wanted velocity given to the velocity loop"
    )
    acceleration_feedforward: Share = Field(
        default=_DRIVES.acceleration_feedforward, description="share of the wanted acceleration given as a force"
    )
    load_feedforward: Share = Field(
        default=_DRIVES.load_feedforward, description="share of the forces that [masses] need given; MuJoCo alone"
    )
    encoder_step_mm: NotNegative = Field(
        default=round(1e3 * _DRIVES.encoder_step, 12), description="resolution of the leg scales; 0: continuous"
    )
    dead_time_ms: NotNegative = Field(
        default=1e3 * _DRIVES.dead_time, description="from reading the scale to the force"
    )
    period_ms: Positive = Field(default=1e3 * _DRIVES.period, description="of the drive's own loop")
    contour_margin: float = Field(
        default=_DRIVES.contour_margin,
        ge=1.1,
        description="the correction by pose may enlarge what is too fast for it so many times; less is slower",
    )


class MassesTable(Table):
    """What the drives move: for `pentapod simulate --engine mujoco`."""

    cylinder_kg: Positive = Field(default=_MASSES.cylinder, description="fixed part of each leg")
    rod_kg: Positive = Field(default=_MASSES.rod, description="moving part of each leg")
    platform_kg: Positive = Field(default=_MASSES.platform, description="spindle and tool")
    gravity_m_s2: Vector = Field(
        default=_MASSES.gravity.tolist(), description="machine frame; +z points from the base to the work"
    )


class WorkTable(Table):
    """What the machine is advertised for: `pentapod machine check` samples it."""

    centre_mm: Vector = Field(description="centre of the cylinder")
    diameter_mm: Positive = Field(description="of the cylinder of tip positions")
    height_mm: Positive = Field(description="of the cylinder, along z")
    tilt_deg: Annotated[float, Field(ge=0.0, lt=90.0)] = Field(description="largest angle between tool axis and −z")


class MachineTables(Table):
    """A machine file."""

    name: Annotated[str, Field(min_length=1, pattern=r"^[\w .+-]+$")] = Field(description="what it is called")
    description: str = Field(default="", description="one sentence")
    geometry: GeometryTable
    guides: GuidesTable = Field(default_factory=GuidesTable, description="on which base joints can be set, if they can")
    legs: LegsTable
    joints: JointsTable
    bodies: BodiesTable
    tool: ToolTable
    controller: ControllerTable
    work: WorkTable
    drives: DrivesTable = Field(default_factory=DrivesTable, description="what moves the legs, for simulation")
    masses: MassesTable = Field(default_factory=MassesTable, description="what the drives move, for simulation")
