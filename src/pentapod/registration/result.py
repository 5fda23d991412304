"""Results of a registration: the placement, its uncertainty, and what the touches leave open."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats, frozen, set_frozen
from pentapod.base.refusal import Refusal
from pentapod.base.values import Result, Value
from pentapod.geometry.rigid import RigidTransform
from pentapod.registration.motions import Motion


@dataclass(frozen=True, eq=False)
class CutSurface(Value):
    """Points (P, 3) of the surface that is cut and its unit normals (P, 3), workpiece frame."""

    points: Floats
    normals: Floats

    def __post_init__(self) -> None:
        for name in ("points", "normals"):
            set_frozen(self, **{name: frozen(getattr(self, name), name, (None, 3))})


@dataclass(frozen=True)
class OtherPlacement(Value):
    """Another placement that fits the touches as well. shift: metres and turn: radians from the one found."""

    placement: RigidTransform
    shift: float
    turn: float
    near: bool

    def __str__(self) -> str:
        return f"turned by {np.degrees(self.turn):.1f} deg, its middle {1e3 * self.shift:.1f} mm away"


@dataclass(frozen=True, eq=False)
class Registration(Result):
    """Where the part is. residuals (N,): gaps that are left, metres, positive where the ball is off the surface.

    used (N,): touches that are no outliers. noise: standard deviation of a touch, metres. covariance (6, 6): of the
    twist of the part about `centre` (3,), workpiece frame, for turns in metres at the distance `size`; motions that are
    held have none. across (P,): standard deviation of the cut surface along its normals, metres. factor: from standard
    deviations to half the width of the confidence interval. held: motions as at the start. others: further placements
    that fit. rows (N, 6): `motion_rows` of the touches.
    """

    summary = ("noise", "uncertainty")

    placement: RigidTransform
    residuals: Floats
    used: Bools
    noise: float
    covariance: Floats
    across: Floats
    factor: float
    centre: Floats
    size: float
    held: tuple[Motion, ...]
    others: tuple[OtherPlacement, ...]
    rows: Floats

    def __post_init__(self) -> None:
        for name in ("residuals", "covariance", "across", "rows"):
            set_frozen(self, **{name: frozen(getattr(self, name), name)})
        self.used.flags.writeable = False

    @property
    def uncertainty(self) -> float:
        """Half the width of the confidence interval of the cut surface's place, along its normal where it is widest."""
        return self.factor * float(self.across.max(initial=0.0))

    @property
    def rms(self) -> float:
        """Root mean square of the residuals that were used, metres."""
        used = self.residuals[self.used] if self.used.any() else self.residuals
        return float(np.sqrt(np.mean(np.square(used))))

    @property
    def outliers(self) -> tuple[int, ...]:
        """Indices of the touches that were not used."""
        return tuple(np.flatnonzero(~self.used).tolist())


@dataclass(frozen=True)
class NotRegistered(Refusal):
    """The refusal of a registration. found: the best placement so far, motions that are held among its values."""

    found: Registration | None = None
