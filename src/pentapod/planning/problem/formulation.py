"""The optimisation problem in casadi: margins and tilt cone of one waypoint as functions of the unknowns.

Unknowns: a small placement step (3 translations in metres, a Cayley rotation vector) around a given placement, if the
placement is free; the lean a (2) of the waypoint in a pair of directions; with the guides free, offsets of the rail
positions. Both solvers use these functions: the reference passes them to IPOPT, the default takes their derivatives.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Literal
from weakref import WeakKeyDictionary

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.arithmetic import Arithmetic
from pentapod.kinematics.legs_on_line import LegsOnLine
from pentapod.numerics.tape.vectorised import PointByPoint, Vectorised
from pentapod.planning.limits.margins import Margins
from pentapod.planning.limits.tool_pose import joints_of
from pentapod.planning.problem.constraints import PlacementConstraints
from pentapod.planning.problem.problem import PlacementProblem
from pentapod.planning.problem.weights import weighed

Slopes = Callable[[Floats, Floats, Ints], Floats]
StepSlopes = Callable[[Margins, RigidTransform, Floats, Ints], Floats]
Room = Callable[[RigidTransform], tuple[Floats, Floats]]
By = Literal["nothing", "lean", "step and lean"]

_MADE: WeakKeyDictionary[Margins, dict[tuple[Any, ...], Any]] = WeakKeyDictionary()
"""Making a function takes a good part of a second; problems that differ in their path or cone alone share them."""


def point_function(
    problem: PlacementProblem, margins: Margins, kinds: Sequence[int], *, by: By = "nothing", guides: bool = False
) -> Any:
    """Return the casadi function of one waypoint: margins K, and the square of the lean (of the tangent of its angle).

    Of step 6, lean a 2, tilt_centre 3, nominal 3, pair 3×2, R 3×3, t 3, contacts. The margins are weighed; kinds:
    which. pair: columns, the directions of the lean's two numbers; only their components across the nominal axis are
    used. by: also return the margins' derivatives by a, K × 2, or by (step, a), K × 8. guides: the first argument are
    the offsets of the rail positions from those of the margins' machine, and derivatives are by (step, offsets, a).
    Common terms are only looked for where many waypoints follow: it takes longer than all else, and saves 7 %.
    """
    import casadi as ca  # noqa: PLC0415  heavy: only when planning

    rails, (step, a, *given), values, square = _point(problem, margins, kinds, guides=guides)
    unknowns = {"nothing": [], "lean": [a], "step and lean": [ca.vertcat(step, *rails, a)]}[by]
    slopes = [ca.densify(ca.jacobian(values, x)) for x in unknowns]
    return ca.Function("point", [*rails, step, a, *given], [values, square, *slopes], {"cse": by == "lean"})


def _point(
    problem: PlacementProblem, margins: Margins, kinds: Sequence[int], *, guides: bool
) -> tuple[list[Any], list[Any], Any, Any]:
    """Return the symbols of the rails' offsets and of a waypoint, its weighed margins, and the square of the lean."""
    import casadi as ca  # noqa: PLC0415

    (step, a, *given), (tip, turned, turn, square) = _pose(problem)
    numbers = ca.SX.sym("contacts", margins.contact_numbers)
    rails, joints = list[Any](), None
    if guides and problem.machine.guides is not None:
        rails = [ca.SX.sym("rail_offsets", len(problem.machine.rail_positions))]
        joints = problem.machine.guides.moved(joints_of(margins.scene.machine.robot), ca.vertsplit(rails[0]))
    values = margins.symbolic(tip, turned, turn, given[-1] + step[:3], numbers, joints)[list(kinds)]
    if not problem.weights.are_even:
        values = weighed(values, ca.DM(problem.weights.of(margins.limits)[list(kinds)]))
    return rails, [step, a, *given, numbers], values, square


