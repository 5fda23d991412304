"""Mesh: a triangulated surface in metres, with welded vertices, smooth normals and its diagnosis."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Bools, Floats, Ints, as_batch, frozen, set_frozen
from pentapod.base.errors import MeshError
from pentapod.base.progress import Progress, silent
from pentapod.base.units import from_si
from pentapod.base.values import Value
from pentapod.geometry.rigid import RigidTransform
from pentapod.mesh import normals
from pentapod.mesh import repair as repairing
from pentapod.mesh.diagnosis import MeshDiagnosis, counted, diagnose
from pentapod.mesh.topology import Topology

if TYPE_CHECKING:
    from trimesh import Trimesh

CREASE_ANGLE = np.radians(40.0)
"""Facets that meet at more than this angle keep their own normals."""


@dataclass(frozen=True, eq=False)
class Mesh(Value):
    """Triangle mesh. `Mesh.of` and `load_mesh` make one from unchecked data; the constructor checks nothing.

    vertices (V, 3): metres, workpiece frame. faces (F, 3): vertex indices, counterclockwise seen from outside.
    diagnosis: faults found and repaired. crease_angle: radians, see `normals`. exact_normals (F, 3, 3): unit, at the
    facets' corners, where they are known better than from the facets.

    >>> corners = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0]])
    >>> len(Mesh.of(corners, np.array([[0, 1, 2]])).faces)
    1
    """

    vertices: Floats
    faces: Ints
    diagnosis: MeshDiagnosis
    crease_angle: float = CREASE_ANGLE
    exact_normals: Floats | None = None

    def __post_init__(self) -> None:
        faces = np.array(self.faces, dtype=np.intp)
        faces.flags.writeable = False
        set_frozen(self, vertices=frozen(self.vertices, "vertices", (None, 3)), faces=faces)
        if self.exact_normals is not None:
            set_frozen(self, exact_normals=frozen(self.exact_normals, "exact_normals", (len(faces), 3, 3)))

    @classmethod
    def of(
        cls,
        vertices: ArrayLike,
        faces: ArrayLike,
        *,
        repair: bool = False,
        source: str = "mesh",
        crease_angle: float = CREASE_ANGLE,
        notes: tuple[str, ...] = (),
        exact_normals: Floats | None = None,
        progress: Progress = silent,
    ) -> Mesh:
        """Return the mesh of vertices (V, 3) in metres and facets (F, 3), with equal vertices welded.

        So are vertices on borders that are closer than 1e-5 of the largest extent; that is listed among the repairs.
        Duplicated and degenerate facets are dropped and listed among the repairs. With `repair`, all facets are also
        wound alike, and those of a closed surface outwards; without it, wrong winding is only diagnosed. Raises
        MeshError for no facets, zero area, indices beyond the vertices, and coordinates that are not finite.
        """
        points, facets = _checked(vertices, faces, source)
        progress("mesh", 0.3, "welding")
        points, facets = repairing.weld(points, facets)
        kept, dropped = _useful(points, facets, source)
        if dropped.any():
            points, facets = repairing.weld(points, facets[kept])
        progress("mesh", 0.6, "edges")
        repairs: list[str] = []
        topology = Topology(facets, len(points))
        if (joined := repairing.joined_borders(points, topology)) is not None:
            instead, near = joined
            merged = int((instead != np.arange(len(instead))).sum())
            repairs.append(f"{merged:,} vertices on borders merged with others less than {1e6 * near:.3g} µm away")
            rows, more = _useful(points, instead[facets], source)
            points, facets = repairing.weld(points, instead[facets[rows]])
            topology, kept, dropped = Topology(facets, len(points)), kept[rows], dropped + more
        names = zip(("degenerate", "duplicated"), dropped.tolist(), strict=True)
        repairs += [f"{count:,} {name} facets dropped" for name, count in names if count]
        exact = None if exact_normals is None else np.asarray(exact_normals)[kept]
        if repair:
            wound, done = repairing.wind(points, facets)
            if done:
                exact = exact if exact is None else _turned(exact, (wound != facets).any(axis=1))
                repairs.extend(done)
                points, facets = repairing.weld(points, wound)
                topology = Topology(facets, len(points))
        counts = (int(dropped[1]), int(dropped[0]))
        diagnosis = diagnose(points, topology, source, counts, tuple(repairs), notes)
        mesh = cls(points, facets, diagnosis, crease_angle, exact)
        mesh.__dict__["topology"] = topology  # fills the cached property: sorting a million edges takes a second
        return mesh

    def _derived(self, vertices: Floats, faces: Ints, source: str, exact: Floats | None) -> Mesh:
        notes, angle = self.diagnosis.notes, self.crease_angle
        return Mesh.of(vertices, faces, source=source, crease_angle=angle, notes=notes, exact_normals=exact)

    @cached_property
    def topology(self) -> Topology:
        """Which facets share which edges."""
        return Topology(self.faces, len(self.vertices))

    @cached_property
    def facet_normals(self) -> Floats:
        """Unit normals (F, 3) of the facets."""
        return frozen(normals.unit_or_zero(normals.facet_cross(self.vertices, self.faces)), "facet_normals")

    @cached_property
    def facet_areas(self) -> Floats:
        """Areas (F,) of the facets, square metres."""
        return frozen(0.5 * np.linalg.norm(normals.facet_cross(self.vertices, self.faces), axis=1), "facet_areas")

    @cached_property
    def vertex_normals(self) -> Floats:
        """Unit normals (V, 3), smooth over all facets at a vertex: for display, not for toolpaths."""
        return frozen(normals.vertex_normals(self.vertices, self.faces, self.facet_normals), "vertex_normals")

    @cached_property
    def corner_normals(self) -> Floats:
        """Unit normals (F, 3, 3) at the facets' corners, equal across edges except at creases and borders.

        Means of the exact normals, where there are some, else of the facets' normals.
        """
        smooth = normals.smooth_pairs(self.topology, self.facet_normals, self.crease_angle)
        exact = self.facet_normals if self.exact_normals is None else self.exact_normals
        return frozen(normals.corner_normals(self.vertices, self.topology, exact, smooth), "corner_normals")

    @property
    def bounds(self) -> Floats:
        """Lowest and highest coordinates (2, 3), metres."""
        return np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)])

    def transformed(self, transform: RigidTransform) -> Mesh:
        """Return the mesh moved rigidly."""
        exact = None if self.exact_normals is None else self.exact_normals @ transform.rotation.T
        return self._derived(transform.apply(self.vertices), self.faces, self.diagnosis.source, exact)

    def flipped(self) -> Mesh:
        """Return the mesh with its other side out: for an open sheet that faces away from the tool."""
        exact = None if self.exact_normals is None else -self.exact_normals[:, ::-1]
        return self._derived(self.vertices, self.faces[:, ::-1], self.diagnosis.source, exact)

    def body(self, number: int) -> Mesh:
        """Return one of the bodies that `diagnosis.bodies` counts, from 0. Raises MeshError for a larger number."""
        count, body_of_facet = self.topology.bodies
        if not 0 <= number < count:
            raise MeshError("no such body", value=number, expected=f"0 to {count - 1}")
        source = f"{self.diagnosis.source}, body {number}"
        own = body_of_facet == number
        exact = None if self.exact_normals is None else self.exact_normals[own]
        return self._derived(self.vertices, self.faces[own], source, exact)

    def small_bodies(self, least: float) -> Bools:
        """Return the facets (F,) of bodies with an extent, the diagonal of their bounding box, below `least` metres."""
        return self.topology.small_bodies(self.vertices, least)

    def without_small_bodies(self, least: float) -> Mesh:
        """Return the mesh without the bodies whose extent is below `least` metres, such as the debris of a scan.

        What was left out is one of its notes. Raises MeshError where nothing would stay.
        """
        small = self.small_bodies(least)
        if not small.any():
            return self
        size, source = f"{from_si(least, 'mm'):g} mm", self.diagnosis.source
        if small.all():
            raise MeshError(
                f"no body of the mesh has an extent of {size}",
                file=source,
                key="least_body_mm",
                remedy="a smaller value",
            )
        count, share = len(np.unique(self.topology.bodies[1][small])), self.facet_areas[small].sum()
        note = (
            f"{counted(count, 'body')} smaller than {size} left out, "
            f"{100.0 * share / self.facet_areas.sum():.2g} % of the area"
        )
        exact = None if self.exact_normals is None else self.exact_normals[~small]
        mesh = Mesh.of(
            self.vertices, self.faces[~small], source=source, crease_angle=self.crease_angle,
            notes=(*self.diagnosis.notes, note), exact_normals=exact,
        )  # fmt: skip
        names = ("repairs", "duplicated", "degenerate")
        done = {name: getattr(self.diagnosis, name) for name in names}
        found = replace(mesh, diagnosis=replace(mesh.diagnosis, **done))
        found.__dict__["topology"] = mesh.topology
        return found

    @classmethod
    def from_trimesh(cls, shape: Trimesh, metres: float, *, repair: bool = False) -> Mesh:
        """Return the mesh of a `trimesh.Trimesh`, read from any format or made by any function of trimesh.

        metres: length of one unit of its numbers, 1e-3 for millimetres. repair and errors: as `of`.
        """
        if not (np.isfinite(metres) and metres > 0.0):
            raise MeshError("the unit must be a positive number of metres", key="metres", value=metres)
        return cls.of(metres * np.asarray(shape.vertices), shape.faces, repair=repair, source="trimesh")

    def to_trimesh(self) -> Trimesh:
        """Return the mesh as a `trimesh.Trimesh`, in metres, with the same vertices and facets in the same order."""
        from trimesh import Trimesh  # noqa: PLC0415  heavy: only for those who ask

        return Trimesh(self.vertices, self.faces, process=False)


def _useful(points: Floats, facets: Ints, source: str) -> tuple[Ints, Ints]:
    """Return the facets (K,) that are neither degenerate nor duplicated, and how many (2,) are.

    Raises MeshError where all are degenerate.
    """
    degenerate = repairing.degenerate_facets(points, facets)
    if degenerate.all():
        raise MeshError("the mesh has zero area: no facet spans a surface", file=source)
    rows = np.flatnonzero(~degenerate)
    duplicated = repairing.duplicated_facets(facets[rows], len(points))
    return rows[~duplicated], np.array([degenerate.sum(), duplicated.sum()])


def _turned(normals: Floats, turned: Bools) -> Floats:
    """Return the normals (F, 3, 3) of corners with those of turned facets reversed."""
    return np.where(turned[:, None, None], -normals[:, ::-1], normals)


def _checked(vertices: ArrayLike, faces: ArrayLike, source: str) -> tuple[Floats, Ints]:
    points, facets = as_batch(vertices, "vertices", (None, 3)), np.asarray(faces)
    if facets.size == 0 or not len(points):
        raise MeshError("the mesh has no facets", file=source, expected="a surface made of triangles")
    if facets.ndim != 2 or facets.shape[1] != 3 or not np.issubdtype(facets.dtype, np.integer):
        raise MeshError(
            "facets are not triangles of vertex indices", file=source, value=facets.shape, expected="(F, 3)"
        )
    facets = facets.astype(np.intp)
    if facets.min() < 0 or facets.max() >= len(points):
        raise MeshError(
            f"a facet uses a vertex that is not there; the mesh has {len(points):,} vertices",
            file=source,
            value=int(facets.max() if facets.max() >= len(points) else facets.min()),
            remedy="the file may be truncated",
        )
    finite = np.isfinite(points).all(axis=1)
    wrong = np.flatnonzero(~np.take(finite, facets).all(axis=1))
    if len(wrong):
        raise MeshError(
            f"{len(wrong):,} facets have coordinates that are not finite, the first is facet {int(wrong[0])}",
            file=source,
            remedy="export the mesh again",
        )
    return points, facets
