"""The probing program, played by the LinuxCNC that is installed against a part that is not where it was planned."""

from __future__ import annotations

import json

import numpy as np
import pytest
from forged_touches import sheet
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from linuxcnc_runs import play, real
from pentapod.cutters import Lollipop
from pentapod.geometry import RigidTransform
from pentapod.kinematics import Component
from pentapod.machine import CollisionWorld, Machine
from pentapod.mesh.query.distance import MeshDistance
from pentapod.registration import CutSurface, Touches, plan_probing, read_touches, register, touches_text
from short_motion import given, post

RADIUS = 2e-3
PROBE = """#!/usr/bin/python3
# Tells the real-time parts where the ball meets the true part on the way that comes next.
import json, time
import hal

ways = json.load(open("ways.json"))
probe = hal.component("probe")
probe.newpin("kind", hal.HAL_S32, hal.HAL_IN)
probe.newpin("armed", hal.HAL_BIT, hal.HAL_OUT)
probe.ready()
count, told = 0, -1
while True:
    if probe["kind"] == 5:
        probe["armed"] = True
    elif probe["armed"]:
        probe["armed"], count = False, count + 1
    elif told < count < len(ways):
        told, (gains, begin) = count, ways[count]
        for name, gain in zip(("0.gain0", "0.gain1", "1.gain0", "1.gain1", "3.gain0"), gains):
            hal.set_p("sum2." + name, repr(gain))
        hal.set_p("sum2.3.offset", repr(begin))
    time.sleep(0.01)
"""
WIRES = """
loadrt sum2 count=4
loadrt comp count=1
loadrt and2 count=1
addf sum2.0 servo-thread
addf sum2.1 servo-thread
addf sum2.2 servo-thread
addf sum2.3 servo-thread
addf comp.0 servo-thread
addf and2.0 servo-thread
loadusr -W ./probe
net command1 => sum2.0.in0
net command2 => sum2.0.in1
net command3 => sum2.1.in0
net command4 => sum2.1.in1
net command5 => sum2.3.in0
net first sum2.0.out => sum2.2.in0
net second sum2.1.out => sum2.2.in1
net third sum2.2.out => sum2.3.in1
net into-the-part sum2.3.out => comp.0.in1
net meets comp.0.out => and2.0.in0
net kind-of-motion => probe.kind
net armed probe.armed => and2.0.in1
net touch and2.0.out => motion.probe-input
"""
"""The probe trips where a weighted sum of the legs becomes positive: within one servo period."""


def waves(x, y):
    return 3e-3 * np.sin(120.0 * x) * np.cos(90.0 * y) + 0.1 * x * y


@real
@pytest.mark.slow
def test_linuxcnc_finds_the_part_with_its_probe(tmp_path) -> None:
    machine, mesh = Machine.load("desk"), sheet(waves, cells=24)
    planned = RigidTransform(np.diag([1.0, -1.0, -1.0]), machine.work.centre)
    truth = RigidTransform(
        Rotation.from_rotvec([2e-3, -3e-3, 5e-3]).as_matrix() @ planned.rotation,
        planned.translation + np.array([0.6e-3, -0.5e-3, 0.4e-3]),
    )
    surface, component = MeshDistance.of(mesh), Component(1, 1)
    world = CollisionWorld.of(machine, Lollipop(RADIUS, 0.5 * RADIUS, 0.04), mesh, allowance=0.0)
    head = Touches(np.zeros((0, 5)), machine.tool_length, RADIUS, (), component, machine.name)
    cut = CutSurface(mesh.vertices[mesh.faces].mean(axis=1), mesh.facet_normals)
    probing = plan_probing(machine, component, surface, planned, cut, world, head, 12)

    post(given(duration=0.5), "linuxcnc", tmp_path)
    folder = tmp_path / "trivkins"
    (folder / "program.ngc").write_text(probing.gcode("touches.csv"), encoding="utf-8")
    (folder / "touches.csv").write_text(touches_text(head), encoding="utf-8")
    ways = []
    for way, beyond in zip(probing.ways, probing.beyond, strict=True):
        begin, along = way[-1], beyond - way[-1]

        def gap(share, begin=begin, along=along):
            p, i = machine.robot.pose((begin + share * along)[None], np.array([1, 1]))
            centre = truth.inverse().apply(p + (machine.tool_length - RADIUS) * i)
            return surface.points(centre).distance[0] - RADIUS

        share = brentq(gap, 0.0, 1.0, xtol=1e-9)
        gains = 1e-3 * along / (along @ along)
        ways.append((gains.tolist(), -float(1e3 * begin @ gains) - share))
    (folder / "ways.json").write_text(json.dumps(ways))
    (folder / "probe").write_text(PROBE)
    (folder / "probe").chmod(0o755)
    with (folder / "record.hal").open("a") as hal:
        hal.write(WIRES)
    play(folder)

    touches = read_touches(folder / "touches.csv")
    found = register(surface, touches.centres(machine), RADIUS, planned, cut)
    points = mesh.vertices[mesh.faces].mean(axis=1)
    across = ((found.placement.apply(points) - truth.apply(points)) * truth.rotate(mesh.facet_normals)).sum(axis=1)
    away = ((planned.apply(points) - truth.apply(points)) * truth.rotate(mesh.facet_normals)).sum(axis=1)
    assert np.abs(away).max() > 300e-6
    assert np.abs(across).max() < 20e-6
