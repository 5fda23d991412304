"""A good program passes; each corrupted one fails, and by the right claim."""

import json
from dataclasses import replace

import numpy as np
import pytest
import replay_cases as cases
from scipy.interpolate import make_interp_spline

from pentapod.base.errors import ArrayError, InputError, ProgramError
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics import Component
from pentapod.program import Switch, quantised, write_csv
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath
from pentapod.verify import CLAIMS, Replay, Specification, verify, write_verdict
from pentapod.verify import judge as judge_module

GEOMETRY = {"tip deviation", "toolpath covered"}
CUTTING = cases.cutting_of(*cases.hill())
NOT_ASKED = {
    "legs, spindle and tool clear of the surroundings",  # one claim where nobody told what is there
    "component as asked",
    "process data",
    "compensation as asked",
    "every cut is made in one set-up",
}
FEEDS = {"feed on cuts", "feed on links", "rapid rate"}


def judge(case, **changes):
    given = {**cases.ASKED, "cutting": CUTTING, **changes}
    return verify(case.program, case.machine, case.toolpath, **given)


def failed(verdict):
    judged = all(c.passed for c in verdict.certificates)
    assert verdict.passed == (judged and all(entry.waived for entry in verdict.not_judged))
    return {c.claim for c in verdict.certificates if not c.passed}


def with_legs(case, legs):
    return replace(case, program=replace(case.program, legs=quantised(legs)))


def with_poses(case, tips, axes, **options):
    given = {"lean": 0.5 * cases.TILT, "interpolation": case.program.interpolation, **options}
    return replace(case, program=cases.program_of(case.machine, tips, axes, **given))


def on_machine(case, **changes):
    """The same rows, sent out for a machine that differs."""
    machine = replace(case.machine, **changes)
    provenance = replace(case.program.provenance, machine_digest=machine.digest)
    return replace(case, machine=machine, program=replace(case.program, provenance=provenance))


def rows_of(case, waypoint):
    """The row whose tip is nearest to a waypoint of the toolpath."""
    return int(np.argmin(np.linalg.norm(case.tips - case.toolpath.tips[waypoint], axis=1)))


def middle_of_first_cut(case):
    return rows_of(case, case.toolpath.starts[1] + 30)


@pytest.fixture(params=["cubic", pytest.param("linear", marks=pytest.mark.slow)])
def good(request):
    return request.getfixturevalue(request.param)


LOWER_BOUNDS = {
    *("component kept, w", "component kept, S", "legs not too short", "platform joints not too closed"),
    *("clearance between legs and shaft", "lowest feed", "legs clear of the tool body", "legs clear of the part"),
    *("spindle clear of the part", "tool body clear of the part"),
}
"""Claims whose values must not fall below their bounds; each is one of most programs."""


def test_bounds_are_told_as_what_they_are(good):
    """Also where a value is on the bound, or beyond it by what is tolerated; a leg that is moved changes no sense."""
    for legs in (good.program.legs, good.program.legs + 0.02):
        for found in judge(with_legs(good, legs)).certificates:
            if found.value is not None and found.bound is not None:
                assert found.sense == ("at least" if found.claim in LOWER_BOUNDS else "at most"), found.claim


def test_good_program_passes_every_claim(good):
    verdict = judge(good)
    assert failed(verdict) == set()
    of_the_tool = {"tip acceleration", "tip jerk", "axis velocity", "axis acceleration"}  # this machine limits none
    # It has no guides either, the path nowhere stops and covers no region, and no lowest feed is asked for.
    idle = of_the_tool | {
        "guides within their travel",
        *("component kept, roll", "component kept", "passive limb within its ranges"),  # of robots of other families
        "surface left on the region",
        "exact stops",
        "dwells",
        "lowest feed",
        *("leg forces", "continuous leg forces"),  # of machines that limit them
        "deflection",  # of machines that give a stiffness
        *NOT_ASKED,
    }
    assert {c.claim for c in verdict.certificates} == {claim.name for claim in CLAIMS} - idle
    assert all(c.method for c in verdict.certificates)


