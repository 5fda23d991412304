"""Script that turns a STEP file into facets by Open CASCADE, in a process of its own: a broken file may end it.

Arguments: the file, the .npz to write, the largest distance of facets from the surface in mm, the largest angle between
neighbouring facets in radians, the largest number of facets. Exit code 4: the last line of stderr says what is wrong.
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import Any

import numpy as np

REFUSED = 4


def refuse(what: str) -> None:
    """End the process with a message."""
    sys.stderr.write(f"\n{what}\n")
    sys.exit(REFUSED)


def shape_of(file: str) -> Any:
    """Return the shape of a STEP file, in mm."""
    control, interface = import_module("OCP.STEPControl"), import_module("OCP.IFSelect")
    reader = control.STEPControl_Reader()
    if reader.ReadFile(file) != interface.IFSelect_ReturnStatus.IFSelect_RetDone:
        refuse("cannot be read as STEP")
    reader.TransferRoots()
    shape = reader.OneShape()
    if shape.IsNull():
        refuse("the file holds no shape")
    return shape


def facets_of(shape: Any, most: int) -> tuple[list[Any], ...]:
    """Return points, facets and normals of the faces of a tessellated shape, and how many faces there are."""
    explorer, kinds = import_module("OCP.TopExp"), import_module("OCP.TopAbs").TopAbs_ShapeEnum
    topods, brep, location = import_module("OCP.TopoDS").TopoDS, import_module("OCP.BRep"), import_module("OCP.TopLoc")
    tool = import_module("OCP.StdPrs").StdPrs_ToolTriangulatedShape
    reversed_ = import_module("OCP.TopAbs").TopAbs_Orientation.TopAbs_REVERSED
    points, facets, normals, missing, count = list[Any](), list[Any](), list[Any](), 0, 0
    faces = explorer.TopExp_Explorer(shape, kinds.TopAbs_FACE)
    while faces.More():
        face = topods.Face_s(faces.Current()) if hasattr(topods, "Face_s") else topods.Face(faces.Current())
        faces.Next()
        count += 1
        place = location.TopLoc_Location()
        found = brep.BRep_Tool.Triangulation_s(face, place)
        if found is None:
            missing += 1
            continue
        # Exact normals; the triangulation's own are means of its facets.
        tool.ComputeNormals_s(face, found)
        move = place.Transformation()
        mirrored = move.IsNegative()
        turned = (face.Orientation() == reversed_) != mirrored
        start, sign = len(points), -1.0 if face.Orientation() == reversed_ else 1.0
        for k in range(1, found.NbNodes() + 1):
            point, normal = found.Node(k).Transformed(move), found.Normal(k).Transformed(move)
            points.append((point.X(), point.Y(), point.Z()))
            normals.append((sign * normal.X(), sign * normal.Y(), sign * normal.Z()))
        for k in range(1, found.NbTriangles() + 1):
            a, b, c = found.Triangle(k).Get()
            corners = (a, c, b) if turned else (a, b, c)
            facets.append([start + corner - 1 for corner in corners])
        if len(facets) > most:
            refuse(f"it takes more than {most:,} facets; a larger chordal_mm takes fewer")
    return points, facets, normals, [count, missing]


def main(source: str, target: str, deflection: float, angle: float, most: int) -> None:
    """Write the facets of a STEP file."""
    shape = shape_of(source)
    import_module("OCP.BRepMesh").BRepMesh_IncrementalMesh(shape, deflection, False, angle, False)
    points, facets, normals, faces = facets_of(shape, most)
    np.savez(
        target, vertices=np.array(points, dtype=np.float64).reshape(-1, 3),
        facets=np.array(facets, dtype=np.int64).reshape(-1, 3),
        normals=np.array(normals, dtype=np.float64).reshape(-1, 3), faces=np.array(faces, dtype=np.int64),
    )  # fmt: skip


if __name__ == "__main__":
    file, arrays, distance, turn, facets = sys.argv[1:]
    main(file, arrays, float(distance), float(turn), int(facets))
