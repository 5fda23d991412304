"""What a cutter leaves on a region: against closed forms, and against dense samples in plain NumPy."""

import re
from dataclasses import replace

import numpy as np
import pytest
import replay_cases as cases
from raster_cases import UP, along, judged, plate, pocket, raster, sheet

from pentapod.base.errors import ArrayError
from pentapod.cutters.ball import BallCutter
from pentapod.cutters.bull_nose import BullNose
from pentapod.cutters.flat_end import FlatEnd
from pentapod.cutters.lollipop import Lollipop
from pentapod.cutters.stand_off import StandOff
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.patch import Patch
from pentapod.mesh.query.distance import MeshDistance
from pentapod.mesh.region import Region
from pentapod.toolpath.linking.partition import Piece
from pentapod.verify import Coverage, Cutting
from pentapod.verify.replay.claim import Idle
from pentapod.verify.surface import surface_left as module
from pentapod.verify.surface.surface_left import SurfaceOptions, surface_left
from pentapod.verify.surface.surface_left_along import surface_left_along

R = 3e-3


NARROW = plate(high=(0.006, 0.012))
"""Lines along x leave the same on it."""


def deepest(finding):
    return 1e-3 * float(finding.method.split("deepest found ")[1].removeprefix("more than ").split(" mm")[0])


@pytest.mark.parametrize(
    ("make", "step"),
    [
        (BallCutter, 1e-3),
        (BallCutter, 4e-3),
        (lambda r: BallCutter(r, 0.02), 2e-3),
        (lambda r: Lollipop(r, 1e-3, 0.02), 2e-3),
    ],
)
def test_a_ball_raster_on_a_plane_leaves_its_scallop(make, step):
    """r − √(r² − s²/4): all is covered a hair above it; below it the share is that of strips in closed form."""
    tool, scallop = make(R), R - np.sqrt(R**2 - step**2 / 4)
    replay = along(*raster(step), tool=tool)
    found = judged(replay, NARROW, tool, 1.02 * scallop)
    assert found.passed
    assert found.value == 0.0
    assert 0.95 * scallop < deepest(found) < 1.01 * scallop
    low = 0.5 * scallop
    held = 2.0 * np.sqrt(R**2 - (R - low) ** 2)
    found = judged(replay, NARROW, tool, low, share=0.01)
    assert not found.passed
    assert found.value == pytest.approx(100.0 * (1.0 - held / step), rel=0.06)
    assert 0.9 * scallop < deepest(found) < 1.01 * scallop


def test_a_flat_end_leaves_nothing_between_passes_that_overlap_and_strips_between_those_that_do_not():
    tool = FlatEnd(2e-3, flute=0.01)
    assert judged(along(*raster(3.9e-3), tool=tool), NARROW, tool, 2e-5).value == 0.0
    found = judged(along(*raster(6e-3), tool=tool), NARROW, tool, 2e-5)
    assert found.value == pytest.approx(100.0 * 4.0 / 12.0, rel=0.03)
    assert deepest(found) == pytest.approx(8e-3)  # nothing was met as far as one looks


def test_a_bull_nose_leaves_the_scallop_of_its_corner():
    """Between discs that are a gap apart the corner's circles meet at its own scallop."""
    radius, corner, gap = 3e-3, 1e-3, 1.2e-3
    tool, scallop = BullNose(radius, corner), corner - np.sqrt(corner**2 - gap**2 / 4)
    step = 2.0 * (radius - corner) + gap
    replay = along(*raster(step, y1=0.016), tool=tool)
    assert judged(replay, plate(), tool, 1.05 * scallop).value == 0.0
    assert not judged(replay, plate(), tool, 0.9 * scallop).passed