@pytest.mark.parametrize("lean", [0.0, 0.99 * cases.TILT])
def test_any_lean_within_the_cone_passes(lean):
    assert judge(cases.good_case(lean=lean)).passed


def test_dwell_that_nothing_asks_for_is_caught(good):
    stop = rows_of(good, good.toolpath.starts[4])
    legs = good.program.legs
    dwelling = np.concatenate([legs[: stop + 1], np.repeat(legs[stop : stop + 1], 300, axis=0), legs[stop + 1 :]])
    assert failed(judge(with_legs(good, dwelling))) == {"no unasked stop"}


@pytest.mark.parametrize("leg", range(5))
def test_leg_shifted_by_50_micrometres(good, leg):
    legs = good.program.legs.copy()
    legs[:, leg] += 50e-6
    assert failed(judge(with_legs(good, legs))) >= {"tip deviation"}


def test_two_rows_swapped(good):
    row, legs = middle_of_first_cut(good), good.program.legs.copy()
    legs[[row, row + 1]] = legs[[row + 1, row]]
    assert failed(judge(with_legs(good, legs))) >= {"leg accelerations"}


def test_row_lost(good):
    legs = np.delete(good.program.legs, middle_of_first_cut(good), axis=0)
    assert failed(judge(with_legs(good, legs))) == {"leg accelerations", "leg jerks", "feed on cuts"}


@pytest.mark.parametrize("name", ["-+", *(pytest.param(name, marks=pytest.mark.slow) for name in ("+-", "--"))])
def test_mirror_component(good, name):
    mirrored = replace(good, program=replace(good.program, component=Component.parse(name)))
    assert failed(judge(mirrored)) >= {"tip deviation", "starts at the toolpath's start"}


def test_wrong_machine_by_digest(good):
    other = replace(good.program.provenance, machine_digest="0123456789abcdef")
    assert failed(judge(replace(good, program=replace(good.program, provenance=other)))) == {"machine"}


def test_wrong_machine_by_geometry(good):
    base = np.array(good.machine.robot.base)
    base[3, 0] += 200e-6
    pentapod = type(good.machine.robot).quadratic(base, good.machine.robot.delta)
    other = replace(good.machine, robot=pentapod)
    assert failed(judge(replace(good, machine=other))) >= {"machine", "tip deviation"}


def test_wrong_job(good):
    assert failed(judge(good, job_digest="job-2")) == {"job"}


def unjudged(verdict):
    return {entry.claim for entry in verdict.not_judged}


def test_program_of_a_job_is_not_judged_without_one(good):
    verdict = judge(good, job_digest=None)
    assert "job" not in {c.claim for c in verdict.certificates}
    assert unjudged(verdict) == {"job"}
    assert not verdict.passed
    assert verdict.answer == "FAILED: 1 not judged"


def test_program_without_a_job_is_asked_for_none(good):
    source = replace(good.program.provenance, job_digest="")
    verdict = judge(replace(good, program=replace(good.program, provenance=source)), job_digest=None)
    assert verdict.passed
    assert verdict.not_judged == ()


@pytest.mark.parametrize(
    ("untold", "claims"),
    [
        ({"cutting": None}, {"gouge on cuts and links", "gouge on rapids", "surface left on the region"}),
        ({"constraints": None}, {"placement as the job asks"}),
        ({"collision_world": None}, {"legs, spindle and tool clear of the surroundings"}),
    ],
)
def test_what_was_not_told_is_not_judged_and_does_not_pass(good, untold, claims):
    verdict = judge(good, **untold)
    assert failed(verdict) == set()
    assert unjudged(verdict) == claims
    assert not verdict.passed
    waived = judge(good, **untold, waived=tuple(claims))
    assert waived.passed
    assert waived.not_judged == tuple(replace(entry, waived=True) for entry in verdict.not_judged)
    assert waived.answer == f"passed ({len(claims)} waived)"


