"""Parts and refinements of a patch that know where they lie on it, so that quantities known there can be asked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.mesh.patch import Patch


@dataclass(frozen=True, eq=False)
class PatchOn:
    """A patch that lies on another. facets (F,): of the other, one for each; weights (F, 3, 3): its corners there."""

    patch: Patch
    facets: Ints
    weights: Floats

    @classmethod
    def of(cls, base: Patch, change: Callable[[Patch], Patch]) -> PatchOn:
        """Return what a change (cut facets, refined ones) makes of a patch."""
        count = len(base.faces)
        # Where corners lie is interpolated with the normals, as further components.
        number = np.broadcast_to(np.arange(count, dtype=np.float64)[:, None, None], (count, 3, 1))
        weights = np.broadcast_to(np.eye(3), (count, 3, 3))
        changed = change(Patch(base.vertices, base.faces, np.concatenate([base.normals, weights, number], axis=2)))
        patch = Patch(changed.vertices, changed.faces, np.ascontiguousarray(changed.normals[:, :, :3]))
        facets = np.rint(changed.normals[:, 0, 6]).astype(np.intp)
        return cls(patch, facets, np.ascontiguousarray(changed.normals[:, :, 3:6]))

    def where(self, keep: Bools) -> PatchOn:
        """Return the facets (F,) that are marked."""
        patch = Patch(self.patch.vertices, self.patch.faces[keep], self.patch.normals[keep])
        return PatchOn(patch, self.facets[keep], self.weights[keep])

    def places(self, facets: Ints, weights: Floats) -> tuple[Ints, Floats]:
        """Return facets (N,) and weights (N, 3) on the other patch of places on this one."""
        return self.facets[facets], np.einsum("nk,nkj->nj", weights, self.weights[facets])

    def at_vertices(self, quantity: Callable[[Ints, Floats], Floats]) -> Floats:
        """Return a quantity of places on the other patch at the vertices (V,) of this one."""
        corner = np.zeros(len(self.patch.vertices), dtype=np.intp)
        corner[self.patch.faces.ravel()[::-1]] = np.arange(3 * len(self.patch.faces))[::-1]
        facet, k = np.divmod(corner, 3)
        return quantity(self.facets[facet], self.weights[facet, k])

    def carried(self, quantity: Callable[[Ints, Floats], Floats]) -> Callable[[Ints, Floats], Floats]:
        """Return a quantity of places on the other patch as one of places on this one."""
        return lambda facets, weights: quantity(*self.places(facets, weights))
