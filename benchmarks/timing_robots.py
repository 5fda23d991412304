"""Drake and ruckig, for benchmarks/timing.py, where they are installed (pip install drake ruckig)."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec

import numpy as np


def drake_solver(s: np.ndarray, legs: np.ndarray, velocity: float, acceleration: float):
    """Return Drake's TOPP-RA on a cubic spline through legs (n, 5) at s (n,), gridpoints s, and q′, q″ of that spline.

    A plant of five sliding joints carries the limits, which are asked for at both ends of each stage. The solve gives
    ṡ² at the gridpoints, None where it fails. None without Drake.
    """
    if find_spec("pydrake") is None:
        return None
    from pydrake.multibody.optimization import Toppra, ToppraDiscretization  # noqa: PLC0415  (may be missing)
    from pydrake.multibody.plant import MultibodyPlant  # noqa: PLC0415
    from pydrake.multibody.tree import PrismaticJoint, SpatialInertia, UnitInertia  # noqa: PLC0415
    from pydrake.trajectories import PiecewisePolynomial  # noqa: PLC0415

    plant = MultibodyPlant(0.0)
    for k in range(legs.shape[1]):
        body = plant.AddRigidBody(f"leg {k}", SpatialInertia(1.0, [0, 0, 0], UnitInertia(1, 1, 1)))
        plant.AddJoint(PrismaticJoint(f"slide {k}", plant.world_frame(), body.body_frame(), [0, 0, 1]))
    plant.Finalize()
    path = PiecewisePolynomial.CubicWithContinuousSecondDerivatives(s, legs.T)
    one, scheme = np.ones(legs.shape[1]), ToppraDiscretization.kInterpolation

    def solve() -> np.ndarray | None:
        problem = Toppra(path, plant, s)
        problem.AddJointVelocityLimit(-velocity * one, velocity * one)
        problem.AddJointAccelerationLimit(-acceleration * one, acceleration * one, scheme)
        law = problem.SolvePathParameterization()
        return None if law is None else np.square(law.derivative(1).vector_values(law.get_segment_times())[0])

    return solve, [path.derivative(k).vector_values(s).T for k in (1, 2)]


def ruckig_line(way: np.ndarray, limits: tuple[float, float, float]) -> tuple[Callable[[], float], float] | None:
    """Return ruckig's way from rest to rest along a straight line of the legs, way (5,), and the seconds it takes.

    ruckig solves another problem: from one state to another, with no path between (waypoints ask for its vendor's
    cloud). Legs in phase follow the straight line, where its answer is the optimum in closed form. None without it.
    """
    if find_spec("ruckig") is None:
        return None
    from ruckig import InputParameter, Result, Ruckig, Synchronization, Trajectory  # noqa: PLC0415  (may be missing)

    count = len(way)
    planner, given, motion = Ruckig(count), InputParameter(count), Trajectory(count)
    given.current_position, given.target_position = np.zeros(count), way
    given.max_velocity, given.max_acceleration, given.max_jerk = (np.full(count, x) for x in limits)
    given.synchronization = Synchronization.Phase

    def solve() -> float:
        if planner.calculate(given, motion) not in {Result.Working, Result.Finished}:
            raise SystemExit("ruckig failed")
        return motion.duration

    return solve, solve()
