"""Script that reads the facets of a GLB file by trimesh, in a process of its own: a hostile file may not end.

Arguments: the file, the .npz to write, the largest number of facets. Exit code 4: the last line of stderr says what is
wrong, and after a tab what helps.
"""

from __future__ import annotations

import io
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

REFUSED = 4
TRIANGLES = (4, 5)
"""Modes of primitives that are triangles: one by one, and strips."""
HARMLESS = ("KHR_materials_", "KHR_texture_", "KHR_lights_", "KHR_mesh_quantization")
"""Beginnings of the names of extensions that leave the vertices as they are."""


def refuse(what: str, remedy: str = "") -> None:
    """End the process with what is wrong, and what helps."""
    sys.stderr.write(f"\n{what}\t{remedy}\n")
    sys.exit(REFUSED)


def check(data: bytes) -> None:
    """Refuse what trimesh would read with facets left out or at wrong places."""
    header: dict[str, Any] = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
    if any("uri" in buffer for buffer in header.get("buffers", [])):
        refuse("its vertices are in another file", "export one file (.glb) with everything in it")
    unknown = [name for name in header.get("extensionsRequired", []) if not name.startswith(HARMLESS)]
    if unknown:
        refuse(f"it needs an extension that is not read: {unknown[0]}", "export without compression and extensions")
    if any(
        "skin" in node or "EXT_mesh_gpu_instancing" in node.get("extensions", {}) for node in header.get("nodes", [])
    ):
        refuse("it holds bodies that are bent by a skeleton, or placed by a list", "export plain bodies")
    accessors = header.get("accessors", [])
    for mesh in header.get("meshes", []):
        for primitive in mesh["primitives"]:
            places = [primitive["attributes"]["POSITION"], *([primitive["indices"]] if "indices" in primitive else [])]
            if primitive.get("mode", TRIANGLES[0]) not in TRIANGLES:
                refuse("it holds lines, points or fans", "export triangles alone")
            if any("bufferView" not in accessors[place] or "sparse" in accessors[place] for place in places):
                refuse("its vertices are compressed, or stored as changes", "export them plainly")
            if "targets" in primitive or accessors[places[0]].get("normalized", False):
                refuse("its vertices are moved by weights, or stored as shares", "export them plainly")


def main(source: str, target: str, most: int) -> None:
    """Write the facets of all bodies of a scene, where they are placed."""
    data = Path(source).read_bytes()
    check(data)
    scene = trimesh.load_scene(io.BytesIO(data), file_type="glb", process=False, skip_materials=True)
    placed = [scene.graph[node] for node in scene.graph.nodes_geometry]
    if sum(len(scene.geometry[name].faces) for _, name in placed) > most:
        refuse(f"it unfolds to more than {most:,} facets", "export fewer facets, or fewer copies")
    points, facets, count = [np.zeros((0, 3))], [np.zeros((0, 3), dtype=np.int64)], 0
    for matrix, name in placed:
        body = scene.geometry[name]
        points.append(trimesh.transform_points(body.vertices, matrix))
        faces = np.asarray(body.faces, dtype=np.int64)
        if len(faces) and not 0 <= faces.min() <= faces.max() < len(body.vertices):
            refuse("a facet uses a vertex that is not there")
        facets.append((faces[:, ::-1] if np.linalg.det(matrix[:3, :3]) < 0.0 else faces) + count)
        count += len(body.vertices)
    np.savez(target, vertices=np.concatenate(points), facets=np.concatenate(facets))


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]))
