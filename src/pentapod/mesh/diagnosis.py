"""MeshDiagnosis: counts of what makes a mesh unsound for machining, and its one-paragraph text."""

from __future__ import annotations

from dataclasses import dataclass

from pentapod.base.values import Value


@dataclass(frozen=True)
class MeshDiagnosis(Value):
    """What was found in a mesh, and what was mended.

    facets, vertices: after welding and repairs. watertight: every edge has exactly two facets. consistent:
    neighbours are wound alike. inverted: a closed surface whose normals point inwards. border_loops: pieces of
    border, of holes and of an open sheet. non_manifold_edges: edges of three facets or more. inconsistent_edges:
    between two facets wound unlike. slivers: facets a thousand times as long as high, which are kept. extents:
    metres. duplicated, degenerate: facets found in the file (they are dropped, see repairs). repairs, notes: sentences.
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
    def remarks(self) -> tuple[str, ...]:
        """What is worth knowing and no problem."""
        found = list(self.notes)
        if self.slivers:
            found.append(f"{_count(self.slivers, 'sliver')}, a thousand times as long as high")
        return tuple(found)

    @property
    def problems(self) -> tuple[str, ...]:
        """What is still wrong after the repairs, with the remedy; empty for a sound surface."""
        found: list[str] = []
        if not self.consistent:
            edges = _count(self.inconsistent_edges, "edge")
            found.append(
                f"facets are wound unlike at {edges}: some normals point the wrong way; load with repair = true"
            )
        if self.inverted:
            found.append("the closed surface is inside out: normals point inwards; load with repair = true")
        if self.non_manifold_edges:
            found.append(f"{_count(self.non_manifold_edges, 'edge')} with more than two facets: passes end there")
        return tuple(found)

    def __str__(self) -> str:
        x, y, z = (1e3 * e for e in self.extents)
        shape = "watertight" if self.watertight else f"open, {_count(self.border_loops, 'border loop')}"
        winding = "winding consistent" if self.consistent else "winding inconsistent"
        lines = [
            f"{self.source}: {_count(self.facets, 'facet')}, {_count(self.vertices, 'vertex')}, "
            f"{_count(self.bodies, 'body')}",
            f"  {x:.4g} x {y:.4g} x {z:.4g} mm, area {1e4 * self.area:.4g} cm2; {shape}; {winding}"
            + ("; inside out" if self.inverted else ""),
        ]
        lines += [f"  repaired: {text}" for text in self.repairs]
        lines += [f"  note: {text}" for text in self.remarks]
        lines += [f"  problem: {text}" for text in self.problems]
        return "\n".join(lines)


def _count(number: int, noun: str) -> str:
    plural = {"vertex": "vertices", "body": "bodies"}.get(noun, noun + "s")
    return f"{number:,} {noun if number == 1 else plural}"
