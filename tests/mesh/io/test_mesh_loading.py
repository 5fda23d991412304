"""Mesh files: good ones are read as another reader reads them; bad ones get one clear line."""

from __future__ import annotations

import numpy as np
import pytest

import toolpath_surfaces as surfaces
from pentapod.base.errors import InputError, MeshError
from pentapod.mesh import MESH_FORMATS, ReadOptions
from pentapod.toolpath import UNITS, Mesh, load_mesh, write_stl
from plugins import install


@pytest.fixture
def ball():
    vertices, faces = surfaces.sphere(50.0, 2)
    return vertices[faces]


def ascii_stl(triangles):
    lines = ["solid ball"]
    for corners in triangles:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += ["vertex {:.9g} {:.9g} {:.9g}".format(*p) for p in corners]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid ball", ""])


@pytest.mark.parametrize("suffix", ["stl", "ascii.stl", "ply", "ascii.ply", "obj", "STL"])
def test_every_format_gives_the_same_closed_ball(tmp_path, ball, suffix):
    import trimesh

    path = tmp_path / f"ball.{suffix}"
    shape = trimesh.Trimesh(*surfaces.sphere(50.0, 2), process=False)
    if suffix == "ascii.ply":
        path.write_bytes(trimesh.exchange.ply.export_ply(shape, encoding="ascii"))
    elif suffix == "ascii.stl":
        path.write_text(ascii_stl(ball))
    elif suffix == "STL":
        path.write_bytes(write_stl(ball, "solid that is binary all the same"))
    else:
        shape.export(path)
    mesh = load_mesh(path, "mm")
    assert len(mesh.faces) == 320
    assert len(mesh.vertices) == 162
    assert mesh.diagnosis.watertight
    assert mesh.diagnosis.consistent
    assert not mesh.diagnosis.inverted
    np.testing.assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 0.05, rtol=1e-6)
    assert str(mesh.diagnosis).startswith(path.name)


def test_written_stl_is_read_by_trimesh(tmp_path, ball):
    import trimesh

    path = tmp_path / "ball.stl"
    path.write_bytes(write_stl(ball, "ball"))
    other = trimesh.load(path, process=False)
    np.testing.assert_allclose(other.triangles, ball, rtol=1e-6, atol=1e-5)
    outward = (other.face_normals * other.triangles_center).sum(axis=1)
    assert (outward > 0).all()


@pytest.mark.parametrize("unit", UNITS)
def test_units_and_scale_are_factors(tmp_path, ball, unit):
    path = tmp_path / "ball.stl"
    path.write_bytes(write_stl(ball, "ball"))
    metres = {"mm": 0.001, "cm": 0.01, "inch": 0.0254, "m": 1.0}[unit]
    assert load_mesh(path, unit, scale=0.5).diagnosis.extents[2] == pytest.approx(50.0 * metres, rel=1e-3)


@pytest.mark.parametrize(
    ("size_mm", "in_file", "likely"), [(100.0, 100.0, "mm"), (100.0, 100.0 / 25.4, "inch"), (100.0, 0.1, "m")]
)
def test_missing_unit_shows_the_extents_and_the_likely_one(tmp_path, size_mm, in_file, likely):
    vertices, faces = surfaces.sphere(in_file / 2, 1)
    path = tmp_path / "ball.stl"
    path.write_bytes(write_stl(vertices[faces], "ball"))
    with pytest.raises(MeshError, match=f'unit = "{likely}" is likely') as caught:
        load_mesh(path)
    assert caught.value.key == "unit"
    assert f"{size_mm:.4g} x" in str(caught.value) or "99." in str(caught.value) or "95" in str(caught.value)


def test_unknown_unit_names_the_nearest(tmp_path, ball):
    path = tmp_path / "ball.stl"
    path.write_bytes(write_stl(ball, "ball"))
    with pytest.raises(MeshError, match='did you mean "inch"'):
        load_mesh(path, "inches")
    with pytest.raises(MeshError, match="known: cm, inch, m, mm"):
        load_mesh(path, "furlong")


def nan_stl(ball):
    broken = ball.copy()
    broken[7, 1, 2] = np.nan
    return write_stl(broken, "ball")


PLY_HEAD = b"ply\nformat ascii 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
PLY_FACES = b"element face %d\nproperty list uchar int vertex_indices\nend_header\n"
OBJ_POINTS = b"v 0 0 0\nv 1 0 0\nv 0 1 0\n"
PLY_POINTS = b"0 0 0\n1 0 0\n0 1 0\n"