def test_passes_on_a_sphere_leave_the_ridge_of_the_law_of_cosines():
    """Ball of r on a sphere of ρ, passes in planes through its axis, s apart at the equator of the region."""
    rho, step = 0.02, 2e-3
    ball = BallCutter(R)
    mesh = sheet(lambda x, y: np.sqrt(rho**2 - x**2 - y**2), (-5e-3, -5e-3), (5e-3, 5e-3), 60)
    turns = (step / rho) * np.arange(-5, 6)
    lean = np.linspace(-0.45, 0.45, 400)
    lines, axes = [], []
    for a in turns:
        across = np.array([0.0, np.sin(a), np.cos(a)])
        axis = np.sin(lean)[:, None] * np.array([1.0, 0, 0]) + np.cos(lean)[:, None] * across
        axis = axis[:: -1 if len(lines) % 2 else 1]  # to and fro
        lines.append(rho * axis)
        axes.append(axis)
    half = 0.5 * step / rho
    centre = rho + R
    ridge = centre * np.cos(half) - np.sqrt(R**2 - (centre * np.sin(half)) ** 2) - rho
    found = judged(along(*lines, tool=ball, axes=axes), mesh, ball, 1.05 * ridge)
    assert found.value == 0.0
    assert deepest(found) == pytest.approx(ridge, rel=0.03)
    assert not judged(along(*lines, tool=ball, axes=axes), mesh, ball, 0.95 * ridge).passed


@pytest.mark.parametrize("make", [FlatEnd, pytest.param(lambda r: BullNose(r, 5e-4), marks=pytest.mark.slow)])
def test_a_flat_end_that_could_clear_a_floor_up_to_the_wall_must(make):
    size, tool, mesh = 0.02, make(R), pocket()
    ends = {"low": R, "high": size - R, "y1": size - R}
    short = along(*raster(2e-3, y0=R + 2e-3, **ends), tool=tool)
    found = judged(short, mesh, tool, 2e-4, region=Region(angle=0.5))
    assert found.value == pytest.approx(100.0 * 2e-3 * size / size**2, rel=0.15)


@pytest.mark.slow
def test_a_share_near_its_bound_is_sampled_more_finely(monkeypatch):
    """With 64 samples chance decides (16 % for 19.1 %); the foot of the walls is left by the ball's shape."""
    size, tool = 0.02, BallCutter(R)
    replay = along(*raster(1e-3, low=R, high=size - R, y0=R + 5e-4, y1=size - R + 1e-9), tool=tool)

    def found(bound, **options):
        monkeypatch.setattr(module, "OPTIONS", replace(SurfaceOptions(), **options))
        return judged(replay, pocket(), tool, 2e-4, share=bound, region=Region(angle=0.5))

    every = 0.01 * found(0.0, balls=10**6).value
    for share, passed in ((0.9, False), (1.1, True)):
        assert found(share * every, balls=64, again=0).value < 90.0 * every
        finer = found(share * every, balls=64)
        assert finer.passed == passed
        assert re.search("; 1,024 of the [0-9,]+ cells not proven stand for all", finer.method)


def test_what_the_view_does_not_see_is_told_apart():
    """A plate with another one above half of it."""
    low, lid = plate(), plate(high=(0.01, 0.012))
    points = np.concatenate([low.vertices, lid.vertices + 0.012 * UP])
    mesh = Mesh.of(points, np.concatenate([low.faces, lid.faces + len(low.vertices)]))
    tool = BallCutter(R)
    lines = raster(1e-3, low=0.013 + R)
    found = judged(along(*lines, tool=tool), mesh, tool, 1e-4, region=Region(box=((-1, -1, -1e-3), (1, 1, 1e-3))))
    # Left are 10 to 16 mm but for what the ball's end takes; its centre may stand 3 mm from the lid's edge at 10 mm.
    taken = np.sqrt(R**2 - (R - 1e-4) ** 2)
    assert found.value == pytest.approx(100.0 * (6e-3 - taken) / 0.02, rel=0.03)
    told = re.search(r"; (\S+) % more is hidden by overhangs or out of reach", found.method)
    # Half of the plate; and at most a strip of 0.02 mm along the lid's edge, where the nearest ball touches nothing.
    assert 50.0 <= float(told[1]) <= 50.1


