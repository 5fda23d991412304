"""3MF, GLB and STEP: read in their own unit, and refused where anything is missing."""

from __future__ import annotations

import json
import zipfile
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from pentapod.base.errors import MeshError
from pentapod.mesh import Mesh, load_mesh
from pentapod.mesh.io.registry import states_unit

slow = pytest.mark.slow
CORE = 'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"'
POINTS = np.array([[0, 0, 0], [10, 0, 0], [0, 20, 0], [0, 0, 30]])
FACETS = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
SHIFT = np.array([5, 6, 7])
TURN = "0 1 0 -1 0 0 0 0 1 5 6 7"
"""A quarter turn about z, then a shift."""

STEP = Path(__file__).parent / "plate_with_ball.step"
"""A plate of 40 x 30 x 10 mm with half a ball on its middle, turned by 30° about x and moved; made by Open CASCADE."""
CENTRE, RADIUS, UP = np.array([7e-3, 8e-3, 9e-3]), 8e-3, np.array([0.0, -0.5, np.sqrt(0.75)])

needs_step = pytest.mark.skipif(find_spec("OCP") is None, reason="the extra step is not installed: 380 MB")


def body(number=1, more=""):
    vertices = "".join('<vertex x="{}" y="{}" z="{}"/>'.format(*p) for p in POINTS)
    facets = "".join('<triangle v1="{}" v2="{}" v3="{}"/>'.format(*f) for f in FACETS)
    mesh = f"<mesh><vertices>{vertices}</vertices><triangles>{facets}</triangles></mesh>"
    return f'<object id="{number}" {more}>{mesh}</object>'


def model(resources, build, more=""):
    return f"<?xml version='1.0'?><model {CORE} {more}><resources>{resources}</resources><build>{build}</build></model>"


def threemf(path, text=None, **parts):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("3D/3dmodel.model", text or model(body(), '<item objectid="1"/>'))
        for name, content in parts.items():
            archive.writestr(f"3D/{name}.model", content)
    return path


def glb(path, *, matrix=None, change=lambda header: None, mode=4):
    packed = POINTS.astype("<f4").tobytes() + FACETS.astype("<u2").tobytes()
    header = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, **({} if matrix is None else {"matrix": matrix})}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "mode": mode}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [10, 20, 30]},
            {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"},
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 24}],
        "buffers": [{"byteLength": len(packed)}],
    }  # fmt: skip
    change(header)
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    size = 12 + 8 + len(text) + 8 + len(packed)
    words = [size.to_bytes(4, "little"), len(text).to_bytes(4, "little"), b"JSON", text]
    words += [len(packed).to_bytes(4, "little"), b"BIN\0", packed]
    path.write_bytes(b"glTF" + (2).to_bytes(4, "little") + b"".join(words))
    return path


def same(mesh: Mesh, points, metres):
    usual = Mesh.of(np.asarray(points) * metres, FACETS)
    np.testing.assert_allclose(mesh.vertices, usual.vertices, atol=1e-7 * metres)
    np.testing.assert_array_equal(mesh.faces, usual.faces)


@pytest.mark.parametrize(
    ("unit", "metres"),
    [("", 1e-3), ("micron", 1e-6), ("millimeter", 1e-3), ("centimeter", 1e-2), ("inch", 0.0254), ("foot", 0.3048),
     ("meter", 1)],
)  # fmt: skip
def test_a_3mf_states_its_unit(tmp_path, unit, metres):
    text = model(body(), '<item objectid="1"/>', f'unit="{unit}"' if unit else "")
    same(load_mesh(threemf(tmp_path / "a.3mf", text)), POINTS, metres)


def test_a_unit_that_differs_from_the_files_is_told(tmp_path):
    mesh = load_mesh(threemf(tmp_path / "a.3mf"), "inch")
    same(mesh, POINTS, 1e-3)
    assert 'unit = "inch" is not used: the file states "mm"' in str(mesh.diagnosis)
    assert "not used" not in str(load_mesh(tmp_path / "a.3mf", "mm").diagnosis)
    assert [states_unit(name) for name in ("a.3mf", "b.GLB", "c.stp", "d.stl", "e.xyz")] == [True] * 3 + [False] * 2


def test_components_of_a_3mf_are_placed_one_in_the_other(tmp_path):
    inner = f'<object id="2"><components><component objectid="1" transform="{TURN}"/></components></object>'
    text = model(body() + inner, f'<item objectid="2" transform="{TURN}"/>')
    turned = POINTS
    for _ in range(2):
        turned = np.stack([-turned[:, 1], turned[:, 0], turned[:, 2]], axis=1) + SHIFT
    same(load_mesh(threemf(tmp_path / "a.3mf", text)), turned, 1e-3)


