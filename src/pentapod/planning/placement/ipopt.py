"""The reference placement solver: the interior-point method of IPOPT, with constraint generation.

It starts with a few waypoints and kinds of margin, and adds the worst ones until none is worse than those considered.
It is slower than the default solver by an order of magnitude; tests compare the default with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.base.progress import Progress, silent
from pentapod.geometry.rigid import RigidTransform
from pentapod.planning.problem.formulation import point_function, room_function, stepped
from pentapod.planning.problem.linear_model import valleys
from pentapod.planning.problem.problem import Candidate, PlacementProblem
from pentapod.planning.tool_axis.cost import AxisCost
from pentapod.planning.tool_axis.spline import AxisSpline, within_discs

_OPTIONS: dict[str, Any] = {
    "print_time": False,
    "error_on_fail": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.max_iter": 200,
    "ipopt.tol": 1e-6,
    "ipopt.acceptable_tol": 1e-4,
    "ipopt.acceptable_iter": 5,
    "ipopt.mu_strategy": "adaptive",
    "ipopt.fixed_variable_treatment": "make_parameter",
}


@dataclass(frozen=True)
class IpoptOptions:
    """Options of the constraint generation; those of IPOPT itself are fixed.

    waypoints: number at first. rounds: programs at most. near: kinds of margin within this distance of the smallest one
    are considered from the start. gain: with contacts, a smaller increase of the margin shortens the longest step by
    the factor shorter, down to shortest. translation_m, rotation: longest step of the placement, metres and
    tan(angle / 2). upright: weight of the field's coefficients beside the margin, a regularisation.
    """

    waypoints: int = 96
    rounds: int = 16
    near: float = 0.6
    gain: float = 1e-4
    shorter: float = 0.25
    shortest: float = 1e-3
    translation_m: float = 0.4
    rotation: float = 0.8
    upright: float = 1e-6


@dataclass(eq=False)
class IpoptSolver:
    """Improves candidates of one problem with IPOPT; free: whether the placement is free.

    whole: all waypoints and all kinds of margin at once, without constraint generation: very slow. patience: processor
    seconds after which IPOPT stops.
    """

    problem: PlacementProblem
    free: bool
    whole: bool = False
    patience: float = 1e6
    options: IpoptOptions = IpoptOptions()
    _solvers: dict[Any, Any] = field(default_factory=dict[Any, Any])

    def raise_margin(
        self, start: Candidate, enough: float = np.inf, others: Sequence[Candidate] | None = None
    ) -> Candidate:
        """Return a candidate whose smallest margin is largest near `start`, or with `enough`; never a worse one.

        others: candidates with which it is compared, of no use here.
        """
        del others
        best, (rows, kinds), reach = start, self._first(start), 1.0
        touching = bool(start.margins.scene.collision_world.obstacles)
        for _ in range(self.options.rounds):
            transform, raw = self._solve(best, rows, kinds, reach)
            coefficients = self.problem.within_cone(raw)
            values = self.problem.values(best.margins, transform, coefficients)
            considered = float(values[np.ix_(rows, kinds)].min())
            smallest, before = float(values.min()), best.smallest
            if smallest > before:
                best = Candidate(best.margins, transform, coefficients, smallest)
            more = self._with_worst(rows, kinds, values, max(considered, before), raw)
            if touching and smallest <= before + self.options.gain:  # contacts are valid nearby only
                reach *= self.options.shorter
            elif not touching and len(more[0]) == len(rows) and len(more[1]) == len(kinds):
                break
            if reach < self.options.shortest or best.smallest >= enough:
                break
            rows, kinds = more
        return best

    def smooth(self, start: Candidate, keep: float, progress: Progress = silent) -> Floats | None:
        """Return coefficients (K, 2) of the smoothest spline at the placement of `start` that keeps the margin `keep`.

        All waypoints at once, and all kinds of margin that are near `keep` at the start. None where IPOPT finds none.
        """
        import casadi as ca  # noqa: PLC0415  heavy: only when planning

        progress("tool axis", 0.0, "smoothing, all waypoints at once")
        problem, samples = self.problem, self.problem.samples
        spline = AxisSpline.of(samples, problem.cone)
        count, first = len(samples.tilt_centres), spline.fitted(problem.leans(start.coefficients))
        margins = problem.values_of(start.margins, start.transform, spline.leans(first))
        kinds = [int(k) for k in np.flatnonzero((margins.min(axis=0) < keep + self.options.near) | self.whole)]
        c = ca.MX.sym("c", 2, len(first))
        margins, _ = point_function(problem, start.margins, kinds).map(count)(
            ca.DM.zeros(6, count), spline.cone * ca.mtimes(c, ca.DM(spline.basis.T)),
            samples.tilt_centres.T, samples.nominal.T, spline.frames.transpose(2, 0, 1).reshape(3, -1),
            np.tile(start.transform.rotation, (1, count)),
            np.tile(start.transform.translation[:, None], (1, count)),
            problem.contacts(start.margins, start.transform, spline.leans(first), np.arange(count)).T,
        )  # fmt: skip
        cost = AxisCost(problem, spline, start)
        spent, excess, room = cost.symbolic(c)
        program = {
            "x": ca.vertcat(ca.vec(c), excess),
            "f": spent / max(spline.cost_of(first), 1e-9),
            "g": ca.vertcat(ca.vec(margins), 1.0 - ca.sum1(c * c).T, room),
        }
        free, charged = first.size, excess.numel()
        begin = np.concatenate([first.ravel(), np.ones(charged)])
        least = np.concatenate([np.full(len(kinds) * count, keep), np.zeros(len(first) + room.numel())])
        solver = ca.nlpsol("smooth", "ipopt", program, self._ipopt)
        lowest = np.concatenate([np.full(free, -np.inf), np.zeros(charged)])
        found = np.asarray(solver(x0=begin, lbx=lowest, lbg=least, ubg=np.inf)["x"], dtype=np.float64)
        found = within_discs(found.ravel()[:free].reshape(-1, 2))
        values = problem.values_of(start.margins, start.transform, spline.leans(found))
        return found if values.min() >= keep - 1e-4 else None

    def _first(self, start: Candidate) -> tuple[Ints, Ints]:
        if self.whole:
            return np.arange(len(self.problem.samples.tilt_centres)), np.arange(len(start.margins.limits))
        rows = self.problem.samples.representatives(self.options.waypoints)
        values = self.problem.values(start.margins, start.transform, start.coefficients, rows).min(axis=0)
        return np.sort(rows), np.flatnonzero(values < values.min() + self.options.near)

    def _with_worst(
        self, rows: Ints, kinds: Ints, values: Floats, level: float, coefficients: Floats
    ) -> tuple[Ints, Ints]:
        worst = valleys(values)
        worst = worst[values[worst].min(axis=1) < level]
        steepness = self.problem.steepness(coefficients)
        steep = valleys(-steepness[:, None])
        rows = np.union1d(np.union1d(rows, worst), steep[steepness[steep] > 1.0 + 1e-6])
        return rows, np.union1d(kinds, np.flatnonzero(values.min(axis=0) < level))

    def _solve(self, at: Candidate, rows: Ints, kinds: Ints, share: float) -> tuple[RigidTransform, Floats]:
        """Return placement and coefficients whose smallest margin is largest over waypoints `rows`.

        share: of the longest step of the placement.
        """
        problem, samples = self.problem, self.problem.samples
        count = 32 * int(np.ceil(len(rows) / 32))  # in buckets, so that few solvers are built
        rows = np.concatenate([rows, np.full(count - len(rows), rows[0], dtype=np.intp)])
        basis, c = problem.basis[rows], at.coefficients
        motion = self._motion
        shifts = np.abs(motion[:3]).sum(axis=0) > 0.0
        reach, moving = share * np.where(shifts, self.options.translation_m, self.options.rotation), motion.shape[1]
        start = np.concatenate([np.zeros(moving), [at.smallest], c.ravel(), (basis @ c).ravel()])
        if samples.tilt == 0.0:
            start = start[: moving + 1]
        tilt = np.full(len(start) - moving - 1, 3.0 * problem.cone)
        solver = self._solver(at, count, tuple(int(k) for k in kinds))
        equations = 2 * count if samples.tilt > 0.0 else 0
        result = solver(
            x0=start,
            p=np.concatenate([
                np.hstack([samples.tilt_centres[rows], samples.nominal[rows], samples.room(rows)[:, None]]).ravel(),
                basis.ravel(),
                at.transform.rotation.T.ravel(),
                at.transform.translation,
                problem.contacts(at.margins, at.transform, problem.leans(c, rows), rows).ravel(),
            ]),
            lbg=0.0,
            ubg=np.concatenate([np.zeros(equations), np.full(solver.size1_out("g") - equations, np.inf)]),
            lbx=np.concatenate([-reach, [-10.0], -tilt]),
            ubx=np.concatenate([reach, [5.0], tilt]),
        )  # fmt: skip
        x = np.asarray(result["x"], dtype=np.float64).ravel()
        coefficients = x[moving + 1 : moving + 1 + c.size].reshape(-1, 2)
        if moving == 0:
            return at.transform, coefficients
        return problem.constraints.nearest_to(stepped(at.transform, motion @ x[:moving])), coefficients

    @property
    def _ipopt(self) -> dict[str, Any]:
        return _OPTIONS | {"ipopt.max_cpu_time": self.patience}

    @property
    def _motion(self) -> Floats:
        motion = self.problem.constraints.motion
        return motion if self.free else motion[:, :0]

    def _solver(self, at: Candidate, count: int, kinds: tuple[int, ...]) -> Any:
        """Return the IPOPT solver for `count` waypoints, built once.

        The leans of the waypoints are unknowns of their own, coupled to the field by linear equations: each margin then
        depends on nine unknowns only, and the derivatives stay sparse.
        """
        key = (at.margins.scene.branch, count, kinds)
        if key in self._solvers:
            return self._solvers[key]
        import casadi as ca  # noqa: PLC0415  heavy: only when planning

        problem, size = self.problem, self.problem.basis.shape[1]
        tilts = problem.samples.tilt > 0.0
        moves, least = ca.MX.sym("moves", self._motion.shape[1]), ca.MX.sym("m")
        step = ca.mtimes(ca.DM(self._motion), moves)
        leans = ca.MX.sym("a", 2, count) if tilts else ca.MX(2, count)
        coefficients = ca.MX.sym("c", 2, size)
        points, basis = ca.MX.sym("points", 7, count), ca.MX.sym("basis", size, count)
        rotation, translation = ca.MX.sym("R", 3, 3), ca.MX.sym("t", 3)
        touching = ca.MX.sym("contacts", at.margins.contact_numbers, count)
        margins, square = point_function(problem, at.margins, kinds).map(count)(
            ca.repmat(step, 1, count), leans, points[:3, :], points[3:6, :],
            np.tile(problem.domain.lean_plane.T, (1, count)),
            ca.repmat(rotation, 1, count), ca.repmat(translation, 1, count), touching,
        )  # fmt: skip
        unknowns, conditions, lean = [moves, least], [ca.vec(margins - least)], ca.MX(0.0)
        if self.free and problem.constraints.is_bounded:
            conditions.append(room_function(problem.constraints)(step, rotation, translation)[0])
        if tilts:
            c = ca.vec(coefficients)
            lean = ca.sumsqr(c) / problem.cone**2
            unknowns += [c, ca.vec(leans)]
            left = 1.0 - square.T / (problem.cone * points[6, :].T) ** 2
            conditions = [ca.vec(leans - ca.mtimes(coefficients, basis)), *conditions, left]
        program = {
            "x": ca.vertcat(*unknowns),
            "p": ca.vertcat(ca.vec(points), ca.vec(basis), ca.vec(rotation), translation, ca.vec(touching)),
            "f": -least + self.options.upright * lean,
            "g": ca.vertcat(*conditions),
        }
        self._solvers[key] = ca.nlpsol("plan", "ipopt", program, self._ipopt)
        return self._solvers[key]
