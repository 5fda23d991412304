"""Registration of a job's part: from a list of touches to the placement at which it is machined."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pentapod.base.archives import read_arrays
from pentapod.base.arrays import Floats
from pentapod.base.errors import InputError
from pentapod.base.progress import Progress, silent
from pentapod.base.units import from_si, to_si
from pentapod.base.values import Value
from pentapod.geometry.rigid import RigidTransform
from pentapod.job.artefacts import ARRAYS
from pentapod.job.build.placement import fixed_placement, job_at, placement_toml, pose_of
from pentapod.job.build.region import job_region
from pentapod.job.build.values import is_compensated, job_machine, job_mesh
from pentapod.job.clamped.placed_job import read_placement
from pentapod.job.plan_arrays import PLACEMENT
from pentapod.job.run_folder import check_run
from pentapod.job.schema.job import Job
from pentapod.job.schema.placement import PlacementTable
from pentapod.machine.machine import Machine
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.patch import Patch
from pentapod.mesh.query.distance import MeshDistance
from pentapod.registration.exchanged import exchanged_legs
from pentapod.registration.fit import register
from pentapod.registration.result import CutSurface, NotRegistered, Registration
from pentapod.registration.selection import chosen, rows_of, surface_points
from pentapod.registration.touches import Touches, read_touches


@dataclass(frozen=True)
class ProposalOptions:
    """Touches that are proposed, and points of the cut surface.

    most: touches at a time. facing: least cosine between a touched surface's normal and the way up. seen: change of a
    gap for each metre of an open motion from which a touch tells it. facets: of the cut surface, at most.
    """

    most: int = 3
    facing: float = -0.1
    seen: float = 0.05
    facets: int = 2_000


OPTIONS = ProposalOptions()


@dataclass(frozen=True, eq=False)
class FoundPart(Value):
    """A registration of a job's part. touches: as read; start: the planned placement.

    proposals: points (K, 3) and normals (K, 3), workpiece frame, where further touches tell most; empty where no
    touch of the mesh tells what is open.
    """

    summary = ("answer",)

    job: Job
    touches: Touches
    start: RigidTransform
    answer: Registration | NotRegistered
    proposals: tuple[Floats, Floats]

    @property
    def registration(self) -> Registration:
        """What was found, also where it is refused. Raises RefusalError where nothing was."""
        found = self.answer.found if isinstance(self.answer, NotRegistered) else self.answer
        return found if found is not None else self.answer.unwrap()

    @property
    def refused(self) -> NotRegistered | None:
        """The refusal; None where the part was registered."""
        return self.answer if isinstance(self.answer, NotRegistered) else None

    @property
    def outlier_names(self) -> list[str]:
        """The touches that were not used, as text."""
        found, lines = self.registration, self.touches.lines
        return [f"line {lines[k]}, off by {from_si(found.residuals[k], 'um'):.1f} um" for k in found.outliers]

    def toml(self) -> str:
        """Return the file for `--placement`, which is a job's table [placement] as well."""
        found = self.registration
        rms, known = (from_si(value, "um") for value in (found.rms, found.uncertainty))
        says = [
            f"# Where {self.job.mesh_path.name} is: from {int(found.used.sum())} of {len(found.used)} touches.",
            f"# Residuals {rms:.2f} um rms; the cut surface is known to {known:.2f} um (95 %).",
            *(f"# Not used: {name}." for name in self.outlier_names),
            *(f"# As planned, not measured: {motion.name}." for motion in found.held),
        ]
        pose = job_at(self.job, found.placement).placement
        table = PlacementTable(mode="fixed", position_mm=pose.position_mm, rotation_deg=pose.rotation_deg)
        return "\n".join([*says, placement_toml(table), ""])


def register_part(
    job: Job,
    touches: str | Path | Touches,
    *,
    near: str | Path | RigidTransform | None = None,
    noise: float | None = None,
    hold: bool = False,
    machine: Machine | None = None,
    progress: Progress = silent,
) -> FoundPart:
    """Return where the part of a job is, from the touches of a file.

    near: the planned placement: a run's folder, a placement file or a transform; by default that of the touches' head,
    or of a job with a fixed placement. noise: standard deviation of a touch, metres, where it is known. hold: motions
    that the touches do not determine stay as planned. machine: instead of the job's. Raises InputError.
    """
    file = None if isinstance(touches, Touches) else Path(touches)
    read = touches if isinstance(touches, Touches) else read_touches(touches)
    used = job_machine(job, machine)
    if used.guides is not None:
        raise InputError(
            "a machine with guides", file=file, key="machine", value=used.name,
            expected="one whose base joints stay where they are", remedy="describe it with its guides as they stand",
        )  # fmt: skip
    if read.machine is not None and read.machine != used.name:
        raise InputError(
            "touches of another machine", file=file, key="machine", value=read.machine, expected=used.name,
            remedy="name the job of that machine, or take the key out",
        )  # fmt: skip
    start = _start(job, read, near, file)
    progress("registration", 0.0)
    mesh = job_mesh(job, progress)
    surface, cut = MeshDistance.of(mesh), cut_surface(job, mesh)
    try:
        centres = read.centres(used, file, loaded=is_compensated(job, used))
    except InputError:
        _check_order(used, read, surface, start, file)
        raise
    try:
        answer = register(surface, centres, read.tip_radius, start, cut, noise=noise, hold=hold)
    except InputError as error:
        raise type(error)(
            error.what, file=file, key=error.key, value=error.value, expected=error.expected, remedy=error.remedy
        ) from error
    progress("registration", 1.0)
    if isinstance(answer, NotRegistered):
        _check_order(used, read, surface, start, file)
    found = answer.found if isinstance(answer, NotRegistered) else answer
    proposals = _proposals(mesh, cut, found, used) if found is not None else (np.zeros((0, 3)), np.zeros((0, 3)))
    if isinstance(answer, NotRegistered) and found is not None and found.held:
        answer = replace(answer, remedy=_remedy(proposals))
    return FoundPart(job, read, start, answer, proposals)


