"""Content of plan.npz: the arrays of all stages by name, with units."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pentapod.base.archives import read_arrays
from pentapod.base.arrays import Floats
from pentapod.base.errors import InputError
from pentapod.base.units import from_si, split_key, to_si
from pentapod.geometry.rigid import RigidTransform
from pentapod.job.artefacts import ARRAYS
from pentapod.job.outcome import Outcome
from pentapod.planning.leg_path.leg_path import LegPath
from pentapod.planning.placement.placed_path import PlacedPath
from pentapod.program.program import Program
from pentapod.timing.explain import Cause, Explanation
from pentapod.timing.time_law.motion_law import MotionLaw
from pentapod.timing.time_law.trajectory import Profile, Trajectory
from pentapod.toolpath.formats.npz import toolpath_arrays
from pentapod.toolpath.linking.partition import Piece
from pentapod.toolpath.toolpath import Toolpath
from pentapod.verify.verdict.material_left import MaterialLeft

Arrays = dict[str, NDArray[Any]]

JOB_FILE = "job.file"
"""The job file of the run, relative to the run's folder where possible."""

PLACEMENT = "placed.placement_mm"
"""Homogeneous matrix (4, 4), workpiece → machine."""

LAW_NAMES = (
    "trajectory.law_knots",
    "trajectory.law_time_s",
    "trajectory.law_station_mm",
    "trajectory.law_speed_mm_s",
    "trajectory.law_acceleration_m_s2",
    "trajectory.law_jerk_m_s3",
)
"""Knots of each motion law, and the values of all laws, one after the other; accelerations and jerks between knots."""

PIECE_STARTS = "trajectory.piece_starts_s"

PROFILE_FORMS: dict[str, tuple[str, tuple[int | None, ...]]] = {
    "trajectory.time_s": ("f", (None,)),
    "trajectory.station_mm": ("f", (None,)),
    "trajectory.speed_mm_s": ("f", (None,)),
    "trajectory.active": ("iu", (None,)),
    "trajectory.shares": ("f", (None,)),
    "trajectory.constraint_names": ("U", (None,)),
}
"""Arrays of a time law's profile: kinds of numbers, as NumPy names them, and shapes."""

STORY_FORMS: dict[str, tuple[str, tuple[int | None, ...]]] = {
    "explanation.causes": ("U", (None,)),
    "explanation.time_s": ("f", (None,)),
    "explanation.cost_s": ("f", (None,)),
    "explanation.lower_bound_s": ("f", ()),
}
"""Arrays of the limits on the motion: their names, how long each holds, and the time lost there to the lower bound."""

LEFT_FORMS: dict[str, tuple[str, tuple[int | None, ...]]] = {
    "left.points_mm": ("f", (None, 3)),
    "left.heights_mm": ("f", (None,)),
    "left.allowed_far_mm": ("f", (2,)),
}
"""Arrays of what the cutter leaves: points of the surface, heights above them, what may be left, and the largest."""

GUIDES = "placed.guides_mm"
"""Positions of the base joints along their guides, for a reconfigurable machine."""

WAYPOINTS, BOX = "setup.waypoints", "setup.box_mm"
"""For one of several set-ups: first and last waypoint (2,) and box (2, 3) of its piece of the toolpath."""


def profile_of(arrays: Mapping[str, NDArray[Any]]) -> Profile:
    """Return the profile of the time law that plan.npz has in arrays of `PROFILE_FORMS`."""
    times, stations, speeds, active, shares, names = (arrays[name] for name in PROFILE_FORMS)
    return Profile(
        times, to_si(stations, "mm"), to_si(speeds, "mm_s"), active.astype(np.intp), shares,
        tuple(str(name) for name in names),
    )  # fmt: skip


def story_of(arrays: Mapping[str, NDArray[Any]]) -> Explanation:
    """Return the explanation of a cycle time that plan.npz has in arrays of `STORY_FORMS`: the limits, no places."""
    names, times, costs, bound = (arrays[name].tolist() for name in STORY_FORMS)
    return Explanation(sum(times), bound, tuple(map(Cause, names, times, costs)), ())


def job_file_of(folder: Path) -> Path | None:
    """Return the job file of the run in a folder; None where there is no run, or the file is gone."""
    file = folder / ARRAYS
    if not file.is_file():
        return None
    arrays = read_arrays(file, (), InputError, optional=(JOB_FILE,))
    job = folder / str(arrays[JOB_FILE]) if JOB_FILE in arrays else None
    return job if job is not None and job.is_file() else None


