"""Tip stiffness: how much force in the direction in which the tip yields most moves it by a metre."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from pentapod.kinematics.arithmetic import NUMPY, dot
from pentapod.machine.rigid_bodies.frames import ring_radii
from pentapod.planning.limits.limit import Group, LimitKind, Scene
from pentapod.planning.limits.tool_pose import ToolPose

Matrix = list[list[Any]]
"""3 × 3 numbers, arrays or expressions, by rows."""


@dataclass(frozen=True, kw_only=True)
class TipStiffness:
    """Its margin is 1 where the tip is as stiff as in the middle of the work volume with the tool upright.

    The springs of legs and joints hold the platform; a force on the tip moves it with S⁻¹, S = A − B D⁻¹ Bᵀ, where A,
    B and D are the stiffness against moving, against both, and against turning about the tip. The least eigenvalue of
    S is wanted. That of the fourth root of the trace of S⁻⁴ is smooth, and below it by 24 % at most.

    comfort: N/m that count as margin 1.
    """

    comfort: float
    name: str = "tip stiffness"
    unit: str = "N/um"
    group: Group = "stiffness"

    @classmethod
    def of(cls, scene: Scene) -> list[TipStiffness]:
        """Return it for a machine that says how far its legs yield; none for others."""
        machine = scene.machine
        if not machine.yielding_known:
            return []
        here = cls(comfort=1.0)
        middle = ToolPose(machine, scene.branch, machine.work.centre.tolist(), [0.0, 0.0, -1.0], NUMPY)
        return [replace(here, comfort=float(here.margin(middle)))]

    def margin(self, pose: ToolPose) -> Any:
        """Return the margin of a pose."""
        springs = pose.machine.stiffness
        fixed = 1.0 / springs.leg_stiffness + 1.0 / springs.joint_stiffness
        by_length = 1.0 / springs.leg_rigidity
        moving, both, turning = _zeros(), _zeros(), _zeros()
        lever2, rings = 0.0, ring_radii(pose.machine.robot)
        for k, vector in enumerate(pose.vectors):
            length = pose.lengths[k]
            unit = [vector[j] / length for j in range(3)]
            stiffness = 1.0 / (fixed[k] + by_length[k] * length)
            lever = pose.heights[k] - pose.machine.tool_length
            turn = [lever * value for value in _cross(pose.direction, unit)]
            if rings[k] > 0.0:  # the joint is beside the line
                beside = _cross(unit, pose.arm(k))
                turn = [turn[j] + beside[j] for j in range(3)]
            _add(moving, stiffness, unit, unit)
            _add(both, stiffness, unit, turn)
            _add(turning, stiffness, turn, turn)
            lever2 = lever2 + stiffness * lever * lever
        # No leg holds the platform against turning about its line. Held there, nothing else changes.
        _add(turning, lever2, pose.direction, pose.direction)
        adjoint, determinant = _adjugate(turning)
        coupled = _product(_product(both, adjoint), [list(column) for column in zip(*both, strict=True)])
        held = [[moving[i][j] - coupled[i][j] / determinant for j in range(3)] for i in range(3)]
        # Compliance S⁻¹ = adj S / det S.
        adjoint, determinant = _adjugate(held)
        squared = _product(adjoint, adjoint)
        trace = sum(dot(row, row) for row in squared)
        return determinant / pose.xp.sqrt(pose.xp.sqrt(trace)) / self.comfort

    def shortfall(self, margin: float) -> float:
        """Return how much stiffness lacks, N/µm."""
        return -margin * self.comfort * 1e-6


STIFFNESS = LimitKind(TipStiffness.of)
"""For jobs that prefer stiff places; it is no limit of a machine."""


def _zeros() -> Matrix:
    return [[0.0] * 3 for _ in range(3)]


def _add(matrix: Matrix, factor: Any, a: Sequence[Any], b: Sequence[Any]) -> None:
    """Add factor · a bᵀ to a matrix."""
    for i in range(3):
        for j in range(3):
            matrix[i][j] = matrix[i][j] + factor * a[i] * b[j]


def _cross(a: Sequence[Any], b: Sequence[Any]) -> list[Any]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _product(a: Matrix, b: Matrix) -> Matrix:
    return [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


def _adjugate(matrix: Matrix) -> tuple[Matrix, Any]:
    """Return the adjugate and the determinant of a symmetric matrix."""
    rows = [_cross(matrix[1], matrix[2]), _cross(matrix[2], matrix[0]), _cross(matrix[0], matrix[1])]
    return rows, dot(matrix[0], rows[0])
