"""Tools: the body touches the tangent plane at the contact and nowhere crosses it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pentapod.base.errors import ToolpathError
from pentapod.cutters.ball import BallCutter
from pentapod.cutters.bull_nose import BullNose
from pentapod.cutters.flat_end import FlatEnd
from pentapod.cutters.lollipop import Lollipop
from pentapod.cutters.stand_off import StandOff
from pentapod.geometry.solids import Cone, Solid

SHANK, HOLDER = (Cone(0.03, 0.003, 0.003),), (Cone(0.01, 0.006, 0.012), Cone(0.03, 0.012, 0.012))
CUTTERS = [
    BallCutter(3e-3, flute=0.01),
    BullNose(5e-3, 1e-3, flute=0.012),
    FlatEnd(4e-3, flute=0.01),
    Lollipop(4e-3, 1.5e-3, 0.02),
]


def surface_points(solid: Solid, rng, count=4000):
    """Points of a solid's surface, from its definition: frustum points pushed outwards by the rounding."""
    height = rng.uniform(solid.low, solid.high, count) if solid.high > solid.low else np.full(count, solid.low)
    height = np.where(rng.random(count) < 0.4, rng.choice([solid.low, solid.high], count), height)
    share = (height - solid.low) / (solid.high - solid.low) if solid.high > solid.low else 0.0
    radius = solid.low_radius + share * (solid.high_radius - solid.low_radius)
    radius = radius * np.where(rng.random(count) < 0.7, 1.0, np.sqrt(rng.random(count)))
    angle = rng.uniform(0, 2 * np.pi, count)
    push = rng.normal(size=(count, 3))
    push *= solid.rounding / np.linalg.norm(push, axis=1)[:, None]
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), height], 1) + push


def turned(direction):
    """A rotation that takes +z to a unit direction."""
    axis = np.cross([0.0, 0.0, 1.0], direction)
    if np.linalg.norm(axis) < 1e-12:
        return np.diag([1.0, 1.0, 1.0]) if direction[2] > 0 else np.diag([1.0, -1.0, -1.0])
    from scipy.spatial.transform import Rotation

    axis /= np.linalg.norm(axis)
    return Rotation.from_rotvec(axis * np.arccos(np.clip(direction[2], -1, 1))).as_matrix()


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 100_000), which=st.integers(0, len(CUTTERS) - 1), lean=st.floats(0.02, 1.4))
def test_cutters_touch_their_tangent_plane_at_the_contact(seed, which, lean):
    rng, tool = np.random.default_rng(seed), CUTTERS[which]
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    aside = np.cross(normal, rng.normal(size=3))
    aside /= np.linalg.norm(aside)
    axis = np.cos(lean) * normal + np.sin(lean) * aside
    contact = rng.normal(size=3) * 0.05
    tip = tool.tips(contact[None], normal[None], axis[None])[0]
    body = np.concatenate([surface_points(s, rng) for s in tool.solids if s.kind == "cutter"])
    heights = (tip + body @ turned(axis).T - contact) @ normal
    assert heights.min() > -1e-12
    # The contact itself belongs to the body: a rim or a rounding comes this near to it in 4000 throws.
    assert np.linalg.norm(tip + body @ turned(axis).T - contact, axis=1).min() < 1.2e-3


def test_tip_of_an_upright_cutter_is_the_contact():
    normal = np.array([[0.0, 0.0, 1.0]])
    for tool in (BullNose(5e-3, 1e-3), FlatEnd(4e-3), BallCutter(3e-3)):
        np.testing.assert_allclose(tool.tips(np.ones((1, 3)), normal, normal), np.ones((1, 3)), atol=1e-15)


def test_stand_off_keeps_its_distance_along_the_axis():
    axis = np.array([[0.0, 0.6, 0.8]])
    tool = StandOff(0.01, shank=SHANK)
    tip = tool.tips(np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]), axis)
    np.testing.assert_allclose(tip, 0.01 * axis)
    np.testing.assert_allclose(tip + tool.tilt_centre * axis, 0.0, atol=1e-18)


