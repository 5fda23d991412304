"""Idle tool bodies: left out only where no lean brings them near the part."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import toolpath_surfaces as surfaces
from pentapod.cutters.ball import BallCutter
from pentapod.geometry.solids import Cone, Solid
from pentapod.machine.clearance.collision_world import CollisionWorld
from pentapod.planning.problem.idle_tool import joints_are_nearer, leaning, without_idle_tool
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.toolpath import Mesh, RasterOptions, make_toolpath

UP = np.array([0.0, 0.0, 1.0])


def samples(tilt, centre=3e-3):
    return ToolpathSamples(np.zeros((1, 3)), UP[None], centre, tilt)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 100_000))
def test_the_leaning_solid_holds_the_solid_at_every_lean(seed):
    rng = np.random.default_rng(seed)
    low, tilt = 3e-3 + rng.uniform(0.0, 0.02), rng.uniform(0.0, 0.6)
    solid = Solid("shank", low, low + rng.uniform(0.0, 0.04), *rng.uniform(0.0, 5e-3, 2))
    around = leaning(solid, samples(tilt))
    height, angle = rng.uniform(solid.low, solid.high, 500), rng.uniform(0.0, 2 * np.pi, 500)
    share = (height - solid.low) / max(solid.high - solid.low, 1e-12)
    radius = solid.low_radius + share * (solid.high_radius - solid.low_radius)
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), height - 3e-3], axis=1)
    turn = rng.uniform(-tilt, tilt)
    turned = points @ np.array([[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]]).T
    at, aside = turned[:, 2] + 3e-3, np.hypot(*turned[:, :2].T)
    assert (at >= around.low - 1e-12).all()
    assert (at <= around.high + 1e-12).all()
    room = around.low_radius + (at - around.low) / (around.high - around.low) * (around.high_radius - around.low_radius)
    assert (aside <= room + 1e-12).all()


def world_of(desk, shape, tool):
    mesh = Mesh.of(*surfaces.grid(shape, width=0.06, cells=30))
    path = make_toolpath(mesh, tool, RasterOptions(stepover=6e-3))
    return CollisionWorld.of(desk, tool, mesh), path


@pytest.mark.parametrize(("tilt", "idle"), [(0.0, True), (np.radians(15.0), True), (np.radians(45.0), False)])
def test_a_stem_over_a_dome_is_idle_in_a_narrow_cone(desk, tilt, idle):
    tool = BallCutter(3e-3).with_stem(desk.bodies.shaft_end)
    world, path = world_of(desk, lambda x, y: -5.0 * (x**2 + y**2), tool)
    assert world.tool
    assert bool(without_idle_tool(world, desk, ToolpathSamples.of(path, tilt)).tool) != idle


@pytest.mark.slow
def test_a_stem_in_a_groove_counts_and_a_holder_too(desk):
    stem = BallCutter(3e-3).with_stem(desk.bodies.shaft_end)
    world, path = world_of(desk, lambda x, y: -0.02 * np.exp(-((x / 0.008) ** 2)), stem)
    found = ToolpathSamples.of(path, np.radians(15.0))
    assert without_idle_tool(world, desk, found) is world
    wide = BallCutter(3e-3, shank=(Cone(2e-3, 3e-3, 3e-3),), holder=(Cone(0.02, 0.03, 0.03),))
    world, path = world_of(desk, lambda x, y: 5.0 * x**2, wide)
    assert without_idle_tool(world, desk, ToolpathSamples.of(path, 0.2)) is world


def test_obstacles_in_the_machine_keep_the_stem(desk):
    tool = BallCutter(3e-3).with_stem(desk.bodies.shaft_end)
    world, path = world_of(desk, lambda x, y: 0.0 * x, tool)
    fixed = replace(world, obstacles=(replace(world.obstacles[0], clamped=False),))
    found = ToolpathSamples.of(path, 0.1)
    assert without_idle_tool(fixed, desk, found) is fixed
    assert not without_idle_tool(world, desk, found).tool


def test_legs_near_a_wide_body_keep_it(desk):
    assert joints_are_nearer(desk, BallCutter(3e-3).with_stem(0.06).solids[1:])
    assert not joints_are_nearer(desk, (Solid("holder", 0.03, 0.085, 0.04, 0.04),))
