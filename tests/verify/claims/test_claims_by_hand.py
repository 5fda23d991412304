"""What each claim says, number by number: value, bound, unit, place and words, recomputed by hand from the rows."""

from dataclasses import replace

import numpy as np
import pytest
import replay_cases as cases

from pentapod.cli.output import verdict_text
from pentapod.kinematics.families.reconfigurable import ReconfigurablePentapod
from pentapod.program import quantised
from pentapod.verify import CLAIMS, Certificate, Claim, NotJudged, Place, Verdict, verify, write_verdict
from pentapod.verify.claims.path_deviation import angle_bound, at_samples
from pentapod.verify.claims.provenance import guides
from pentapod.verify.replay.claim import Finding, Idle
from pentapod.verify.replay.interval_bounds import ComponentFindings, RunningMaximum


@pytest.fixture(scope="module")
def replay(linear):
    return cases.replay_of(linear, cutting=cases.cutting_of(*cases.hill()))


@pytest.fixture(scope="module")
def found(linear):
    verdict = verify(linear.program, linear.machine, linear.toolpath, **cases.TOLERANCES, job_digest="job-1")
    return {c.claim: c for c in verdict.certificates}


def worst(values):
    """Value, row and leg (from 1) of the largest of values (N, 5)."""
    row, leg = np.unravel_index(int(np.argmax(values)), values.shape)
    return values[row, leg], int(row), int(leg) + 1


@pytest.mark.parametrize(
    ("claim", "unit", "measure", "limit"),
    [
        ("legs not too short", "mm", lambda rows, _: -rows, "min_length"),
        ("legs not too long", "mm", lambda rows, _: rows, "max_length"),
        ("leg rates", "mm/s", lambda rows, h: np.abs(np.diff(rows, axis=0)) / h, "max_velocity"),
        (
            "leg accelerations",
            "mm/s²",
            lambda rows, h: np.abs(np.diff(rows[[0, *range(len(rows)), -1]], n=2, axis=0)) / h**2,
            "max_acceleration",
        ),
        (
            "leg jerks",
            "mm/s³",
            lambda rows, h: np.abs(np.diff(rows[[0, *range(len(rows)), -1]], n=3, axis=0)) / h**3,
            "max_jerk",
        ),
    ],
)
def test_legs_by_differences_of_the_rows(linear, found, claim, unit, measure, limit):
    """With lines between rows all extremes are differences of rows."""
    value, row, leg = worst(measure(linear.program.legs, linear.program.period))
    certificate = found[claim]
    assert certificate.value == pytest.approx(1e3 * abs(value), rel=1e-9)
    assert certificate.bound == pytest.approx(1e3 * getattr(linear.machine.legs, limit)[0])
    assert certificate.unit == unit
    assert certificate.method.startswith(f"leg {leg} is closest to its limit; ")
    assert "exact" in certificate.method or claim == "leg jerks"
    assert abs(certificate.where.row - row) <= 1
    assert certificate.where.time_s == pytest.approx(certificate.where.row * linear.program.period, abs=1e-9)


@pytest.mark.parametrize(
    ("claim", "sign"),
    [("base joint cones", 1), ("platform joints not too closed", -1), ("platform joints not too open", 1)],
)
def test_joints_by_angles_at_the_samples(linear, found, claim, sign):
    position, direction = linear.machine.robot.pose(linear.program.legs, linear.program.component)
    base = np.column_stack([linear.machine.robot.base, np.zeros(5)])
    legs = position[:, None] + linear.machine.robot.offsets[:, None] * direction[:, None] - base
    axes = linear.machine.joints.base_axes if "base" in claim else direction[:, None]
    cosine = (legs * axes).sum(axis=2) / np.linalg.norm(legs, axis=2) / np.linalg.norm(axes, axis=-1)
    value, row, leg = worst(sign * np.degrees(np.arccos(cosine)))
    certificate = found[claim]
    assert sign * certificate.value == pytest.approx(value, abs=0.02)
    assert sign * certificate.value >= value - 1e-9
    assert certificate.unit == "deg"
    assert f"joint of leg {leg} " in certificate.method
    assert "proven bound" in certificate.method
    assert abs(certificate.where.row - row) <= 1


