"""Mesh diagnosis: counts and places of the faults that make a mesh unsuitable for machining."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.base.values import Value
from pentapod.mesh.normals import facet_cross
from pentapod.mesh.repair import signed_volume, slivers
from pentapod.mesh.topology import Topology

SHATTERED = 0.5
"""Ratio of bodies to facets above which the facets are said not to join."""


@dataclass(frozen=True)
class MeshDiagnosis(Value):
    """Faults of a mesh.

    facets, vertices: after welding and repairs. watertight: every edge has exactly two facets. consistent: neighbours
    are wound alike. inverted: a closed surface whose normals point inwards. border_loops: connected pieces of border,
    of holes or of an open sheet. non_manifold_edges: edges of three facets or more. inconsistent_edges: between two
    facets wound in opposite senses. slivers: facets a thousand times as long as high; they are kept. duplicated,
    degenerate: facets of the file that were dropped. extents: metres; area: square metres.
    """

    source: str
    facets: int
    vertices: int
    bodies: int
    watertight: bool
    consistent: bool
    inverted: bool
    border_loops: int
    non_manifold_edges: int
    inconsistent_edges: int
    slivers: int
    duplicated: int
    degenerate: int
    area: float
    extents: tuple[float, float, float]
    repairs: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def shattered(self) -> bool:
        """Whether the facets are no surface: nearly each of them is a body of its own."""
        return self.facets > 1 and self.bodies > SHATTERED * self.facets

    @property
    def remarks(self) -> tuple[str, ...]:
        """Findings that do not disturb machining."""
        thin = f"{counted(self.slivers, 'sliver')}, a thousand times as long as high"
        return (*self.notes, thin) if self.slivers else self.notes

    @property
    def problems(self) -> tuple[str, ...]:
        """Faults left after the repairs, each with its remedy; empty for a sound surface."""
        found: list[str] = []
        if not self.consistent:
            edges = counted(self.inconsistent_edges, "edge")
            found.append(
                f"facets are wound in opposite senses at {edges}: some normals point the wrong way; "
                "load with repair = true"
            )
        if self.inverted:
            found.append("the closed surface is inside out: normals point inwards; load with repair = true")
        if self.non_manifold_edges:
            found.append(f"{counted(self.non_manifold_edges, 'edge')} with more than two facets: passes end there")
        if self.shattered:
            found.append(
                f"the facets do not join: {self.bodies:,} bodies of {self.facets:,} facets; "
                "merge close vertices in the program that wrote the mesh"
            )
        return tuple(found)

    def __str__(self) -> str:
        x, y, z = (1e3 * e for e in self.extents)
        shape = "watertight" if self.watertight else f"open, {counted(self.border_loops, 'border loop')}"
        winding = "winding consistent" if self.consistent else "winding inconsistent"
        lines = [
            f"{self.source}: {counted(self.facets, 'facet')}, {counted(self.vertices, 'vertex')}, "
            f"{counted(self.bodies, 'body')}",
            f"  {x:.4g} x {y:.4g} x {z:.4g} mm, area {1e4 * self.area:.4g} cm2; {shape}; {winding}"
            + ("; inside out" if self.inverted else ""),
        ]
        lines += [f"  repaired: {text}" for text in self.repairs]
        lines += [f"  note: {text}" for text in self.remarks]
        lines += [f"  problem: {text}" for text in self.problems]
        return "\n".join(lines)


def counted(number: int, noun: str) -> str:
    """Return a number with its noun."""
    plural = {"vertex": "vertices", "body": "bodies"}.get(noun, noun + "s")
    return f"{number:,} {noun if number == 1 else plural}"


def diagnose(
    vertices: Floats,
    topology: Topology,
    source: str,
    dropped: tuple[int, int],
    repairs: tuple[str, ...],
    notes: tuple[str, ...],
) -> MeshDiagnosis:
    """Return the diagnosis of a repaired mesh. dropped: how many facets were duplicated, and degenerate."""
    facets = topology.faces
    closed = topology.watertight and topology.consistent
    extents = vertices.max(axis=0) - vertices.min(axis=0)
    return MeshDiagnosis(
        source=source,
        facets=len(facets),
        vertices=len(vertices),
        bodies=topology.bodies[0],
        watertight=topology.watertight,
        consistent=topology.consistent,
        inverted=closed and signed_volume(vertices, facets) < 0.0,
        border_loops=topology.border_loops,
        non_manifold_edges=int((topology.facets_at_edge > 2).sum()),
        inconsistent_edges=int((~topology.pair_agrees).sum()),
        slivers=int(slivers(vertices, facets).sum()),
        duplicated=dropped[0],
        degenerate=dropped[1],
        area=float(0.5 * np.linalg.norm(facet_cross(vertices, facets), axis=1).sum()),
        extents=(float(extents[0]), float(extents[1]), float(extents[2])),
        repairs=repairs,
        notes=notes,
    )


def fault_edges(vertices: Floats, topology: Topology) -> dict[str, Floats]:
    """Return by name the edges (K, 2, 3), metres, of each kind of fault that a mesh has, to draw them.

    "border": of holes and of an open sheet; "more than two facets": not manifold; "opposite winding": between facets
    that face opposite ways; "sliver": the longest side of each.
    """
    edges = {
        "border": topology.edges[topology.facets_at_edge == 1],
        "more than two facets": topology.edges[topology.facets_at_edge > 2],
        "opposite winding": topology.edges[topology.pair_edges[~topology.pair_agrees]],
        "sliver": _longest_sides(vertices, topology.faces[slivers(vertices, topology.faces)]),
    }
    return {name: vertices[ends] for name, ends in edges.items() if len(ends)}


def _longest_sides(vertices: Floats, faces: Ints) -> Ints:
    """Return the vertices (F, 2) of the longest side of each facet."""
    after = np.roll(faces, -1, axis=1)
    longest = np.linalg.norm(vertices[after] - vertices[faces], axis=2).argmax(axis=1)
    rows = np.arange(len(faces))
    return np.stack([faces[rows, longest], after[rows, longest]], axis=1)
