"""compare: a log against its program."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.base.errors import InputError
from pentapod.geometry.directions import angle_between
from pentapod.machine.dynamics.dynamics import Dynamics
from pentapod.machine.machine import Machine
from pentapod.program.commands import commands_digest, readings, springs
from pentapod.program.posts.motion import lengths_at
from pentapod.program.program import Program
from pentapod.simulate.measures import Measure, contour_errors, on_cuts
from pentapod.simulate.recorded.alignment import Alignment, align
from pentapod.simulate.recorded.leg_errors import LegErrors
from pentapod.simulate.recorded.recorded_run import RecordedRun
from pentapod.simulate.recorded.run_log import RunLog
from pentapod.simulate.reference import Reference
from pentapod.toolpath.toolpath import Toolpath
from pentapod.verify.replay.free_space import PosedPolyline
from pentapod.verify.replay.path_matching import match


@dataclass(frozen=True)
class CompareOptions:
    """Options of the comparison.

    window: rows of the program around the place that was found in which the nearest point of the path is sought.
    rounds: of the search for the start. smoothing: seconds over which recorded legs are smoothed for accelerations.
    stride: rows of the program between those that are matched with the toolpath.
    """

    window: int = 32
    rounds: int = 4
    smoothing: float = 25e-3
    stride: int = 4


OPTIONS = CompareOptions()


def compare(
    log: RunLog, reference: Reference, toolpath: Toolpath | None = None, tolerance: float = 1e-4
) -> RecordedRun:
    """Return a log compared with its program. toolpath: as placed, which says where the program cuts.

    tolerance: metres, of the program against the toolpath, to match them. The log's lengths are those of the drives;
    leg model and compensation are undone. Raises InputError: another program's log, a wrong
    unit, legs without a pose.

    >>> run = compare(read_log("log.csv", 5, program.period), reference)  # doctest: +SKIP
    >>> run.largest("contour error")  # doctest: +SKIP
    0.012
    """
    program, machine = reference.program, reference.machine
    log = _readings(log, reference)
    aligned = align(log, program)
    part = slice(aligned.first, aligned.last)
    times, legs, commands = log.times[part], log.legs[part], None if log.commands is None else log.commands[part]
    if program.process_force is not None:
        forced = _by_process(program, machine, aligned.places)
        legs, commands = legs - forced, None if commands is None else commands - forced
    position, direction = machine.robot.pose(legs, program.component)
    lost = np.flatnonzero(~np.isfinite(position).all(axis=1))
    if len(lost):
        raise InputError(
            "these leg lengths have no pose on this machine", file=log.file, line=log.lines[aligned.first + lost[0]],
            value=np.round(1e3 * legs[lost[0]], 6).tolist(), remedy="a leg's column is wrong, or its scale lost count",
        )  # fmt: skip
    tips = position + machine.tool_length * direction
    due = np.rint(2.0 * aligned.places).astype(np.intp)
    contour, turned = contour_errors(
        tips, direction, reference.tips, reference.directions, due, min(2 * OPTIONS.window, len(reference.tips))
    )
    measures = [
        Measure("contour error", "mm", 1e3 * contour, "tip to the programmed path, at any time"),
        Measure("axis error", "deg", np.degrees(turned), "axis to the programmed one at that point"),
    ]
    timed = legs if commands is None else commands
    where, start = _due_times(times, timed, aligned, reference)
    wanted = lengths_at(program, where)
    rates = _rates(reference, where)
    off = legs - wanted
    if start is None:
        speed = np.square(rates).sum(axis=1, keepdims=True)
        share = (off * rates).sum(axis=1, keepdims=True) / np.where(speed > 0.0, speed, 1.0)
        off = off - share * rates
    else:
        at, pointed = machine.robot.pose(wanted, program.component)
        late = np.linalg.norm(tips - at - machine.tool_length * pointed, axis=1)
        twist = angle_between(direction, pointed)
        measures += [
            Measure("tip error in time", "mm", 1e3 * late, "tip to where it is due at that time"),
            Measure("axis error in time", "deg", np.degrees(twist), "axis to the one due at that time"),
        ]
    measures.append(Measure("leg error", "mm", 1e3 * np.abs(off).max(axis=1), "of any leg"))
    if commands is not None:
        follows = legs - commands
        measures.append(Measure("following error", "mm", 1e3 * np.abs(follows).max(axis=1), "leg to its command"))
        told = np.gradient(commands, times, axis=0)
        errors = LegErrors.of(times, commands, told, follows, in_time=True, absolute=True)
    else:
        errors = LegErrors.of(times, wanted, rates, off, in_time=start is not None)
    cutting = _cutting(reference, toolpath, tolerance, aligned)
    expected = _expected(log.times[part], legs, (position, direction), reference)
    measured = None if log.forces is None else log.forces[part]
    measures += _of_forces(expected, measured)
    return RecordedRun(log, reference, aligned, start, tuple(measures), off, errors, expected, measured, cutting)


def _readings(log: RunLog, reference: Reference) -> RunLog:
    """Return a log with what the legs read, of one with what their drives count."""
    if not commands_digest(reference.program, reference.machine):
        return log

    steady = replace(reference.program, process_force=None)  # that depends on the row: see `_by_process`

    def read(values: Floats) -> Floats:
        found = readings(steady, reference.machine, values)
        return np.where(np.isfinite(found), found, values)  # far from the program, where no pose is

    return replace(log, legs=read(log.legs), commands=None if log.commands is None else read(log.commands))


def _by_process(program: Program, machine: Machine, places: Floats) -> Floats:
    """Return how much longer drives are told legs (n, n_legs) at places in a program, because of its process force."""
    steady = replace(program, process_force=None)
    more = springs(program, machine, program.legs) - springs(steady, machine, program.legs)
    return np.stack([np.interp(places, np.arange(len(more)), leg) for leg in more.T], axis=1)


def _rates(reference: Reference, times: Floats) -> Floats:
    """Return rates (n, n_legs) of the programmed legs at times (n,), m/s: differences over a period."""
    half, program = 0.5 * reference.program.period, reference.program
    early, late = np.maximum(times - half, 0.0), np.minimum(times + half, program.duration)
    apart = np.maximum(late - early, half)
    return (lengths_at(program, late) - lengths_at(program, early)) / apart[:, None]


def _due_times(times: Floats, legs: Floats, aligned: Alignment, reference: Reference) -> tuple[Floats, float | None]:
    """Return the program's time (n,) for each row, and the start: by least squares in time, else place by place."""
    program, start = reference.program, aligned.start
    place = aligned.places * program.period
    most = OPTIONS.window * program.period
    for _ in range(OPTIONS.rounds):
        where = place if start is None else np.clip(times - start, 0.0, program.duration)
        rates, off = _rates(reference, where), legs - lengths_at(program, where)
        if start is None:
            ahead, speed = (off * rates).sum(axis=1), np.square(rates).sum(axis=1)
            moves = np.clip(ahead / np.where(speed > 0.0, speed, np.inf), -most, most)
            place = np.clip(place + moves, 0.0, program.duration)
        else:
            start += float(LegErrors.of(times, lengths_at(program, where), rates, off, in_time=True).lag.mean())
    return (place, None) if start is None else (np.clip(times - start, 0.0, program.duration), start)


