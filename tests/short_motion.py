"""A short motion of the shipped machine, within its limits, made without the planner; and the round trip of posts."""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path

import numpy as np

from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.component import COMPONENTS, Component
from pentapod.machine import Machine
from pentapod.program import Program, Provenance, quantised
from pentapod.program.csv import csv_bytes
from pentapod.program.posts import PostInput, find_post, write_post
from pentapod.toolpath import Segment, SegmentKind, Toolpath


def rise(u):
    """From 0 to 1, with no velocity, acceleration or jerk at either end."""
    return u**4 * (35 - 84 * u + 70 * u**2 - 20 * u**3)


def poses(u):
    """Tips (N, 3), metres, and directions (N, 3) of the platform, u in [0, 1]: a leaning loop in the work volume."""
    machine = Machine.load("desk")
    turn, s = 2.0 * np.pi * rise(u), rise(u)
    tips = machine.work.centre + np.c_[0.03 * np.sin(turn), 0.02 * (1 - np.cos(turn)), 0.02 * s]
    lean = np.radians(8.0)
    i = np.c_[np.sin(lean) * np.sin(turn), np.sin(0.6 * lean) * s, np.ones_like(s)]
    return tips, i / np.linalg.norm(i, axis=1, keepdims=True)


def motion(duration=1.2, interpolation="cubic", component=COMPONENTS[0]):
    """A program at the machine's period, and the machine."""
    machine = Machine.load("desk")
    period = machine.controller.period
    count = round(duration / period)
    tips, i = poses(np.arange(count + 1) / count)
    legs = machine.robot.leg_lengths(tips - machine.tool_length * i, i)
    placement = RigidTransform(np.diag([1.0, -1.0, -1.0]), np.array([0.085, -0.017, 0.1 + 1 / 3]))
    source = Provenance("desk", machine.digest, "job µ", "0.1.0", None, "x86_64 znver4", "numpy 2.4.0")
    return Program(period, quantised(legs), interpolation, component, placement, source), machine


def loop(machine: Machine, seconds: float) -> Program:
    """A leaning loop in the work volume, from rest to rest."""
    u = np.linspace(0.0, 1.0, round(1e3 * seconds) + 1)
    rise = u**4 * (35 - 84 * u + 70 * u**2 - 20 * u**3)
    turn, lean = 2.0 * np.pi * rise, np.radians(12.0)
    tips = machine.work.centre + 0.01 * np.stack([np.sin(turn), 1.0 - np.cos(turn), rise], axis=1)
    i = np.stack([np.sin(lean) * np.sin(turn), np.sin(0.6 * lean) * rise, np.ones_like(rise)], axis=1)
    i /= np.linalg.norm(i, axis=1, keepdims=True)
    p = tips - machine.tool_length * i
    component = Component(*machine.robot.branch(p, i)[0].tolist())
    legs = quantised(machine.robot.leg_lengths(p, i))
    source = Provenance(machine.name, machine.digest, "job", "0", None)
    return Program(1e-3, legs, "cubic", component, RigidTransform(np.eye(3), np.zeros(3)), source)


def placed():
    """The same way of the tool as a toolpath as placed: a rapid, then a cut."""
    tips, i = poses(np.linspace(0.0, 1.0, 41))
    rapid = Segment(SegmentKind.RAPID, tips[:11], -i[:11], np.inf)
    return Toolpath((rapid, Segment(SegmentKind.CUT, tips[10:], -i[10:], 0.05)), 0.0)


def given(**changes):
    program, machine = motion(**changes)
    return PostInput(program, machine, placed())


def passed(program):
    """The content of a verdict that passed for a program as its file holds it."""
    return {"passed": True, "certificates": [], "sha256": {"program": sha256(csv_bytes(program)).hexdigest()}}


def post(what: PostInput, name: str, folder: Path):
    """Write the files of a post of a program that was judged and passed."""
    return write_post(what, name, folder, verdict=passed(what.program))


def round_trip(what: PostInput, name: str, folder: Path):
    """Write, read back, compare as far as the post keeps things; a program written again gives the same bytes."""
    form = find_post(name)
    files = post(what, name, folder)
    contents = {file: file.read_bytes() for file in files}
    back = form.read(folder)
    if isinstance(back, Toolpath):
        assert np.abs(back.tips - what.toolpath.tips).max() < 1e-10
        assert np.abs(back.axes - what.toolpath.axes).max() < 1e-10
        assert [s.kind for s in back.segments] == [s.kind for s in what.toolpath.segments]
        assert np.allclose([s.feed for s in back.segments], [s.feed for s in what.toolpath.segments], rtol=1e-9)
        return back
    for field in ("interpolation", "component", "provenance", "rail_positions"):
        assert getattr(back, field) == getattr(what.program, field)
    assert back.placement.matrix.tobytes() == what.program.placement.matrix.tobytes()
    assert abs(back.duration - what.program.duration) < 1e-9
    if not form.loses:
        assert back.legs.tobytes() == what.program.legs.tobytes()
        assert back.period == what.program.period
        post(PostInput(back, what.machine, what.toolpath), name, folder)
        assert {file: file.read_bytes() for file in files} == contents
    return back
