"""A toolpath and a program that follows it, made without the planner: curves, a quintic time law, leg lengths."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from pentapod.cutters.ball import BallCutter
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics import Component
from pentapod.machine import load_machine
from pentapod.machine.clearance.collision_world import NOTHING
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.query.distance import MeshDistance
from pentapod.planning.problem.constraints import FREE
from pentapod.program import Program, Provenance, quantised
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath
from pentapod.verify import Coverage, Cutting, Replay, Specification
from pentapod.verify.replay.interval_bounds import IntervalBounds

STAND = load_machine(Path(__file__).with_name("stand.toml"))
BALL = 3e-3
FEED = 0.03
LINK_FEED = 0.02
RAPID = 0.08
TILT = np.radians(5.0)
TOLERANCES = {"tilt": TILT, "path_tolerance": 20e-6, "axis_tolerance": np.radians(0.1), "lowest_share": 0.0}
"""The quintic time law is slower than it has to be: no lowest feed is asked for."""
ASKED = {**TOLERANCES, "job_digest": "job-1", "constraints": FREE, "collision_world": NOTHING}
"""All that a verdict asks of a program, but for what is cut: the part may stand anywhere, with nothing around it."""
PERIOD = 1e-3
TURN_RATE = 0.5
ACCELERATION = 2.5
TOP = 8e-3


def surface(x, y):
    """Points and unit normals of a gentle hill, metres."""
    x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
    z = 4e-3 * np.cos(x / 0.02) * np.cos(y / 0.03)
    zx = -0.2 * np.sin(x / 0.02) * np.cos(y / 0.03)
    zy = -4e-3 / 0.03 * np.cos(x / 0.02) * np.sin(y / 0.03)
    normal = np.stack([-zx, -zy, np.ones_like(z)], axis=-1)
    return np.stack([x, y, z], axis=-1), normal / np.linalg.norm(normal, axis=-1, keepdims=True)


def on_surface(x, y):
    """Ball-cutter poses (tip, axis) that touch the surface at x, y."""
    points, normals = surface(x, y)
    # The tip lies a radius below the ball's centre along the axis; with the axis normal it is the contact.
    return points, normals


def hill(shape=(121, 81)):
    """Vertices and facets of that hill, 60 mm by 40 mm, as an open sheet."""
    x, y = np.meshgrid(*(np.linspace(-w, w, n) for w, n in zip((0.03, 0.02), shape, strict=True)), indexing="ij")
    k = np.arange(x.size).reshape(shape)
    a, b, c, d = (q.ravel() for q in (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]))
    facets = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return surface(x.ravel(), y.ravel())[0], facets


def cutting_of(vertices, facets, tool=None, depth=5e-5):
    tool = tool or BallCutter(BALL)
    return Cutting(MeshDistance.of(Mesh.of(vertices, facets)), tool.solids, depth, Coverage.nothing("two passes"))


def slerp(a, b, f):
    angle = np.arccos(np.clip(a @ b, -1, 1))
    if angle < 1e-12:
        return np.broadcast_to(a, (len(f), 3)).copy()
    return (np.sin((1 - f) * angle)[:, None] * a + np.sin(f * angle)[:, None] * b) / np.sin(angle)


@dataclass(frozen=True)
class Stroke:
    """A piece of the motion between exact stops: `pose(f)` → tips, axes for f in [0, 1]."""

    kind: SegmentKind
    feed: float
    pose: object
    count: int


def cut(y, x0, x1):
    return Stroke(SegmentKind.CUT, FEED, lambda f: on_surface(x0 + (x1 - x0) * f, y + 0 * f), 61)


def straight(kind, feed, start, stop, axis, axis_end=None, count=2):
    start, stop = np.asarray(start), np.asarray(stop)
    axis_end = axis if axis_end is None else axis_end
    return Stroke(kind, feed, lambda f: (start + f[:, None] * (stop - start), slerp(axis, axis_end, f)), count)


def turn(tilt_centre_tip, axis, axis_end, count):
    """Turn about the ball's centre, which stands."""
    tilt_centre = tilt_centre_tip + BALL * axis

    def pose(f):
        axes = slerp(axis, axis_end, f)
        return tilt_centre - BALL * axes, axes

    return Stroke(SegmentKind.LINK, LINK_FEED, pose, count)


