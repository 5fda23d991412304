"""LinuxCNC's HAL: a component that corrects the legs by the tool's way across the path, as `simulate --correct` does.

Its mathematics is a header without HAL, on that of the kinematics module; its model of the drives is that of the
machine file's [drives], at one servo period. It is off until its pin `enable` is set.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from pentapod.machine.drives import Drives
from pentapod.machine.dynamics.correction import Correction, CorrectionOptions, correction_for, steps_of
from pentapod.program.posts.linuxcnc.config import packaged
from pentapod.program.posts.linuxcnc.module import Module, c_numbers, filled, module_names, nominal_robot

HEADER = "pentapod_kinematics.h"
SOURCES = ("pentapod_contour.h", "pentapod_contour.c")


@dataclass(frozen=True)
class ContourOptions:
    """What the pins of the correction hold from the start.

    bound_um: largest correction of a leg. range_um: way off the path beyond which nothing is corrected. share: of the
    legs' accelerations, with which the correction may change; planner_share: of them, where LinuxCNC plans, whose axes
    leave most of it. late: servo periods that the path is looked back beyond
    the lag of the drives.
    """

    bound_um: float = 50.0
    range_um: float = 1000.0
    share: float = 0.1
    planner_share: float = 0.3
    late: int = 3


OPTIONS = ContourOptions()


def contour_files(given: Module, period: float) -> dict[str, bytes]:
    """Return header and shell of the correction; none where the drives have none with their stability margin.

    period: of the servo thread, seconds. The header includes that of the kinematics module. Raises MachineError where
    the machine can have no module.
    """
    nominal_robot(given.machine)
    values = contour_values(given, period)
    if not values:
        return {}
    words = {**module_names(given), **{name: c_numbers(value) for name, value in values.items()}}
    words |= {name: str(int(np.asarray(values[name]))) for name in ("STATES", "WINDOW")}
    return {name: filled(packaged(f"kinematics/{name}").decode(), words).encode() for name in SOURCES}


def contour_values(given: Module, period: float) -> dict[str, ArrayLike]:
    """Return the numbers of the correction by name, mm and periods; none where the drives have none."""
    drives = given.machine.drives
    correction = calm_correction(drives, period)
    if correction is None:
        return {}
    return {
        "STATES": correction.state_matrix.shape[-1], "WINDOW": _window(drives, period), "PERIOD": period,
        "MEMORY": correction.memory, "MODEL": correction.state_matrix, "INPUT": correction.input_vector,
        "LEAD": correction.lead, "LEG_ACCELERATION": 1e3 * given.machine.legs.max_acceleration,
        "BOUND_UM": OPTIONS.bound_um, "RANGE_UM": OPTIONS.range_um, "SHARE": OPTIONS.share,
    }  # fmt: skip


def calm_correction(drives: Drives, period: float) -> Correction | None:
    """Return the correction that asks no leg to be elsewhere than where it should be; None where there is none.

    The inverse of a drive, which the simulation asks for, would often be cut off by the bounds, and then swing. The
    filter is also so slow that a step of an encoder becomes no larger step of a command.
    """
    correction = correction_for(drives, period, *steps_of(drives, period), CorrectionOptions(effort=math.inf))
    if correction is None:
        return None
    # With x = 1 − memory the filter's first answer to a unit step, 2 x − x² + lead · x², is at most 1.
    root = math.sqrt(float(correction.lead.max()))
    return replace(correction, memory=max(correction.memory, root / (1.0 + root)))


def joint_lines(legs: int) -> list[str]:
    """Return the HAL between LinuxCNC's joints and the drives, whose command is its own feedback here."""
    return [
        "loadrt pentapod_contour",
        "addf pentapod-contour servo-thread",
        *(f"net command{k + 1} joint.{k}.pos-cmd => pentapod-contour.command.{k}" for k in range(legs)),
        *(f"net feedback{k + 1} joint.{k}.pos-fb => pentapod-contour.feedback.{k}" for k in range(legs)),
        *(f"net leg{k + 1} joint.{k}.motor-pos-cmd => pentapod-contour.motor.{k}" for k in range(legs)),
        *(f"net drive{k + 1} pentapod-contour.out.{k} => joint.{k}.motor-pos-fb" for k in range(legs)),
        "setp pentapod-contour.bound-um [CONTOUR]BOUND_UM",
        "setp pentapod-contour.acceleration-share [CONTOUR]ACCELERATION_SHARE",
        "setp pentapod-contour.enable [CONTOUR]ENABLE",
    ]


def ini_table() -> str:
    """Return the ini's table of the correction: off."""
    share = f"ACCELERATION_SHARE = {OPTIONS.planner_share:g}"
    return f"[CONTOUR]\nENABLE = 0\nBOUND_UM = {OPTIONS.bound_um:g}\n{share}\n"


def player_lines(legs: int) -> list[str]:
    """Return the HAL between the player's limits and the drives, whose command is its own feedback here."""
    return [
        *(f"net limited{k + 1} => pentapod-contour.command.{k} pentapod-contour.motor.{k}" for k in range(legs)),
        *(f"net drive{k + 1} pentapod-contour.out.{k} => pentapod-contour.feedback.{k}" for k in range(legs)),
    ]


def _window(drives: Drives, period: float) -> int:
    """Return among how many pieces of the path, a period each, the nearest point is looked for."""
    lag = max(1.0 - drives.velocity_feedforward, 0.0) / float(drives.position_gain.min()) + drives.dead_time
    return int(lag / period) + 1 + OPTIONS.late
