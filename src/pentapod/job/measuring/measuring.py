"""plan_measuring: the poses in which a machine shall be measured, and the program that takes it there."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.base.errors import InputError
from pentapod.base.progress import Progress, silent
from pentapod.base.refusal import Refusal
from pentapod.base.values import Value
from pentapod.geometry.directions import angle_between, partway
from pentapod.geometry.rigid import RigidTransform
from pentapod.job.artefacts import PROGRAM, VERDICT, check_folder, write_json
from pentapod.job.measuring.candidates import Instruments, candidates, clear_way, measurements_in
from pentapod.job.measuring.order import short_order
from pentapod.kinematics.component import Component
from pentapod.kinematics.robot import Branch
from pentapod.machine.identification.measurements import Measurements
from pentapod.machine.identification.measurements_file import is_filled_in, write_measurements
from pentapod.machine.identification.pose_choice import choose_poses, predicted_tip_error
from pentapod.machine.machine import Machine
from pentapod.planning import PlacementConstraints, leg_path, plan
from pentapod.planning.limits.margins import Margins
from pentapod.planning.problem.weights import NEEDED_MARGIN
from pentapod.program import sample, write_csv
from pentapod.timing import retime
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath
from pentapod.verify import Verdict, verify

MEASUREMENTS = "measurements.csv"
SIX_DEGREES = Instruments()
"""A laser tracker with a probe of six degrees of freedom."""
NO_PART = (
    "gouge on cuts and links",
    "gouge on rapids",
    "surface left on the region",
    "legs, spindle and tool clear of the surroundings",
)
"""Claims that a program without a part cannot be judged by: the work volume must be empty."""


@dataclass(frozen=True)
class MeasuringOptions:
    """dwell: seconds of rest in each pose. path_tolerance, axis_tolerance: of the ways, metres and radians.

    The verdict proves the program for legs that are off by the path tolerance: a wide one proves nothing on machines
    on which small errors of the legs move the tip far. axis_step: largest turn of the tool between waypoints, radians.
    random: draws of as many poses by chance, with which the choice is compared.
    """

    dwell: float = 5.0
    path_tolerance: float = 5e-6
    axis_tolerance: float = 2e-3
    axis_step: float = 0.05
    random: int = 50


@dataclass(frozen=True, eq=False)
class MeasuringPlan(Value):
    """What was planned. poses: as an instrument would see them on the machine as designed, in their order.

    tip_sigma: predicted root mean square error of the tip after calibration, metres; random_tip_sigma: the same for as
    many poses chosen by chance. seconds: of the program. verdict: on the program.
    """

    summary = ("tip_sigma",)

    poses: Measurements
    tip_sigma: float
    random_tip_sigma: float
    seconds: float
    verdict: Verdict


def plan_measuring(
    machine: Machine,
    out: str | Path,
    count: int,
    instruments: Instruments = SIX_DEGREES,
    *,
    component: Branch | None = None,
    seed: int = 0,
    options: MeasuringOptions = MeasuringOptions(),
    progress: Progress = silent,
) -> MeasuringPlan | Refusal:
    """Choose poses, write program.csv, verdict.json and an empty measurements.csv into `out`, return the plan.

    component: by default that of the middle of the work volume. Returns a Refusal where the ways between the poses
    cannot be driven. Raises InputError: a count below 2, more than there are poses, a folder that cannot be written or
    that has measurements.
    """
    folder = Path(out)
    check_folder(folder)
    if is_filled_in(folder / MEASUREMENTS):
        raise InputError(
            "holds measurements, which would be lost", file=folder / MEASUREMENTS,
            remedy="choose another folder with -o, or move this file away",
        )  # fmt: skip
    branch = component or _usual(machine)
    progress("poses", 0.0)
    every = candidates(machine, branch, instruments, seed)
    if not 2 <= count <= len(every.tips):
        raise InputError("wrong count of poses", key="-n", value=count, expected=f"2 to {len(every.tips)}")
    choice = choose_poses(every.columns, every.tips_move, count)
    rng = np.random.default_rng(seed)
    chance = [
        predicted_tip_error(every.columns[rng.choice(len(every.tips), count, replace=False)], every.tips_move)
        for _ in range(options.random)
    ]
    tips, axes = _in_order(machine, branch, every.tips[choice.chosen], every.axes[choice.chosen])
    progress("poses", 1.0)
    poses = measurements_in(machine, branch, instruments, tips, axes)
    folder.mkdir(parents=True, exist_ok=True)
    judged = _driven(machine, branch, tips, axes, folder, options, progress)
    if isinstance(judged, Refusal):
        return judged
    seconds, verdict = judged
    write_measurements(poses, folder / MEASUREMENTS, empty=True)
    write_json(verdict.to_dict(), folder / VERDICT)
    return MeasuringPlan(poses, choice.tip_sigma, float(np.median(chance)), seconds, verdict)


def _usual(machine: Machine) -> Branch:
    """Return the branch of the middle of the work volume."""
    axis = np.array([0.0, 0.0, -1.0])
    signs = machine.robot.branch(machine.work.centre + machine.tool_length * axis, -axis).tolist()
    found = next((branch for branch in machine.robot.branches if [*branch][: len(signs)] == signs), None)
    if found is None:
        raise InputError("the middle of the work volume is singular", remedy="name a component with --component")
    return found


def _in_order(machine: Machine, branch: Branch, tips: Floats, axes: Floats) -> tuple[Floats, Floats]:
    """Return the poses in an order of short, clear ways."""
    legs = machine.robot.leg_lengths(tips + machine.tool_length * axes, -axes)
    seconds = (np.abs(legs[:, None] - legs[None]) / machine.legs.max_velocity).max(axis=-1)
    first, second = (index.ravel() for index in np.meshgrid(*[np.arange(len(tips))] * 2, indexing="ij"))
    margins = Margins.of(machine, branch)
    clear = clear_way(margins, (tips[first], axes[first]), (tips[second], axes[second]), NEEDED_MARGIN)
    order: Ints = short_order(seconds, clear.reshape(seconds.shape))
    return tips[order], axes[order]


def _driven(
    machine: Machine,
    branch: Branch,
    tips: Floats,
    axes: Floats,
    folder: Path,
    options: MeasuringOptions,
    progress: Progress,
) -> tuple[float, Verdict] | Refusal:
    """Write the program through poses, and return its duration and verdict, or the refusal of a way."""
    ways = tuple(_way(tips[k : k + 2], axes[k : k + 2], options) for k in range(len(tips) - 1))
    toolpath = Toolpath(ways, wait=options.dwell)
    here = PlacementConstraints.fixture([RigidTransform.identity()])
    placed = plan(toolpath, machine, constraints=here, component=branch, progress=progress)
    if isinstance(placed, Refusal):
        return placed
    path, axis = options.path_tolerance, options.axis_tolerance
    trajectory = retime(leg_path(placed, machine, path_tolerance=path, axis_tolerance=axis), machine, progress=progress)
    if isinstance(trajectory, Refusal):
        return trajectory
    program = sample(trajectory, machine, placed)
    file = write_csv(program, folder / PROGRAM)
    verdict = verify(
        file,
        machine,
        toolpath,
        tilt=0.0,
        path_tolerance=path,
        axis_tolerance=axis,
        constraints=here,
        component=branch if isinstance(branch, Component) else None,
        waived=NO_PART,
        progress=progress,
    )
    return program.duration, verdict


def _way(tips: Floats, axes: Floats, options: MeasuringOptions) -> Segment:
    """Return the straight motion between two poses (2, 3), the axis on the great circle, with a rest at its end."""
    count = 1 + math.ceil(float(angle_between(axes[0], axes[1])) / options.axis_step)
    share = np.linspace(0.0, 1.0, max(count, 2))
    between = partway(np.broadcast_to(axes[0], (len(share), 3)), np.broadcast_to(axes[1], (len(share), 3)), share)
    between[0], between[-1] = axes
    return Segment(
        SegmentKind.RAPID, tips[0] + share[:, None] * (tips[1] - tips[0]), between, np.inf, dwell=options.dwell
    )
