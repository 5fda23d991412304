"""The walk along the polynomials: the same in blocks as in one piece, and what it proves against dense moments."""

from dataclasses import fields, replace

import numpy as np
import pytest
import replay_cases as cases

from pentapod.geometry.interpolant import Interpolant
from pentapod.kinematics.proof_results import BranchProof
from pentapod.verify.replay.interval_bounds import ComponentFindings, RunningMaximum, interval_bounds

TILT_CENTRE, EVERY = 0.1, 5


@pytest.fixture(scope="module", params=["cubic", "linear"])
def turning(request):
    """While the tool turns on the spot by 0.2 rad: sixty rows, five milliseconds apart."""
    case = request.getfixturevalue(request.param)
    turn = np.linalg.norm(np.diff(case.axes, axis=0), axis=1) * (case.tips[1:, 2] > 1e-2)
    middle = int(np.argmax(turn))
    legs = case.program.legs[middle - 30 * EVERY : middle + 30 * EVERY : EVERY]
    program = replace(case.program, legs=legs, period=EVERY * cases.PERIOD)
    return program, case.machine, interval_bounds(program, case.machine, TILT_CENTRE, 1e-6, lambda _: None)


def same(a, b):
    if isinstance(a, RunningMaximum):
        return np.allclose(a.values, b.values, rtol=1e-4, atol=0.0) and (np.abs(a.at - b.at) <= 1).all()
    if isinstance(a, ComponentFindings):
        return all(same(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))
    return np.allclose(a, b, rtol=1e-2, atol=1e-12) if isinstance(a, np.ndarray) else a == b


@pytest.mark.parametrize("block", [7, 1, 59, 58])
def test_interval_bounds_in_blocks_are_those_in_one_piece(turning, block):
    program, machine, whole = turning
    shares = []
    parts = interval_bounds(program, machine, TILT_CENTRE, 1e-6, shares.append, block)
    for field in fields(whole):
        assert same(getattr(whole, field.name), getattr(parts, field.name)), field.name
    np.testing.assert_allclose(shares, np.arange(0, 59, block) / 59)


def test_what_is_proven_of_chords_holds_at_dense_moments(turning):
    """Speeds and deviations of the tip, of the tilt centre and of the ends of what the platform's line carries."""
    program, machine, found = turning
    b = Interpolant.through(program.legs, program.period, program.interpolation).bernstein
    degree, t = b.shape[-1] - 1, np.linspace(0.0, 1.0, 41)
    basis = {1: [1 - t, t], 3: [(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t * t * (1 - t), t**3]}[degree]
    position, direction = machine.robot.pose(np.einsum("nlk,kt->ntl", b, np.array(basis)), program.component)
    offsets, tip = machine.robot.offsets, machine.tool_length

    def halves(arm):
        """Points (118, 21, 3) at moments of each chord: of half a period."""
        points = position + arm * direction
        return np.stack([points[:, :21], points[:, 20:]], axis=1).reshape(-1, 21, 3)

    step = program.period / 40

    def fastest(arm):
        return np.linalg.norm(np.diff(halves(arm), axis=1), axis=2).max(axis=1) / step

    far = max(offsets.max(), tip)
    for column, speed in enumerate(
        (fastest(tip), fastest(tip - TILT_CENTRE), np.maximum(fastest(offsets.min()), fastest(far)))
    ):
        assert (found.speeds[:, column] >= speed * (1.0 - 1e-6)).all()
        # A spline clamped at both ends rings there, where the program is cut out of its motion.
        assert (found.speeds[20:-20, column] <= speed[20:-20] * 1.01 + 2e-5).all()
    tilt_centres, share = halves(tip - TILT_CENTRE), np.linspace(0.0, 1.0, 21)[:, None]
    off = np.linalg.norm(tilt_centres - (1 - share) * tilt_centres[:, :1] - share * tilt_centres[:, -1:], axis=2).max(
        axis=1
    )
    assert (found.deviations >= off - 1e-13).all()
    assert found.deviations.max() <= 2.2 * off.max()
    axes = halves(1.0) - halves(0.0)
    chords = (1 - share) * axes[:, :1] + share * axes[:, -1:]
    aside = np.linalg.norm(np.cross(axes, chords), axis=2).max(axis=1)
    assert (found.axis_deviations >= aside * (1.0 - 1e-6) - 1e-13).all()


def test_poses_and_extremes_of_joints_are_those_of_the_samples(turning):
    """Rows and halfway between: the extremes are at their chords."""
    program, machine, found = turning
    motion = Interpolant.through(program.legs, program.period, program.interpolation)
    position, direction = machine.robot.pose(motion.halves, program.component)
    np.testing.assert_allclose(found.position, position, atol=1e-14)
    np.testing.assert_allclose(found.direction, direction, atol=1e-14)
    base = np.column_stack([machine.robot.base, np.zeros(5)])
    legs = position[:, None] + machine.robot.offsets[:, None] * direction[:, None] - base
    legs /= np.linalg.norm(legs, axis=2, keepdims=True)
    at_base = (legs * (machine.joints.base_axes / np.linalg.norm(machine.joints.base_axes, axis=1)[:, None])).sum(
        axis=2
    )
    at_platform = (legs * direction[:, None]).sum(axis=2)
    for extreme, cosines in (
        (found.base_widest, -at_base),
        (found.platform_closed, at_platform),
        (found.platform_open, -at_platform),
    ):
        np.testing.assert_allclose(extreme.values, cosines.max(axis=0), atol=3e-4)
        assert (np.abs(extreme.at - cosines.argmax(axis=0)) <= 1).all()


def test_a_program_that_ends_at_speed_has_its_largest_acceleration_there(linear):
    """Faster and faster, by 0.02 mm more each row, and then nothing: the last step is made good in one period."""
    legs = np.repeat(linear.program.legs[:1], 6, axis=0)
    legs[:, 2] += 1e-5 * np.array([0.0, 1.0, 4.0, 9.0, 16.0, 25.0])
    program = replace(linear.program, legs=legs)
    found = interval_bounds(program, linear.machine, 0.0, 0.0, lambda _: None)
    assert found.accelerations.values[2] == pytest.approx(9e-5 / cases.PERIOD**2)
    assert found.accelerations.at[2] == 5
    assert found.rates.values[2] == pytest.approx(9e-5 / cases.PERIOD)
    assert found.longest.values[2] == pytest.approx(legs[-1, 2])
    assert -found.shortest.values[2] == pytest.approx(legs[0, 2])


def test_what_is_undecided_is_counted_and_the_first_is_kept():
    findings, none = ComponentFindings(), np.zeros(3, dtype=bool)
    doubt = np.array([[0.1, 0.2], [0.3, 0.4], [0.5, 0.6]])
    for first, undecided, refuted in (
        (0, none, none),
        (3, none | [0, 1, 1], none),
        (6, none | [1, 0, 0], none | [0, 0, 1]),
    ):
        lower = np.array([5.0, 4.0, 6.0]) - 0.1 * first
        proof = BranchProof(~(undecided | refuted), refuted, doubt, np.stack([lower, 2.0 * lower], axis=1))
        findings.update(proof, first)
    assert (findings.undecided, findings.refuted) == (3, 1)
    assert findings.first_undecided == (4, 0.3, 0.4)
    assert findings.first_refuted == (8, 0.5, 0.6)
    np.testing.assert_allclose(-findings.lower.values, [3.4, 6.8])
    assert findings.lower.at.tolist() == [7, 7]
