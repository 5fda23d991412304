"""Candidates that do not fit: one at which only bodies touch is nearer to a plan than one in a wrong branch."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from pentapod.geometry.rigid import RigidTransform
from pentapod.geometry.solids import Solid
from pentapod.machine.clearance.collision_world import CollisionWorld, Obstacle
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.query.distance import MeshDistance
from pentapod.planning.placement.search import search
from pentapod.planning.problem.constraints import PlacementConstraints
from pentapod.planning.problem.problem import PlacementProblem
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.planning.problem.weights import NEEDED_MARGIN


@pytest.fixture
def through_a_block(desk):
    """A path whose shank is in a block of the part at a few of its waypoints, with all branches to choose from."""
    block = trimesh.creation.box((0.01, 0.03, 0.03))
    block.apply_translation([0.03, 0.0, 0.025])
    surface = MeshDistance.of(Mesh.of(block.vertices, block.faces))
    shank = (Solid("shank", 0.01, 0.05, 0.006, 0.006),)
    here = RigidTransform(np.diag([1.0, -1.0, -1.0]), desk.work.centre)
    centres = np.c_[np.linspace(-0.04, 0.04, 60), np.zeros((60, 2))]
    samples = ToolpathSamples(centres, np.tile([0.0, 0.0, 1.0], (60, 1)), 0.0, 0.0)
    world = CollisionWorld((Obstacle("block", surface, clamped=True),), shank)
    problem = PlacementProblem.of(samples, desk, PlacementConstraints.fixture([here]), collision_world=world)
    return replace(problem, margins=problem.margins[::-1])  # the right branch comes last


def test_the_branch_in_which_the_machine_keeps_its_limits_is_the_best_attempt(through_a_block):
    found = search(through_a_block).best
    others = [through_a_block.candidate(each, found.transform, found.coefficients) for each in through_a_block.margins]
    assert found.smallest < NEEDED_MARGIN
    assert [each.smallest for each in others].count(found.smallest) > 1  # the shank tells no branches apart
    values = through_a_block.values(found.margins, found.transform, found.coefficients)
    assert 0 < (values.min(axis=1) < NEEDED_MARGIN).sum() < 30
    assert through_a_block.rank(found) == (NEEDED_MARGIN, found.smallest)


def test_candidates_that_fit_are_compared_by_their_margin(through_a_block):
    free = through_a_block.without_collision_world()
    first, second = (free.candidate(each, free.constraints.poses[0], free.upright) for each in free.margins[-2:])
    assert free.rank(max(first, second, key=free.rank))[1] == max(first.smallest, second.smallest)
