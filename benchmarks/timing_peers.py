"""Peers of the jerk passes and of the whole chain, for benchmarks/timing.py: the same problems, by other solvers."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import csr_array, vstack

from pentapod.base.refusal import Refusal
from pentapod.timing.jerk.subproblem import Subproblem
from pentapod.timing.waypoints import through_waypoints

FAR = 1e3
"""A limit that is none, for the coordinate whose velocity is the feed."""


def copp_robot(s: np.ndarray, q: list[np.ndarray], limits: tuple[float, float, float], feed: float):
    """Return copp-py and its robot; the path parameter is a sixth axis, whose velocity is the feed. None without it."""
    if find_spec("copp_py") is None:
        return None
    import copp_py as copp  # noqa: PLC0415  (may be missing)

    n, one = len(s), np.ones(n := len(s))
    extra = (s, one, 0.0 * one, 0.0 * one)
    columns = [np.ascontiguousarray(np.column_stack([y, more])) for y, more in zip(q, extra, strict=True)]
    velocity, acceleration, jerk = (np.append(np.full(5, x), FAR) for x in limits)
    velocity[5] = feed
    robot = copp.Robot(6, capacity=n)
    robot.append_s(s)
    robot.set_q(*columns[:3], 0, dddq=columns[3])
    robot.add_velocity_limits(velocity, -velocity, start_idx_s=0, length=n)
    robot.add_acceleration_limits(acceleration, -acceleration, start_idx_s=0, length=n)
    robot.add_jerk_limits(jerk, -jerk, start_idx_s=0, length=n)
    return copp, robot


def socp(peer, x: np.ndarray, s: np.ndarray, rounds: int) -> tuple[list[Callable[[], object]], list[float]]:
    """Return how to solve TOPP3-SOCP once about ever better profiles, and the durations reached."""
    copp, robot = peer
    around, bend, solves, durations = np.maximum(x, 1e-8 * x.max()), None, [], []
    for _ in range(rounds):
        # Near a rest its own manual asks for the accelerations of the last round, too.
        problem = copp.solver.topp3_socp.Problem(robot.constraints, around, b_linearization=bend)

        def solve(problem=problem):
            return copp.solver.topp3_socp.solve(problem)

        try:
            found = solve()
        except copp.CoppError:
            break  # it finds nothing better
        solves.append(solve)
        durations.append(float(copp.interpolation.s_to_t_topp3(s, found)[0]))
        around, bend = np.maximum(np.asarray(found.a), 1e-8 * x.max()), np.asarray(found.b)
    return solves, durations


def highs(problem: Subproblem) -> Callable[[], object]:
    """Return how HiGHS takes a first pass of a problem; the objective is linear about the same x."""
    y, rows = problem.start(), problem.rows
    around = np.minimum(problem.top, problem.ramps)
    count, n = len(problem.s), len(y)
    columns = (problem.first[:, None] + np.arange(4)).ravel()
    at = np.repeat(np.arange(count), 4)

    def by_y(a0, a1, a2) -> csr_array:
        values = np.sum([a[:, None] * problem.basis[:, d] for d, a in enumerate((a0, a1, a2))], axis=0)
        return csr_array((values.ravel(), (at, columns)), shape=(count, n))

    blocks: list[csr_array] = []
    bounds: list[float] = []
    zero = np.zeros(count)
    for j in range(rows.first.shape[1]):
        row = by_y(rows.second[:, j], 0.5 * rows.first[:, j], zero)
        blocks, bounds = [*blocks, row, -row], [*bounds, 1.0, 1.0]
    lean, root = by_y(0.5 / around, zero, zero), np.sqrt(around)
    for j in range(rows.jerks.shape[1]):
        row = by_y(*(root * rows.jerks[:, j, d] for d in range(3)))
        blocks, bounds = [*blocks, row + lean, lean - row], [*bounds, 1.5, 1.5]
    value = by_y(1.0 / problem.top, zero, zero)
    blocks, bounds = [*blocks, value, -value], [*bounds, 1.0, 0.0]
    matrix, right = vstack(blocks, format="csr"), np.repeat(bounds, count)
    gain = by_y(problem.weight / around**1.5, zero, zero).sum(axis=0)
    held = [(v, v) if k in (0, 1, n - 2, n - 1) else (None, None) for k, v in enumerate(y)]

    def solve():
        result = linprog(-gain, A_ub=matrix, b_ub=right, bounds=held, method="highs")
        if result.status != 0:
            raise SystemExit(f"HiGHS: {result.message}")
        return result

    return solve


def toppra_chain(s: np.ndarray, legs: np.ndarray, velocity: float, acceleration: float, period: float):
    """Return toppra's way from waypoints to samples every period."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import toppra  # noqa: PLC0415
        from toppra import algorithm, constraint  # noqa: PLC0415
    logging.getLogger("toppra").setLevel(logging.CRITICAL)
    one = np.ones(5)

    def chain():
        path = toppra.SplineInterpolator(s, legs)
        rates = constraint.JointVelocityConstraint(np.stack([-velocity * one, velocity * one], axis=1))
        pushes = constraint.JointAccelerationConstraint(
            np.stack([-acceleration * one, acceleration * one], axis=1),
            discretization_scheme=constraint.DiscretizationType.Interpolation,
        )
        instance = algorithm.TOPPRA(
            [rates, pushes], path, gridpoints=s, solver_wrapper="seidel", parametrizer="ParametrizeConstAccel"
        )
        motion: Any = instance.compute_trajectory(0.0, 0.0)
        return motion(np.arange(0.0, motion.duration, period))

    return chain


def our_chain(s: np.ndarray, legs: np.ndarray, velocity: float, acceleration: float, period: float):
    """Return our way from waypoints to samples every period, through the same cubic spline."""

    def chain():
        motion = through_waypoints(s, legs, velocity=velocity, acceleration=acceleration, period=period)
        if isinstance(motion, Refusal):
            raise SystemExit(str(motion))
        return motion.rows

    return chain
