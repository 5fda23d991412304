"""Measurements: what an instrument saw of the tool, and what the legs' scales read, pose by pose."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Bools, Floats, Ints, frozen, set_frozen
from pentapod.base.errors import ArrayError
from pentapod.base.values import Value
from pentapod.kinematics.five_legs import FiveLegs
from pentapod.kinematics.robot import Branch


class Instrument(StrEnum):
    """What measures the tool.

    pose: position and axis (a laser tracker with a probe of six degrees of freedom, cameras). tracker: the position of
    a target on the tool's axis. plate: the same from a touch probe on the spheres of a plate, whose centres are known.
    ballbar: the distance of the target from a fixed ball. dock: a fixture that holds the tool in a known pose.
    """

    POSE = "pose"
    TRACKER = "tracker"
    PLATE = "plate"
    BALLBAR = "ballbar"
    DOCK = "dock"

    @property
    def sees_axes(self) -> bool:
        """Whether tool axes are measured, too."""
        return self in (Instrument.POSE, Instrument.DOCK)

    @property
    def sees_positions(self) -> bool:
        """Whether positions are measured."""
        return self is not Instrument.BALLBAR


class Frame(StrEnum):
    """In which frame the instrument reports: the machine's, or one of its own that is to be found."""

    MACHINE = "machine"
    INSTRUMENT = "instrument"


WIDTHS = {Instrument.POSE: 6, Instrument.DOCK: 6, Instrument.TRACKER: 3, Instrument.PLATE: 3, Instrument.BALLBAR: 1}
"""How many numbers an instrument gives of a pose."""


def _not_given() -> Ints:
    return np.zeros(0, dtype=np.intp)


@dataclass(frozen=True, eq=False)
class Measurements(Value):
    """Poses of one machine as an instrument saw them, and the readings of the legs there; SI units.

    legs (N, 5): readings. seen (N, 6, 3 or 1): x, y, z of the target and the tool axis (tip → spindle), or x, y, z, or
    the distance. setups (N,): which of several stations of the instrument (or places of plate or ball), from 0.
    target: of the point that is seen, along the platform line from p towards the tip. machine, digest: name and digest
    of the nominal machine; component: in which it stood. leg_sigma: standard deviation of a reading, None where the
    residuals shall tell it; position_sigma: of each coordinate of a position, or of a distance; direction_sigma: of an
    axis to either side, radians. lines (N,): of the file, for messages.

    Raises ArrayError: wrong shapes, axes that are not unit vectors to 1e-3 (they are then normalised), sigmas that are
    negative, or all zero.
    """

    instrument: Instrument
    legs: Floats
    seen: Floats
    target: float
    component: Branch
    frame: Frame = Frame.MACHINE
    setups: Ints = field(default_factory=_not_given)
    machine: str = ""
    digest: str = ""
    leg_sigma: float | None = None
    position_sigma: float = 0.0
    direction_sigma: float = 0.0
    lines: Ints = field(default_factory=_not_given)

    def __post_init__(self) -> None:
        instrument = Instrument(self.instrument)
        count, width = len(self.legs), WIDTHS[instrument]
        legs = frozen(self.legs, "legs", (None, FiveLegs.n_legs))
        seen = frozen(self.seen, "seen", (None, width))
        for name, array, expected in (("legs", legs, FiveLegs.n_legs), ("seen", seen, width)):
            if array.shape != (count, expected):
                raise ArrayError(f"{name} has shape {array.shape}", expected=f"shape ({count}, {expected})")
        if count == 0:
            raise ArrayError("there are no poses to calibrate from", expected="one row for each pose")
        if instrument.sees_axes:
            lengths = np.linalg.norm(seen[:, 3:], axis=1)
            worst = int(np.abs(lengths - 1.0).argmax())
            if abs(lengths[worst] - 1.0) > 1e-3:
                what = f"the tool axis of pose {worst + 1} is not a unit vector"
                raise ArrayError(what, key="i, j, k", value=float(lengths[worst]), expected="length 1")
            seen = frozen(np.hstack([seen[:, :3], seen[:, 3:] / lengths[:, None]]), "seen")
        given = {name: getattr(self, name) for name in ("leg_sigma", "position_sigma", "direction_sigma")}
        for name, value in given.items():
            if value is not None and not (math.isfinite(value) and value >= 0.0):
                raise ArrayError(f"{name} must not be negative", key=name, value=value)
        set_frozen(self, instrument=instrument, frame=Frame(self.frame), legs=legs, seen=seen)
        for name, default in (("setups", np.zeros(count)), ("lines", np.arange(1, count + 1))):
            value = getattr(self, name)
            array = np.array(value if len(value) else default, dtype=np.intp)
            if array.shape != (count,):
                raise ArrayError(f"{name} has shape {array.shape}", expected=f"shape ({count},)")
            array.flags.writeable = False
            set_frozen(self, **{name: array})

    def __len__(self) -> int:
        return len(self.legs)

    @property
    def equations(self) -> int:
        """How many numbers the measurements tell: of a pose five, for the turn about the tool's axis tells nothing."""
        return len(self) * min(WIDTHS[self.instrument], FiveLegs.n_legs)

    def some(self, which: Bools | Ints) -> Measurements:
        """Return some of the poses."""
        rows = {name: getattr(self, name)[which] for name in ("legs", "seen", "setups", "lines")}
        return dataclasses.replace(self, **rows)

    def with_legs(self, legs: ArrayLike) -> Measurements:
        """Return the same with other readings (N, 5)."""
        return dataclasses.replace(self, legs=np.asarray(legs, dtype=np.float64))
