"""Workspaces against sampled directions and positions: Monte Carlo volume, balls and boxes full of reachable poses."""

import itertools

import numpy as np
import pytest

from pentapod.base.errors import ArrayError
from pentapod.geometry import normalised, tangent_frame
from pentapod.kinematics import COMPONENTS, Component, LinearPentapod
from pentapod.theory import ReachField, Workspace
from pentapod.theory.cuboid import largest_cuboid

BASE = np.array([(0.586, -0.12), (0.224, 0.554), (-0.326, 0.498), (-0.597, -0.039), (-0.055, -0.595)])
ROBOT = LinearPentapod.quadratic(BASE, 0.185)


def space(tilt_deg: float = 20.0, towards=(0.1, 0.0, 1.0), component=COMPONENTS[0], **changed) -> Workspace:
    given = {"shortest": [0.489] * 5, "longest": [0.929] * 5, "tool_length": 0.198, **changed}
    return Workspace(ROBOT, component, np.array(towards), np.radians(tilt_deg), **given)


def cone(workspace: Workspace, rings: int = 4, around: int = 48) -> np.ndarray:
    """Directions of the cone, most of them on its rim."""
    t1, t2 = tangent_frame(workspace.direction)
    turn = 2.0 * np.pi * np.arange(around) / around
    lean = workspace.half_angle * np.sqrt(np.linspace(0.0, 1.0, rings))[:, None, None]
    side = np.cos(turn)[:, None] * t1 + np.sin(turn)[:, None] * t2
    return (np.cos(lean) * workspace.direction + np.sin(lean) * side).reshape(-1, 3)


def reachable(workspace: Workspace, tips: np.ndarray) -> np.ndarray:
    """Whether every sampled direction is within limits and in the component, by leg lengths and component alone."""
    answer = np.ones(len(tips), dtype=bool)
    for i in cone(workspace):
        p = tips - workspace.tool_length * i
        legs = ROBOT.leg_lengths(p, i)
        answer &= ((legs >= workspace.shortest) & (legs <= workspace.longest)).all(axis=1)
        answer &= (ROBOT.branch(p, i) == workspace.component).all(axis=1)
    return answer


SPACES = {
    "desk": space(),
    "one direction": space(0.0),
    "the singular plane cuts it": space(15.0, towards=(0.5, 0.2, 0.8), shortest=[0.1] * 5, longest=[0.8] * 5),
    "below": space(10.0, towards=(0.0, 0.2, -1.0), component=Component(-1, -1)),
}


@pytest.mark.parametrize("workspace", SPACES.values(), ids=SPACES.keys())
def test_slack_has_the_sign_of_sampled_reachability(workspace: Workspace) -> None:
    low, high = workspace.bounds()
    tips = np.random.default_rng(1).uniform(low, high, size=(20_000, 3))
    slack, found = workspace.slack(tips), reachable(workspace, tips)
    assert found.any()
    assert not (found & (slack < -2e-3)).any()  # 48 directions on the rim miss the worst by this much at most
    assert not (~found & (slack >= 0.0)).any()


@pytest.mark.parametrize("workspace", SPACES.values(), ids=SPACES.keys())
def test_slack_changes_by_at_most_a_metre_a_metre(workspace: Workspace) -> None:
    rng = np.random.default_rng(2)
    low, high = workspace.bounds()
    a = rng.uniform(low, high, size=(20_000, 3))
    b = a + rng.normal(size=a.shape) * 10.0 ** rng.uniform(-4, -0.5, size=(20_000, 1))
    assert (np.abs(workspace.slack(a) - workspace.slack(b)) <= np.linalg.norm(a - b, axis=1) * (1 + 1e-9) + 1e-13).all()