def test_bodies_of_a_3mf_in_further_parts_of_the_archive(tmp_path):
    space = 'xmlns:p="http://schemas.microsoft.com/3dmanufacturing/production/2015/06" requiredextensions="p"'
    outer = '<object id="9"><components><component objectid="1" p:path="/3D/b.model"/></components></object>'
    text = model(outer, '<item objectid="9"/>', space)
    same(load_mesh(threemf(tmp_path / "a.3mf", text, b=model(body(), ""))), POINTS, 1e-3)
    threemf(tmp_path / "b.3mf", text, b=model(body(), "", 'unit="inch"'))
    with pytest.raises(MeshError, match='a part of the archive is in "inch", the model in "millimeter"'):
        load_mesh(tmp_path / "b.3mf")


def test_a_mirrored_body_stays_right_side_out(tmp_path):
    text = model(body(), '<item objectid="1" transform="-1 0 0 0 1 0 0 0 1 0 0 0"/>')
    assert not load_mesh(threemf(tmp_path / "a.3mf", text)).diagnosis.inverted
    scaled = glb(tmp_path / "a.glb", matrix=[-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1])
    assert not load_mesh(scaled, scale=1e-3).diagnosis.inverted


def test_supports_of_a_3mf_are_left_out_and_told(tmp_path):
    text = model(body() + body(2, 'type="support"'), '<item objectid="1"/><item objectid="2"/>')
    mesh = load_mesh(threemf(tmp_path / "a.3mf", text))
    same(mesh, POINTS, 1e-3)
    assert "1 supports left out" in str(mesh.diagnosis)


def laughs(depth):
    each = "".join(
        f'<object id="{k + 2}"><components>' + f'<component objectid="{k + 1}"/>' * 10 + "</components></object>"
        for k in range(depth)
    )
    return model(body() + each, f'<item objectid="{depth + 1}"/>')


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (model(body(), '<item objectid="7"/>'), "an object is missing .*7"),
        (model('<object id="1"><components><component objectid="1"/></components></object>', '<item objectid="1"/>'),
         "a component of itself"),
        (laughs(9), "unfolds to too many facets"),
        (model(body(), '<item objectid="1"/>', 'unit="furlong"'), "an unknown unit .*furlong"),
        (model(body(), '<item objectid="1" transform="1 0 0"/>'), "not twelve numbers"),
        (model(body() + body(), '<item objectid="1"/>'), "there twice"),
        (model(body().replace('v1="1"', 'v1="9"'), '<item objectid="1"/>'), "a vertex that is not there"),
        (model(body().replace('x="10"', 'x="ten"'), '<item objectid="1"/>'), "not a finite number"),
        (model(body().replace('x="10"', 'x="1_0"'), '<item objectid="1"/>'), "not a finite number"),
        (model(body().replace('z="30"', 'z="1e999"'), '<item objectid="1"/>'), "not a finite number"),
        (model(body().replace(' z="30"', ""), '<item objectid="1"/>'), "an attribute is missing: z"),
        (model("", ""), "no facets"),
        (model(body(), '<item objectid="1"/>')[:-20], "cannot be read as 3MF: 3D/3dmodel.model line 1"),
        ('<!DOCTYPE a [<!ENTITY b "c">]>' + model(body(), "")[21:], "a document type is not allowed"),
        (model(body(), '<item objectid="1"/>', 'xmlns:b="http://x/beamlattice/2017" requiredextensions="b"'),
         "an extension that is not read .*beamlattice"),
    ],
)  # fmt: skip
def test_a_3mf_in_which_anything_is_wrong_is_refused(tmp_path, text, words):
    with pytest.raises(MeshError, match=words) as caught:
        load_mesh(threemf(tmp_path / "a.3mf", text))
    assert "\n" not in str(caught.value)


def test_a_3mf_that_grows_is_refused_before_it_does(tmp_path, monkeypatch):
    monkeypatch.setattr("pentapod.mesh.io.threemf.MOST_UNPACKED", 1_000_000)
    with pytest.raises(MeshError, match="at most 1 MB unpacked"):
        load_mesh(threemf(tmp_path / "a.3mf", " " * 2_000_000))


def test_a_3mf_that_was_cut_off_is_refused(tmp_path):
    whole = threemf(tmp_path / "b.3mf").read_bytes()
    for size in (0, 3, len(whole) // 2, len(whole) - 1):
        (tmp_path / "b.3mf").write_bytes(whole[:size])
        with pytest.raises(MeshError):
            load_mesh(tmp_path / "b.3mf")
    with zipfile.ZipFile(tmp_path / "c.3mf", "w") as archive:
        archive.writestr("readme", "x")
    with pytest.raises(MeshError, match="a part of the archive is missing"):
        load_mesh(tmp_path / "c.3mf")


def test_a_glb_is_in_metres_and_placed_by_its_nodes(tmp_path):
    shift = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1]
    mesh = load_mesh(glb(tmp_path / "a.glb", matrix=shift), scale=1e-3)
    same(mesh, POINTS + SHIFT, 1e-3)
    assert "region_direction = [0, 1, 0]" in str(mesh.diagnosis)