def test_a_waiver_does_not_excuse_what_was_judged(good):
    assert failed(judge(good, job_digest="job-2", waived=("job",))) == {"job"}


def test_waiving_a_claim_that_does_not_exist_is_bad_input(good):
    with pytest.raises(InputError, match='did you mean "leg jerks"'):
        judge(good, waived=("leg jerk",))


def test_guides_for_a_machine_that_has_none(good):
    guided = replace(good.program, rail_positions=(0.0, 0.0, 0.0, 0.0, 0.0))
    assert failed(judge(replace(good, program=guided))) == {"guides within their travel"}


def test_feed_5_percent_over_everywhere(good):
    # Planned at 98 % of every feed.
    faster = replace(good.program, period=good.program.period * 0.98 / 1.05)
    assert failed(judge(replace(good, program=faster))) == {*FEEDS, "controller"}


@pytest.mark.parametrize(
    ("kind", "claim"), [("cut", "feed on cuts"), ("link", "feed on links"), ("rapid", "rapid rate")]
)
def test_feed_5_percent_over_on_one_kind(good, kind, claim):
    def hurried(stroke):
        speed = min(stroke.feed, cases.RAPID) * 1.05 / 0.98
        return replace(stroke, feed=speed) if stroke.kind == kind else stroke

    cap = cases.RAPID * (1.1 if kind == "rapid" else 1.0)
    tips, axes = cases.timed([hurried(stroke) for stroke in cases.strokes()], cap=cap)
    assert failed(judge(with_poses(good, tips, axes))) == {claim}


def test_feed_allowance_is_small(good):
    faster = replace(good.program, period=good.program.period * 0.98 / 1.004)
    assert failed(judge(replace(good, program=faster))) == {"feed on cuts", "controller"}


def test_tilt_beyond_the_cone(good):
    leaned = with_poses(good, good.tips, good.axes, lean=cases.TILT + np.radians(0.15))
    assert failed(judge(leaned)) == {"axis deviation"}


def test_turn_on_the_spot_left_out(good):
    """The toolpath nods by 20° while the tilt centre stands; the program does not."""
    k = int(good.toolpath.starts[1])
    tip, axis = good.toolpath.tips[k], good.toolpath.axes[k]
    nod = cases.turn(tip, axis, cases.tilted_axes(axis[None], np.radians(20.0))[0], 9).pose(np.linspace(0, 1, 9))
    link = Segment(SegmentKind.LINK, *(np.concatenate([x, x[-2::-1]]) for x in nod), cases.LINK_FEED)
    first, *others = good.toolpath.segments
    nodding = Toolpath((first, link, *others), good.toolpath.tilt_centre)
    assert failed(judge(replace(good, toolpath=nodding))) == {"axis deviation"}


def through(case, position, direction):
    legs = case.machine.robot.leg_lengths(position, direction)
    return judge(with_legs(case, legs))


def test_path_through_s_zero(good):
    robot, delta = good.machine.robot, good.machine.robot.delta
    position, direction = robot.pose(good.program.legs[0], good.program.component)
    u, _, w = direction
    normal = np.array([delta * w, 0.0, 1.0 - delta * u])
    reduced = position + robot.offsets[2] * direction - np.append(robot.base[2], 0.0)
    depth = reduced @ normal / (normal @ normal)
    way = np.linspace(0.0, 1.1, 4000)[:, None]
    names = failed(through(good, position - way * depth * normal, np.broadcast_to(direction, (4000, 3))))
    assert "component kept, S" in names
    assert "component kept, w" not in names


def test_path_through_w_zero(good):
    position, direction = good.machine.robot.pose(good.program.legs[0], good.program.component)
    angle = np.linspace(0.0, 0.55 * np.pi, 4000)[:, None]
    side = np.array([0.0, 1.0, 0.0]) - direction[1] * direction
    side /= np.linalg.norm(side)
    names = failed(
        through(good, np.broadcast_to(position, (4000, 3)), np.cos(angle) * direction + np.sin(angle) * side)
    )
    assert "component kept, w" in names


