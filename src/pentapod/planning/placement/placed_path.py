"""PlacedPath: the toolpath in the machine, with its placement, the chosen tool axes and their margins."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats, frozen, set_frozen
from pentapod.base.display import plot_axes
from pentapod.base.refusal import Refusal
from pentapod.base.values import Result, Value
from pentapod.geometry.directions import angle_between
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.robot import Branch
from pentapod.planning.limits.limit import Limit
from pentapod.planning.problem.common_axis import CommonAxis
from pentapod.toolpath.toolpath import Toolpath


@dataclass(frozen=True)
class Placement(Value):
    """Rigid transform workpiece → machine, and the reason for its choice ("job", "the one with the most room ...").

    rail_positions (n,): of a reconfigurable machine, metres; None for other machines.

    >>> placed.placement.transform.translation.tolist() == here.translation.tolist()
    True
    """

    summary = ("chosen_by",)

    transform: RigidTransform
    chosen_by: str
    rail_positions: tuple[float, ...] | None = None

    @property
    def guides(self) -> str:
        """The rail positions as text, in mm; empty for a machine without guides."""
        return "" if self.rail_positions is None else ", ".join(f"{1e3 * x:.3f}" for x in self.rail_positions) + " mm"


SINGLE = 1e-7
"""Rounding of margins up to 1 to single precision."""


@dataclass(frozen=True, eq=False)
class PlacedPath(Result):
    """Tool poses in the machine frame, one for each waypoint of the toolpath.

    tips (N, 3) metres; axes (N, 3) unit, tip → spindle; margins (N, M) of the limits (M,), dimensionless, 0 at a limit,
    in single precision: of a long path they take more memory than all else.
    common_axis: the direction towards which the tool leans from the toolpath's axes; None where none was chosen.

    >>> str(placed.component), placed.margins.shape == (len(placed.tips), len(placed.limits))
    ('++', True)
    """

    summary = ("smallest_margin", "active_limit")

    toolpath: Toolpath
    placement: Placement
    component: Branch
    tips: Floats
    axes: Floats
    margins: Floats
    limits: tuple[Limit, ...]
    common_axis: CommonAxis | None = None

    def __post_init__(self) -> None:
        count = len(self.toolpath)
        for name in ("tips", "axes"):
            set_frozen(self, **{name: frozen(getattr(self, name), name, (count, None))})
        set_frozen(self, margins=frozen(self.margins, "margins", (count, None), np.float32))

    @property
    def margin_names(self) -> tuple[str, ...]:
        """The names (M,) of the limits."""
        return tuple(limit.name for limit in self.limits)

    @property
    def smallest_margin(self) -> float:
        """The smallest margin over all waypoints and limits."""
        return float(self.margins.min())

    def keeps(self, margin: float) -> bool:
        """Return whether no margin is smaller, but for its rounding to single precision."""
        return self.smallest_margin >= margin - SINGLE

    @property
    def active_limit(self) -> str:
        """The limit with the smallest margin."""
        return self.margin_names[int(self.margins.min(axis=0).argmin())]

    @property
    def lean(self) -> str:
        """How far the tool leans from the toolpath's axes (from the surface's normal), in words."""
        own = self.placement.transform.rotate(self.toolpath.axes)
        return f"it leans by up to {np.degrees(angle_between(self.axes, own).max()):.0f} deg from the normal"

    @property
    def tilt_centres(self) -> Floats:
        """The points (N, 3) about which the tool is tilted, machine frame, metres."""
        return self.tips + self.toolpath.tilt_centre * self.axes

    def plot(self, axes: Any = None, most: int = 6) -> Any:
        """Draw the margins of the `most` tightest limits along the waypoints into matplotlib axes, and return them.

        Raises InputError where matplotlib is not installed.
        """
        (drawn,) = plot_axes(axes)
        for k in np.argsort(self.margins.min(axis=0), kind="stable")[:most]:
            drawn.plot(self.margins[:, k], label=self.margin_names[k], lw=1)
        drawn.axhline(0.0, color="tab:red", lw=1, ls="--")
        drawn.set(xlabel="waypoint", ylabel="margin, 0 at the limit")
        drawn.legend()
        return drawn


@dataclass(frozen=True)
class UnplacedPath(Refusal):
    """The refusal of a placement, with the best attempt; the diagnosis is that of the attempt."""

    attempt: PlacedPath = field(kw_only=True)
