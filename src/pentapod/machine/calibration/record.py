"""CalibrationRecord: the geometry of a machine as it was measured: what a calibration file holds."""

from __future__ import annotations

import datetime
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from pentapod.base.arrays import Floats, set_frozen
from pentapod.base.errors import MachineError
from pentapod.base.keys import Key, check_fields, declared
from pentapod.base.units import from_si
from pentapod.base.values import Value
from pentapod.kinematics.families.as_built import AsBuiltPentapod
from pentapod.kinematics.families.as_built_forward import Nominal
from pentapod.kinematics.robot import Robot
from pentapod.machine.calibration.digest import digest_of
from pentapod.machine.calibration.parameters import LEGS, PARAMETERS

DIGITS = 13
"""Significant digits of the numbers in a calibration file, 1e-10 mm of a metre. A record holds what its file says."""

FIVE_NUMBERS = Annotated[list[float], Field(min_length=LEGS, max_length=LEGS)]
FIVE_POINTS = Annotated[
    list[Annotated[list[float], Field(min_length=3, max_length=3)]], Field(min_length=LEGS, max_length=LEGS)
]

LARGEST_ERROR = 0.1
"""Largest error of a joint, as a share of the base's size: beyond it units or legs were mixed up."""


@dataclass(frozen=True, eq=False)
class MeasuredGeometry(Value):
    """Where the joints are, as measured.

    base (5, 3): base joints, machine frame. offsets, radii, zeros (5,): as in `AsBuiltPentapod`. All in metres. Raises
    MachineError: wrong shapes, numbers that are not finite, negative radii.
    """

    base: Annotated[Floats, Key("mm", "base joints [x, y, z], machine frame, leg 1 to leg 5", kind=FIVE_POINTS)]
    offsets: Annotated[
        Floats,
        Key("mm", "platform joints along the line towards the tip, leg 1 to leg 5", "platform", kind=FIVE_NUMBERS),
    ]
    radii: Annotated[
        Floats,
        Key(
            "mm", "radii of the rings on which the legs end; 0 is a joint on the line", "ring_radius", kind=FIVE_NUMBERS
        ),
    ]
    zeros: Annotated[Floats, Key("mm", "reading of a leg's scale minus the leg's length", "zero", kind=FIVE_NUMBERS)]

    def __post_init__(self) -> None:
        for name, shape in (("base", (LEGS, 3)), *((name, (LEGS,)) for name in ("offsets", "radii", "zeros"))):
            array = np.array(getattr(self, name), dtype=np.float64)
            if array.shape != shape:
                raise MachineError("wrong shape", key=name, value=array.shape, expected=str(shape))
            set_frozen(self, **{name: array})
        _as_in_files(self)
        if (self.radii < 0.0).any():
            leg = int(np.argmin(self.radii))
            raise MachineError(
                f"leg {leg + 1}: its ring has a negative radius", key="radii", value=float(self.radii[leg]),
                expected="0 or more",
            )  # fmt: skip


@dataclass(frozen=True, eq=False)
class CalibrationFit(Value):
    """How well a measured geometry is known.

    identified: those of the `PARAMETERS` that the measurements tell; the others are nominal. leg_sigma: standard
    deviation of a reading, metres. covariance (30, 30): of the `PARAMETERS`, m²; rows of those not identified are zero.
    residuals (N, 5): readings of the measured poses minus those of the geometry, metres.

    Raises MachineError: wrong shapes, unknown parameters, a covariance that is not symmetric or has negative variances.
    """

    identified: Annotated[tuple[str, ...], Key("", "numbers that the measurements tell", kind=list[str])]
    leg_sigma: Annotated[float, Key("mm", "standard deviation of a leg's reading", ge=0.0)]
    covariance: Annotated[Floats, Key("mm2", "covariance of all numbers, leg by leg", kind=list[list[float]])]
    residuals: Annotated[Floats, Key("mm", "readings minus those of this geometry", kind=list[list[float]])]

    def __post_init__(self) -> None:
        set_frozen(self, identified=tuple(self.identified))
        unknown = [name for name in self.identified if name not in PARAMETERS]
        if unknown:
            raise MachineError("unknown number", key="identified", value=unknown[0], expected='names like "leg 1 x"')
        count = len(PARAMETERS)
        for name, shape in (("covariance", (count, count)), ("residuals", (None, LEGS))):
            try:
                array = np.asarray(getattr(self, name), dtype=np.float64)
            except ValueError as error:
                raise MachineError("not a matrix", key=name, expected="rows of one length") from error
            if array.ndim != 2 or any(n not in (m, None) for m, n in zip(array.shape, shape, strict=True)):
                expected = f"{shape[0] or 'N'} rows of {shape[1]} numbers"
                raise MachineError("wrong shape", key=name, value=array.shape, expected=expected)
            set_frozen(self, **{name: array})
        check_fields(self, MachineError)
        _as_in_files(self)
        if (self.covariance != self.covariance.T).any() or (np.diagonal(self.covariance) < 0.0).any():
            raise MachineError("not a covariance", key="covariance", expected="symmetric, no negative variances")