def test_a_beam_covers_what_is_near_its_lines_on_cuts_alone():
    jet = StandOff(5e-3)
    lines = [line[1:3] + 5e-3 * UP for line in raster(2e-3)]
    lines = [line if k % 2 == 0 else line[::-1] for k, line in enumerate(lines)]
    assert judged(along(*lines, tool=jet), plate(), jet, 1.1e-3).value == 0.0
    wide = judged(along(*lines[::2], tool=jet), plate(), jet, 1.1e-3)
    assert wide.value == pytest.approx(100.0 * (4.0 - 2.2) / 4.0, rel=0.06)
    assert "beam's line" in wide.method


@pytest.mark.parametrize(
    ("tool", "lines", "left"),
    [
        (BallCutter(R), raster(4e-3), 3.8e-4),
        (FlatEnd(2e-3, flute=0.01), raster(6e-3), 2e-5),
        (StandOff(5e-3), [line[1:3] + 5e-3 * UP for line in raster(4e-3)], 1.1e-3),
    ],
)
def test_a_toolpath_alone_tells_what_a_program_along_it_leaves(tool, lines, left):
    """By the same claim, on the waypoints instead of a replay of rows."""
    replay = along(*lines, tool=tool)
    found = judged(replay, NARROW, tool, left, tilt=0.0)
    coverage = Coverage(Patch.of(NARROW, Region()), left, 0.0, UP)
    cutting = Cutting(MeshDistance.of(NARROW), tool.solids, 0.0, coverage)
    foreseen = surface_left_along(replace(replay.specification, cutting=cutting, tilt=0.0))
    assert found.value > 10.0
    assert foreseen.value == pytest.approx(found.value, rel=1e-6)
    assert not foreseen.passed
    assert surface_left_along(replace(replay.specification, cutting=None)) is None


@pytest.mark.parametrize(("tilt", "flute", "told"), [(0.0, 0.02, True), (0.1, None, True), (0.1, 0.02, False)])
def test_a_toolpath_does_not_tell_what_the_side_of_a_leaning_cutter_leaves(tilt, flute, told):
    tool = BallCutter(R) if flute is None else BallCutter(R, flute)
    cutting = Cutting(MeshDistance.of(NARROW), tool.solids, 0.0, Coverage(Patch.of(NARROW, Region()), 3.8e-4, 0.0, UP))
    asked = replace(along(*raster(4e-3), tool=tool).specification, cutting=cutting, tilt=tilt)
    assert (surface_left_along(asked) is not None) == told