def test_rest_at_both_ends(linear, found):
    legs, h = linear.program.legs, linear.program.period
    for claim, step, row in (("starts at rest", legs[1] - legs[0], 0), ("ends at rest", legs[-1] - legs[-2], -1)):
        certificate, leg = found[claim], int(np.argmax(np.abs(step)))
        assert certificate.value == pytest.approx(1e3 * abs(step[leg]) / h, rel=1e-9)
        assert certificate.bound == pytest.approx(1e3 * linear.machine.legs.max_acceleration[leg] * h)
        assert certificate.unit == "mm/s"
        assert f"leg {leg + 1} over the {'first' if row == 0 else 'last'} period" in certificate.method
        assert certificate.where.row == row % len(legs)


def test_ends_of_the_path(linear, found, replay):
    for claim, k in (("starts at the toolpath's start", 0), ("ends at the toolpath's end", -1)):
        distance = np.linalg.norm(replay.tilt_centres[k] - linear.toolpath.tilt_centres[k])
        assert found[claim].value == pytest.approx(1e3 * distance, rel=1e-6, abs=1e-12)
        assert found[claim].bound == pytest.approx(1e3 * cases.TOLERANCES["path_tolerance"])
        assert found[claim].where.row == (0 if k == 0 else len(linear.program.legs) - 1)


def test_deviations_by_their_parts(linear, found, replay):
    match, bounds = replay.match, replay.interval_bounds.deviations
    around = np.maximum(np.append(bounds, 0.0), np.append(0.0, bounds))
    deviation = match.distances + around
    tip = found["tip deviation"]
    assert tip.value == pytest.approx(1e3 * deviation.max(), rel=1e-9)
    assert tip.where.row == int(np.argmax(deviation)) // 2
    assert f"{1e6 * around[np.argmax(deviation)]:.2g} µm" in tip.method
    assert "3 mm from the tip" in tip.method
    chord = np.minimum(match.times.astype(int), len(bounds) - 1)
    covered = match.waypoint_distances + bounds[chord]
    cover = found["toolpath covered"]
    assert cover.value == pytest.approx(1e3 * covered.max(), rel=1e-9)
    assert cover.method.endswith(f"farthest: waypoint {np.argmax(covered)}")
    assert "not reached" not in cover.method
    axis = found["axis deviation"]
    assert np.degrees(match.angles.max()) <= axis.value <= np.degrees(match.angles.max()) + 2e-3
    assert axis.bound == pytest.approx(5.1)
    assert "tilt cone 5 deg and tolerance 0.1 deg" in axis.method


def test_waypoints_that_are_missed_are_counted(linear):
    """The whole toolpath 0.1 mm higher."""
    up = np.array([0.0, 0.0, 1e-4])
    segments = tuple(replace(segment, tips=segment.tips + up) for segment in linear.toolpath.segments)
    toolpath = type(linear.toolpath)(segments, linear.toolpath.tilt_centre)
    verdict = verify(linear.program, linear.machine, toolpath, **cases.TOLERANCES)
    (cover,) = (c for c in verdict.certificates if c.claim == "toolpath covered")
    assert cover.method.endswith(" waypoints are not reached")
    far = int(cover.method.split("; ")[-1].split(" ")[0])
    # But for those that it comes near while it goes straight up or down.
    assert 0.8 * len(toolpath.tips) <= far <= len(toolpath.tips)
    assert not cover.passed


@pytest.mark.parametrize("rise", [0.0, 1e-4])
def test_what_unit_vectors_may_turn_between_two_samples(rise):
    """An arc of the given height over its chord adds that much, at any angle."""
    for angle in (0.0, 0.1, 1.0, 3.0):
        raised = angle_bound(np.array([angle]), np.array([rise]), np.array([0.25]))[0] - 0.25
        apart = 2.0 * np.sin(0.5 * raised) - 2.0 * np.sin(0.5 * angle)
        assert apart == pytest.approx(rise, abs=1e-12)
    assert angle_bound(np.array([np.pi]), np.array([1.0]), np.array([0.0]))[0] == pytest.approx(np.pi)