def test_no_pose_at_all(good):
    legs = good.program.legs.copy()
    legs[1000] = 0.02
    verdict = judge(with_legs(good, legs))
    assert failed(verdict) >= {"component kept, S", "tip deviation", "axis deviation", "legs not too short"}
    write = json.dumps(verdict.to_dict(), allow_nan=False)
    assert "NaN" not in write


def spark_out():
    """Three passes over the same line: forth, back, forth."""
    lift = cases.straight(SegmentKind.RAPID, np.inf, (0.0, 0.0, 0.02), (0.0, 0.0, 4e-3), np.array([0.0, 0.0, 1.0]))
    forth, back = cases.cut(0.0, 0.0, 0.01), cases.cut(0.0, 0.01, 0.0)
    return lift, forth, back


def test_skipped_passes_on_the_same_line(good):
    lift, forth, back = spark_out()
    tips, axes = cases.timed([lift, forth])
    all_three = replace(good, toolpath=cases.toolpath_of([lift, forth, back, forth]))
    assert failed(judge(with_poses(all_three, *cases.timed([lift, forth, back, forth])))) == set()
    assert failed(judge(with_poses(all_three, tips, axes))) == {"toolpath covered"}


def test_skipped_pass_of_a_raster(good):
    parts = cases.strokes()
    start = parts[1].pose(np.ones(1))
    stop = parts[4].pose(np.ones(1))
    over = cases.straight(SegmentKind.RAPID, np.inf, start[0][0], stop[0][0], start[1][0], stop[1][0])
    tips, axes = cases.timed([*parts[:2], over, *parts[5:]])
    assert failed(judge(with_poses(good, tips, axes))) >= {"toolpath covered"}


def test_loop_added(good):
    """The program is always on the toolpath, but goes back and forth once more than asked."""
    lift, forth, back = spark_out()
    once = replace(good, toolpath=cases.toolpath_of([lift, forth]))
    assert failed(judge(with_poses(once, *cases.timed([lift, forth, back, forth])))) >= {"tip deviation"}


def processed(case):
    """The case with coolant from its first cut on, and a laser that is on in its cuts."""
    times = Replay(case.program, Specification(case.machine, case.toolpath, **cases.ASKED)).match.times
    starts = np.rint(0.5 * times[case.toolpath.starts]).astype(int).tolist()
    power, segments = np.zeros(len(case.program.legs)), list(case.toolpath.segments)
    for k, segment in enumerate(segments):
        share = 0.5 * (segment.kind is SegmentKind.CUT)
        power[starts[k] : starts[k + 1]] = share
        segments[k] = replace(segment, words=(*(("M8",) if k == 1 else ()), f"M67 E0 Q{share:g}"))
    program = replace(case.program, switches=(Switch(starts[1], ("M8",)),), laser_power=power)
    return replace(case, program=program, toolpath=replace(case.toolpath, segments=tuple(segments)))


def process_data(case):
    return next(each for each in judge(case).certificates if each.claim == "process data")


def test_process_data_as_the_toolpath_says_pass_and_others_fail(linear):
    case = processed(linear)
    found = process_data(case)
    assert found.passed, found.method
    assert found.value < found.bound
    row = case.program.switches[0].row
    late = (Switch(row + 300, ("M8",)),)
    on = np.full(len(case.program.legs), 0.5)
    for wrong in ({"switches": ()}, {"switches": late}, {"laser_power": None}, {"laser_power": on}):
        assert not process_data(replace(case, program=replace(case.program, **wrong))).passed, wrong


def test_reversed_path(good):
    names = failed(judge(with_legs(good, good.program.legs[::-1])))
    assert names >= {"starts at the toolpath's start", "ends at the toolpath's end", *GEOMETRY}


def test_wrong_placement(good):
    shift = RigidTransform(np.eye(3), np.array([0.0, 100e-6, 0.0]))
    moved = replace(good.program, placement=good.program.placement @ shift)
    names = failed(judge(replace(good, program=moved)))
    assert names >= {"starts at the toolpath's start", "ends at the toolpath's end", *GEOMETRY}
    # A stop that lies off the path is far from what asks for it.
    assert names <= {"starts at the toolpath's start", "ends at the toolpath's end", "no unasked stop", *GEOMETRY}