def strokes():
    """Plunge, two passes 0.5 mm apart with a link, retract along the plunge's way, turn on the spot, and again."""
    rapid = SegmentKind.RAPID

    def at(x, y):
        return (v[0] for v in on_surface(np.array([x]), np.array([y])))

    up = np.array([0.0, 0.0, TOP])
    a, na = at(-0.012, 0.0)
    e, ne = at(-0.012, 5e-4)
    tilted = np.array([0.0, np.sin(0.2), np.cos(0.2)])
    turned_tip = a + up + BALL * (na - tilted)
    return [
        straight(rapid, np.inf, a + up, a, na, count=4),
        cut(0.0, -0.012, 0.012),
        Stroke(SegmentKind.LINK, LINK_FEED, lambda f: on_surface(0.012 + 0 * f, 5e-4 * f), 4),
        cut(5e-4, 0.012, -0.012),
        straight(rapid, np.inf, e, e + up, ne, count=3),
        straight(rapid, np.inf, e + up, a + up, ne, na, count=5),
        straight(rapid, np.inf, a + up, a, na, count=4),
        straight(rapid, np.inf, a, a + up, na, count=6),
        turn(a + up, na, tilted, 7),
        straight(rapid, np.inf, turned_tip, turned_tip + up, tilted, count=2),
    ]


def toolpath_of(parts):
    return Toolpath(
        tuple(Segment(p.kind, *p.pose(np.linspace(0, 1, p.count)), p.feed) for p in parts), tilt_centre=BALL
    )


def quintic(f):
    return f**3 * (10 - 15 * f + 6 * f * f)


def timed(parts, feed_factor=0.98, cap=RAPID):
    """Poses at the period, each stroke from rest to rest by a quintic whose peak is the stroke's feed."""
    tips, axes = [], []
    for part in parts:
        fine_tips, fine_axes = part.pose(np.linspace(0, 1, 4001))
        length, turn = (np.linalg.norm(np.diff(x, axis=0), axis=1).sum() for x in (fine_tips, fine_axes))
        speed = min(part.feed, cap) * feed_factor
        slowest = max(1.875 * length / speed, 1.875 * turn / TURN_RATE, np.sqrt(5.774 * length / ACCELERATION))
        rows = int(np.ceil(slowest / PERIOD))
        # Even in arc length, so that the quintic's speed is the tip's.
        arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(fine_tips, axis=0), axis=1))])
        f = np.interp(quintic(np.arange(rows + 1) / rows), arc / arc[-1], np.linspace(0, 1, 4001))
        f[0], f[-1] = 0.0, 1.0
        t, x = part.pose(f)
        first = 0 if not tips else 1
        tips.append(t[first:])
        axes.append(x[first:])
    return np.concatenate(tips), np.concatenate(axes)


def placement(machine):
    """Workpiece z against the machine's: the part lies below the base, which hangs above."""
    flip = np.diag([1.0, -1.0, -1.0])
    return RigidTransform(flip, machine.work.centre)


def tilted_axes(axes, angle, azimuth=0.7):
    """Axes leaned by an angle to one side."""
    side = np.cross(axes, [np.cos(azimuth), np.sin(azimuth), 0.0])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    return np.cos(angle) * axes + np.sin(angle) * side


def program_of(machine, tips, axes, *, lean=0.0, interpolation="cubic"):
    """A program whose tool leans by a constant angle about the tilt_centre."""
    leaned = tilted_axes(axes, lean)
    leaned_tips = tips + BALL * (axes - leaned)
    place = placement(machine)
    direction = -place.rotate(leaned)
    position = place.apply(leaned_tips) - machine.tool_length * direction
    legs = quantised(machine.robot.leg_lengths(position, direction))
    provenance = Provenance(machine.name, machine.digest, "job-1", "0")
    return Program(PERIOD, legs, interpolation, Component(1, 1), place, provenance)


@dataclass(frozen=True)
class Case:
    machine: object
    toolpath: Toolpath
    program: Program
    tips: np.ndarray
    axes: np.ndarray