@pytest.mark.parametrize(("name", "samples"), [("desk", 30_000), pytest.param("desk", 600_000, marks=pytest.mark.slow)])
def test_volume_by_throwing_darts(name: str, samples: int) -> None:
    workspace = SPACES[name]
    field = ReachField.of(workspace, 0.02)
    inside = np.argwhere(field.slack > -0.04)
    low, high = field.origin + field.step * inside.min(axis=0), field.origin + field.step * inside.max(axis=0)
    tips = np.random.default_rng(3).uniform(low, high, size=(samples, 3))
    share = reachable(workspace, tips).mean()
    volume, deviation = np.prod(high - low) * share, np.prod(high - low) * np.sqrt(share * (1 - share) / samples)
    assert field.volume() == pytest.approx(volume, abs=4.0 * deviation + 0.01 * volume)
    lower, upper = field.volume_bounds()
    assert lower <= volume + 4.0 * deviation
    assert upper >= volume - 4.0 * deviation


@pytest.mark.slow
@pytest.mark.parametrize("name", ["desk", "the singular plane cuts it"])
def test_ball_and_box_are_full_of_reachable_tips(name: str) -> None:
    workspace = SPACES[name]
    field = ReachField.of(workspace, 0.03)
    rng = np.random.default_rng(4)
    centre, radius, bound = field.largest_ball()
    assert 0.0 < radius <= bound
    inside = centre + radius * normalised(rng.normal(size=(20_000, 3)))
    assert reachable(workspace, inside).all()
    low, high = field.largest_box()
    assert (high > low).all()
    assert reachable(workspace, rng.uniform(low, high, size=(20_000, 3))).all()
    corners = np.array(list(itertools.product(*zip(low, high, strict=True))))
    assert reachable(workspace, corners).all()
    # No random point serves a larger ball, no random box of greater volume is reachable.
    tips = rng.uniform(*workspace.bounds(), size=(200_000, 3))
    assert workspace.slack(tips).max() <= radius + 1e-9
    ends = np.sort(tips[: 2 * (len(tips) // 2)].reshape(-1, 2, 3), axis=1)
    larger = np.prod(ends[:, 1] - ends[:, 0], axis=1) > 1.15 * np.prod(high - low)
    assert not any(field.box_is_reachable(*pair) for pair in ends[larger][:2000])


@pytest.mark.slow
def test_the_ball_where_legs_decide_touches_the_unreachable() -> None:
    workspace = SPACES["desk"]
    centre, radius, _ = ReachField.of(workspace, 0.03).largest_ball()
    just_outside = centre + 1.02 * radius * normalised(np.random.default_rng(5).normal(size=(50_000, 3)))
    assert not reachable(workspace, just_outside).all()


def test_largest_cuboid_by_trying_all() -> None:
    rng = np.random.default_rng(6)
    for density in (0.5, 0.8, 0.95, 1.0):
        inside = rng.random((5, 6, 7)) < density
        best = 0
        spans = [list(itertools.combinations(range(n), 2)) for n in inside.shape]
        for (a, b), (c, d), (e, f) in itertools.product(*spans):
            if inside[a : b + 1, c : d + 1, e : f + 1].all():
                best = max(best, (b - a) * (d - c) * (f - e))
        found = largest_cuboid(inside)
        assert (found is None) == (best == 0)
        if found:
            (a, c, e), (b, d, f) = found
            assert (b - a) * (d - c) * (f - e) == best
            assert inside[a : b + 1, c : d + 1, e : f + 1].all()


def test_nothing_reachable_and_bad_input() -> None:
    nothing = ReachField.of(space(80.0, towards=(1.0, 0.0, 0.3)), 0.1)
    assert nothing.volume() == 0.0
    assert nothing.largest_ball()[1] == 0.0
    assert np.isnan(nothing.largest_box()[0]).all()
    with pytest.raises(ArrayError, match="exclude each other"):
        space(shortest=[1.0] * 5)
    with pytest.raises(ArrayError, match="half_angle"):
        space(95.0)
    with pytest.raises(ArrayError, match="component"):
        space(component=(0, 1))
    with pytest.raises(ArrayError, match="too fine"):
        ReachField.of(space(), 1e-4)
    with pytest.raises(ArrayError, match="positive"):
        ReachField.of(space(), 0.0)
