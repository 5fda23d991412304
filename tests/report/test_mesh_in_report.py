"""The part in the report's scene: what the diagnosis counts is drawn where it is, in the machine's millimetres."""

from __future__ import annotations

import base64

import numpy as np

from pentapod.geometry import RigidTransform
from pentapod.report.scene import fault_traces
from pentapod.toolpath import Mesh


def drawn(trace):
    """The segments (K, 2, 3) of a trace, millimetres; gaps between them are NaN."""
    assert trace["type"] == "scatter3d"
    flat = [np.frombuffer(base64.b64decode(trace[axis]["bdata"]), "<f4") for axis in "xyz"]
    rows = np.stack(flat, axis=1).reshape(-1, 3, 3)
    assert np.isnan(rows[:, 2]).all()
    return rows[:, :2]


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
    traces = {trace["name"]: trace for trace in fault_traces(mesh, placement)}
    fin = traces["mesh: more than two facets (1)"]
    wanted = 1e3 * placement.apply(1e-2 * vertices[[1, 2]])
    np.testing.assert_allclose(np.sort(drawn(fin)[0], axis=0), np.sort(wanted, axis=0), atol=1e-4)
    assert "visible" not in fin
    splinter = drawn(traces["mesh: sliver (1)"])
    np.testing.assert_allclose(np.linalg.norm(splinter[0, 1] - splinter[0, 0]), 10.0, rtol=1e-5)
    borders = traces[f"mesh: border ({sum(mesh.topology.facets_at_edge == 1)})"]
    assert borders["visible"] == "legendonly"


def test_what_is_wound_unlike_is_drawn():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float) * 1e-2
    mesh = Mesh.of(vertices, np.array([[0, 1, 2], [0, 3, 2]]))
    trace = {t["name"]: t for t in fault_traces(mesh, RigidTransform.identity())}["mesh: opposite winding (1)"]
    np.testing.assert_allclose(np.sort(drawn(trace)[0], axis=0), [[0, 0, 0], [10, 10, 0]], atol=1e-5)
