"""Small bodies of a mesh, such as the debris of a scan, are left out and told."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from pentapod import Mesh, load_mesh
from pentapod.base.errors import JobError, MeshError
from pentapod.job import Job
from pentapod.job.build.values import job_mesh


def scan():
    """An open sheet of 40 x 30 mm, and pieces with an extent of 1.5, 2.9 and 5 mm; the numbers are mm."""
    sheet = trimesh.creation.box((40.0, 30.0, 10.0))
    sheet.update_faces(sheet.face_normals[:, 2] > -0.5)
    pieces = []
    for k, size in enumerate((1.5, 2.9, 5.0)):
        corners = size * np.array([[0.0, 0.0, 0.0], [0.6, 0.0, 0.0], [0.6, 0.8, 0.0], [0.0, 0.8, 0.0]])
        pieces.append(trimesh.Trimesh(corners + np.array([8.0 * k, 0.0, 20.0]), [[0, 1, 2], [0, 2, 3]]))
    return sheet, trimesh.util.concatenate([sheet, *pieces])


def test_bodies_of_a_smaller_extent_are_left_out(tmp_path):
    sheet, whole = scan()
    whole.export(tmp_path / "scan.stl")
    mesh = load_mesh(tmp_path / "scan.stl", "mm", least_body=3e-3)
    assert mesh.diagnosis.bodies == 2
    (note,) = mesh.diagnosis.notes
    area = 0.48 * (1.5**2 + 2.9**2)
    assert note == f"2 bodies smaller than 3 mm left out, {100 * area / whole.area:.2g} % of the area"
    assert 1e6 * mesh.facet_areas.sum() == pytest.approx(whole.area - area, rel=1e-6)
    all_of_them = load_mesh(tmp_path / "scan.stl", "mm")
    assert all_of_them.diagnosis.bodies == 4
    assert all_of_them.diagnosis.notes == ()
    only = load_mesh(tmp_path / "scan.stl", "mm", least_body=20e-3)
    np.testing.assert_allclose(1e6 * only.facet_areas.sum(), sheet.area, rtol=1e-6)


def test_the_repairs_of_the_file_stay_listed():
    _, whole = scan()
    faces = np.concatenate([whole.faces, whole.faces[:1], [[0, 0, 1]]])
    mesh = Mesh.of(1e-3 * whole.vertices, faces)
    assert mesh.diagnosis.repairs
    small = mesh.without_small_bodies(3e-3).diagnosis
    assert (small.repairs, small.degenerate, small.duplicated) == (mesh.diagnosis.repairs, 1, 1)
    assert small.facets == len(whole.faces) - 4


def test_a_mesh_without_small_bodies_stays_as_it_is():
    sheet, _ = scan()
    mesh = Mesh.of(1e-3 * sheet.vertices, sheet.faces)
    assert mesh.without_small_bodies(10e-3) is mesh


def test_the_error_of_a_job_names_its_key(make_job):
    job = Job.load(make_job()).with_(part={"least_body_mm": 1e4})
    with pytest.raises(JobError, match=r"part\.least_body_mm: no body of the mesh has an extent of 10000 mm"):
        job_mesh(job)


@pytest.mark.parametrize("least", [1.0, 0.0, -1e-3, np.nan])
def test_what_leaves_no_mesh_is_an_error(tmp_path, least):
    scan()[1].export(tmp_path / "scan.stl")
    with pytest.raises(MeshError, match="least_body"):
        load_mesh(tmp_path / "scan.stl", "mm", least_body=least)
