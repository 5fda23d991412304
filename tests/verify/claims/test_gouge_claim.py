"""Claims about gouges: proven depths are never below what dense samples find, and each corruption is caught."""

from dataclasses import replace

import numpy as np
import pytest
import replay_cases as cases
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from pentapod.base.errors import ArrayError
from pentapod.cutters.ball import BallCutter
from pentapod.cutters.flat_end import FlatEnd
from pentapod.cutters.stand_off import StandOff
from pentapod.geometry.interpolant import Interpolant
from pentapod.mesh.query.swept_depth import RESOLUTION_M
from pentapod.toolpath.toolpath import SegmentKind
from pentapod.verify import Cutting, verify
from pentapod.verify.claims.gouge import gouge, rapid_chords
from pentapod.verify.replay.claim import Idle
from pentapod.verify.replay.gouge_bounds import GougeBound, depth_resolution
from pentapod.verify.replay.stretches import Stretches, deviation_bounds

CUTS, RAPIDS = "gouge on cuts and links", "gouge on rapids"
LARGE = 1e3  # trimesh counts in units of about this many to the metre


def judged(case, cutting, **options):
    return {c.claim: c for c in verdict_on(case, cutting, **options).certificates}


def verdict_on(case, cutting, **options):
    return verify(case.program, case.machine, case.toolpath, **cases.ASKED, cutting=cutting, **options)


def unjudged(case, cutting):
    return {entry.claim: entry.why for entry in verdict_on(case, cutting).not_judged}


def failed(case, cutting):
    return {name for name, c in judged(case, cutting).items() if not c.passed}


def raised(rise, tool=None, **options):
    vertices, facets = cases.hill()
    return cases.cutting_of(vertices + np.array([0.0, 0.0, rise]), facets, tool, **options)


def with_block(low, high, tool=None, rise=0.0):
    """The hill, raised, and a closed block from corner to corner."""
    vertices, facets = cases.hill()
    vertices = vertices + np.array([0.0, 0.0, rise])
    box = trimesh.creation.box(bounds=[low, high])
    both = np.concatenate([facets, len(vertices) + np.asarray(box.faces)])
    return cases.cutting_of(np.concatenate([vertices, np.asarray(box.vertices)]), both, tool)


def moments(case, every=1, parts=2):
    """Tips and axes of the program in the workpiece frame, at rows and parts of the way between them."""
    program, machine = case.program, case.machine
    b = Interpolant.through(program.legs, program.period, program.interpolation).bernstein[::every]
    n, t = b.shape[-1] - 1, np.arange(parts) / parts
    basis = np.array([[_choose(n, k) * x**k * (1 - x) ** (n - k) for k in range(n + 1)] for x in t])
    legs = np.einsum("nlk,tk->ntl", b, basis).reshape(-1, 5)
    position, direction = machine.robot.pose(legs, program.component)
    home = program.placement.inverse()
    return home.apply(position + machine.tool_length * direction), home.rotate(-direction)


def _choose(n, k):
    return [[1], [1, 1], [1, 2, 1], [1, 3, 3, 1]][n][k]


@pytest.fixture(params=["cubic", "linear"])
def good(request):
    return request.getfixturevalue(request.param)


@pytest.mark.parametrize("rise", [-2e-4, 0.0, 4e-5])
def test_the_depth_of_a_ball_is_proven_and_close(good, rise):
    """Against trimesh's nearest points from the ball's centre, at dense moments."""
    cutting = raised(rise)
    tips, axes = moments(good, every=7, parts=3)
    mesh = cutting.surface.mesh
    shape = trimesh.Trimesh(LARGE * mesh.vertices, mesh.faces, process=False)
    near = np.flatnonzero(tips[:, 2] < 6e-3)
    distance = trimesh.proximity.closest_point(shape, LARGE * (tips + cases.BALL * axes)[near])[1] / LARGE
    deepest = cases.BALL - distance.min()
    found = judged(good, cutting)
    assert found[CUTS].passed
    assert found[CUTS].unit == "mm"
    assert found[CUTS].bound == pytest.approx(0.05 + 0.02)
    most = max(found[CUTS].value, found[RAPIDS].value)
    assert deepest <= 1e-3 * most <= deepest + 5e-6 + 0.03 * (7e-5 - deepest)
    assert "proven bound for all times" in found[CUTS].method
    assert ("gap" in found[CUTS].method) == (rise < 0.0)


@given(st.floats(-1e-3, 1e-2))
def test_what_the_sweep_leaves_open_is_added(told):
    """A sweep is exact to its resolution and 1 %: no true depth may be above what is claimed of it."""
    true = told + RESOLUTION_M + 0.01 * max(told, 0.0)
    assert told + float(depth_resolution(told)) == pytest.approx(true, rel=1e-12)