def made_for_longer_tool(case, longer):
    """The rows of a program made for a tool that is longer, beside the machine with the job's."""
    made = cases.good_case(0.5 * cases.TILT, case.program.interpolation, longer=longer)
    return replace(case, program=replace(made.program, provenance=case.program.provenance))


@pytest.mark.parametrize(("longer", "words"), [(3e-5, "0.030 mm longer"), (-1e-3, "1.000 mm shorter")])
def test_a_tool_of_another_length_is_told(good, longer, words):
    verdict = judge(made_for_longer_tool(good, longer))
    found = {c.claim: c for c in verdict.certificates}["tip deviation"]
    assert not found.passed
    assert found.value == pytest.approx(1e3 * abs(longer), abs=0.5e-3)
    assert found.method.startswith(f"the program seems to be made for a tool that is {words} than the job's")


@pytest.mark.parametrize("shift", [[0.0, 1e-4, 0.0], [3e-3, -2e-3, 1e-4]])
def test_a_part_that_stands_elsewhere_is_told(good, shift):
    placement = good.program.placement
    moved = RigidTransform(np.eye(3), -np.array(shift)) @ placement
    verdict = judge(replace(good, program=replace(good.program, placement=moved)))
    found = {c.claim: c for c in verdict.certificates}["tip deviation"]
    x, y, z = 1e3 * np.array(shift)
    assert not found.passed
    assert found.value == pytest.approx(1e3 * np.linalg.norm(shift), abs=0.5e-3)
    assert found.method.startswith(
        f"the program seems to be made for a part that is [{x:.3f}, {y:.3f}, {z:.3f}] mm elsewhere"
    )


def test_no_cause_is_told_where_the_tip_is_off_at_one_place(good):
    legs = good.program.legs.copy()
    legs[middle_of_first_cut(good)] += 50e-6
    found = {c.claim: c for c in judge(with_legs(good, legs)).certificates}["tip deviation"]
    assert not found.passed
    assert "seems to be made for" not in found.method


def test_placement_far_off(good):
    shift = RigidTransform(np.eye(3), np.array([0.0, 0.3, 0.0]))
    moved = replace(good.program, placement=good.program.placement @ shift)
    verdict = judge(replace(good, program=moved))
    found = {c.claim: c for c in verdict.certificates}
    assert found["tip deviation"].value == pytest.approx(300.0, abs=10.0)


def test_program_ends_early(good):
    names = failed(judge(with_legs(good, good.program.legs[:-120])))
    assert names >= {"ends at rest", "ends at the toolpath's end", "toolpath covered"}


def test_not_at_rest_at_the_end(good):
    """All the way, but the last stroke does not slow down."""
    legs = good.program.legs
    last = rows_of(good, good.toolpath.starts[-2])
    tips, axes = good.tips[last:], good.axes[last:]
    peak = int(np.argmax(np.linalg.norm(np.diff(tips, axis=0), axis=1)))
    step = np.linalg.norm(tips[peak + 1] - tips[peak])
    rest = np.linalg.norm(tips[-1] - tips[peak])
    f = np.linspace(0.0, 1.0, int(np.ceil(rest / step)) + 1)[:, None]
    hasty = tips[peak] + f * (tips[-1] - tips[peak])
    tips = np.concatenate([good.tips[: last + peak], hasty])
    axes = np.concatenate([good.axes[: last + peak], np.repeat(axes[-1:], len(hasty), axis=0)])
    assert len(tips) < len(legs)
    names = failed(judge(with_poses(good, tips, axes)))
    # The spline overshoots where it is stopped that hard; the rows themselves are not too fast.
    assert names - {"rapid rate"} == {"ends at rest", "leg accelerations", "leg jerks"}


