"""Probing: touches that a machine can make and that tell most, the way to them, and their program for LinuxCNC.

The probe keeps its axis upright. It comes down beside a touch, goes to the surface along its normal, and returns the
same way; between touches it moves above the part. All of that is checked against the machine's limits, the part and its
fixture.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints, frozen, set_frozen
from pentapod.base.refusal import Refusal
from pentapod.base.units import from_si
from pentapod.base.values import Result
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.robot import Branch, own_branch
from pentapod.machine.clearance.collision_world import CollisionWorld
from pentapod.machine.machine import Machine
from pentapod.mesh.query.distance import MeshDistance
from pentapod.planning.limits.margins import Margins
from pentapod.planning.problem.weights import NEEDED_MARGIN
from pentapod.program.posts.linuxcnc.trivkins import LETTERS
from pentapod.registration.contacts import off_edges
from pentapod.registration.result import CutSurface
from pentapod.registration.selection import chosen, rows_of, surface_points
from pentapod.registration.touches import Touches

PROBE_RESULTS = {"X": 5061, "Y": 5062, "Z": 5063, "U": 5067, "V": 5068, "W": 5069}
"""LinuxCNC's parameters that hold the axes at the trip."""


@dataclass(frozen=True)
class ProbingOptions:
    """The motion of the probe, SI units.

    steepest: angle between the surface's normal and the probe's axis. approach: from the surface, where the slow way to
    it begins; beyond: how far behind the planned surface it ends. above: height over the part between touches; beside:
    free room around the ball there and on the way down. speed, travel: to the surface, and between touches. step:
    between points at which the way is checked and written. misplaced: how far the part may be from its place.
    """

    steepest: float = float(np.radians(80.0))
    approach: float = 5e-3
    beyond: float = 4e-3
    above: float = 10e-3
    beside: float = 1e-3
    speed: float = 2e-3
    travel: float = 0.03
    step: float = 2e-3
    misplaced: float = 3e-3


OPTIONS = ProbingOptions()


@dataclass(frozen=True, eq=False)
class Probing(Result):
    """Touches in the order in which they are made. points, normals (N, 3): workpiece frame.

    legs (N, n): as the drives count them at the touch. ways: for each touch the legs (K, n) on the way to its approach,
    from the one before; beyond (N, n): where the way to the surface ends; length (N,): metres of that way. head: of the
    list of touches, without any.
    """

    points: Floats
    normals: Floats
    legs: Floats
    ways: tuple[Floats, ...]
    beyond: Floats
    head: Touches

    def __post_init__(self) -> None:
        for name in ("points", "normals", "legs", "beyond"):
            set_frozen(self, **{name: frozen(getattr(self, name), name, (None, None))})

    @property
    def expected(self) -> Touches:
        """The touches if the part is where it was planned."""
        head, count = self.head, len(self.legs)
        return Touches(
            self.legs, head.probe_length, head.tip_radius, tuple(range(count)), head.component, head.machine,
            head.position_mm, head.rotation_deg,
        )  # fmt: skip

    def gcode(self, log: str) -> str:
        """Return the program for LinuxCNC with the legs as axes X Y Z U V (trivkins); it appends to the file `log`."""
        here = from_si(self.ways[0][0], "mm")
        letters = LETTERS[: len(here)]
        lines = [
            f"({len(self.legs)} touches; legs as axes {' '.join(letters)}: trivkins coordinates={letters})",
            f"(begin near {_words(here)}, above the part)",
            "G21 G90 G40 G49 G61", "G94", f"G1 {_words(here)} F{_feed_mm_min(OPTIONS.travel):.3f}",
            f"(LOGAPPEND,{log})",
        ]  # fmt: skip
        logged = ",".join(f"#{PROBE_RESULTS[letter]}" for letter in letters)
        for way, beyond in zip(self.ways, self.beyond, strict=True):
            lines.append("G93")
            per_minute = 60.0 * OPTIONS.travel / OPTIONS.step
            lines += [f"G1 {_words(row)} F{per_minute:.6f}" for row in from_si(way[1:], "mm")]
            seconds = (OPTIONS.approach + OPTIONS.beyond) / OPTIONS.speed
            # Feed is that of X, Y and Z alone.
            feed = _feed_mm_min(float(np.linalg.norm((beyond - way[-1])[:3])) / seconds)
            lines += ["G94", f"G38.2 {_words(from_si(beyond, 'mm'))} F{feed:.6f}", f"(LOG,{logged})"]
            lines += ["G93", f"G1 {_words(from_si(way[-1], 'mm'))} F{per_minute:.6f}"]
        return "\n".join([*lines, "G94", "(LOGCLOSE)", "M2"]) + "\n"


