"""Where kernels cannot be compiled, arrays give the same tree and the same depths."""

from __future__ import annotations

import numpy as np
import pytest
import toolpath_surfaces as surfaces

from pentapod.toolpath import Mesh, facet_tree, sweep
from pentapod.toolpath.facet_tree import FacetTree
from pentapod.toolpath.solids import Cone
from pentapod.toolpath.tools import BallCutter, BullNose, FlatEnd, Lollipop, StandOff

TOOLS = [
    BallCutter(3e-3, flute=8e-3, shank=(Cone(0.01, 2e-3, 2e-3),), holder=(Cone(0.01, 4e-3, 9e-3),)),
    BullNose(5e-3, 1.5e-3, flute=8e-3, holder=(Cone(0.02, 7e-3, 7e-3),)),
    FlatEnd(3e-3, flute=8e-3, shank=(Cone(0.01, 3e-3, 2e-3),)),
    Lollipop(4e-3, 1.5e-3, 0.02),
    StandOff(5e-3, shank=(Cone(0.01, 0.5e-3, 6e-3),)),
]


def waves(x, y):
    return 3e-3 * np.sin(120 * x) * np.cos(90 * y)


@pytest.fixture
def without_kernels(monkeypatch):
    for module in (sweep, facet_tree):
        monkeypatch.setattr(module, "kernels_available", lambda: False)


def test_boxes_are_those_of_the_kernel_and_hold_their_facets(without_kernels):
    from pentapod.toolpath.box_kernels import fit_boxes

    tree = FacetTree.of(Mesh.of(*surfaces.grid(waves, width=0.04, cells=13)))
    expected = np.empty_like(tree.boxes)
    fit_boxes(tree.corners, tree.starts, expected)
    np.testing.assert_allclose(tree.boxes, expected, atol=1e-12)
    root = tree.boxes[0]
    along = (tree.corners.reshape(-1, 3) - root[:3]) @ root[6:].reshape(3, 3).T
    assert (np.abs(along) <= root[3:6]).all()


@pytest.mark.parametrize("tool", TOOLS, ids=lambda tool: type(tool).__name__)
@pytest.mark.parametrize("threshold", [0.0, -2e-3])
def test_depths_are_those_of_the_kernels(tool, threshold, monkeypatch):
    tree = FacetTree.of(Mesh.of(*surfaces.grid(waves, width=0.04, cells=16)))
    random = np.random.default_rng(2)
    tips = random.uniform(-0.012, 0.012, (5, 3)) * [1.0, 1.0, 0.4]
    axes = random.normal(size=(5, 3)) * 0.4 + [0.0, 0.0, 1.0]
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    expected = [f(tree, tool, tips, axes, threshold=threshold) for f in (sweep.sweep, sweep.touch)]
    for module in (sweep, facet_tree):
        monkeypatch.setattr(module, "kernels_available", lambda: False)
    for found, known in zip(
        [f(tree, tool, tips, axes, threshold=threshold) for f in (sweep.sweep, sweep.touch)], expected, strict=True
    ):
        # Each is exact to the resolution and one per cent; what is just at the threshold either may miss.
        deep = known.depths > threshold + 1e-5
        assert (found.depths[deep] > threshold).all()
        np.testing.assert_allclose(found.depths[deep], known.depths[deep], atol=2e-6, rtol=0.021)
        assert (found.depths[known.depths == -np.inf] < threshold + 1e-5).all()
        hit = found.depths > -np.inf
        assert (found.facets[hit] >= 0).all()
        np.testing.assert_array_equal(np.isfinite(found.times), hit)
