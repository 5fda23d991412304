"""The optimisation problem over placement and tilt field, stated in casadi and solved by IPOPT.

Unknowns: a small placement step (3 translations, a Cayley rotation vector) around a given placement, the
coefficients of the tilt field, and the smallest margin m. Every chosen waypoint contributes its margins
and its tilt cone. Two objectives on the same constraints: the largest m (the placement), or the
calmest tilt that keeps m at a given value (the axis along the path).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from pentapod.arrays import Floats, Ints
from pentapod.geometry.rigid import RigidTransform
from pentapod.planning.margins import Margins
from pentapod.planning.task import Task
from pentapod.planning.tilt import FieldDomain

Goal = Literal["margin", "calm"]

CONE_SHARE = 0.98
"""Share of the tilt cone used by the optimiser; the rest absorbs what happens between waypoints."""

_TRANSLATION_STEP_M, _ROTATION_STEP = 0.4, 0.8
_OPTIONS: dict[str, Any] = {
    "print_time": False,
    "error_on_fail": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.max_iter": 120,
    "ipopt.tol": 1e-6,
    "ipopt.acceptable_tol": 1e-4,
    "ipopt.acceptable_iter": 5,
    "ipopt.mu_strategy": "adaptive",
    "ipopt.fixed_variable_treatment": "make_parameter",
}


@dataclass(frozen=True, eq=False)
class Solution:
    """What the solver came back with; whoever uses it recomputes the margins at every waypoint."""

    placement: RigidTransform
    coefficients: Floats
    iterations: int


class PlanningProblem:
    """The problem for one task, component and set of margin rows; solved for any subset of waypoints.

    rows: indices of the margins that can become small; the others are left out and checked afterwards.
    free: whether the placement may move.
    """

    def __init__(self, task: Task, margins: Margins, domain: FieldDomain, rows: Sequence[int], *, free: bool) -> None:
        self._task, self._margins, self._domain, self._free = task, margins, domain, free
        self._cone = float(np.tan(task.tilt) * CONE_SHARE)
        self._tilts = task.tilt > 0.0
        self._point = self._point_function(tuple(rows))
        self._solvers: dict[tuple[int, Goal], Any] = {}

    def _point_function(self, rows: tuple[int, ...]) -> Any:
        """Return the casadi function (step, a, pivot, nominal, R, t) → margins, share of the cone used (squared)."""
        import casadi as ca  # noqa: PLC0415  heavy: only when planning

        step, a = ca.SX.sym("step", 6), ca.SX.sym("a", 2)
        pivot, nominal = ca.SX.sym("pivot", 3), ca.SX.sym("nominal", 3)
        rotation, translation = ca.SX.sym("R", 3, 3), ca.SX.sym("t", 3)
        b = ca.mtimes(ca.DM(self._domain.lean_plane.T), a)
        across = b - ca.dot(b, nominal) * nominal
        square = ca.dot(across, across)
        turn = ca.mtimes(rotation, _cayley(step[3:]))
        turned = ca.mtimes(turn, (nominal + across) / ca.sqrt(1.0 + square))
        tip = ca.mtimes(turn, pivot) + translation + step[:3] - self._task.pivot * turned
        margins = self._margins.symbolic(tip, turned)[list(rows)]
        used = square / self._cone**2 if self._tilts else ca.SX(0.0)
        return ca.Function("point", [step, a, pivot, nominal, rotation, translation], [margins, used], {"cse": True})

    def _solver(self, count: int, goal: Goal) -> Any:
        """Return the IPOPT solver for `count` waypoints, built once.

        The leans a of the waypoints are unknowns of their own, tied to the field by linear equations: so each margin
        depends on nine unknowns only, and the derivatives stay sparse.
        """
        if (count, goal) in self._solvers:
            return self._solvers[count, goal]
        import casadi as ca  # noqa: PLC0415

        size = self._domain.size
        step, least = ca.MX.sym("step", 6), ca.MX.sym("m")
        leans = ca.MX.sym("a", 2, count) if self._tilts else ca.MX(2, count)
        coefficients = ca.MX.sym("c", 2, size) if self._tilts else ca.MX(2, 0)
        points, basis = ca.MX.sym("points", 6, count), ca.MX.sym("basis", size, count)
        rotation, translation = ca.MX.sym("R", 3, 3), ca.MX.sym("t", 3)
        margins, used = self._point.map(count)(
            ca.repmat(step, 1, count), leans, points[:3, :], points[3:, :],
            ca.repmat(rotation, 1, count), ca.repmat(translation, 1, count),
        )  # fmt: skip
        unknowns, constraints, calm = [step, least], [ca.vec(margins - least)], ca.MX(0.0)
        if self._tilts:
            bends = ca.mtimes(coefficients, ca.DM(self._domain.roughness().T))
            calm = (ca.sumsqr(bends) + 1e-3 * ca.sumsqr(coefficients)) / (size * self._cone**2) + ca.sum2(used) / count
            unknowns += [ca.vec(coefficients), ca.vec(leans)]
            constraints = [ca.vec(leans - ca.mtimes(coefficients, basis)), *constraints, 1.0 - used.T]
        solver = ca.nlpsol(
            "plan",
            "ipopt",
            {
                "x": ca.vertcat(*unknowns),
                "p": ca.vertcat(ca.vec(points), ca.vec(basis), ca.vec(rotation), translation),
                "f": -least + 1e-3 * calm if goal == "margin" else calm,
                "g": ca.vertcat(*constraints),
            },
            _OPTIONS,
        )
        self._solvers[count, goal] = solver
        return solver

    def solve(self, rows: Ints, placement: RigidTransform, coefficients: Floats, goal: Goal, margin: float) -> Solution:
        """Solve for the waypoints `rows`, starting from a placement and coefficients (size, 2).

        goal "margin": `margin` is the first guess of the smallest margin. goal "calm": it is the margin to keep.
        """
        count = 32 * int(np.ceil(len(rows) / 32))  # in buckets, so that few solvers are built
        padded = np.concatenate([rows, np.full(count - len(rows), rows[0], dtype=np.intp)])
        task = self._task
        basis = self._domain.basis(task.pivots[padded])
        parameters = [
            np.hstack([task.pivots[padded], task.nominal[padded]]).ravel(),
            basis.ravel(),
            placement.rotation.T.ravel(),
            placement.translation,
        ]
        leans = [coefficients.ravel(), (basis @ coefficients).ravel()] if self._tilts else []
        start = np.concatenate([np.zeros(6), [margin], *leans])
        reach = np.concatenate([np.full(3, _TRANSLATION_STEP_M), np.full(3, _ROTATION_STEP)]) * float(self._free)
        tilt = np.full(len(start) - 7, 3.0 * self._cone)
        low, high = (-10.0, 5.0) if goal == "margin" else (margin, margin)
        solver = self._solver(count, goal)
        equations = 2 * count * self._tilts
        result = solver(
            x0=start,
            p=np.concatenate(parameters),
            lbg=0.0,
            ubg=np.concatenate([np.zeros(equations), np.full(solver.size1_out("g") - equations, np.inf)]),
            lbx=np.concatenate([-reach, [low], -tilt]),
            ubx=np.concatenate([reach, [high], tilt]),
        )
        x = np.asarray(result["x"], dtype=np.float64).ravel()
        found = x[7 : 7 + coefficients.size].reshape(-1, 2) if self._tilts else coefficients
        iterations = int(solver.stats()["iter_count"])
        if not self._free:
            return Solution(placement, found, iterations)
        turned = placement.rotation @ cayley(x[3:6])
        return Solution(RigidTransform(turned, placement.translation + x[:3]), found, iterations)


def cayley(r: Floats) -> Floats:
    """Return the rotation of Cayley's vector r (3,): tan(angle / 2) times the unit axis."""
    n = float(r @ r)
    skew = np.array([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])
    return ((1.0 - n) * np.eye(3) + 2.0 * skew + 2.0 * np.outer(r, r)) / (1.0 + n)


def _cayley(r: Any) -> Any:
    import casadi as ca  # noqa: PLC0415

    n = ca.dot(r, r)
    return ((1.0 - n) * ca.SX.eye(3) + 2.0 * ca.skew(r) + 2.0 * ca.mtimes(r, r.T)) / (1.0 + n)