def test_chords_that_meet_at_a_sample():
    assert at_samples(np.array([1.0, 3.0, 2.0])).tolist() == [1.0, 3.0, 3.0, 2.0]


def test_the_axis_is_bounded_between_coarse_samples():
    """Arcs that cross at right angles in the middle of one long chord: the bound is above what happens there."""
    own, path = 0.3, 0.2
    t = np.linspace(0.0, 1.0, 101)
    across = np.stack([np.sin(own * (t - 0.5)), 0 * t, np.cos(own * (t - 0.5))], axis=1)
    along = np.stack([0 * t, np.sin(path * (t - 0.5) + 0.4), np.cos(path * (t - 0.5) + 0.4)], axis=1)
    straight = across[0] * (1 - t[:, None]) + across[-1] * t[:, None]
    angles = np.arccos(np.clip((straight * along).sum(axis=1) / np.linalg.norm(straight, axis=1), -1, 1))
    ends = max(angles[0], angles[-1])
    rise = 0.25 * own**2 + 0.125 * path**2 + path**3 / 50.0
    assert angles.max() <= angle_bound(np.array([ends]), np.array([rise]), np.zeros(1))[0]


# Claims and verdicts as such.


def claim_of(finding, **options):
    return Claim("a claim", lambda _: finding, **options)


HELD = Finding(np.bool_(True), 1.0 / 3.0, np.inf, "mm", Place(), "by hand")


def test_a_claim_gives_plain_numbers(replay):
    certificate = claim_of(HELD)(replay)
    assert certificate == Certificate("a claim", True, 0.333333333333, None, "mm", Place(), "by hand")
    assert type(certificate.passed) is bool
    allowed = replace(HELD, value=2.0 / 3.0, bound=0.5, allowed=2.0 / 3.0)
    certificate = claim_of(allowed)(replay)
    assert (certificate.bound, certificate.allowed) == (0.5, 0.666666666667)
    assert certificate.is_lenient
    assert "(at most 0.5, 0.666667 allowed)" in verdict_text(Verdict((certificate,)))
    for other in (replace(allowed, value=0.5), replace(allowed, passed=False), replace(allowed, allowed=None)):
        assert not claim_of(other)(replay).is_lenient
        assert "allowed" not in verdict_text(Verdict((claim_of(other)(replay),)))
    low = claim_of(replace(HELD, value=0.4999, bound=0.5, at_least=True))(replay)
    assert "(at least 0.5)" in verdict_text(Verdict((low,)))
    for tiny in (1.5e-159, -1.5e-159):
        assert ": 0 deg" in verdict_text(Verdict((replace(low, value=tiny, unit="deg"),)))
    assert claim_of(Idle("nothing there"))(replay) == Idle("nothing there")


def test_what_a_strict_verdict_says_of_an_idle_claim():
    idle = claim_of(HELD).inapplicable(Idle("nothing there"))
    assert idle == Certificate("a claim", True, None, None, "", Place(), "does not apply: nothing there")


def test_what_was_not_judged_is_told_beside_the_claims():
    good, unknown = Certificate("a", True, None, None, "", Place(), ""), NotJudged("b", "not given")
    for waived, words in ((False, "FAILED: 1 not judged"), (True, "passed (1 waived)")):
        verdict = Verdict((good,), (replace(unknown, waived=waived),))
        assert verdict.passed == waived
        assert verdict.answer == words
        text = verdict_text(verdict).splitlines()
        assert text[-1] == f"verdict: {words}"
        assert text[-2].endswith("b: not judged: not given")
        assert ("waived" in text[-2]) == waived
        assert verdict.to_dict()["not_judged"] == [{"claim": "b", "why": "not given", "waived": waived}]
    failing = replace(good, passed=False)
    assert Verdict((good, failing), (unknown,)).answer == "FAILED: 1 of 2 claims, 1 not judged"
    assert Verdict((good, failing), (replace(unknown, waived=True),)).answer == "FAILED: 1 of 2 claims, 1 waived"