def _pose(problem: PlacementProblem) -> tuple[list[Any], tuple[Any, Any, Any, Any]]:
    """Return a waypoint's symbols step, a, tilt centre, nominal, pair, R, t; its tip, axis, turn, squared lean."""
    import casadi as ca  # noqa: PLC0415

    step, a = ca.SX.sym("step", 6), ca.SX.sym("a", 2)
    tilt_centre, nominal = ca.SX.sym("tilt_centre", 3), ca.SX.sym("nominal", 3)
    pair, rotation, translation = ca.SX.sym("pair", 3, 2), ca.SX.sym("R", 3, 3), ca.SX.sym("t", 3)
    b = ca.mtimes(pair, a)
    across = b - ca.dot(b, nominal) * nominal
    square = ca.dot(across, across)
    turn = ca.mtimes(rotation, _cayley(step[3:]))
    turned = ca.mtimes(turn, (nominal + across) / ca.sqrt(1.0 + square))
    tip = ca.mtimes(turn, tilt_centre) + translation + step[:3] - problem.samples.tilt_centre * turned
    return [step, a, tilt_centre, nominal, pair, rotation, translation], (tip, turned, turn, square)


def leg_function(problem: PlacementProblem, margins: Margins, *, slopes: bool = False) -> Any:
    """Return the casadi function of one waypoint: its leg readings n, metres, for the machine of the margins.

    Of a, tilt_centre, nominal, pair, R, t as in `point_function`. slopes: also return their derivatives by a, n × 2.
    """
    return _once(margins, ("legs", slopes), problem, lambda: _legs(problem, margins, slopes))


def _legs(problem: PlacementProblem, margins: Margins, slopes: bool) -> Any:
    import casadi as ca  # noqa: PLC0415

    (step, a, *given), (tip, turned, _, _) = _pose(problem)
    robot, do = margins.scene.machine.robot, Arithmetic.casadi()
    at, along = ca.vertsplit(tip), ca.vertsplit(turned)
    if not isinstance(robot, LegsOnLine):  # where the joints are is told by the platform's own pose
        length = margins.scene.machine.tool_length
        vectors = robot.vectors_of([at[k] + length * along[k] for k in range(3)], [-x for x in along], do)
    else:  # heights from the tip along the tool axis, not from p along the platform line
        bases, heights = joints_of(robot)
        joints = bases, [margins.scene.machine.tool_length - z for z in heights]
        vectors = robot.vectors_of(at, along, do, joints)
    legs = ca.vertcat(*robot.lengths_of(vectors, do))
    wanted = [legs, ca.jacobian(legs, a)] if slopes else [legs]
    here = ca.substitute(wanted, [step], [ca.SX.zeros(6)])
    return ca.Function("legs", [a, *given], [ca.densify(each) for each in here], {"cse": True})


def _once(margins: Margins, name: tuple[Any, ...], problem: PlacementProblem, make: Callable[[], Any]) -> Any:
    """Return the function `name` for these margins, tilt_centre and weights, made once."""
    made, key = _MADE.setdefault(margins, {}), (*name, problem.samples.tilt_centre, problem.weights)
    if key not in made:
        made[key] = make()
    return made[key]


def curvature_function(problem: PlacementProblem, margins: Margins, *, guides: bool = False) -> Any:
    """Return the function of waypoints (n,): second derivatives of weights · margins by (step, a), (n, 64).

    Of the arguments of `point_function`, rows for each waypoint or one for all, and the weights (n, M), one for each
    margin. With the guides free the derivatives are by (step, offsets, a).
    """
    return _once(margins, ("curvature", guides), problem, lambda: _curvature(problem, margins, guides))


def _curvature(problem: PlacementProblem, margins: Margins, guides: bool) -> Any:
    import casadi as ca  # noqa: PLC0415

    weights = ca.SX.sym("weights", len(margins.limits))
    rails, inputs, values, _ = _point(problem, margins, range(len(margins.limits)), guides=guides)
    bent, _ = ca.hessian(ca.dot(weights, values), ca.vertcat(inputs[0], *rails, inputs[1]))
    return PointByPoint(ca.Function("curvature", [*rails, *inputs, weights], [ca.densify(bent)]))


