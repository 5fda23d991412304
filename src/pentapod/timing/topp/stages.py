"""The discretised problem of TOPP-RA, free of units, and the reasons why it may have no solution."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats, as_floats
from pentapod.base.errors import InputError

NOT_CONTROLLABLE = "no time law reaches the end from here (not controllable)"
UNBOUNDED = "no limit bounds the speed here"
TOO_FAST_END = "the speed at the end is above a limit"
TOO_FAST = "the speed at the start is higher than any from which the end can be reached"
STANDS_BEYOND = "a limit is exceeded even at rest there"
TOO_SLOW = "the speed at the start is lower than any from which the end can be reached"


@dataclass(frozen=True)
class Failure:
    """Why there is no law: the gridpoint where the solver stopped, and its reason.

    conflict: the rows that leave no acceleration there, where they are known, limits: the names of their limits;
    station: s there in metres, likewise.
    """

    gridpoint: int
    reason: str
    conflict: tuple[int, ...] = ()
    station: float | None = None
    limits: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Stages:
    """What the passes take: |first · u + second · x + offset| ≤ 1 at both ends of each stage, 0 ≤ x ≤ ceiling.

    s (N + 1,) never falls; where it stays, the coefficients jump and x does not. first, second (N + 1, R): with leg
    derivatives over leg acceleration limits, for instance; offset (N + 1, R) or (1, R), within ±1: what is there
    at rest, less the middle of limits that are not symmetric. ceiling (N + 1,) may be infinite. u is s̈,
    constant in each stage. Any units: nothing in the passes is absolute.
    """

    s: Floats
    first: Floats
    second: Floats
    offset: Floats
    ceiling: Floats

    @classmethod
    def of(cls, s: Floats, first: Floats, second: Floats, ceiling: Floats, offset: Floats | None = None) -> Stages:
        """Return the stages, their arrays of one shape. Raises InputError: s falls, a standstill is not allowed."""
        s = np.require(as_floats(s, "s", (None,)), requirements=["C", "W"])
        if len(s) < 2 or not (np.diff(s) >= 0.0).all():
            raise InputError("gridpoints must not fall", key="s", expected="two or more, each at least the last")
        rows = np.asarray(first).shape[-1]
        if offset is None:
            offset = np.zeros((1, rows))
        if not (np.abs(offset) <= 1.0).all():
            raise InputError(
                "a standstill breaks a limit", key="offset", value=float(np.nanmax(np.abs(offset))), expected="−1 to 1"
            )
        shapes = {"first": (len(s), rows), "second": (len(s), rows), "ceiling": (len(s),)}
        arrays = {"first": first, "second": second, "ceiling": ceiling}
        for name, shape in shapes.items():
            if np.asarray(arrays[name]).shape != shape:
                raise InputError("wrong shape", key=name, value=np.asarray(arrays[name]).shape, expected=str(shape))
        plain = {name: np.require(array, np.float64, ["C", "W"]) for name, array in arrays.items()}
        return cls(s=s, offset=np.require(offset, np.float64, ["C", "W"]), **plain)

    def fault(self) -> Failure | None:
        """Return the first gridpoint whose coefficients are no numbers."""
        if np.isfinite(self.first).all() and np.isfinite(self.second).all() and (self.ceiling >= 0.0).all():
            return None
        unfit = ~(np.isfinite(self.first) & np.isfinite(self.second)).all(axis=1) | ~(self.ceiling >= 0.0)
        return Failure(int(np.argmax(unfit)), "a limit or a derivative of the path is not a number")