def _cutting(reference: Reference, toolpath: Toolpath | None, tolerance: float, aligned: Alignment) -> Bools:
    """Return the rows of the log that are on cuts (n,)."""
    if toolpath is None:
        return np.zeros(len(aligned.places), dtype=bool)
    rows = np.unique(np.append(np.arange(0, len(reference.tips), 2 * OPTIONS.stride), len(reference.tips) - 1))
    axes = -reference.directions[rows]
    course = PosedPolyline(reference.tips[rows] + toolpath.tilt_centre * axes, axes)
    cuts = on_cuts(match(course, PosedPolyline(toolpath.tilt_centres, toolpath.axes), tolerance), toolpath)
    found: Bools = cuts[np.minimum(np.searchsorted(rows, 2.0 * aligned.places), len(rows) - 1)]
    return found


def _expected(times: Floats, legs: Floats, poses: tuple[Floats, Floats], reference: Reference) -> Floats | None:
    """Return the forces (n, n_legs) that the recorded motion needs, newtons; None where the machine's are not known."""
    from scipy.signal import savgol_filter  # noqa: PLC0415  slow to load

    machine = reference.machine
    if not machine.leg_forces_known:
        return None
    period = float(np.median(np.diff(times)))
    even = np.arange(times[0], times[-1] + 0.5 * period, period)
    values = np.column_stack([np.interp(even, times, leg) for leg in legs.T])
    window = 2 * max(2, round(0.5 * OPTIONS.smoothing / period)) + 1
    window = min(window, len(even) - 1 + len(even) % 2)
    moved = [np.asarray(savgol_filter(values, window, 3, deriv=k, delta=period, axis=0)) for k in (1, 2)]
    rates, accelerations = (np.column_stack([np.interp(times, even, leg) for leg in m.T]) for m in moved)
    terms = Dynamics.of(machine).of_rows(*poses, rates, accelerations, reach=False)
    return terms.quadratic + terms.weight + np.sign(rates) * machine.drive_forces.friction(rates)


def _of_forces(expected: Floats | None, measured: Floats | None) -> Sequence[Measure]:
    """Return the measures of forces."""
    found = list[Measure]()
    if expected is not None:
        found.append(Measure("expected force", "N", np.abs(expected).max(axis=1), "that the recorded motion needs"))
    if measured is not None:
        found.append(Measure("measured force", "N", np.abs(measured).max(axis=1), "of any drive"))
    if expected is not None and measured is not None:
        off = np.abs(measured - expected).max(axis=1)
        found.append(Measure("force difference", "N", off, "measured less expected, of any drive"))
    return found