@pytest.mark.parametrize("rise", [8e-5, 1e-3])
def test_a_toolpath_that_gouges_is_caught_by_that_alone(good, rise):
    """The program follows its toolpath perfectly: only the part tells that the toolpath is wrong."""
    assert failed(good, raised(rise)) == {CUTS, RAPIDS}
    found = judged(good, raised(rise))[CUTS]
    assert 0.07 < found.value <= 1e3 * rise + 1e-3
    assert "it may be deeper elsewhere" in found.method


def test_what_is_engraved_is_no_gouge(good):
    engraved = raised(2e-4, depth=2e-4)
    assert failed(good, engraved) == {RAPIDS}  # they begin and end on the surface here
    assert judged(good, engraved)[CUTS].bound == pytest.approx(0.22)
    assert judged(good, raised(-1e-4, depth=0.0))[CUTS].passed


@pytest.mark.parametrize(("rise", "passed"), [(2e-4, True), (2.9e-3, True), (3.2e-3, False)])
def test_depths_beyond_the_thickness_of_the_cutter_are_judged(cubic, rise, passed):
    """No point of the mesh is deeper in a ball than its radius; how deep the ball is in the part is told all the same.

    The ball is raised by 0.32 mm to tell it: what is nearer to the surface than that is known no better.
    """
    cutting = raised(rise, depth=cases.BALL)
    assert CUTS not in unjudged(cubic, cutting)
    found = judged(cubic, cutting)[CUTS]
    assert found.bound == pytest.approx(3.02)
    assert found.passed is passed
    if passed:
        assert found.value >= 1e3 * (rise - 3e-5) - 0.04 * 3.0  # the hill leans by 11 deg at most
        assert found.value <= 3.02
        assert "raised" in found.method
    assert judged(cubic, raised(2e-4, depth=cases.BALL - 3e-5))[CUTS].bound == pytest.approx(2.99)


def pushed(case, depth):
    """The tool pushed into the part along its axis, smoothly, in the middle of the first cut."""
    start, stop = case.toolpath.starts[1:3]
    first, last = (int(np.argmin(np.linalg.norm(case.tips - case.toolpath.tips[k], axis=1))) for k in (start, stop))
    middle = (first + last) // 2
    push = depth * np.exp(-(((np.arange(len(case.tips)) - middle) / 40.0) ** 2))
    tips = case.tips - push[:, None] * case.axes
    kind = case.program.interpolation
    program = cases.program_of(case.machine, tips, case.axes, lean=0.5 * cases.TILT, interpolation=kind)
    return replace(case, program=program), middle


def test_a_tip_pushed_into_the_part_is_caught(good):
    corrupted, middle = pushed(good, 1.5e-4)
    found = judged(corrupted, raised(0.0))
    assert {CUTS, "tip deviation"} <= {name for name, c in found.items() if not c.passed}
    assert found[RAPIDS].passed
    assert found[CUTS].where.segment == 1
    assert abs(found[CUTS].where.row - middle) < 120
    slight, _ = pushed(good, 4e-5)
    found = judged(slight, raised(0.0))
    assert found[CUTS].passed
    assert 0.04 <= found[CUTS].value < 0.044


def test_what_is_in_the_way_of_rapids_is_caught_by_their_claim(cubic):
    """A plate above all that is cut; only the last rapid rises so far."""
    found = judged(cubic, with_block([-0.03, -0.02, 0.0185], [0.03, 0.02, 0.0205]))
    assert {name for name, c in found.items() if not c.passed} == {RAPIDS}
    assert found[RAPIDS].bound == pytest.approx(0.02)
    assert found[RAPIDS].where.segment == 9


def test_a_fin_between_two_rows_is_caught():
    """A thin tool, rows three millimetres apart, and a fin that it passes through between two samples."""
    coarse = cases.good_case(interpolation="cubic")
    program = replace(coarse.program, legs=coarse.program.legs[::100], period=100 * cases.PERIOD)
    case, thin = replace(coarse, program=program), FlatEnd(1e-4, flute=2e-3)
    tips, _ = moments(case)
    cut = np.flatnonzero((np.abs(tips[:, 0]) < 6e-3) & (np.abs(tips[:, 1]) < 1e-4) & (tips[:, 2] < 4.2e-3))
    step = int(np.argmax(np.diff(tips[cut, 0])))
    left, right = tips[cut[step], 0], tips[cut[step + 1], 0]
    assert right - left > 8e-4
    middle = 0.5 * (left + right)
    assert np.abs(tips[:, 0] - middle).min() > 3e-4
    fin = with_block([middle - 1e-4, -1e-3, 3e-3], [middle + 1e-4, 1e-3, 5e-3], thin, rise=-1e-3)
    before, after = (judged(case, cutting)[CUTS] for cutting in (raised(-1e-3, thin), fin))
    assert before.passed, before
    assert not after.passed, after