def test_claims_that_need_a_pose_or_a_proof_fail_without(linear):
    legs = linear.program.legs.copy()
    legs[1000] = 0.02
    broken = cases.replay_of(linear, replace(linear.program, legs=quantised(legs)))
    certificate = claim_of(HELD)(broken)
    assert not certificate.passed
    assert certificate.method == "not judged: the leg lengths have no pose at 3 of the samples"
    assert certificate.where.row == 999
    assert certificate.where.segment is None
    assert claim_of(HELD, needs_pose=False)(broken).passed
    unproven = claim_of(HELD, needs_pose=False, needs_proof=True)(broken)
    assert not unproven.passed
    assert unproven.value is None
    assert unproven.method.startswith("undecided: too near a singularity to prove the motion on ")
    assert unproven.where.row in (998, 999)


def test_component_answers(linear, found):
    for claim in ("component kept, w", "component kept, S"):
        assert found[claim].method.startswith("proven; component ++: ")
        assert "0.02 mm" in found[claim].method
    legs = linear.program.legs.copy()
    legs[1000] = 0.02
    broken = replace(linear.program, legs=quantised(legs))
    verdict = verify(broken, linear.machine, linear.toolpath, **cases.TOLERANCES)
    (refuted,) = (c for c in verdict.certificates if c.claim == "component kept, S")
    assert refuted.method.startswith("refuted: the leg lengths have no pose, first from 0.99")
    assert "2 intervals refuted" in refuted.method
    assert refuted.where.row == 999
    assert refuted.bound == 0.0


def test_component_findings_keep_the_first(linear):
    """Two blocks: in the second an interval has no pose."""
    legs = linear.program.legs[:40].copy()
    legs[30] = 0.02
    rows = np.stack([legs[:-1], legs[1:]], axis=-1)
    found, robot = ComponentFindings(), linear.machine.robot
    for first in (0, 20):
        ends = robot.pose(legs[first : first + 21], (1, 1))
        found.update(robot.prove(rows[first : first + 20], ends, (1, 1)), first)
    assert found.refuted == 2
    assert found.undecided == 0
    assert found.first_refuted is not None
    assert found.first_refuted[0] == 29
    assert 0.0 <= found.first_refuted[1] <= found.first_refuted[2] <= 1.0
    assert found.first_undecided is None


def test_extremes_over_blocks():
    extreme, values = RunningMaximum(), np.random.default_rng(1).integers(0, 9, (30, 2)).astype(float)
    for first in range(0, 30, 7):
        extreme.update(values[first : first + 7], first)
    assert extreme.values.tolist() == values.max(axis=0).tolist()
    assert extreme.at.tolist() == values.argmax(axis=0).tolist()


def test_a_verdict_without_claims_is_no_pass():
    good = Certificate("a", True, None, None, "", Place(), "")
    assert not Verdict(()).passed
    assert Verdict((good,)).passed
    assert not Verdict((good, replace(good, passed=False))).passed
    assert Verdict((good,)).to_dict()["certificates"][0]["where"] == {"time_s": None, "row": None, "segment": None}


@pytest.mark.parametrize("name", ["machine", "machine_digest"])
def test_either_name_or_digest_of_the_machine_is_enough_to_refuse(linear, name):
    source = replace(linear.program.provenance, **{name: "another"})
    verdict = verify(replace(linear.program, provenance=source), linear.machine, linear.toolpath, **cases.TOLERANCES)
    assert [c.claim for c in verdict.certificates if not c.passed] == ["machine"]


def test_zero_is_a_tolerance_of_angles_but_not_of_lengths(linear):
    given = {**cases.TOLERANCES, "tilt": 0.0, "axis_tolerance": 0.0}
    verdict = verify(linear.program, linear.machine, linear.toolpath, **given)
    assert "axis deviation" in {c.claim for c in verdict.certificates if not c.passed}
    with pytest.raises(Exception, match="path_tolerance"):
        verify(linear.program, linear.machine, linear.toolpath, **{**cases.TOLERANCES, "path_tolerance": 0.0})


# How much is allowed beyond a limit.


def judged(replay, name, machine=None, **changes):
    """Whether a claim holds on the same motion, judged on another machine or with other tolerances."""
    other = cases.same_motion(replay, machine=machine or replay.machine, **changes)
    (claim,) = (claim for claim in CLAIMS if claim.name == name)
    certificate = claim(other)
    assert certificate is not None
    return certificate.passed