def test_not_at_rest_at_the_start(good):
    # From inside the plunge: the toolpath's start is missed, too.
    names = failed(judge(with_legs(good, good.program.legs[100:])))
    assert names >= {"starts at rest", "starts at the toolpath's start", "leg accelerations"}


def test_spike_of_3_micrometres_in_one_row(good):
    legs = good.program.legs.copy()
    legs[rows_of(good, good.toolpath.starts[2]) + 5, 3] += 3e-6
    assert failed(judge(with_legs(good, legs))) == {"leg accelerations", "leg jerks"}


def test_hum_of_3_micrometres_in_a_dwell(good):
    """150 Hz, growing and fading: 3 of 5 m/s², slow, within tolerance; only the jerk, near 2.7e6 mm/s³, tells."""
    stop = rows_of(good, good.toolpath.starts[4])
    legs = good.program.legs
    t = np.arange(300) * good.program.period
    humming = np.repeat(legs[stop : stop + 1], 300, axis=0)
    humming[:, 2] += 3.4e-6 * np.sin(np.pi * np.arange(300) / 299) ** 4 * np.sin(2 * np.pi * 150.0 * t)
    verdict = judge(with_legs(good, np.concatenate([legs[: stop + 1], humming, legs[stop + 1 :]])))
    assert failed(verdict) == {"leg jerks", "no unasked stop"}
    found = next(c for c in verdict.certificates if c.claim == "leg jerks")
    assert found.value == pytest.approx(1e3 * 3.4e-6 * (2 * np.pi * 150.0) ** 3, rel=0.15)
    assert found.where.row == pytest.approx(stop + 150, abs=10)
    assert found.method.startswith("leg 3")


def test_ripple_beyond_the_jerk_limit_at_a_short_period(cubic):
    """At 0.1 ms rounding alone may make 120 m/s³ of jerk: that is no leave to exceed the limit by as much."""
    fine, limit = 1e-4, float(cubic.machine.legs.max_jerk[2])
    t = np.arange(len(cubic.program.legs)) * cubic.program.period
    stop = 10 * rows_of(cubic, cubic.toolpath.starts[4])
    legs = make_interp_spline(t, cubic.program.legs)(np.arange(10 * (len(t) - 1) + 1) * fine)
    ripple = np.repeat(legs[stop : stop + 1], 3000, axis=0)
    rows, pulse = np.arange(3000), 2 * np.pi * 100.0
    ripple[:, 2] += (limit + 40.0) / pulse**3 * np.sin(np.pi * rows / 2999) ** 4 * np.sin(pulse * rows * fine)
    rippled = with_legs(cubic, np.concatenate([legs[: stop + 1], ripple, legs[stop + 1 :]]))
    machine = replace(cubic.machine, controller=replace(cubic.machine.controller, period=fine))
    source = replace(rippled.program.provenance, machine_digest=machine.digest)
    program = replace(rippled.program, period=fine, provenance=source)
    verdict = judge(replace(rippled, program=program, machine=machine))
    assert "leg jerks" in failed(verdict)
    found = next(c for c in verdict.certificates if c.claim == "leg jerks")
    assert found.method.startswith("leg 3")
    assert found.where.row == pytest.approx(stop + 1500, abs=100)
    assert 1.0 < found.value / found.bound < 1.0 + 120.0 / limit


def test_bulge_off_the_path(good):
    """The axis-aligned detour of 60 µm is slow and smooth: only the deviation tells."""
    row = middle_of_first_cut(good)
    bump = 60e-6 * np.exp(-(((np.arange(len(good.tips)) - row) / 60.0) ** 2))
    names = failed(judge(with_poses(good, good.tips + bump[:, None] * np.array([0.0, 0.0, 1.0]), good.axes)))
    assert "tip deviation" in names
    assert not names - GEOMETRY


def extremes(case):
    return {c.claim: c for c in judge(case).certificates}


