"""The part in the report's scene: what the diagnosis counts is drawn where it is, in the machine's millimetres."""

from __future__ import annotations

import numpy as np

from page_arrays import arrays_of
from pentapod.geometry import RigidTransform
from pentapod.report.pack import Packed
from pentapod.report.page.scene import fault_lines
from pentapod.toolpath import Mesh


def faults(mesh, placement):
    """The lines of the faults by name, and whether they are shown; segments (K, 2, 3), millimetres."""
    packed = Packed()
    lines = fault_lines(packed, mesh, placement)
    arrays = arrays_of(packed.directory, packed.block)
    for line in lines:
        points = arrays[line["points"]]
        assert arrays[line["runs"]].ravel().tolist() == list(range(0, len(points), 2))
        line["segments"] = points.reshape(-1, 2, 3)
    return {line["name"]: line for line in lines}


def test_faults_are_drawn_where_they_are():
    """Two squares of opposite winding, a fin on their common edge, and a splinter apart."""
    vertices = np.array(
        [
            [0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0], [2, 1, 0], [1, 0.5, 1],
            [5, 0, 0], [6, 0, 0], [5.5, 1e-4, 0],
        ],
        dtype=float,
    )  # fmt: skip
    squares = [[0, 1, 2], [0, 2, 3], [1, 2, 4], [4, 2, 5]]
    mesh = Mesh.of(1e-2 * vertices, np.array([*squares, [1, 2, 6], [7, 8, 9]]))
    placement = RigidTransform(np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]]), np.array([0.1, 0.2, 0.3]))
    lines = faults(mesh, placement)
    fin = lines["mesh: more than two facets (1)"]
    wanted = 1e3 * placement.apply(1e-2 * vertices[[1, 2]])
    np.testing.assert_allclose(np.sort(fin["segments"][0], axis=0), np.sort(wanted, axis=0), atol=3e-3)
    assert fin["shown"]
    splinter = lines["mesh: sliver (1)"]["segments"]
    np.testing.assert_allclose(np.linalg.norm(splinter[0, 1] - splinter[0, 0]), 10.0, rtol=1e-3)
    borders = lines[f"mesh: border ({sum(mesh.topology.facets_at_edge == 1)})"]
    assert not borders["shown"]


def test_what_is_wound_unlike_is_drawn():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float) * 1e-2
    mesh = Mesh.of(vertices, np.array([[0, 1, 2], [0, 3, 2]]))
    line = faults(mesh, RigidTransform.identity())["mesh: opposite winding (1)"]
    np.testing.assert_allclose(np.sort(line["segments"][0], axis=0), [[0, 0, 0], [10, 10, 0]], atol=3e-3)