@pytest.mark.parametrize(
    ("claim", "name", "allowed"),
    [
        ("leg rates", "max_velocity", 1e-3),
        ("leg accelerations", "max_acceleration", 1e-3),
        ("leg jerks", "max_jerk", 1e-3),
        ("starts at rest", "max_acceleration", 1e-3),
        ("ends at rest", "max_acceleration", 1e-3),
        ("legs not too long", "max_length", 0.0),
        ("legs not too short", "min_length", 0.0),
    ],
)
def test_allowance_on_limits_of_legs(replay, found, claim, name, allowed):
    per = replay.program.period if "rest" in claim else 1.0
    needed = found[claim].value / 1e3 / per
    sign = -1.0 if name == "min_length" else 1.0
    for share, holds in ((0.9 * allowed - 1e-9, True), (1.1 * allowed + 1e-6, False)):
        legs = replace(replay.machine.legs, **{name: np.full(5, needed / (1.0 + sign * share))})
        assert judged(replay, claim, replace(replay.machine, legs=legs)) is holds


@pytest.mark.parametrize(
    ("claim", "name", "side"),
    [
        ("base joint cones", "base_cone", None),
        ("platform joints not too closed", "platform_range", 0),
        ("platform joints not too open", "platform_range", 1),
    ],
)
def test_nothing_is_allowed_beyond_a_joint(replay, found, claim, name, side):
    joints, needed = replay.machine.joints, np.radians(found[claim].value)
    for wider, holds in ((1e-9, True), (-1e-9, False)):
        limit = np.array(getattr(joints, name))
        limit[... if side is None else (slice(None), side)] = needed + (-wider if side == 0 else wider)
        assert judged(replay, claim, replace(replay.machine, joints=replace(joints, **{name: limit}))) is holds


@pytest.mark.parametrize("leg", range(5))
@pytest.mark.parametrize(
    ("claim", "name", "extreme"),
    [
        ("leg rates", "max_velocity", "rates"),
        ("leg accelerations", "max_acceleration", "accelerations"),
        ("leg jerks", "max_jerk", "jerks"),
        ("legs not too long", "max_length", "longest"),
        ("legs not too short", "min_length", "shortest"),
    ],
)
def test_each_leg_is_held_to_its_own_limit(replay, claim, name, extreme, leg):
    """All legs have room but one, whose limit is 8 % too tight; that one is named, with its own numbers."""
    needed = np.abs(getattr(replay.interval_bounds, extreme).values)
    least = name == "min_length"
    limit = needed * (0.5 if least else 2.0)
    limit[leg] = needed[leg] * (1.08 if least else 1.0 / 1.08)
    machine = replace(replay.machine, legs=replace(replay.machine.legs, **{name: limit}))
    other = cases.same_motion(replay, machine=machine)
    (found,) = (claim_ for claim_ in CLAIMS if claim_.name == claim)
    certificate = found(other)
    assert not certificate.passed
    assert certificate.method.startswith(f"leg {leg + 1} is closest to its limit; ")
    assert certificate.value == pytest.approx(1e3 * needed[leg])
    assert certificate.bound == pytest.approx(1e3 * limit[leg])
    assert certificate.where.row == int(getattr(replay.interval_bounds, extreme).at[leg])


@pytest.mark.parametrize("claim", ["tip deviation", "toolpath covered"])
def test_allowance_on_the_path_tolerance(replay, found, claim):
    for share, holds in ((0.9e-3, True), (1.1e-3, False)):
        assert judged(replay, claim, path_tolerance=1e-3 * found[claim].value / (1.0 + share)) is holds


def test_allowance_on_the_axis_tolerance(replay, found):
    needed = np.radians(found["axis deviation"].value) - replay.specification.tilt
    assert needed < 0.0
    for share, holds in ((0.9e-3, True), (1.1e-3, False)):
        tolerance = np.radians(0.1)
        tilt = np.radians(found["axis deviation"].value) - tolerance * (1.0 + share)
        assert judged(replay, "axis deviation", tilt=tilt, axis_tolerance=tolerance) is holds