def _check_order(
    machine: Machine, touches: Touches, surface: MeshDistance, planned: RigidTransform, file: Path | None
) -> None:
    """Raise InputError where two legs are in each other's column."""
    pair = exchanged_legs(machine, touches, surface, planned)
    if pair is not None:
        first, second = (f"leg{leg}_mm" for leg in pair)
        raise InputError(
            f"{first} and {second} are exchanged: in each other's column, the touches are on the planned part",
            file=file, line=touches.lines[0] if touches.lines else None, remedy="write each leg into its own column",
        )  # fmt: skip


def cut_surface(job: Job, mesh: Mesh) -> CutSurface:
    """Return points and normals of the surface that a job cuts; of the whole mesh where its region holds nothing."""
    patch = Patch.of(mesh, job_region(job))
    patch = patch if len(patch.faces) else Patch.whole(mesh)
    count = min(len(patch.faces), OPTIONS.facets)
    facets = np.unique(np.linspace(0, len(patch.faces) - 1, count).astype(np.intp))
    points = patch.vertices[patch.faces[facets]].reshape(-1, 3)
    normals = np.repeat(patch.facet_normals[facets], 3, axis=0)
    return CutSurface(points, normals)


def planned_placement(folder: Path) -> RigidTransform:
    """Return the placement of the run in a folder. Raises InputError where there is none."""
    file = folder / ARRAYS
    if not file.is_file():
        raise InputError("there is no run in this folder", file=folder, expected=f"a folder with {ARRAYS}")
    check_run(folder)
    arrays = read_arrays(file, (), InputError, optional=(PLACEMENT,))
    if PLACEMENT not in arrays:
        raise InputError("the run found no placement", file=file, key=PLACEMENT, remedy="plan the job again")
    matrix = arrays[PLACEMENT].copy()
    matrix[:3, 3] = to_si(matrix[:3, 3], "mm")
    return RigidTransform.from_matrix(matrix)


def placement_from(place: str | Path | RigidTransform) -> RigidTransform:
    """Return a placement: of a run's folder, of a placement file, or as it is. Raises InputError."""
    if isinstance(place, RigidTransform):
        return place
    return planned_placement(Path(place)) if Path(place).is_dir() else read_placement(place)


def _start(job: Job, touches: Touches, near: str | Path | RigidTransform | None, file: Path | None) -> RigidTransform:
    """Return the planned placement."""
    if near is not None:
        return placement_from(near)
    if touches.position_mm is not None:
        return pose_of(touches.position_mm, touches.rotation_deg or (0.0, 0.0, 0.0))
    if job.placement.mode == "fixed":
        return fixed_placement(job.placement, lambda key, what, **details: job.error("placement", key, what, **details))
    raise InputError(
        "the planned placement is not known", file=file, key="position_mm",
        expected="where the part should be, to start from",
        remedy="name the run's folder or a placement file with --near",
    )  # fmt: skip


def _proposals(mesh: Mesh, cut: CutSurface, found: Registration, machine: Machine) -> tuple[Floats, Floats]:
    """Return points and normals where further touches tell most: of what is open, else of the cut surface."""
    base_is = -1.0 if machine.work.centre[2] > 0.0 else 1.0
    upward = found.placement.rotation.T @ np.array([0.0, 0.0, base_is])
    outward = -1.0 if mesh.diagnosis.inverted else 1.0
    points, normals = surface_points(mesh, outward * mesh.facet_normals @ upward > OPTIONS.facing)
    if not len(points):
        return points, normals
    rows = rows_of(points, normals, mesh)
    goal = rows_of(cut.points, cut.normals, mesh)
    if found.held:
        open_ = np.stack([motion.twist for motion in found.held])
        goal = open_
        rows = rows @ open_.T @ open_
        seen = np.linalg.norm(rows, axis=1)
        if seen.max() < OPTIONS.seen:
            return points[:0], normals[:0]
    take = chosen(rows, goal, found.rows[found.used], OPTIONS.most)
    return points[take], normals[take]


def _remedy(proposals: tuple[Floats, Floats]) -> str:
    if not len(proposals[0]):
        return (
            "No touch of this surface tells it: touch another face of the part, or keep it as planned with --hold "
            "where it does not matter"
        )
    return f"Touch next: {'; '.join(touch_names(*proposals))} (mesh frame); or keep it as planned with --hold"


def touch_names(points: Floats, normals: Floats) -> Sequence[str]:
    """Return touches as text: point in mm and direction of the normal, mesh frame."""

    def triple(values: Floats, digits: int) -> str:
        return f"({', '.join(f'{round(v, digits) + 0.0:g}' for v in values.tolist())})"

    return [
        f"{triple(np.asarray(from_si(point, 'mm')), 2)} mm from {triple(normal, 2)}"
        for point, normal in zip(points, normals, strict=True)
    ]