def test_a_flute_counts_with_its_lean(cubic):
    """A wall beside the passes that the ball clears; the leaning flute above it does or does not."""
    tips, axes = moments(cubic, every=3, parts=1)
    heights = np.linspace(cases.BALL, 0.03, 28)
    across = np.sqrt(1.0 - axes[:, :1] ** 2)
    reach = ((tips[:, None] + heights[:, None] * axes[:, None])[..., 0] + cases.BALL * across).max()
    assert reach > (tips + cases.BALL * axes)[:, 0].max() + cases.BALL + 4e-4
    long = BallCutter(cases.BALL, flute=0.03)
    for wall, tool, caught in ((reach + 2e-4, long, False), (reach - 2e-4, long, True), (reach - 2e-4, None, False)):
        block = with_block([wall, -0.02, 0.0], [0.05, 0.02, 0.05], tool, rise=-1e-3)
        assert (CUTS in failed(cubic, block)) == caught


def test_a_cutter_that_begins_inside_is_caught(cubic):
    """Nothing of the surface ever comes near: what is inside stays inside."""
    box = trimesh.creation.box(bounds=[[-0.2, -0.2, -0.2], [0.2, 0.2, 0.2]])
    cutting = cases.cutting_of(np.asarray(box.vertices), np.asarray(box.faces))
    found = judged(cubic, cutting)
    assert not found[CUTS].passed
    assert found[CUTS].method == "the cutter is inside the part at the start"
    assert found[CUTS].bound == pytest.approx(0.07)
    assert (found[CUTS].where.row, found[CUTS].where.time_s) == (0, 0.0)


@pytest.mark.parametrize(
    ("most", "met", "words"),
    [
        (2e-4, True, "depth of the cutter in the part at this moment; it may be deeper elsewhere"),
        (np.inf, False, "not proven: the tool turns too far within half a period"),
        (2e-4, False, "proven bound for all times on the depth of the deepest mesh point inside the cutter: exact"),
        (-2e-4, False, "proven bound for all times on the smallest gap of the cutter (negative): exact"),
        (0.0, False, "proven bound for all times on the smallest gap of the cutter (negative): exact"),
    ],
)
def test_a_depth_is_told_for_what_it_is(monkeypatch, cubic, most, met, words):
    monkeypatch.setattr("pentapod.verify.claims.gouge.gouge_bound", lambda *_, **__: GougeBound(most, 0, attained=met))
    assert judged(cubic, cases.cutting_of(*cases.hill()))[CUTS].method.startswith(words)


def test_nothing_that_cuts_and_nothing_to_cut(cubic):
    jet = cases.cutting_of(*cases.hill(), StandOff(5e-3))
    assert not {CUTS, RAPIDS} & judged(cubic, jet).keys()
    strict = judged(cubic, jet, strict=True)
    assert strict[CUTS].passed
    assert strict[CUTS].method == "does not apply: the tool has no cutting part"
    assert not {CUTS, RAPIDS} & judged(cubic, None).keys()
    left = {"surface left on the region": "the surface to be machined is not given"}
    assert unjudged(cubic, None) == {**dict.fromkeys((CUTS, RAPIDS), "the mesh of the part is not given"), **left}


def test_a_negative_depth_is_bad_input():
    with pytest.raises(ArrayError, match="depth"):
        Cutting(raised(0.0).surface, (), -1e-6)


# The parts of the claim.


@pytest.fixture(scope="module")
def replay(cubic):
    return cases.replay_of(cubic, cutting=raised(0.0))


def test_rapids_are_the_chords_that_meet_rapids_alone(replay):
    """Each chord against each segment, on the arc length of the toolpath."""
    path, tolerance = replay.toolpath, replay.path_tolerance
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path.tilt_centres, axis=0), axis=1))])
    marked = rapid_chords(replay)
    chords = range(0, len(marked), 3)
    expected = []
    for k in chords:
        low, high = replay.match.arcs[k] - tolerance, replay.match.arcs[k + 1] + tolerance
        # Whether a segment is met that only touches there is decided by rounding: such chords are left out.
        begins, stops = arc[path.starts[:-1]], arc[path.starts[1:]]
        sure = (np.abs(begins - high) > 1e-12).all() and (np.abs(stops - low) > 1e-12).all()
        met = np.flatnonzero((begins < high) & (stops > low))
        expected.append(all(path.segments[s].kind is SegmentKind.RAPID for s in met) if sure else None)
    known = np.array([value is not None for value in expected])
    assert known.mean() > 0.9
    found = marked[::3][known]
    assert np.array_equal(found, np.array(expected)[known].astype(bool))
    assert 0.1 < found.mean() < 0.9