def test_bounds_for_all_times_are_undecided_where_the_motion_is_not_proven(replay):
    """One chord of which nothing is proven: every claim that speaks of the time between samples fails."""
    deviations = replay.interval_bounds.deviations.copy()
    deviations[7] = np.inf
    other = cases.same_motion(replay)
    other.__dict__["interval_bounds"] = replace(replay.interval_bounds, deviations=deviations)
    answers = [answer for claim in CLAIMS if isinstance(answer := claim(other), Certificate)]
    undecided = {answer.claim for answer in answers if answer.method.startswith("undecided")}
    assert undecided == {answer.claim for answer in answers if not answer.passed}
    assert undecided >= {
        "base joint cones",
        "platform joints not too closed",
        "platform joints not too open",
        "clearance between legs and shaft",
        "tip deviation",
        "axis deviation",
        "gouge on cuts and links",
        "gouge on rapids",
        "toolpath covered",
        "feed on cuts",
        "feed on links",
        "rapid rate",
    }
    assert "leg rates" not in undecided
    assert all(answer.where.row == 3 for answer in answers if answer.claim in undecided)


def test_a_verdict_that_json_cannot_hold_is_not_written(tmp_path):
    verdict = Verdict((Certificate("a", True, np.nan, None, "", Place(), ""),))
    with pytest.raises(ValueError, match="JSON"):
        write_verdict(verdict, tmp_path / "verdict.json")
    assert list(tmp_path.iterdir()) == []


def test_what_the_legs_alone_tell_is_judged_without_a_pose(linear):
    legs = linear.program.legs.copy()
    legs[1000] = 0.02
    program = replace(linear.program, legs=quantised(legs))
    verdict = verify(program, linear.machine, linear.toolpath, **cases.TOLERANCES, job_digest="job-1")
    judged_anyway = {c.claim for c in verdict.certificates if not c.method.startswith("not judged")}
    assert judged_anyway >= {"machine", "job", "component kept, w", "component kept, S", "legs not too short"}
    assert judged_anyway >= {"legs not too long", "leg rates", "leg accelerations", "leg jerks"}
    assert judged_anyway >= {"starts at rest", "ends at rest"}
    assert not judged_anyway & {"tip deviation", "axis deviation", "toolpath covered", "rapid rate", "base joint cones"}


def test_speeds_say_how_they_were_bounded(linear, cubic):
    for case, words in ((linear, "from row to row"), (cubic, "proven bound for all times")):
        verdict = verify(case.program, case.machine, case.toolpath, **cases.TOLERANCES)
        methods = [c.method for c in verdict.certificates if c.claim in ("feed on cuts", "rapid rate")]
        assert len(methods) == 2
        assert all(words in method for method in methods)


@pytest.fixture(scope="module")
def railed():
    """The machine on guides that are parallel to y."""
    guides = ReconfigurablePentapod.along_y(cases.STAND.robot, np.tile([-0.1, 0.15], (5, 1)))
    return replace(cases.STAND, guides=guides)


def guides_at(machine, positions):
    path = cases.toolpath_of(cases.strokes()[:1])
    return guides(cases.measured(path, cases.along_x(np.zeros(3)), machine=machine, rail_positions=positions))


def test_a_header_without_positions_of_the_guides(railed):
    found = guides_at(railed, None)
    assert (found.passed, found.value, found.bound, found.unit) == (False, None, 0.0, "mm")
    assert "has no positions" in found.method


@pytest.mark.parametrize(
    ("third", "room", "passed"), [(0.05, 50.0, True), (-0.09, 10.0, True), (-0.1, 0.0, True), (-0.11, -10.0, False)]
)
def test_guides_stand_within_their_travel(railed, third, room, passed):
    found = guides_at(railed, (0.0, 0.02, third, -0.03, 0.1))
    assert found.passed == passed
    assert found.value == pytest.approx(room, abs=1e-9)
    assert (found.bound, found.unit) == (0.0, "mm")
    assert found.method.startswith(f"header: guides at 0, 20, {1e3 * third:.6g}, -30, 100 mm; smallest distance")