@pytest.mark.parametrize(
    ("claim", "name", "sign", "slack", "part"),
    [
        ("legs not too long", "max_length", -1, 1e-6, "legs"),
        ("legs not too short", "min_length", 1, 1e-6, "legs"),
        ("leg rates", "max_velocity", -1, 2e-3, "legs"),
        ("leg accelerations", "max_acceleration", -1, 2e-3, "legs"),
        ("leg jerks", "max_jerk", -1, 2e-3, "legs"),
        ("base joint cones", "base_cone", -1, 1e-5, "joints"),
    ],
)
def test_limit_of_the_machine_exceeded(good, claim, name, sign, slack, part):
    """With the limit just beyond what the program needs it passes; just before, that claim fails alone."""
    scale = {"mm": 1e-3, "mm/s": 1e-3, "mm/s²": 1e-3, "mm/s³": 1e-3, "deg": np.pi / 180}
    found = extremes(good)[claim]
    needed = found.value * scale[found.unit]
    relative = slack if name in {"max_velocity", "max_acceleration", "max_jerk"} else slack / needed
    for wide, expected in ((1 - sign * relative, set()), (1 + sign * relative, {claim})):
        limits = replace(getattr(good.machine, part), **{name: np.full(5, needed * wide)})
        tight = on_machine(good, **{part: limits})
        # A smaller greatest acceleration also means a slower step from rest.
        assert failed(judge(tight)) - ({"starts at rest", "ends at rest"} - {claim}) == expected


@pytest.mark.parametrize("side", [0, 1])
def test_platform_joint_range_exceeded(good, side):
    claim = ("platform joints not too closed", "platform joints not too open")[side]
    needed = np.radians(extremes(good)[claim].value)
    for wide, expected in ((1e-5, set()), (-1e-5, {claim})):
        limits = np.array(good.machine.joints.platform_range)
        limits[:, side] = needed + (wide if side else -wide)
        joints = replace(good.machine.joints, platform_range=limits)
        assert failed(judge(on_machine(good, joints=joints))) == expected


def test_bodies_touch(good):
    free = 1e-3 * extremes(good)["clearance between legs and shaft"].value
    assert free > 1e-3
    for more, expected in ((-1e-4, set()), (1e-3, {"clearance between legs and shaft"})):
        bodies = replace(good.machine.bodies, leg_radius=good.machine.bodies.leg_radius + 0.5 * free + more)
        names = failed(judge(on_machine(good, bodies=bodies)))
        assert names == expected


# Files.


def test_file_passes_like_the_program(good, tmp_path):
    path = write_csv(good.program, tmp_path / "program.csv")
    verdict = verify(path, good.machine, good.toolpath, **cases.ASKED, cutting=CUTTING)
    assert verdict.passed
    assert verdict.certificates[0].claim == "readable"
    assert verdict.certificates[1:] == judge(good).certificates