BAD = {
    "empty.stl": (lambda _: b"", "empty"),
    "blank.stl": (lambda _: b" \n\n", "empty"),
    "short.stl": (lambda _: b"\0" * 40, "truncated"),
    "cut.stl": (lambda ball: write_stl(ball, "ball")[:-77], "announces 320 facets, the file holds 318"),
    "cut_ascii.stl": (lambda ball: ascii_stl(ball)[: len(ascii_stl(ball)) // 2].encode(), "truncated"),
    "no_endsolid.stl": (lambda ball: ascii_stl(ball).replace("endsolid", "").encode(), "endsolid"),
    "words.stl": (lambda _: b"Dear reader,\nthis is not a mesh but a letter.\n" * 20, "a text file, not STL"),
    "solid_words.stl": (lambda _: b"solid advice for everyone who reads this letter" * 9, "no facet follows"),
    "letters.stl": (
        lambda ball: ascii_stl(ball).replace("vertex ", "vertex x", 1).encode(),
        "letters.stl:4: a vertex is not three numbers",
    ),
    "none.stl": (lambda _: write_stl(np.zeros((0, 3, 3)), "none"), "no facets"),
    "none_ascii.stl": (lambda _: b"solid x\nendsolid x\n", "no facets"),
    "flat.stl": (lambda ball: write_stl(ball[:, [0, 0, 1]], "flat"), "zero area"),
    "nan.stl": (nan_stl, "1 facets have coordinates that are not finite, the first is facet 7"),
    "noise.ply": (lambda _: bytes(range(256)) * 9, "cannot be read as PLY"),
    "words.ply": (lambda _: b"a letter, not a mesh", "cannot be read as PLY"),
    "cut.ply": (lambda _: PLY_HEAD % 3 + PLY_FACES % 5 + PLY_POINTS + b"3 0 1 2\n", "PLY|truncated"),
    "points.ply": (lambda _: PLY_HEAD % 3 + b"end_header\n" + PLY_POINTS, "no facets|cannot be read"),
    "index.ply": (lambda _: PLY_HEAD % 3 + PLY_FACES % 1 + PLY_POINTS + b"3 0 1 9\n", "not there|cannot be read"),
    "words.obj": (lambda _: b"a letter, not a mesh", "words.obj:1: a: cannot be read as OBJ: an unknown word"),
    "index.obj": (lambda _: OBJ_POINTS + b"f 1 2 8\n", "index.obj:4: f: .*not there"),
    "early.obj": (lambda _: b"v 0 0 0\nf -1 -2 -3\n" + OBJ_POINTS, "early.obj:2: f: .*not there"),
    "nan.obj": (lambda _: OBJ_POINTS.replace(b"v 1", b"v nan") + b"f 1 2 3\n", "not finite"),
    "letter.obj": (lambda _: OBJ_POINTS.replace(b"v 1", b"v l") + b"f 1 2 3\n", "letter.obj:2: v: .*not three numbers"),
    "line.obj": (lambda _: OBJ_POINTS + b"f 1 2\n", "line.obj:4: f: .*not three corners"),
    "curve.obj": (lambda _: OBJ_POINTS + b"curv 0 1 1 2 3\n", "curve.obj:4: curv: .*an unknown word"),
    "cut.obj": (lambda _: OBJ_POINTS + b"f 1 2 3\nf 1//1 2//2 3//", "cut.obj:5: the last line has no end"),
    "open.obj": (lambda _: OBJ_POINTS + b"f 1 2 3", "open.obj:4: the last line has no end.*repair = true takes it"),
    "slash.obj": (lambda _: OBJ_POINTS + b"f 1/1 2/2 3/", "slash.obj:4: the last line has no end"),
    "number.obj": (lambda _: OBJ_POINTS + b"f 1 2 3\nv 0 0 1", "number.obj:5: the last line has no end|cut off"),
    "few.obj": (
        lambda _: OBJ_POINTS + 200 * b"v 0 0 0\nf -1 1 2\n" + b"v 0 1 1\nf 1 2 3",
        "few.obj:405: the last line has no end",
    ),
    "points.obj": (lambda _: OBJ_POINTS, "no facets"),
    "letter.ply": (
        lambda _: PLY_HEAD % 3 + PLY_FACES % 1 + PLY_POINTS.replace(b"1 0", b"l 0") + b"3 0 1 2\n",
        "letter.ply:11: cannot be read as PLY: not numbers .*l 0 0",
    ),
    # Each of these takes for ever where a number can be read in more ways than one.
    "digits.ply": (
        lambda _: PLY_HEAD % 3 + PLY_FACES % 1 + PLY_POINTS.replace(b"1 0", b"1" * 60 + b" x") + b"3 0 1 2\n",
        "digits.ply:11: cannot be read as PLY: not numbers",
    ),
    "polygon.ply": (
        lambda _: PLY_HEAD % 3 + PLY_FACES % 1 + PLY_POINTS + b"30" + b" 1234567" * 30 + b" x\n",
        "polygon.ply:13: cannot be read as PLY: not numbers",
    ),
    "digits.obj": (
        lambda _: OBJ_POINTS + b"v" + 8 * b" 123456789012" + b" x\n",
        "digits.obj:4: v: .*not three numbers",
    ),
    "goes_on.obj": (lambda _: b"v 0 \\\r\n 0 \\\n0\n" + OBJ_POINTS + b"f 1 2 9\n", "goes_on.obj:7: f: .*not there"),
    "head.ply": (lambda _: PLY_HEAD.replace(b"float y", b"flo.at y") % 3 + PLY_FACES % 1, "head.ply:5: .*of a header"),
    "end.ply": (lambda _: PLY_HEAD % 3, 'end.ply:7: .*"end_header" is missing'),
    "part.iges": (lambda _: b"S 1", "not a mesh format"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_files_get_one_clear_line(tmp_path, ball, name):
    make, message = BAD[name]
    path = tmp_path / name
    path.write_bytes(make(ball))
    with pytest.raises(MeshError, match=message) as caught:
        load_mesh(path, "mm")
    assert "\n" not in str(caught.value)
    assert name in str(caught.value)


def test_missing_file_folder_and_bad_scale_are_refused(tmp_path):
    with pytest.raises(MeshError, match="no such file"):
        load_mesh(tmp_path / "nowhere.stl", "mm")
    (tmp_path / "folder.stl").mkdir()
    with pytest.raises(MeshError, match="a folder"):
        load_mesh(tmp_path / "folder.stl", "mm")
    with pytest.raises(MeshError, match="scale"):
        load_mesh(tmp_path / "nowhere.stl", "mm", scale=-1.0)


@pytest.mark.parametrize("suffix", ["stl", "ply", "obj"])
def test_truncated_files_are_refused(tmp_path, suffix):
    """Every cut is refused with an InputError; but an OBJ does not tell how many lines it has."""
    import trimesh

    path = tmp_path / f"ball.{suffix}"
    trimesh.Trimesh(*surfaces.sphere(50.0, 1), process=False).export(path)
    data = path.read_bytes()
    refused = 0
    for size in range(0, len(data), max(1, len(data) // 60)):
        path.write_bytes(data[:size])
        message = ""
        try:
            load_mesh(path, "mm")
        except InputError as error:
            message = str(error)
        refused += bool(message)
        if message:
            assert path.name in message
        else:
            assert data[:size].endswith(b"\n")
            assert suffix == "obj" or not data[size:].strip()
    assert refused > 50


def test_obj_with_the_words_of_other_programs(tmp_path):
    """Polygons, textures, corners counted from the end, groups, continued lines; what belongs to no facet is told."""
    path = tmp_path / "a.obj"
    path.write_text(
        "# Blender\nmtllib a.mtl\no part\nv 0 0 0\nv 10 0 0 1 0 0\nv 10 10 0\n v 0 10 0 # a corner\nvt 0 0\nvn 0 0 1\n"
        "g top\nusemtl red\ns off\nf 1/1/1 2/1/1 3//1 4\nv 5 5 9\nf -1 -5 \\\n -4\nl 1 2\nv 7 7 7\n\n"
    )
    mesh = load_mesh(path, "mm")
    assert mesh.diagnosis.facets == 3
    assert mesh.diagnosis.area == pytest.approx(1e-4 + 0.5 * 10e-3 * np.hypot(5e-3, 9e-3))
    assert "1 of 6 vertices belong to no facet" in str(mesh.diagnosis)


CORNERS = ((1, 3, 2), (1, 2, 4), (2, 3, 4), (3, 1, 4))
"""A tetrahedron's."""


@pytest.mark.parametrize("form", ["f {} {} {}", "f {0}/{0} {1}/{1} {2}/{2}"])
def test_an_obj_whose_last_line_has_no_end(tmp_path, form):
    """A closed surface lacks no facet, also where each facet has vertices of its own; an open one may."""
    path, points = tmp_path / "a.obj", ("0 0 0", "9 0 0", "0 9 0", "0 0 9")

    def written(corners, vertices=points):
        lines = [f"v {point}" for point in vertices] + [form.format(*each) for each in corners]
        path.write_text("\n".join(lines))

    written(CORNERS)
    assert load_mesh(path, "mm").diagnosis.watertight
    written(np.arange(1, 13).reshape(4, 3), [points[k - 1] for each in CORNERS for k in each])
    assert MESH_FORMATS["obj"].read(path, path.read_bytes(), ReadOptions()).notes == ()
    written(CORNERS[:-1])
    with pytest.raises(MeshError, match=r"the last line has no end.*where it is complete, repair = true takes it"):
        load_mesh(path, "mm")
    assert "the last line has no end: was the file cut off?" in str(load_mesh(path, "mm", repair=True).diagnosis)
    written(CORNERS[:1])
    for repair in (False, True):
        with pytest.raises(MeshError, match="cut off"):
            load_mesh(path, "mm", repair=repair)


@pytest.mark.parametrize("end", ["o seco", "# the second body", "usemtl", "v 5 5 5", "v 5 5 5\nf 1 2 163"])
def test_an_obj_that_is_cut_off_behind_a_closed_body_is_refused(tmp_path, end):
    """What is there is closed, but a body was to follow. A whole facet of that is taken with repair = true alone."""
    path, shape = tmp_path / "a.obj", surfaces.sphere(50.0, 2)
    lines = [f"v {x} {y} {z}" for x, y, z in shape[0]] + [f"f {a} {b} {c}" for a, b, c in np.asarray(shape[1]) + 1]
    path.write_text("\n".join(lines))
    assert load_mesh(path, "mm").diagnosis.watertight
    path.write_text("\n".join([*lines, end]))
    assert len(shape[0]) == 162
    for repair in (False,) if "f" in end else (False, True):
        with pytest.raises(MeshError, match="the last line has no end"):
            load_mesh(path, "mm", repair=repair)


def test_obj_comments_end_at_a_backslash(tmp_path):
    path = tmp_path / "a.obj"
    path.write_bytes(b"# from C:\\parts\\\nv 0 0 0\nv 1 0 0 # in D:\\\r\nv 0 1 0\nf 1 2 3\n")
    vertices, faces, notes, *_ = MESH_FORMATS["obj"].read(path, path.read_bytes(), ReadOptions())
    np.testing.assert_array_equal(vertices, [[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    np.testing.assert_array_equal(faces, [[0, 1, 2]])
    assert not notes


def test_obj_is_read_as_trimesh_reads_it(tmp_path, ball):
    import trimesh

    path = tmp_path / "ball.obj"
    shape = trimesh.Trimesh(*surfaces.sphere(50.0, 2), process=False)
    shape.export(path)
    again = trimesh.load(path, force="mesh", process=False)
    vertices, faces, notes, *_ = MESH_FORMATS["obj"].read(path, path.read_bytes(), ReadOptions())
    np.testing.assert_array_equal(vertices, again.vertices)
    np.testing.assert_array_equal(faces, again.faces)
    assert not notes


def test_ply_comments_announce_nothing(tmp_path, ball):
    """A comment, or an obj_info line, may hold any words, those of an element too; what is announced is counted."""
    told = b"comment element vertex 999\nobj_info element face 7\ncomment\n  comment property float x\n"
    head = PLY_HEAD % 3 + PLY_FACES % 1
    path = tmp_path / "told.ply"
    for place in (b"element vertex", b"element face", b"end_header"):
        path.write_bytes(head.replace(place, told + place) + PLY_POINTS + b"3 0 1 2\n")
        mesh = load_mesh(path, "mm")
        assert (len(mesh.vertices), len(mesh.faces)) == (3, 1)
    short = (PLY_HEAD % 3 + PLY_FACES % 2).replace(b"element face", told + b"element face")
    path.write_bytes(short + PLY_POINTS + b"3 0 1 2\n")
    with pytest.raises(MeshError, match="announces 2 facets, the file holds 1"):
        load_mesh(path, "mm")


def test_stl_with_bytes_after_the_last_facet_is_refused(tmp_path, ball):
    path = tmp_path / "ball.stl"
    path.write_bytes(write_stl(ball, "ball") + b"\0\0")
    with pytest.raises(MeshError, match="2 bytes follow after the last of 320 facets"):
        load_mesh(path, "mm")


@pytest.mark.parametrize(("unit", "scale", "doubtful"), [("mm", 1.0, False), ("m", 1.0, True), ("mm", 1e-3, True)])
def test_a_doubtful_unit_is_noted_with_the_likely_one(tmp_path, ball, unit, scale, doubtful):
    path = tmp_path / "ball.stl"
    path.write_bytes(write_stl(ball, "ball"))
    said = str(load_mesh(path, unit, scale=scale).diagnosis)
    assert ("doubtful unit" in said) == doubtful
    assert ('unit = "mm" is likely' in said) == doubtful


@pytest.mark.parametrize("suffix", ["stl", "ply", "obj"])
def test_a_gigabyte_of_zeros_is_refused_before_it_is_read(tmp_path, suffix):
    import tracemalloc

    path = tmp_path / f"zeros.{suffix}"
    with path.open("wb") as stream:
        stream.truncate(10**9)
    tracemalloc.start()
    with pytest.raises(MeshError, match="zeros"):
        load_mesh(path, "mm")
    assert tracemalloc.get_traced_memory()[1] < 5_000_000
    tracemalloc.stop()


@pytest.mark.parametrize("suffix", ["stl", "ply", "obj"])
def test_other_encodings_are_refused_with_one_line(tmp_path, ball, suffix):
    import trimesh

    shape = trimesh.Trimesh(*surfaces.sphere(50.0, 1), process=False)
    text = {
        "stl": ascii_stl(ball),
        "ply": trimesh.exchange.ply.export_ply(shape, encoding="ascii").decode(),
        "obj": trimesh.exchange.obj.export_obj(shape),
    }[suffix]
    path = tmp_path / f"wide.{suffix}"
    path.write_bytes(text.encode("utf-16"))
    with pytest.raises(MeshError, match=r"wide\.") as caught:
        load_mesh(path, "mm")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("suffix", ["stl", "ply", "obj"])
def test_a_changed_byte_is_read_or_refused_but_never_crashes(tmp_path, suffix):
    import trimesh

    path = tmp_path / f"ball.{suffix}"
    trimesh.Trimesh(*surfaces.sphere(50.0, 1), process=False).export(path)
    data, rng = path.read_bytes(), np.random.default_rng(0)
    for _ in range(50):
        changed = bytearray(data)
        at = int(rng.integers(len(data)))
        changed[at : at + 1] = bytes(rng.choice([b"?", b"x", b"--", b"\xff", b"1e999", b"\n"]))
        path.write_bytes(changed)
        try:
            load_mesh(path, "mm")
        except InputError as error:
            message = str(error)
        else:
            continue
        assert path.name in message


def test_meshes_go_to_trimesh_and_back():
    import trimesh

    shape = trimesh.creation.box((80.0, 60.0, 30.0))
    mesh = Mesh.from_trimesh(shape, 1e-3)
    assert mesh.facet_areas.sum() == pytest.approx(1e-6 * shape.area)
    back = mesh.to_trimesh()
    assert back.volume == pytest.approx(1e-9 * shape.volume)
    np.testing.assert_array_equal(back.vertices, mesh.vertices)
    np.testing.assert_array_equal(back.faces, mesh.faces)
    with pytest.raises(MeshError, match="metres"):
        Mesh.from_trimesh(shape, 0.0)


RAW = """
import numpy as np
from pentapod.mesh import MeshData, MeshFormat

def read(path, data, options):
    corners = np.frombuffer(data).reshape(-1, 3)
    return MeshData(corners, np.arange(len(corners)).reshape(-1, 3))

FORMAT = MeshFormat(read)
"""


def test_a_format_of_another_package_is_read_by_its_suffix(tmp_path, monkeypatch):
    file = tmp_path / "part.raw"
    file.write_bytes(np.array([[0.0, 0.0, 0.0], [9.0, 0.0, 0.0], [0.0, 9.0, 0.0]]).tobytes())
    with pytest.raises(MeshError, match=r"not a mesh format that is read.*\.obj, \.ply, \.stl"):
        load_mesh(file, "mm")
    install(tmp_path / "site", monkeypatch, {"pentapod.mesh_formats": {"raw": "raw_meshes:FORMAT"}}, raw_meshes=RAW)
    assert load_mesh(file, "mm").facet_areas.sum() == pytest.approx(40.5e-6)