@pytest.mark.parametrize("tool", [BallCutter(3e-3), Lollipop(4e-3, 1.5e-3, 0.02), StandOff(5e-3)])
def test_tools_that_can_tilt_keep_their_tilt_centre(tool):
    rng = np.random.default_rng(3)
    axes = rng.normal(size=(50, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    normals = np.tile([0.0, 0.0, 1.0], (50, 1))
    tilt_centres = tool.tips(np.zeros((50, 3)), normals, axes) + tool.tilt_centre * axes
    assert tool.can_tilt
    np.testing.assert_allclose(tilt_centres, tilt_centres[:1].repeat(50, axis=0), atol=1e-15)


def test_shank_and_holder_are_stacked_on_the_cutter():
    tool = BallCutter(3e-3, flute=0.01, shank=SHANK, holder=HOLDER)
    assert [(s.kind, s.low, s.high) for s in tool.solids] == [
        ("cutter", 3e-3, 3e-3),
        ("cutter", 3e-3, 0.01),
        ("shank", 0.01, 0.04),
        ("holder", 0.04, 0.05),
        ("holder", 0.05, pytest.approx(0.08)),
    ]
    assert BallCutter(3e-3, flute=4e-3, holder=HOLDER).solids[2].low == 4e-3
    assert [s.kind for s in Lollipop(4e-3, 1e-3, 0.02, holder=HOLDER).solids] == ["cutter", "shank", "holder", "holder"]
    assert [s.kind for s in StandOff(5e-3, shank=SHANK).solids] == ["shank"]


@pytest.mark.parametrize(
    "make",
    [
        lambda: BallCutter(0.0),
        lambda: BallCutter(3e-3, flute=2e-3),
        lambda: BullNose(3e-3, 3e-3),
        lambda: BullNose(3e-3, -1e-3),
        lambda: FlatEnd(np.nan),
        lambda: Lollipop(3e-3, 3e-3, 0.02),
        lambda: Lollipop(3e-3, 1e-3, 5e-3),
        lambda: StandOff(-1.0),
        lambda: Cone(0.0, 1e-3, 1e-3),
        lambda: Cone(1e-3, 0.0, 0.0),
        lambda: Solid("cutter", 1.0, 0.0, 1.0, 1.0),
        lambda: Solid("spindle", 0.0, 1.0, 1.0, 1.0),
    ],
)
def test_impossible_tools_are_refused(make):
    with pytest.raises(ToolpathError):
        make()


@pytest.mark.parametrize(
    "tool", [BallCutter(3e-3), BallCutter(3e-3, flute=0.01), BullNose(5e-3, 1e-3), FlatEnd(4e-3), CUTTERS[3]]
)
def test_a_stem_continues_the_cutter_at_its_widest_without_a_gap(tool):
    cutter = tool.solids
    with_stem = tool.with_stem(0.05).solids
    assert with_stem[:-1] == cutter
    stem = with_stem[-1]
    assert (stem.kind, stem.high) == ("shank", 0.05)
    assert stem.low == cutter[-1].high
    assert stem.low_radius == stem.high_radius == max(solid.largest_radius for solid in cutter)


@pytest.mark.parametrize(
    "tool",
    [
        BallCutter(3e-3, shank=SHANK),
        FlatEnd(4e-3, holder=HOLDER),
        StandOff(5e-3),
        StandOff(5e-3, shank=SHANK),
        BallCutter(3e-3, flute=0.06),
    ],
)
def test_no_stem_is_assumed_beside_a_shank_or_holder_or_without_a_cutter(tool):
    assert tool.with_stem(0.05) is tool


def test_a_reserve_makes_shank_and_holder_larger_all_around():
    tool = BallCutter(3e-3, flute=0.01, shank=SHANK, holder=HOLDER)
    plain, larger = tool.solids, BallCutter(3e-3, flute=0.01, shank=SHANK, holder=HOLDER, reserve=2e-5).solids
    assert larger[:2] == plain[:2]  # ball and flute
    for one, other in zip(plain[2:], larger[2:], strict=True):
        assert other.numbers == (*one.numbers[:4], one.rounding + 2e-5)