@pytest.mark.slow
def test_dense_samples_agree_on_a_wavy_sheet_with_a_leaning_tool():
    """Heights by brute force: many balls along the path, the first that a ray up the normal meets."""
    rng = np.random.default_rng(5)
    mesh = sheet(lambda x, y: 1e-3 * np.sin(x / 3e-3) * np.cos(y / 4e-3), cells=24)
    tool = BallCutter(2e-3)
    lines, axes = [], []
    for y in np.arange(0.0, 0.0121, 2.4e-3):
        x = np.linspace(-1e-3, 0.021, 60)
        z = 1e-3 * np.sin(x / 3e-3) * np.cos(y / 4e-3) + 2e-4
        axis = np.stack([0.2 * np.sin(x / 5e-3), 0.1 + 0 * x, np.ones_like(x)], axis=1)
        lines.append(np.stack([x, y + 0 * x, z], axis=1))
        axes.append(axis / np.linalg.norm(axis, axis=1)[:, None])
    replay = along(*lines, tool=tool, axes=axes)
    patch = Patch.of(mesh, Region())
    facet = rng.choice(len(patch.faces), 3000, p=patch.areas / patch.areas.sum())
    w = rng.dirichlet([1, 1, 1], 3000)
    q, n = np.einsum("ni,nij->nj", w, patch.vertices[patch.faces[facet]]), patch.facet_normals[facet]
    share = np.linspace(0, 1, 60, endpoint=False)[:, None]
    c = np.concatenate(
        [a + share * (b - a) for a, b in zip(replay.tilt_centres[:-1], replay.tilt_centres[1:], strict=True)]
    )
    heights = np.full(len(q), np.inf)
    for part in np.array_split(np.arange(len(q)), 60):
        d = c[None] - q[part, None]
        t = np.einsum("nkj,nj->nk", d, n[part])
        off = np.einsum("nkj,nkj->nk", d, d) - t**2
        root = np.sqrt(np.maximum(4e-6 - off, 0.0))
        first = np.where((off < 4e-6) & (t + root > 0.0), np.maximum(t - root, 0.0), np.inf)
        heights[part] = first.min(axis=1)
    for left in (4e-4, 6e-4, 8e-4):
        found = judged(replay, mesh, tool, left)
        expected = 100.0 * np.mean(heights > left)
        assert found.value >= expected - 300.0 * np.sqrt(max(expected, 1.0) / 100.0 / 3000)
        assert found.value <= 1.1 * expected + 1.0
        assert deepest(found) == pytest.approx(min(heights.max(), 8e-3), rel=0.1) or found.value < 0.1


def test_motion_that_is_not_known_exactly_counts_for_less():
    """A motion that may be 50 µm off leaves 50 µm more, as far as is proven."""
    tool, step = BallCutter(R), 2e-3
    scallop = R - np.sqrt(R**2 - step**2 / 4)
    replay = along(*raster(step), tool=tool)
    replay.interval_bounds.deviations[:] = 5e-5
    assert not judged(replay, plate(), tool, 1.02 * scallop).passed
    assert judged(replay, plate(), tool, scallop + 6e-5).value == 0.0


@pytest.mark.slow
def test_each_piece_answers_for_its_own_part():
    """Three passes each for two set-ups; a piece without one of its passes fails, whatever the other does."""
    tool, lines = BallCutter(R), [line[1:3] for line in raster(2e-3)]
    lines = [line if k % 2 == 0 else line[::-1] for k, line in enumerate(lines)]
    whole = along(*lines, tool=tool)
    scallop = R - np.sqrt(R**2 - 1e-6)

    def part(rows, piece):
        replay = along(*[lines[k] for k in rows], tool=tool, piece=piece)
        return judged(replay, plate(), tool, 1.1 * scallop, share=2e-3, whole=lambda: whole.toolpath)

    first, second = Piece(0, 7), Piece(8, len(whole.toolpath) - 1)
    assert part([0, 1, 2, 3], first).passed
    assert part([4, 5, 6], second).passed
    assert not part([0, 1, 3], first).passed
    assert not part([4, 5, 6], first).passed


def test_lines_that_cover_nothing_are_not_judged_and_silence_is_not_consent():
    tool = BallCutter(R)
    replay = along(*raster(1e-3), tool=tool)
    surface = MeshDistance.of(plate())
    cutting = Cutting(surface, tool.solids, 0.0, Coverage.nothing("it is text"))
    assert surface_left(cases.same_motion(replay, cutting=cutting)) == Idle("it is text")
    for cutting in (None, Cutting(surface, tool.solids, 0.0)):
        unknown = Idle("the surface to be machined is not given", unknown=True)
        assert surface_left(cases.same_motion(replay, cutting=cutting)) == unknown


@pytest.mark.parametrize(("key", "options"), [("left", {"left": 0.0}), ("share", {"left": 1e-4, "share": 1.5})])
def test_impossible_bounds_are_bad_input(key, options):
    with pytest.raises(ArrayError, match=key):
        Coverage(Patch.whole(plate()), **options)
