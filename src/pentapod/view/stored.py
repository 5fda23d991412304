"""The outcome of a run as far as its folder has it, so that the viewer shows it on the report's page."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.archives import check_array, read_arrays
from pentapod.base.arrays import Floats, Ints
from pentapod.base.errors import InputError
from pentapod.base.refusal import Advice, Change, Refusal, Shortfall
from pentapod.geometry.polyline import arc_length
from pentapod.job.artefacts import ARRAYS, VERDICT
from pentapod.job.build.limits import placement_limits
from pentapod.job.outcome import Outcome
from pentapod.job.plan_arrays import LEFT_FORMS, PIECE_STARTS, PROFILE_FORMS, STORY_FORMS, left_of, profile_of, story_of
from pentapod.job.stage_runner import Stage
from pentapod.planning import PlacedPath, Placement
from pentapod.planning.limits.margins import Margins
from pentapod.timing.explain import Explanation
from pentapod.timing.time_law.trajectory import Profile
from pentapod.verify.verdict.material_left import MaterialLeft
from pentapod.verify.verdict.verdict import Certificate, NotJudged, Place, Sources, Verdict
from pentapod.view.opened_run import OpenedRun

T = TypeVar("T")

READ_BACK, IN_THE_MIDDLE = "the run in the folder", "nothing: without a placement the part is in the middle of the work"
"""By what the placement of a stored run was chosen, for the page."""

SAME_M = 1e-7
"""Metres within which a station is that of a segment's beginning."""

_LAW = {**PROFILE_FORMS, PIECE_STARTS: ("f", (None,))}


@dataclass(frozen=True, eq=False)
class StoredLaw:
    """A time law read back: its profile, when its pieces (L,) begin, in seconds, and the segments (S,), in metres."""

    profile: Profile
    pieces: Floats
    segments: Floats

    @property
    def duration(self) -> float:
        """Seconds."""
        return float(self.profile.times[-1])

    def segment(self, t: ArrayLike) -> Ints:
        """Return the index (n,) of the toolpath's segment at each time; at a stop the one before it."""
        times = np.asarray(t, dtype=np.float64)
        ended = np.searchsorted(self.segments + SAME_M, self._station(times), side="left") - 1
        begun = np.searchsorted(self.segments - SAME_M, self._station(self.pieces), side="right") - 1
        piece = np.searchsorted(self.pieces, times, side="right") - 1
        return np.maximum(np.maximum(ended, begun[np.maximum(piece, 0)]), 0).astype(np.intp)

    def _station(self, times: Floats) -> Floats:
        return np.interp(times, self.profile.times, self.profile.stations)


def placed_path(run: OpenedRun) -> PlacedPath:
    """Return the toolpath of a run at its placement, with its margins there."""
    tips = run.placement.apply(run.toolpath.tilt_centres - run.toolpath.tilt_centre * run.axes)
    axes = run.placement.rotate(run.axes)
    margins = Margins.of(run.machine, run.component, run.collision_world, placement_limits(run.job))
    rails = run.machine.rail_positions if run.machine.guides is not None else None
    chosen = Placement(
        run.placement, READ_BACK if run.is_placed else IN_THE_MIDDLE, None if rails is None else tuple(rails.tolist())
    )
    return PlacedPath(
        run.toolpath, chosen, run.component, tips, axes, margins(tips, axes, run.placement), margins.limits
    )


def stored_law(run: OpenedRun, placed: PlacedPath) -> StoredLaw | None:
    """Return the time law of a run; None where there is none. Raises InputError where the file is broken."""
    file = run.folder / ARRAYS
    arrays = read_arrays(file, (), InputError, optional=_LAW)
    if run.program is None or len(arrays) < len(_LAW):
        return None
    for name, form in _LAW.items():
        check_array(arrays[name], name, file, InputError, *form)
    profile, pieces = profile_of(arrays), arrays[PIECE_STARTS]
    travelled = arc_length(placed.tips)
    scale = profile.stations[-1] / travelled[-1] if travelled[-1] > 0.0 else 0.0
    return StoredLaw(profile, pieces[:-1], travelled[run.toolpath.starts[:-1]] * scale)


