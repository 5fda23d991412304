"""Margins: one dimensionless number for every limit, positive inside and 0 at the limit.

All are scaled so that 1 is comfortable, so that "the smallest margin" compares like with like. The one
formula below serves NumPy arrays and casadi symbols alike: it uses element-wise arithmetic only.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, Literal

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ArrayError
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.component import Component
from pentapod.machine.clearance.collision_world import NOTHING, TOOL_BODY, Surroundings
from pentapod.machine.clearance.tool_clearance import Arithmetic, leg_spindle_gap, leg_tool_gap
from pentapod.machine.machine import Machine
from pentapod.planning.limits.contacts import NUMBERS, comforts, contacts, margin_formulas, names
from pentapod.planning.limits.signed_leg_clearance import passing_gap

W_COMFORTABLE = float(np.sin(np.radians(60.0)))
"""|w| of a tool axis 30° off the base normal: margin 1."""

S_COMFORTABLE_FRACTION = 0.25
"""Distance to the surface S = 0, as a fraction of the mean leg length, that counts as margin 1."""

CLEARANCE_COMFORTABLE_M = 0.05
"""Gap between two legs that counts as margin 1."""

TOOL_COMFORTABLE_M = 0.02
"""Gap between a leg and the spindle or tool that it is joined to, that counts as margin 1."""

_BLOCK = 16_384
"""Poses at a time: a hundred intermediate values of each need not be held for a million."""

_PAIRS = tuple(combinations(range(5), 2))


Joints = tuple[Sequence[Sequence[Any]], Sequence[Any]]
"""Base attachments (5) of two and platform offsets (5), metres: numbers or expressions."""

Group = Literal["strokes", "singularities", "joints", "bodies"]


@dataclass(frozen=True)
class Limit:
    """What one margin row stands for. name: as a user knows it; unit: of the shortfall, mm or deg; group: its kind."""

    name: str
    unit: str
    shortfall: Callable[[float], float]
    """Converts a negative margin into how far beyond the limit it is, in `unit`."""
    group: Group = "bodies"


@dataclass(frozen=True, eq=False)
class Margins:
    """The margins of one machine in one component.

    Called with tips and tool axes (..., 3) in the machine frame it returns (..., M), M = len(limits). surroundings:
    what must not be touched; its margins come last, and need to know where the workpiece stands.
    """

    machine: Machine
    component: Component
    limits: tuple[Limit, ...]
    sides: tuple[float, ...]
    surroundings: Surroundings = NOTHING

    @classmethod
    def of(cls, machine: Machine, component: Component, surroundings: Surroundings = NOTHING) -> Margins:
        """Build the margins of `machine` in `component`."""
        limits = (*_limits(machine, surroundings), *_outer_limits(surroundings))
        return cls(machine, component, limits, _home_sides(machine, component), surroundings)

    def __call__(self, tips: Floats, axes: Floats, placement: RigidTransform | None = None) -> Floats:
        """Return margins (..., M) of tool tips and axes (tip → spindle), both (..., 3), machine frame.

        placement: of the workpiece; needed where there are obstacles.
        """
        own = self.own(tips, axes)
        if not self.surroundings.obstacles:
            return own
        if placement is None:
            raise ArrayError("gaps to the part need to know where it stands", key="placement")
        outer = contacts(self.machine, self.surroundings, tips.reshape(-1, 3), axes.reshape(-1, 3), placement).margins
        return np.concatenate([own, outer.reshape(*own.shape[:-1], -1)], axis=-1)

    def own(self, tips: Floats, axes: Floats) -> Floats:
        """Return the margins (..., M) of the machine alone: without those to obstacles, which come last."""
        if tips.ndim == 2 and len(tips) > _BLOCK:
            blocks = range(0, len(tips), _BLOCK)
            return np.concatenate([self.own(tips[k : k + _BLOCK], axes[k : k + _BLOCK]) for k in blocks])
        tip, axis = list(np.moveaxis(tips, -1, 0)), list(np.moveaxis(axes, -1, 0))
        rows = self.rows(tip, axis, np.sqrt, np.minimum, np.maximum, np.where)
        return np.stack(np.broadcast_arrays(*rows), axis=-1)

    def contacts(self, tips: Floats, axes: Floats, placement: RigidTransform) -> Floats:
        """Return the contacts (n, contact_numbers) that the formulas need, of poses (n, 3); none without obstacles."""
        if not self.surroundings.obstacles:
            return np.zeros((len(tips), 0))
        return contacts(self.machine, self.surroundings, tips, axes, placement).numbers

    @property
    def contact_numbers(self) -> int:
        """How many numbers the contacts of one pose are."""
        return NUMBERS * len(names(self.surroundings))

    def symbolic(
        self,
        tip: Any,
        axis: Any,
        turn: Any = None,
        shift: Any = None,
        numbers: Any = None,
        joints: Joints | None = None,
    ) -> Any:
        """Return the column of the same margins for casadi SX vectors tip and axis (3).

        turn, shift: the workpiece's rotation (3×3) and translation; numbers: of its contacts, see `contacts`. All three
        are needed where there are obstacles. joints: as in `rows`.
        """
        import casadi as ca  # noqa: PLC0415  heavy: only when planning

        pose = ca.vertsplit(tip), ca.vertsplit(axis)
        rows = self.rows(*pose, ca.sqrt, ca.fmin, ca.fmax, ca.if_else, joints)
        if self.surroundings.obstacles:
            placement = (lambda k, j: turn[k, j]), ca.vertsplit(shift)
            known = self.joints if joints is None else joints
            rows += margin_formulas(self.machine, self.surroundings, pose, placement, ca.vertsplit(numbers), known)
        return ca.vertcat(*rows)

    @property
    def joints(self) -> Joints:
        """Where the joints are: base attachments (5) of two, and platform offsets (5), metres."""
        robot = self.machine.pentapod
        return robot.base.tolist(), robot.offsets.tolist()

    def rows(
        self,
        tip: Sequence[Any],
        axis: Sequence[Any],
        sqrt: Any,
        least: Any,
        most: Any,
        where: Any,
        joints: Joints | None = None,
    ) -> list[Any]:
        """Return the margin expressions, in the order of `limits`; tip and axis are three components each.

        joints: where base joints on guides, and the platform joints that belong to them, are, as expressions; where the
        machine has them by default. The singular surfaces do not change with them, and gaps between a leg and what
        hangs on its platform line change so little that they are taken as they are.
        """
        m = self.machine
        bases, offsets = self.joints if joints is None else joints
        robot, legs, cones = m.pentapod, m.legs, m.joints
        u, v, w = -axis[0], -axis[1], -axis[2]  # i points to the tip
        p = [tip[k] + m.tool_length * axis[k] for k in range(3)]

        def dot(a: Sequence[Any], b: Sequence[Any]) -> Any:
            return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]

        vectors, lengths = [], []
        for (x, y), z in zip(bases, offsets, strict=True):
            d = [p[0] + z * u - x, p[1] + z * v - y, p[2] + z * w]
            vectors.append(d)
            lengths.append(sqrt(dot(d, d)))
        half_stroke = (0.5 * (legs.max_length - legs.min_length)).tolist()
        rows = [
            (length - low) / h for length, low, h in zip(lengths, legs.min_length.tolist(), half_stroke, strict=True)
        ]
        rows += [
            (high - length) / h for length, high, h in zip(lengths, legs.max_length.tolist(), half_stroke, strict=True)
        ]

        # The singular surfaces: w = 0, and S = 0 as the position distance (kinematics notes, section 4).
        # S is taken in the reduced frame of leg 3, in which the formula of the notes holds.
        delta, (x3, _) = robot.delta, robot.base[2].tolist()
        z3 = float(robot.offsets[2])
        px, pz = p[0] + z3 * u - x3, p[2] + z3 * w
        s = delta * w * px - (delta * u - 1.0) * pz
        distance = s / sqrt((delta * w) * (delta * w) + (1.0 - delta * u) * (1.0 - delta * u))
        rows.append(self.component.w * w / W_COMFORTABLE)
        rows.append(self.component.s * distance / _s_comfortable(m))

        direction = [u, v, w]
        for d, length, a, cone in zip(
            vectors, lengths, cones.base_axes.tolist(), cones.base_cone.tolist(), strict=True
        ):
            edge = float(np.cos(cone))
            rows.append((dot(d, a) / length - edge) / (1.0 - edge))
        for k, (least_angle, most_angle) in enumerate(cones.platform_range.tolist()):
            widest, narrowest, scale = _platform_edges(least_angle, most_angle)
            cosine = dot(vectors[k], direction) / lengths[k]
            rows.append((cosine - widest) / scale)
            rows.append((narrowest - cosine) / scale)

        for (j, k), side in zip(_PAIRS, self.sides, strict=True):
            offset = [b - a for a, b in zip(bases[j], bases[k], strict=True)]
            gap = passing_gap(offset, vectors[j], vectors[k], side, sqrt, least, most, where)
            rows.append((gap - 2.0 * m.bodies.leg_radius) / CLEARANCE_COMFORTABLE_M)

        do, cosines = Arithmetic(sqrt, least, most, where), [dot(vectors[k], direction) / lengths[k] for k in range(5)]
        rows += [leg_spindle_gap(m, k, cosines[k], do) / TOOL_COMFORTABLE_M for k in range(5)]
        if tool := self.surroundings.tool:
            gaps = [leg_tool_gap(m, tool, k, cosines[k], lengths[k], do) for k in range(5)]
            rows += [gap / TOOL_COMFORTABLE_M for gap in gaps]
        return rows


def _platform_edges(least: float, most: float) -> tuple[float, float, float]:
    """Return the cosines at which a platform joint's angle is too large and too small, and what counts as margin 1.

    An angle cannot be below 0° nor above 180°: such an end is no limit, and its margin is 1 at least.
    """
    low, high = float(np.cos(most)), float(np.cos(least))
    scale = 0.5 * (high - low)
    return (low if most < np.pi else low - scale), (high if least > 0.0 else high + scale), scale


def _home_sides(machine: Machine, component: Component) -> tuple[float, ...]:
    """Return for each pair of legs on which side the second passes the first in the middle of the work volume."""
    direction = np.array([0.0, 0.0, float(component.w)])
    position = machine.work.centre - machine.tool_length * direction
    legs, base = machine.pentapod.leg_vectors(position, direction), machine.pentapod.base
    triples = [np.dot([*(base[k] - base[j]), 0.0], np.cross(legs[j], legs[k])) for j, k in _PAIRS]
    return tuple(float(np.sign(t)) for t in triples)


def _s_comfortable(machine: Machine) -> float:
    return S_COMFORTABLE_FRACTION * float(np.mean(0.5 * (machine.legs.min_length + machine.legs.max_length)))


def _limits(machine: Machine, surroundings: Surroundings) -> tuple[Limit, ...]:
    legs, joints = machine.legs, machine.joints

    def length(half_stroke: float) -> Callable[[float], float]:
        return lambda margin: -margin * half_stroke * 1e3

    def cone(edge: float, scale: float, sign: float) -> Callable[[float], float]:
        at_limit = float(np.arccos(np.clip(edge, -1.0, 1.0)))
        return lambda margin: float(
            abs(np.degrees(np.arccos(np.clip(edge + sign * margin * scale, -1.0, 1.0)) - at_limit))
        )

    half = (0.5 * (legs.max_length - legs.min_length)).tolist()
    rows = [Limit(f"leg {k + 1} too short", "mm", length(half[k]), "strokes") for k in range(5)]
    rows += [Limit(f"leg {k + 1} too long", "mm", length(half[k]), "strokes") for k in range(5)]
    rows.append(
        Limit(
            "singular surface w = 0",
            "deg",
            lambda m: float(np.degrees(np.arcsin(np.clip(-m * W_COMFORTABLE, -1.0, 1.0)))),
            "singularities",
        )
    )
    rows.append(Limit("singular surface S = 0", "mm", length(_s_comfortable(machine)), "singularities"))
    for k, angle in enumerate(joints.base_cone.tolist()):
        edge = float(np.cos(angle))
        rows.append(Limit(f"base joint {k + 1} beyond its cone", "deg", cone(edge, 1.0 - edge, 1.0), "joints"))
    for k, (least, most) in enumerate(joints.platform_range.tolist()):
        widest, narrowest, scale = _platform_edges(least, most)
        rows.append(
            Limit(
                f"platform joint {k + 1} beyond its largest angle",
                "deg",
                cone(widest, scale, 1.0),
                "joints",
            )
        )
        rows.append(
            Limit(
                f"platform joint {k + 1} below its least angle",
                "deg",
                cone(narrowest, scale, -1.0),
                "joints",
            )
        )
    rows += [Limit(f"legs {j + 1} and {k + 1} touch", "mm", length(CLEARANCE_COMFORTABLE_M)) for j, k in _PAIRS]
    held = ("spindle", TOOL_BODY) if surroundings.tool else ("spindle",)
    rows += [
        Limit(f"leg {k + 1} touches the {body}", "mm", length(TOOL_COMFORTABLE_M)) for body in held for k in range(5)
    ]
    return tuple(rows)


def _outer_limits(surroundings: Surroundings) -> tuple[Limit, ...]:
    def length(comfort: float) -> Callable[[float], float]:
        return lambda margin: -margin * comfort * 1e3

    both = zip(names(surroundings), comforts(surroundings), strict=True)
    return tuple(Limit(name, "mm", length(comfort)) for name, comfort in both)
