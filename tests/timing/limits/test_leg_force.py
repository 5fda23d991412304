"""The drives' forces as a limit of the time law: kept by law and setpoints, named, refused where none is left."""

from dataclasses import replace

import numpy as np
import pytest
from timing_paths import Path, raster

from pentapod.base.refusal import Refusal
from pentapod.geometry.interpolant import Interpolant
from pentapod.machine import DriveForces, Dynamics, Machine
from pentapod.timing import Trajectory, certify, explain, override, retime
from pentapod.toolpath.toolpath import SegmentKind

DESK = Machine.load("desk")


def strong(peak: float = 400.0, cutting: float = 0.0, interpolation: str = "cubic", **forces) -> Machine:
    """The shipped machine with limited drives; accelerations that do not limit beside them."""
    legs = replace(DESK.legs, max_acceleration=np.full(5, 20.0), max_jerk=np.full(5, 2000.0))
    controller = replace(DESK.controller, interpolation=interpolation)
    given = DriveForces(peak_force=np.full(5, peak), **{k: np.full(5, v) for k, v in forces.items()})
    return replace(DESK, legs=legs, controller=controller, drive_forces=given, cutting_force=cutting)


def zigzag(feed: float = 0.15, kind: SegmentKind = SegmentKind.CUT):
    """A raster in the middle of the work volume, the tool leaning."""
    piece = raster(lines=3, feed=feed)
    tip, lean = piece.legs.tool[0], np.array([0.15, 0.1, -1.0]) / np.linalg.norm([0.15, 0.1, -1.0])

    def tips(s):
        p, *rest = tip(s)
        return p + np.array([0.085, -0.017, 0.467 - 0.9]), *rest

    def axes(s):
        z = np.zeros((len(s), 3))
        return z + lean, z, z

    def legs(s):
        return DESK.robot.leg_derivatives(list(zip(tips(s), axes(s), strict=True)), DESK.tool_length)

    legs.tool = tips, axes
    piece.section_kinds, piece.legs = (kind,), legs
    return piece


def timed(piece, machine, **options) -> Trajectory:
    result = retime(Path((piece,)), machine, **options)
    assert isinstance(result, Trajectory), str(result)
    return result


def rows(trajectory, machine):
    """Forces (N, 5) and rates (N, 5) at the program's rows, and the reach of a force on the tip."""
    period = machine.controller.period
    t = np.arange(round(trajectory.duration / period) + 1) * period
    legs, (tips, axes) = Interpolant.through(trajectory(t), period, "cubic"), trajectory.pose(t)
    position = tips + machine.tool_length * axes
    terms = Dynamics.of(machine).of_rows(position, -axes, legs.first, legs.second)
    return terms.quadratic + terms.weight, legs.first, terms.reach


@pytest.mark.parametrize("limit_jerk", [True, False])
def test_the_drives_keep_their_peak_force_and_use_it(limit_jerk: bool) -> None:
    free, machine = timed(zigzag(), strong(5000.0), limit_jerk=limit_jerk), strong()
    kept = timed(zigzag(), machine, limit_jerk=limit_jerk)
    before, after = (np.abs(rows(y, machine)[0]).max() for y in (free, kept))
    assert before > 1.3 * 400.0
    assert 0.96 * 400.0 < after <= 400.0 * 1.0005
    assert kept.duration > 1.02 * free.duration
    story = explain(kept, machine, certify(kept, machine))
    assert any(cause.name in {f"leg {k} force" for k in range(1, 6)} for cause in story.causes)
    (use,) = (use for use in story.uses if use.quantity == "leg force")
    assert use.value == pytest.approx(after, rel=1e-3)
    assert use.unit == "N"


def test_durations_fall_as_drives_get_stronger() -> None:
    durations = [timed(zigzag(), strong(peak)).duration for peak in (250.0, 320.0, 400.0, 600.0, 1000.0)]
    assert (np.diff(durations) < 2e-3).all(), durations
    assert durations[0] > 1.1 * durations[-1]


def test_friction_cutting_and_a_drive_that_weakens_with_speed_take_their_part() -> None:
    """At every row: |force| + friction + reserve within what the drive has at that rate."""
    machine = strong(
        500.0, cutting=20.0, knee_velocity=0.03, no_load_velocity=0.25, coulomb_friction=15.0, viscous_friction=150.0
    )
    kept, plain = timed(zigzag(), machine), timed(zigzag(), strong(500.0))
    forces, rates, reach = rows(kept, machine)
    limits = machine.drive_forces
    left = limits.available(rates) - limits.friction(rates) - 20.0 * reach - np.abs(forces)
    assert left.min() >= -0.5
    assert (left / limits.available(rates)).min() < 0.05
    assert kept.duration > 1.03 * plain.duration
    (use,) = (use for use in certify(kept, machine) if use.quantity == "leg force")
    assert 0.95 < use.share < 1.001


def test_nothing_is_kept_free_for_cutting_on_rapids() -> None:
    machine, rapid = strong(400.0, cutting=40.0), SegmentKind.RAPID
    cut, free = timed(zigzag(), machine), timed(zigzag(kind=rapid), machine)
    assert free.duration == pytest.approx(timed(zigzag(kind=rapid), strong(400.0)).duration, rel=1e-9)
    assert cut.duration > 1.005 * free.duration


@pytest.mark.parametrize(
    ("machine", "words"),
    [(strong(12.0), "N of weight"), (strong(100.0, cutting=60.0), "N for cutting")],
)
def test_drives_that_cannot_hold_the_machine_are_refused_with_leg_place_and_newtons(machine, words) -> None:
    result = retime(Path((zigzag(),)), machine)
    assert isinstance(result, Refusal)
    assert "a limit is exceeded even at rest there" in result.cause
    assert words in result.cause
    assert "mm along the path" in result.cause
    assert result.diagnosis[0].constraint.startswith("leg ")
    assert result.diagnosis[0].constraint.endswith(" force")


def test_machines_without_a_peak_force_have_no_such_limit() -> None:
    assert not [use for use in certify(timed(zigzag(), DESK), DESK) if use.quantity == "leg force"]


def test_an_override_keeps_the_peak_force() -> None:
    machine = strong()
    trajectory = timed(zigzag(), machine)
    for share in (0.0, 0.5, 1.5):
        turned = override(trajectory, machine, 0.3, share)
        assert isinstance(turned, Trajectory), str(turned)
        assert np.abs(rows(turned, machine)[0][2:-2]).max() <= 400.0 * 1.001
