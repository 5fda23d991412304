"""The search for a placement: what cannot fit with nothing around is refused before its surroundings are looked at."""

import signal

import numpy as np
import pytest
import trimesh

from pentapod.kinematics.component import Component
from pentapod.machine.clearance.collision_world import CollisionWorld, Obstacle
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.query.distance import MeshDistance
from pentapod.planning.limits.margins import Margins
from pentapod.planning.placement.sampling import SamplingOptions, first_guesses
from pentapod.planning.placement.search import SearchOptions, search
from pentapod.planning.problem.problem import PlacementProblem
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.planning.problem.weights import NEEDED_MARGIN

PLUS = Component(1, 1)


@pytest.fixture(scope="module")
def collision_world():
    """A small post beside the part, far below the path."""
    shape = trimesh.creation.cylinder(0.01, 0.04, sections=12)
    shape.apply_translation([0.1, 0.1, -0.2])
    surface = MeshDistance.of(Mesh.of(np.asarray(shape.vertices), np.asarray(shape.faces)))
    return CollisionWorld((Obstacle("fixture", surface, clamped=True),))


def names(margins):
    return [limit.name for limit in margins.limits]


@pytest.mark.slow
def test_what_does_not_fit_alone_is_answered_without_obstacles(desk, wide, collision_world):
    problem = PlacementProblem.of(ToolpathSamples.of(wide, 0.2), desk, component=PLUS, collision_world=collision_world)
    alone = search(problem.without_collision_world(), options=SearchOptions(tried=2))
    found = search(problem, options=SearchOptions(tried=2, hopeless=np.inf))
    assert found.best.smallest == alone.best.smallest < NEEDED_MARGIN
    assert names(found.best.margins) == names(Margins.of(desk, PLUS))


def test_what_fits_alone_is_placed_among_its_obstacles(desk, cap, collision_world):
    problem = PlacementProblem.of(ToolpathSamples.of(cap, 0.2), desk, component=PLUS, collision_world=collision_world)
    promising = search(problem, options=SearchOptions(refined=1))
    found = search(problem, options=SearchOptions(refined=1, hopeless=np.inf))
    assert names(found.best.margins) == names(Margins.of(desk, PLUS, collision_world))
    assert found.best.smallest == promising.best.smallest >= NEEDED_MARGIN
    assert np.array_equal(found.best.transform.matrix, promising.best.transform.matrix)


def test_an_interruption_of_the_look_without_obstacles_ends_the_search(desk, cap, collision_world):
    improved = []

    def progress(stage: str, fraction: float, note: str = "") -> None:
        if note.startswith("component"):
            improved.append(note)
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        search(
            PlacementProblem.of(ToolpathSamples.of(cap, 0.2), desk, component=PLUS, collision_world=collision_world),
            progress=progress,
            options=SearchOptions(hopeless=np.inf),
        )
    assert len(improved) == 1


def test_first_guesses_judged_in_part_are_those_judged_whole(desk, cap):
    """No placement is left out because of the waypoints at which all are judged first."""
    problem = PlacementProblem.of(ToolpathSamples.of(cap, np.radians(15.0)), desk)
    few, every = (
        list(first_guesses(problem, options=SamplingOptions(tries=600, ranked=12, first=first))) for first in (2, 12)
    )
    assert [guess.margin for guess in few] == [guess.margin for guess in every]
    assert [guess.margin for guess in few] == sorted((guess.margin for guess in few), reverse=True)
