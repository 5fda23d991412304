"""Triangle meshes: reading, repair, diagnosis, and geometric queries."""

from pentapod.mesh.diagnosis import MeshDiagnosis
from pentapod.mesh.io.load import UNITS, load_mesh
from pentapod.mesh.io.registry import MESH_FORMATS, MeshData, MeshFormat, ReadOptions
from pentapod.mesh.io.stl import write_stl
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.query.heightfield import HeightField
from pentapod.mesh.region import Region

__all__ = [
    "MESH_FORMATS",
    "UNITS",
    "HeightField",
    "Mesh",
    "MeshData",
    "MeshDiagnosis",
    "MeshFormat",
    "ReadOptions",
    "Region",
    "load_mesh",
    "write_stl",
]