def test_legs_that_are_in_memory_are_held_once_where_a_file_has_the_same(good, tmp_path, monkeypatch):
    path, held = write_csv(good.program, tmp_path / "program.csv"), []
    monkeypatch.setattr(judge_module, "Replay", lambda program, *_: held.append(program) or 1 // 0)
    legs = good.program.legs.copy()
    legs[7, 0] += 1e-8
    others = (good.program, replace(good.program, legs=legs), None)
    for other in others:
        with pytest.raises(ZeroDivisionError):
            judge_module.judged(path, Specification(good.machine, good.toolpath, **cases.ASKED), in_memory=other)
    assert [program.legs is good.program.legs for program in held] == [True, False, False]
    assert all(np.array_equal(program.legs, good.program.legs) for program in held)


def spoil_nan(lines):
    fields = lines[2000].split(",")
    return [*lines[:2000], ",".join([*fields[:3], "nan", *fields[4:]]), *lines[2001:]]


SPOILT = {
    "NaN": spoil_nan,
    "row lost": lambda lines: lines[:2000] + lines[2001:],
    "rows swapped": lambda lines: [*lines[:2000], lines[2001], lines[2000], *lines[2002:]],
    "truncated after a row": lambda lines: lines[:-50],
    "truncated within a row": lambda lines: [*lines[:-50], lines[-50][:20]],
    "header only": lambda lines: [line for line in lines if line.startswith("#")],
    "column lost": lambda lines: [line.rsplit(",", 1)[0] for line in lines],
    "a word": lambda lines: [*lines[:2000], lines[2000].replace(",", ",x", 1), *lines[2001:]],
    "empty": lambda lines: [],
}


@pytest.mark.parametrize("name", SPOILT)
def test_malformed_file_is_a_verdict(linear, tmp_path, name):
    path = write_csv(linear.program, tmp_path / "program.csv")
    lines = path.read_text().splitlines()
    tail = "" if name == "truncated within a row" else "\n"
    path.write_text("\n".join(SPOILT[name](lines)) + tail)
    verdict = verify(path, linear.machine, linear.toolpath, **cases.TOLERANCES)
    assert failed(verdict) == {"readable"}
    assert "program.csv" in verdict.certificates[0].method


def test_unknown_keys_of_the_header_are_refused_by_name(linear, tmp_path):
    path = write_csv(linear.program, tmp_path / "program.csv")

    def verdict(**options):
        return verify(path, linear.machine, linear.toolpath, **cases.ASKED, cutting=CUTTING, **options)

    assert verdict(strict=True).passed
    path.write_bytes(path.read_bytes().replace(b"# rows", b"# spindle_rpm = 3\n# coolant = true\n# rows", 1))
    for refused in (verdict(strict=True), verdict()):
        assert failed(refused) == {"readable"}
        assert "program.csv:10:" in refused.certificates[0].method
        assert "spindle_rpm: unknown key in the header" in refused.certificates[0].method


def test_strict_verdict_says_what_does_not_apply(good):
    """Three passes without links: the claim about links is there, and says so."""
    lift, forth, back = spark_out()
    case = replace(good, toolpath=cases.toolpath_of([lift, forth, back, forth]))
    case = with_poses(case, *cases.timed([lift, forth, back, forth]))
    assert "feed on links" not in {c.claim for c in judge(case).certificates}
    verdict = judge(case, strict=True)
    assert [c.claim for c in verdict.certificates] == [claim.name for claim in CLAIMS]
    (links,) = (c for c in verdict.certificates if c.claim == "feed on links")
    assert links.passed
    assert links.method == "does not apply: the program has no link"


def test_binary_file_is_a_verdict(linear, tmp_path):
    path = tmp_path / "program.csv"
    path.write_bytes(bytes(range(256)) * 40)
    assert failed(verify(path, linear.machine, linear.toolpath, **cases.TOLERANCES)) == {"readable"}


def test_missing_file_is_bad_input(linear, tmp_path):
    with pytest.raises(ProgramError, match="no such file"):
        verify(tmp_path / "none.csv", linear.machine, linear.toolpath, **cases.TOLERANCES)


def test_nan_in_memory_is_bad_input(linear):
    legs = linear.program.legs.copy()
    legs[7, 2] = np.nan
    with pytest.raises(InputError):
        replace(linear.program, legs=legs)


@pytest.mark.parametrize("name", ["tilt", "path_tolerance", "axis_tolerance"])
@pytest.mark.parametrize("value", [-1.0, np.nan, np.inf])
def test_senseless_tolerance_is_bad_input(linear, name, value):
    with pytest.raises(ArrayError, match=name):
        judge(linear, **{name: value})


def test_verdict_file(linear, tmp_path):
    verdict = judge(linear)
    content = json.loads(write_verdict(verdict, tmp_path / "verdict.json").read_text(encoding="utf-8"))
    assert content == verdict.to_dict()
    assert content["passed"] is True
    assert [p.name for p in tmp_path.iterdir()] == ["verdict.json"]


def test_progress_is_told(linear):
    told = []
    judge(linear, progress=lambda stage, fraction, note="": told.append((stage, fraction)))
    assert told[-1] == ("verify", 1.0)
    assert [f for _, f in told] == sorted(f for _, f in told)