@pytest.mark.parametrize(
    ("kind", "missing"), [(SegmentKind.CUT, "no rapid"), (SegmentKind.RAPID, "no cut and no link")]
)
def test_a_kind_that_is_missing_is_not_judged(replay, kind, missing):
    segments = tuple(replace(s, kind=kind, feed=cases.FEED) for s in replay.toolpath.segments)
    other = cases.same_motion(replay, toolpath=replace(replay.toolpath, segments=segments))
    assert gouge(other, rapid=kind is SegmentKind.CUT) == Idle(f"the program has {missing}")
    assert rapid_chords(other).all() == (kind is SegmentKind.RAPID)


def test_what_the_claims_say_is_allowed(cubic):
    found = judged(cubic, raised(0.0, depth=3e-5))
    assert found[RAPIDS].method.endswith("of the motion from them; allowed: 0.02 mm of path tolerance")
    assert found[CUTS].method.endswith("of path tolerance and 0.03 mm of engraving depth or gouge tolerance")


@pytest.mark.parametrize("lever", [0.0, 0.03])
def test_deviation_bounds_are_never_less_than_at_dense_moments(replay, cubic, lever):
    """Each moment against the nearest of many places of the straight stretch, tool and tilt centre together."""
    parts = 6
    tips, axes = moments(cubic, parts=parts)
    tilt_centres = tips + cases.BALL * axes
    ends = len(replay.tilt_centres) - 1
    starts = np.array([200, 2600, 6900, 7060, 7400, 7700, 8200, ends - 64])
    counts = np.array([64, 8, 64, 300, 1, 64, 64, 64])
    found = deviation_bounds(replay, Stretches(starts, starts + counts), lever)
    for k, (first, last) in enumerate(zip(starts, starts + counts, strict=True)):
        own = slice(first * parts // 2, last * parts // 2)
        start, end = (replay.tilt_centres[first], replay.axes[first]), (replay.tilt_centres[last], replay.axes[last])
        worst = 0.0
        for p, u in zip(tilt_centres[own], axes[own], strict=True):
            share = np.linspace(0.0, 1.0, 101)
            for _ in range(3):
                place = start[0] + share[:, None] * (end[0] - start[0])
                turned = cases.slerp(start[1], end[1], share)
                off = np.linalg.norm(place - p, axis=1), lever * np.linalg.norm(turned - u, axis=1)
                nearest = int(np.argmin(off[0] ** 2 + off[1] ** 2))
                around = share[max(nearest - 1, 0)], share[min(nearest + 1, 100)]
                share = np.linspace(*around, 101)
            worst = max(worst, off[0][nearest] + off[1][nearest])
        turn = lever * np.linalg.norm(end[1] - start[1])
        assert found[k] >= worst - 1e-6 * (np.linalg.norm(end[0] - start[0]) + turn) - 1e-10
        assert found[k] <= 1.5 * worst + 1e-7 + 0.1 * turn


@pytest.mark.parametrize(("swing", "bounded"), [(0.8, True), (2.0, False), (3.1, False)])
def test_an_axis_that_swings_out_and_back_is_bounded_or_said_not_to_be(swing, bounded):
    """A stretch that ends as it began, the axis far away in between: a body's end is off by the chord of that swing."""
    lean = swing * np.array([0.0, 0.5, 1.0, 0.5, 0.0])
    axes = np.stack([np.sin(lean), 0.0 * lean, np.cos(lean)], axis=1)
    swung = cases.measured(cases.toolpath_of(cases.strokes()[:1]), np.zeros((5, 3)), axes)
    found = deviation_bounds(swung, Stretches(np.array([0]), np.array([4])), 0.03)[0]
    assert np.isfinite(found) == bounded
    assert found >= 0.06 * np.sin(0.5 * swing)


def test_stretches_are_cut_without_gaps():
    marked = np.zeros(300, dtype=bool)
    marked[3:131], marked[200:201], marked[290:] = True, True, True
    pieces = Stretches.along(marked).cut(64)
    assert pieces.starts.tolist() == [3, 67, 200, 290]
    assert pieces.ends.tolist() == [67, 131, 201, 300]
    again = pieces.where(np.array([1, 3])).cut(8)
    assert again.starts.tolist() == [*range(67, 131, 8), 290, 298]
    assert again.ends.tolist() == [*range(75, 132, 8), 298, 300]


def test_what_is_far_away_counts_as_a_millimetre(cubic):
    found = judged(cubic, raised(-5e-3))
    assert -1.0 < found[CUTS].value < -0.95
    assert -1.0 < found[RAPIDS].value < -0.95