def without_view(header):
    del header["accessors"][0]["bufferView"]


def elsewhere(header):
    header["buffers"][0]["uri"] = "a.bin"


def as_shares(header):
    header["accessors"][0]["normalized"] = True


def by_weights(header):
    header["meshes"][0]["primitives"][0]["targets"] = [{"POSITION": 0}]


def many_times(header):
    header["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0}}}


def beyond(header):
    header["accessors"][0]["count"] = 10**12


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ({"change": without_view}, "its vertices are compressed"),
        ({"mode": 1}, "lines, points or fans"),
        ({"change": beyond}, "cannot be read as GLB: it is broken"),
        pytest.param({"change": elsewhere}, "its vertices are in another file", marks=slow),
        pytest.param({"change": as_shares}, "or stored as shares", marks=slow),
        pytest.param({"change": by_weights}, "its vertices are moved by weights", marks=slow),
        pytest.param({"change": many_times}, "placed by a list", marks=slow),
        pytest.param(
            {"change": lambda header: header.update(extensionsRequired=["X"])},
            "needs an extension that is not read: X",
            marks=slow,
        ),
    ],
)
def test_a_glb_that_would_lose_facets_is_refused(tmp_path, how, words):
    """And the remedy is for that: only a broken file may be incomplete."""
    with pytest.raises(MeshError, match=words) as error:
        load_mesh(glb(tmp_path / "a.glb", **how))
    assert ("may be incomplete" in str(error.value)) == ("broken" in words)


def test_a_glb_that_was_cut_off_is_refused(tmp_path):
    data = glb(tmp_path / "a.glb").read_bytes()
    for size in (2, 30, len(data) - 1):
        (tmp_path / "a.glb").write_bytes(data[:size])
        with pytest.raises(MeshError, match=r"truncated|not a binary glTF"):
            load_mesh(tmp_path / "a.glb")


@needs_step
@pytest.mark.parametrize("chordal", [1e-4, pytest.param(1e-5, marks=slow)])
def test_a_step_part_has_the_normals_of_its_surfaces(chordal):
    """Facets near the surface, normals of the ball itself."""
    mesh = load_mesh(STEP, "inch", chordal=chordal)
    assert mesh.diagnosis.watertight
    assert mesh.diagnosis.bodies == 1
    assert not mesh.diagnosis.inverted
    assert 'unit = "inch" is not used' in str(mesh.diagnosis)
    corners = mesh.vertices[mesh.faces] - CENTRE
    on_ball = (np.abs(np.linalg.norm(corners, axis=2) - RADIUS) < 1e-9).all(axis=1)
    assert on_ball.sum() > 100
    outward = corners[on_ball] / RADIUS
    inside = np.abs(outward @ UP).min(axis=1) > 0.02  # not at the plate, where the ball meets it
    cosine = (mesh.corner_normals[on_ball] * outward).sum(axis=2)
    assert np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))[inside].max()) < 1e-4
    sag = RADIUS - np.linalg.norm(corners[on_ball].mean(axis=1), axis=1)
    assert 0.2 * chordal < sag.max() < chordal
    np.testing.assert_allclose(mesh.flipped().corner_normals, -mesh.corner_normals[:, ::-1], atol=1e-12)


@needs_step
def test_a_step_file_that_lost_a_face_is_refused(tmp_path):
    file, text = tmp_path / "a.step", STEP.read_text()
    lost = text.replace("ADVANCED_FACE(", "ADVANCED_FACE((", 1)
    for changed, words in ((lost, "faces cannot be read|cannot be read as STEP"), (text[:-200], "truncated")):
        file.write_text(changed)
        with pytest.raises(MeshError, match=words):
            load_mesh(file)


def test_without_the_extra_a_step_file_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setattr("pentapod.mesh.io.step.find_spec", lambda _: None)
    (tmp_path / "a.step").write_text("ISO-10303-21;\nEND-ISO-10303-21;\n")
    with pytest.raises(MeshError, match=r'pip install "pentapod\[step\]"'):
        load_mesh(tmp_path / "a.step")
    (tmp_path / "b.stp").write_text("solid a\n")
    with pytest.raises(MeshError, match="does not begin with"):
        load_mesh(tmp_path / "b.stp")