def good_case(lean=0.0, interpolation="cubic", *, longer=0.0):
    """A case; with the program made for a tool so much longer than the machine has, metres."""
    controller = replace(STAND.controller, interpolation=interpolation)
    machine = replace(STAND, rapid_velocity=RAPID, controller=controller)
    parts = strokes()
    tips, axes = timed(parts)
    return Case(
        machine,
        toolpath_of(parts),
        program_of(machine.with_tool(machine.tool_length + longer), tips, axes, lean=lean, interpolation=interpolation),
        tips,
        axes,
    )


def asked_anew(replay, **changes):
    """The same program, with some of what is asked of it changed."""
    return replace(replay, specification=replace(replay.specification, **changes))


def same_motion(replay, **changes):
    """The same, with what was measured of the motion so far: it is not measured again."""
    _, other = replay.match, asked_anew(replay, **changes)
    names = ("interval_bounds", "match", "tilt_centres", "axes")
    other.__dict__.update({name: replay.__dict__[name] for name in names if name in replay.__dict__})
    return other


def replay_of(case, program=None, toolpath=None, **changes):
    """The replay of a case's program, or of another, with some of what is asked of it changed."""
    asked = Specification(case.machine, toolpath or case.toolpath, **{**ASKED, **changes})
    return Replay(program or case.program, asked)


def given_bounds(position, direction, deviations=0.0, axis_deviations=0.0, speeds=0.0, **extremes):
    """Interval bounds of poses (M, 3) and of their chords, as they are given; scalars hold for all chords."""
    chords = len(position) - 1
    arrays = [np.zeros(chords) + deviations, np.zeros(chords) + axis_deviations, np.zeros((chords, 3)) + speeds]
    return IntervalBounds(position, direction, *arrays, **extremes)


def given_match(samples, waypoints, **given):
    """A matching of that many samples with that many waypoints, as it is given; what is not is zero.

    Between samples the path turns evenly, unless `waypoint_turned` is given.
    """
    of_waypoints = ("times", "waypoint_distances", "waypoint_angles")
    of_samples = ("places", "arcs", "turned", "distances", "angles")
    zeros = {name: np.zeros(waypoints) for name in of_waypoints} | {name: np.zeros(samples) for name in of_samples}
    match = zeros | {name: np.asarray(values) for name, values in given.items()}
    even = {"waypoint_turned": np.interp(match["times"], np.arange(samples), match["turned"])}
    return SimpleNamespace(**(even | match))


def measured(toolpath, tilt_centres, axes=None, *, bounds=None, match=None, machine=STAND, legs=None, **changes):
    """A replay whose measurements are given, not computed: M poses, what is proven of their chords, the matching.

    The machine frame is the workpiece frame. changes: of the program or of what is asked of it.
    """
    tilt_centres = np.asarray(tilt_centres, float)
    axes = np.tile([0.0, 0.0, 1.0], (len(tilt_centres), 1)) if axes is None else np.asarray(axes, float)
    legs = np.full((max(len(tilt_centres) // 2 + 1, 2), 5), 0.7) if legs is None else legs
    own = {"period": PERIOD, "interpolation": "cubic", "component": Component(1, 1)}
    own |= {name: changes.pop(name) for name in (*own, "rail_positions") if name in changes}
    provenance = Provenance(machine.name, machine.digest, "job-1", "0", changes.pop("piece", None))
    program = Program(legs=legs, placement=RigidTransform.identity(), provenance=provenance, **own)
    position = tilt_centres + (machine.tool_length - toolpath.tilt_centre) * axes
    replay = Replay(program, Specification(machine, toolpath, **{**ASKED, **changes}))
    replay.__dict__.update(
        interval_bounds=given_bounds(position, -axes, **(bounds or {})),
        match=given_match(len(tilt_centres), len(toolpath), **(match or {})),
        tilt_centres=tilt_centres,
        axes=axes,
    )
    return replay


def along_x(metres):
    """Points (M, 3) so far along x."""
    metres = np.asarray(metres, float)
    return np.stack([metres, 0.0 * metres, 0.0 * metres], axis=1)