def stored_outcome(run: OpenedRun, placed: PlacedPath) -> Outcome:
    """Return the outcome of a run: its values, the limits on its motion, its verdict, and its refusal if it has one.

    Raises InputError where verdict.json or plan.npz is broken.
    """
    content = _verdict_content(run.folder / VERDICT)
    try:
        verdict, refusal = replace(_verdict(content), left=_left(run)), _refusal(content.get("refusal"))
    except (TypeError, ValueError, KeyError, AttributeError) as error:
        raise InputError("a broken verdict", file=run.folder / VERDICT, remedy="plan the job again") from error
    values = (run.mesh, run.toolpath, placed, run.program, run.piece, _story(run), refusal)
    stages = tuple(Stage("read back", 0.0, value) for value in values if value is not None)
    return Outcome(run.job, run.machine, stages, verdict)


def _story(run: OpenedRun) -> Explanation | None:
    """Return the limits on the motion of a run; None where there is no program, or an older version planned it."""
    file = run.folder / ARRAYS
    arrays = read_arrays(file, (), InputError, optional=STORY_FORMS)
    if run.program is None or len(arrays) < len(STORY_FORMS):
        return None
    for name, form in STORY_FORMS.items():
        check_array(arrays[name], name, file, InputError, *form)
    return story_of(arrays)


def _left(run: OpenedRun) -> MaterialLeft | None:
    """Return what the cutter leaves on the surface; None where nothing says it, or an older version judged the run."""
    file = run.folder / ARRAYS
    arrays = read_arrays(file, (), InputError, optional=LEFT_FORMS)
    if len(arrays) < len(LEFT_FORMS):
        return None
    for name, form in LEFT_FORMS.items():
        check_array(arrays[name], name, file, InputError, *form)
    return left_of(arrays)


def _verdict_content(file: Path) -> Mapping[str, Any]:
    if not file.is_file():
        return {"not_judged": [{"claim": "all claims", "why": f"there is no {VERDICT} in the folder"}]}
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise InputError("a broken verdict", file=file, remedy="plan the job again") from error
    return content if isinstance(content, dict) else {}


def _verdict(content: Mapping[str, Any]) -> Verdict:
    """Return the verdict of verdict.json; entries that another version added are left out."""
    certificates = [
        Certificate(**_own(Certificate, {**entry, "where": Place(**_own(Place, entry["where"]))}))
        for entry in content.get("certificates", ())
    ]
    unjudged = [NotJudged(**_own(NotJudged, entry)) for entry in content.get("not_judged", ())]
    return Verdict(tuple(certificates), tuple(unjudged), Sources(**_own(Sources, content.get("sha256", {}))))


def _refusal(content: Mapping[str, Any] | None) -> Refusal | None:
    if content is None:
        return None
    diagnosis = tuple(
        Shortfall(
            entry["constraint"], tuple((a, b) for a, b in entry["waypoints"]), float(entry["shortfall"]), entry["unit"]
        )
        for entry in content["diagnosis"]
    )
    advice = tuple(_advice(entry) for entry in content.get("advice", ()))
    stage, cause, remedy = (content[name] for name in ("stage", "cause", "remedy"))
    return Refusal(stage, cause, diagnosis, remedy, advice)


def _advice(entry: Mapping[str, Any]) -> Advice:
    changes = [Change(table, key, value) for table, keys in entry["changes"].items() for key, value in keys.items()]
    return Advice(tuple(changes), entry["words"], float(entry["kept"]), bool(entry["whole"]), entry.get("margin"))


def _own(kind: type[Any], entry: Mapping[str, Any]) -> dict[str, Any]:
    """Return the entries that are fields of a class."""
    names = {field.name for field in fields(kind)}
    return {name: value for name, value in entry.items() if name in names}