@dataclass(frozen=True, eq=False)
class CalibrationRecord(Value):
    """The result of a calibration as its file holds it; `calibration_file` reads and writes it.

    machine: name of the machine as designed. nominal: `geometry_digest` of its geometry. date: of the measurement. fit:
    None where a geometry was measured in another way.
    """

    summary = ("digest",)

    machine: str
    nominal: str
    date: datetime.date
    geometry: MeasuredGeometry
    fit: CalibrationFit | None = None

    @property
    def name(self) -> str:
        """How programs name it: machine, day and digest."""
        return f"{self.machine} {self.date} {self.digest}"

    @cached_property
    def digest(self) -> str:
        """16 hexadecimal digits of a SHA-256 over all that the record says."""
        parts: dict[str, object] = {"machine": self.machine, "nominal": self.nominal, "date": str(self.date)}
        for part in (self.geometry, self.fit):
            if part is not None:
                parts |= {f.name: getattr(part, f.name) for f in fields(part) if f.name != "identified"}
        identified = () if self.fit is None else self.fit.identified
        return digest_of({**parts, "identified": ", ".join(identified)})

    def as_built(self, nominal: Robot) -> AsBuiltPentapod:
        """Return the machine as measured, beside the geometry that it was built to.

        Raises MachineError: the calibration is of another machine, its joints are far from the nominal ones, or the
        robot is no linear pentapod.
        """
        design = nominal.nominal if isinstance(nominal, AsBuiltPentapod) else nominal
        if not isinstance(design, Nominal):
            family = type(nominal).__name__
            raise MachineError("calibration files are for linear pentapods", key="calibration", value=family)
        if (found := geometry_digest(nominal)) != self.nominal:
            raise MachineError(
                f'the calibration is of another geometry: "{self.machine}" as it was designed then', key="nominal",
                value=self.nominal, expected=found, remedy="name this machine's calibration, or calibrate it again",
            )  # fmt: skip
        here = self.geometry
        off = np.linalg.norm(here.base - nominal.base_joints, axis=1)
        if off.max() > LARGEST_ERROR * float(np.ptp(nominal.base_joints, axis=0).max()):
            leg = int(off.argmax())
            raise MachineError(
                f"base joint {leg + 1} is {from_si(off[leg], 'mm'):.4g} mm from where the machine file has it",
                key="base", expected="millimetres, leg 1 to leg 5", remedy="check the unit and the order of the legs",
            )  # fmt: skip
        return AsBuiltPentapod(here.base, here.offsets, here.radii, here.zeros, design)


def geometry_digest(robot: Robot) -> str:
    """Return 16 hexadecimal digits of a SHA-256 over a robot's geometry alone: what a calibration belongs to."""
    return digest_of(robot.numbers)


def in_file(value: Any, unit: str) -> Any:
    """Return a number or an array in the unit of a file, rounded to `DIGITS`: numbers, or lists of them."""
    rounded = np.vectorize(lambda x: float(f"{x:.{DIGITS}g}"), otypes=[np.float64])
    return (rounded(np.asarray(from_si(value, unit))) + 0.0).tolist()


def _as_in_files(instance: Any) -> None:
    """Replace the numbers of a dataclass by those that its file gives back. Raises MachineError: not finite."""
    for item in declared(type(instance)):
        value = getattr(instance, item.field)
        if not isinstance(value, float | np.ndarray):
            continue
        if not np.isfinite(value).all():
            raise MachineError("must be finite", key=item.field)
        exact = item.key.si(in_file(value, item.key.unit))
        if isinstance(exact, np.ndarray):
            exact = exact.reshape(np.shape(value))  # no residuals at all, too
            exact.flags.writeable = False
        set_frozen(instance, **{item.field: exact})