def room_function(constraints: PlacementConstraints) -> Any:
    """Return the casadi function (step 6, R 3×3, t 3) → constraints L of the stepped placement, derivatives L × 6."""
    import casadi as ca  # noqa: PLC0415

    step, rotation, translation = ca.SX.sym("step", 6), ca.SX.sym("R", 3, 3), ca.SX.sym("t", 3)
    room = ca.vertcat(*constraints.room(ca.mtimes(rotation, _cayley(step[3:])), translation + step[:3]))
    return ca.Function("room", [step, rotation, translation], [room, ca.densify(ca.jacobian(room, step))])


def placement_room(constraints: PlacementConstraints, *, free: bool = True) -> Room:
    """Return the function placement → its constraints (L,), derivatives (L, 6) by a step; L = 0 without bounds."""
    function = room_function(constraints) if free and constraints.is_bounded else None

    def room(transform: RigidTransform) -> tuple[Floats, Floats]:
        if function is None:
            return np.zeros(0), np.zeros((0, 6))
        found, slopes = function(np.zeros(6), transform.rotation, transform.translation)
        return np.asarray(found).ravel(), np.asarray(slopes)

    return room


def lean_slopes(problem: PlacementProblem, margins: Margins, transform: RigidTransform, kinds: Sequence[int]) -> Slopes:
    """Return the function (frames (n, 2, 3), leans in them (n, 2), waypoints (n,)) → margins' derivatives (n, K, 2)."""
    point = Vectorised(point_function(problem, margins, kinds, by="lean"))
    samples = problem.samples

    def slopes(frames: Floats, leans: Floats, rows: Ints) -> Floats:
        touching = problem.contacts(margins, transform, np.einsum("nk,nkj->nj", leans, frames), rows)
        _, _, found = point(
            np.zeros(6),
            leans,
            samples.tilt_centres[rows],
            samples.nominal[rows],
            frames.reshape(-1, 6),
            transform.rotation.T.ravel(),
            transform.translation,
            touching,
        )
        return found.reshape(len(rows), 2, len(kinds)).transpose(0, 2, 1)

    return slopes


def step_slopes(problem: PlacementProblem, margins: Margins, *, guides: bool = False) -> StepSlopes:
    """Return the function (margins, placement, coefficients, waypoints (n,)) → their derivatives (n, M, 8 or 13).

    By the placement's step and the lean; with the guides free by step, rail positions and lean, for margins of the
    problem's machine with its guides anywhere.
    """
    kinds, samples = range(len(margins.limits)), problem.samples

    def made() -> PointByPoint:
        return PointByPoint(point_function(problem, margins, kinds, by="step and lean", guides=guides))

    point = _once(margins, ("slopes", guides), problem, made)

    def slopes(there: Margins, transform: RigidTransform, coefficients: Floats, rows: Ints) -> Floats:
        offsets = [there.scene.machine.rail_positions - margins.scene.machine.rail_positions] if guides else []
        leans = problem.basis[rows] @ coefficients if samples.tilt > 0.0 else np.zeros(2)
        touching = problem.contacts(there, transform, problem.leans(coefficients, rows), rows)
        found = point(
            *offsets, np.zeros(6), leans, samples.tilt_centres[rows], samples.nominal[rows],
            problem.domain.lean_plane.ravel(), transform.rotation.T.ravel(), transform.translation, touching,
        )  # fmt: skip
        return found.reshape(len(rows), -1, len(kinds)).transpose(0, 2, 1)

    return slopes


def stepped(transform: RigidTransform, step: Floats) -> RigidTransform:
    """Return the placement after a step (6,): translation in metres, Cayley vector of a rotation of the workpiece."""
    return RigidTransform(transform.rotation @ cayley(step[3:]), transform.translation + step[:3])


def cayley(r: Floats) -> Floats:
    """Return the rotation of Cayley's vector r (3,): tan(angle / 2) times the unit axis."""
    n = float(r @ r)
    skew = np.array([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])
    return ((1.0 - n) * np.eye(3) + 2.0 * skew + 2.0 * np.outer(r, r)) / (1.0 + n)


def _cayley(r: Any) -> Any:
    import casadi as ca  # noqa: PLC0415

    n = ca.dot(r, r)
    return ((1.0 - n) * ca.SX.eye(3) + 2.0 * ca.skew(r) + 2.0 * ca.mtimes(r, r.T)) / (1.0 + n)