def plan_probing(
    machine: Machine,
    branch: Branch,
    surface: MeshDistance,
    placement: RigidTransform,
    cut: CutSurface,
    world: CollisionWorld,
    head: Touches,
    count: int,
    misplaced: float = OPTIONS.misplaced,
) -> Probing | Refusal:
    """Return touches that tell most of where the cut surface is, and the way to them.

    machine: with the probe as its tool; branch: in which it moves; placement: the planned one; world: the probe's body
    and its obstacles; head: of the list of touches; misplaced: how far the part may be from its place, metres: touches
    stay so far from edges. Refuses where fewer than `count` touches can be reached.
    """
    upright = np.array([0.0, 0.0, -float(own_branch(machine.robot, branch).w)])
    task = _Task(machine, Margins.of(machine, branch, world), surface, placement, upright, head.tip_radius)
    axis = placement.rotation.T @ upright
    outward = -1.0 if surface.mesh.diagnosis.inverted else 1.0
    facing = outward * surface.mesh.facet_normals @ axis >= np.cos(OPTIONS.steepest)
    points, normals = surface_points(surface.mesh, facing)
    if len(points):
        inner = off_edges(surface, points, normals, head.tip_radius, misplaced)
        points, normals = points[inner], normals[inner]
        free = task.reachable(points, normals)
        points, normals = points[free], normals[free]
    if len(points) < count:
        return Refusal(
            "probing", f"only {len(points)} of the points tried can be touched, {count} are asked for",
            remedy="Take a longer probe, a thinner stylus or fewer touches, or place the part more exactly",
        )  # fmt: skip
    rows, goal = rows_of(points, normals, surface.mesh), rows_of(cut.points, cut.normals, surface.mesh)
    take = chosen(rows, goal, np.zeros((0, 6)), count)
    take = take[_tour(points[take])]
    points, normals = points[take], normals[take]
    ways = task.ways(points, normals)
    if ways is None:
        return Refusal("probing", "the way between touches, above the part, is beyond a limit of the machine")
    centres = task.centres(points, normals)
    there = placement.rotate(normals)
    return Probing(points, normals, task.legs(centres), ways, task.legs(centres - OPTIONS.beyond * there), head)


@dataclass(frozen=True, eq=False)
class _Task:
    machine: Machine
    margins: Margins
    surface: MeshDistance
    placement: RigidTransform
    axis: Floats
    radius: float

    def centres(self, points: Floats, normals: Floats, off: float = 0.0) -> Floats:
        """Return the ball's centres (N, 3), machine frame, at a distance from the surface."""
        return self.placement.apply(points + (self.radius + off) * normals)

    def legs(self, centres: Floats) -> Floats:
        """Return the legs (N, n) of the ball's centres (N, 3)."""
        direction = np.broadcast_to(-self.axis, centres.shape)
        position = centres - (self.machine.tool_length - self.radius) * direction
        return self.machine.robot.leg_lengths(position, direction)

    @property
    def top(self) -> float:
        """Height along the probe's axis of the ball's centre between touches."""
        vertices = self.placement.apply(self.surface.mesh.vertices)
        return float((vertices @ self.axis).max()) + self.radius + OPTIONS.above

    def reachable(self, points: Floats, normals: Floats) -> Bools:
        """Return which points (N,) can be touched, with the way to them from above."""
        at, near, behind = (self.centres(points, normals, off) for off in (0.0, OPTIONS.approach, -OPTIONS.beyond))
        free = self._within(at) & self._within(near)
        free &= (self.margins.own(*self._poses(behind)) >= NEEDED_MARGIN).all(axis=1)
        for row in np.flatnonzero(free):
            way = self._down(near[row])
            gaps = self.surface.points(self.placement.inverse().apply(way)).distance - self.radius
            free[row] = gaps.min() >= OPTIONS.beside and self._within(way).all()
        return free

    def ways(self, points: Floats, normals: Floats) -> tuple[Floats, ...] | None:
        """Return the legs (K, n) on the way to the approach of each touch; None where one is beyond a limit."""
        near, ways, last = self.centres(points, normals, OPTIONS.approach), list[Floats](), None
        for centre in near:
            down = self._down(centre)
            way = down
            if last is not None:
                over = _line(last[0], down[0])
                if not self._within(over).all():
                    return None
                way = np.concatenate([last[::-1], over, down])
            ways.append(self.legs(way))
            last = down
        return tuple(ways)

    def _down(self, centre: Floats) -> Floats:
        """Return the ball's centres (K, 3) on the way down to a centre (3,) from above the part."""
        return _line(centre + max(self.top - float(centre @ self.axis), OPTIONS.step) * self.axis, centre)

    def _poses(self, centres: Floats) -> tuple[Floats, Floats]:
        """Return tips and axes (N, 3) of the ball's centres (N, 3)."""
        return centres - self.radius * self.axis, np.broadcast_to(self.axis, centres.shape).copy()

    def _within(self, centres: Floats) -> Bools:
        """Return at which of the ball's centres (N,) all margins are kept."""
        values = self.margins(*self._poses(centres), self.placement)
        return np.asarray((values >= NEEDED_MARGIN).all(axis=1))


def _line(start: Floats, end: Floats) -> Floats:
    """Return points (K, 3) from start to end, no further apart than a step."""
    count = max(int(np.ceil(np.linalg.norm(end - start) / OPTIONS.step)), 1)
    return start + np.linspace(0.0, 1.0, count + 1)[:, None] * (end - start)


def _tour(points: Floats) -> Ints:
    """Return an order (N,) of points in which each is the nearest to the one before."""
    left, order = list(range(1, len(points))), [0]
    while left:
        away = np.linalg.norm(points[left] - points[order[-1]], axis=1)
        order.append(left.pop(int(away.argmin())))
    return np.array(order, dtype=np.intp)


def _words(legs_mm: Floats) -> str:
    return " ".join(f"{letter}{value:.6f}" for letter, value in zip(LETTERS, legs_mm.tolist(), strict=False))


def _feed_mm_min(speed: float) -> float:
    return float(from_si(speed, "mm_min"))