def array_parts(outcome: Outcome, folder: Path) -> Iterator[Arrays]:
    """Yield the arrays of an outcome by name, `stage.quantity_unit`, and `JOB_FILE`. folder: of the run.

    Each part is made when it is asked for: together they are as large as all stages.
    """
    yield {JOB_FILE: np.array(_relative(outcome.job.path, folder))}
    if (toolpath := outcome.find(Toolpath)) is not None:
        yield toolpath_arrays(toolpath)
    if (piece := outcome.find(Piece)) is not None:
        box = np.array([piece.low, piece.high])
        yield _in_units({WAYPOINTS: np.array([piece.first, piece.last]), BOX: box})
    if (placed := outcome.find(PlacedPath)) is not None:
        yield _placed(placed)
    if (path := outcome.find(LegPath)) is not None:
        yield _leg_path(path)
    if (trajectory := outcome.find(Trajectory)) is not None:
        yield _trajectory(trajectory)
    if (story := outcome.find(Explanation)) is not None:
        yield _story(story)
    if (program := outcome.find(Program)) is not None:
        yield _in_units({"program.time_s": program.times, "program.legs_mm": program.legs})
    if (left := outcome.verdict.left) is not None:
        bounds = np.array([left.allowed, left.far])
        yield _in_units(dict(zip(LEFT_FORMS, (left.points, left.heights, bounds), strict=True)))


def left_of(arrays: Mapping[str, NDArray[Any]]) -> MaterialLeft:
    """Return what the cutter leaves on the surface, as plan.npz has it in arrays of `LEFT_FORMS`."""
    points, heights, (allowed, far) = (to_si(arrays[name], "mm") for name in LEFT_FORMS)
    return MaterialLeft(points, heights, float(allowed), float(far))


def _relative(job: Path, folder: Path) -> str:
    try:
        return Path(os.path.relpath(job.resolve(), folder.resolve())).as_posix()
    except ValueError:  # on another drive
        return job.resolve().as_posix()


def matrix_mm(transform: RigidTransform) -> Floats:
    """Return the homogeneous matrix (4, 4) with its translation in millimetres."""
    matrix = transform.matrix
    matrix[:3, 3] = from_si(matrix[:3, 3], "mm")
    return matrix


def piece_in(arrays: Mapping[str, NDArray[Any]]) -> Piece | None:
    """Return the piece of the job's toolpath that a run is for; None for the whole toolpath."""
    if WAYPOINTS not in arrays:
        return None
    first, last = arrays[WAYPOINTS].tolist()
    (x, y, z), (far_x, far_y, far_z) = (_metres(corner) for corner in arrays[BOX])
    return Piece(first, last, (x, y, z), (far_x, far_y, far_z))


def guides_in(arrays: Mapping[str, NDArray[Any]]) -> list[float] | None:
    """Return the positions along the guides, metres; None for a machine without guides."""
    return _metres(arrays[GUIDES]) if GUIDES in arrays else None


def _metres(values_mm: Floats) -> list[float]:
    """Return metres rounded to the nanometre: whole micrometres, as the planner sets them, are read back exactly."""
    return [round(value, 9) for value in to_si(values_mm, "mm").tolist()]


def _in_units(values: Arrays) -> Arrays:
    """Return SI arrays in the units at the end of their names."""
    return {name: from_si(value, split_key(name)[1]) for name, value in values.items()}


def _placed(placed: PlacedPath) -> Arrays:
    rail_positions = placed.placement.rail_positions
    arrays = {
        "placed.component": np.array(placed.component, dtype=np.int8),
        "placed.tips_mm": placed.tips,
        "placed.axes": placed.axes,
        "placed.margins": placed.margins,
        "placed.margin_names": np.array(placed.margin_names),
        **({} if rail_positions is None else {GUIDES: np.array(rail_positions)}),
    }
    return {PLACEMENT: matrix_mm(placed.placement.transform), **_in_units(arrays)}


def _leg_path(path: LegPath) -> Arrays:
    knots = [start + np.asarray(p.knots) for start, p in zip(path.starts, path.pieces, strict=False)]
    values = [[p(np.asarray(p.knots), order) for p in path.pieces] for order in range(3)]
    arrays = {
        "leg_path.piece_starts_mm": np.asarray(path.starts),
        "leg_path.dwells_s": path.dwells,
        "leg_path.knots_mm": np.concatenate(knots),
        "leg_path.legs_mm": np.concatenate(values[0]),
        "leg_path.legs_first": np.concatenate(values[1]),
        "leg_path.legs_second_per_mm": np.concatenate(values[2]),
    }
    return _in_units(arrays)


def _story(story: Explanation) -> Arrays:
    causes = story.causes
    values = (
        np.array([cause.name for cause in causes]), np.array([cause.time for cause in causes]),
        np.array([cause.cost for cause in causes]), np.array(story.lower_bound),
    )  # fmt: skip
    return dict(zip(STORY_FORMS, values, strict=True))


def _trajectory(trajectory: Trajectory) -> Arrays:
    profile = trajectory.profile
    arrays = {
        "trajectory.piece_starts_s": trajectory.starts,
        "trajectory.time_s": profile.times,
        "trajectory.station_mm": profile.stations,
        "trajectory.speed_mm_s": profile.speeds,
        "trajectory.active": profile.active,
        "trajectory.shares": profile.shares,
        "trajectory.constraint_names": np.array(profile.constraint_names),
        LAW_NAMES[0]: np.array([len(law.times) for law in trajectory.laws]),
        **{
            name: np.concatenate([getattr(law, part) for law in trajectory.laws])
            for name, part in zip(LAW_NAMES[1:], MotionLaw.__dataclass_fields__, strict=True)
        },
    }
    return _in_units(arrays)
