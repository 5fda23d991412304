"""Files made to break their readers: each gets one clear line, soon, and without much memory."""

from __future__ import annotations

import io
import json
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

import fuzzed_files
from pentapod.base.errors import InputError, JobError, MachineError, MeshError, ProgramError, ToolpathError
from pentapod.job import Job
from pentapod.machine.machine import load_machine
from pentapod.program import read_csv
from pentapod.program.posts import read_post
from pentapod.toolpath import load_mesh, read_darkness, read_lines, read_points, write_stl
from pentapod.toolpath.formats import read_toolpath

DIGITS = "9" * 5000
SVG = '<svg xmlns="http://www.w3.org/2000/svg" width="9mm" height="9mm" viewBox="0 0 9 9">{}</svg>'


def written(folder: Path, name: str, content: str | bytes) -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def program(folder: Path, old: str = "", new: str = "") -> Path:
    name, content = next(iter(fuzzed_files._post("csv").items()))
    text = content.decode()
    assert old in text
    return written(folder, name, text.replace(old, new, 1))


@pytest.mark.parametrize("load", [(Job.load, JobError), (load_machine, MachineError)], ids=["job", "machine"])
@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a = " + "[" * 5000 + "]" * 5000, ":1: nested too deep"),
        ("\na = " + "[" * 99 + "]" * 99, ":2: nested too deep"),
        ("a = " + "{b = " * 2000 + "1" + "}" * 2000, ":1: nested too deep"),
        ("\n" + "a." * 200_000 + "b = 1", ":2: a key of too many parts"),
        (f"a = 1\nb = {DIGITS}", ":2: a number of too many digits"),
        (f"a = 0x{'f' * 5000}", ":1: a number of too many digits"),
    ],
    ids=["arrays", "99 arrays", "tables", "dotted", "digits", "hexadecimal"],
)
def test_toml_that_no_parser_bears_is_refused_with_its_line(tmp_path, load, text, words):
    read, kind = load
    with pytest.raises(kind, match=words) as caught:
        read(written(tmp_path, "a.toml", text + "\n"))
    assert len(str(caught.value)) < 600


@pytest.mark.parametrize("value", [DIGITS, "1e99999999999999999999", "[" * 3000, "0x" + "f" * 5000])
def test_header_values_beyond_all_numbers_are_refused(tmp_path, value):
    with pytest.raises(ProgramError) as caught:
        read_csv(program(tmp_path, "# rows = 9", f"# rows = {value}"))
    assert len(str(caught.value)) < 600


def test_a_row_without_end_is_refused_before_it_is_read(tmp_path):
    """A sparse file of 4 GB."""
    path = program(tmp_path)
    with path.open("r+b") as file:
        file.truncate(4_000_000_000)
    with pytest.raises(ProgramError, match=r"bytes|columns"):
        read_csv(path)
    head = written(tmp_path, "head.csv", b"# a")
    with head.open("r+b") as file:
        file.truncate(4_000_000_000)
    with pytest.raises(ProgramError, match="the header is longer than any"):
        read_csv(head)


@pytest.mark.parametrize("index", ["18446744073709551616", "9223372036854775807", DIGITS, "-18446744073709551616"])
def test_an_obj_index_beyond_64_bits_is_a_vertex_that_is_not_there(tmp_path, index):
    path = written(tmp_path, "a.obj", f"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 {index}\n")
    with pytest.raises(MeshError, match=":4: f: a facet uses a vertex that is not there"):
        load_mesh(path, "mm")


@pytest.mark.parametrize("name", ["a.obj", "a.ply", "a.stl"])
@pytest.mark.parametrize("filling", [b" " * 400_000, b"\n" * 3_000_000, b" \n" * 1_500_000])
def test_white_space_without_end_takes_no_time(tmp_path, name, filling):
    """Each took minutes to hours: patterns that try the same spaces in two ways."""
    whole = {
        "a.obj": b"v 0 0 0\nv 1 0 0\nv 0 1 0" + filling + b"!\nf 1 2 3\n",
        "a.ply": fuzzed_files._ply(binary=False).replace(b"end_header\n", b"end_header\n" + filling + b"!\n"),
        "a.stl": b"solid a\n" + filling + b"facet\n",
    }
    with pytest.raises(MeshError):
        load_mesh(written(tmp_path, name, whole[name]), "mm")


def test_three_million_blank_lines_in_an_stl_are_passed_over(tmp_path):
    text = fuzzed_files._ascii_stl().replace(b"  facet", b"\n" * 170_000 + b"  facet")
    assert len(load_mesh(written(tmp_path, "a.stl", text), "mm").faces) == 18


def test_bytes_that_slip_into_an_stl_are_an_error(tmp_path):
    """Half of the part was loaded, with a remark of 68 facets dropped."""
    ball = load_mesh(written(tmp_path, "a.stl", fuzzed_files._stl()), "mm")
    data = write_stl(1e3 * ball.vertices[ball.faces], "ball")
    middle = 84 + 50 * (len(ball.faces) // 2) + 7
    with pytest.raises(MeshError, match="2 bytes follow after the last"):
        load_mesh(written(tmp_path, "b.stl", data[:middle] + b"xy" + data[middle:]), "mm")


def test_many_useless_facets_are_an_error_unless_they_are_asked_for(tmp_path):
    triangles = (1e3 * (mesh := load_mesh(written(tmp_path, "a.stl", fuzzed_files._stl()), "mm")).vertices)[mesh.faces]
    flat = np.repeat(triangles[:1, :1], 3, axis=1)
    path = written(tmp_path, "b.stl", write_stl(np.concatenate([triangles, np.repeat(flat, 5, axis=0)]), "a"))
    with pytest.raises(MeshError, match="facets without area: 5"):
        load_mesh(path, "mm")
    assert load_mesh(path, "mm", repair=True).diagnosis.degenerate == 5


def test_an_obj_cut_at_the_end_of_a_line_is_told_by_its_loose_vertices_or_its_remarks(tmp_path):
    whole = fuzzed_files._obj()
    cut = b"".join(whole.splitlines(keepends=True)[:-8])
    with pytest.raises(MeshError, match="belong to no facet"):
        load_mesh(written(tmp_path, "a.obj", cut), "mm")
    one_less = b"".join(whole.splitlines(keepends=True)[:-1])
    with pytest.raises(MeshError, match="a remark announces 18 faces, the file holds 17"):
        load_mesh(written(tmp_path, "b.obj", b"# Vertices: 16\n# Faces: 18\n" + one_less), "mm")


@pytest.mark.parametrize(("old", "new"), [("3 0 1 5", "3 0 1.5 5"), ("3 0 1 5", "3 0 nan 5"), ("3 0 1 5", "3.5 0 1 5")])
def test_a_ply_index_is_a_whole_number(tmp_path, old, new):
    text = fuzzed_files._ply(binary=False).decode()
    assert old in text
    with pytest.raises(MeshError, match=r"whole number|wrong count"):
        load_mesh(written(tmp_path, "a.ply", text.replace(old, new, 1)), "mm")


def test_bytes_that_slip_into_a_ply_are_an_error(tmp_path):
    data = fuzzed_files._ply(binary=True)
    with pytest.raises(MeshError):
        load_mesh(written(tmp_path, "a.ply", data[:-40] + b"xy" + data[-40:]), "mm")


def test_ply_polygons_of_different_sizes_are_cut_into_triangles(tmp_path):
    head = (
        b"ply\nformat binary_big_endian 1.0\nelement vertex 5\nproperty double x\nproperty double y\n"
        b"property double z\n"
        b"element face 2\nproperty uchar red\nproperty list uchar ushort vertex_index\nend_header\n"
    )
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0.5, 0]], dtype=">f8").tobytes()
    faces = b"\1\4" + np.array([0, 1, 2, 3], ">u2").tobytes() + b"\1\3" + np.array([1, 4, 2], ">u2").tobytes()
    assert len(load_mesh(written(tmp_path, "a.ply", head + points + faces), "m").faces) == 3


@pytest.mark.parametrize("cell", ["1_0", "\u0661", "1e999", "nan", "1" * 200_000 + "x"])
def test_numbers_of_points_are_plain_decimals(tmp_path, cell):
    path = written(tmp_path, "a.csv", f"x_mm,y_mm,z_mm\n0,0,0\n{cell},0,0\n")
    with pytest.raises(ToolpathError, match=r":3: .*not a (finite number|row)") as caught:
        read_points(path)
    assert len(str(caught.value)) < 600


def test_points_may_tell_how_many_they_are(tmp_path):
    text = "# points = 3\nx_mm,y_mm,z_mm\n0,0,0\n1,0,0\n2,0,0\n"
    assert len(read_points(written(tmp_path, "a.csv", text))[0]) == 3
    with pytest.raises(ToolpathError, match="the file was cut off"):
        read_points(written(tmp_path, "b.csv", text.removesuffix("2,0,0\n")))


def test_g_code_in_digits_of_other_scripts_is_refused(tmp_path):
    text = fuzzed_files._toolpath(".ngc").decode()
    with pytest.raises(ToolpathError, match="G-code does not have"):
        read_toolpath(written(tmp_path, "a.ngc", text.replace("G0 X0.0", "G0 X\u0660.0", 1)))


def packed(arrays: dict[str, np.ndarray], method: int = zipfile.ZIP_DEFLATED) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", method) as archive:
        for name, values in arrays.items():
            buffer = io.BytesIO()
            np.save(buffer, values)
            archive.writestr(f"{name}.npy", buffer.getvalue())
    return out.getvalue()


def test_an_array_is_no_archive(tmp_path):
    np.save(tmp_path / "a.npy", np.zeros(3))
    data = (tmp_path / "a.npy").read_bytes()
    with pytest.raises(ToolpathError):
        read_toolpath(written(tmp_path, "a.npz", data))
    written(tmp_path, "program.npz", data)
    with pytest.raises(ProgramError, match="not a NumPy archive"):
        read_post(tmp_path, "npz")


def test_an_archive_that_grows_is_refused_before_it_does(tmp_path):
    """Directory says 1.2 GB; packed it is about a megabyte. A second one lies about its size."""
    import tracemalloc

    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        with archive.open("header.npy", "w") as entry:
            np.lib.format.write_array(entry, np.array("x"))
        with archive.open("legs_mm.npy", "w", force_zip64=True) as entry:
            head = {"descr": "<f8", "fortran_order": False, "shape": (30_000_000, 5)}
            np.lib.format.write_array_header_1_0(entry, head)
            for _ in range(1200):
                entry.write(bytes(1_000_000))
    written(tmp_path, "program.npz", out.getvalue())
    tracemalloc.start()
    with pytest.raises(ProgramError, match=r"1,200 MB unpacked.*at most 1,000 MB"):
        read_post(tmp_path, "npz")
    assert tracemalloc.get_traced_memory()[1] < 50_000_000
    tracemalloc.stop()


def test_an_array_of_another_size_than_its_header_is_refused(tmp_path):
    whole = packed({"header": np.array("x"), "legs_mm": np.ones((2, 5))}, zipfile.ZIP_STORED)
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(whole)) as old, zipfile.ZipFile(out, "w") as new:
        for name in old.namelist():
            new.writestr(name, old.read(name).replace(b"(2, 5)", b"(9999999999999, 5)".ljust(6)))
    written(tmp_path, "program.npz", out.getvalue())
    with pytest.raises(ProgramError, match="broken NumPy archive"):
        read_post(tmp_path, "npz")


def test_hdf5_that_announces_more_than_memory_is_refused(tmp_path):
    h5py = pytest.importorskip("h5py")
    for shape in ((2**40, 5), (2**62, 5), (3, 2**50)):
        with h5py.File(tmp_path / "program.h5", "w") as archive:
            archive.attrs["header"] = "x"
            archive.create_dataset("legs_mm", shape=shape, chunks=(1, 5), dtype="f8")
        with pytest.raises(ProgramError, match=r"too large|broken one"):
            read_post(tmp_path, "hdf5")


@pytest.mark.parametrize(
    "points",
    ["[" * 100_000, '[{"time_from_start": {"sec": [0], "nanosec": 0}, "positions": [1, 1, 1, 1, 1]}]', "[1e999]"],
)
def test_nested_and_odd_json_is_refused(tmp_path, points):
    for name, content in fuzzed_files._post("ros2-json").items():
        written(tmp_path, name, content)
    text = (tmp_path / "joint_trajectory.json").read_text()
    names = json.dumps([f"leg{leg}" for leg in range(1, 6)])
    assert names in text
    written(tmp_path, "joint_trajectory.json", f'{{"joint_names": {names}, "points": {points}}}')
    with pytest.raises(ProgramError):
        read_post(tmp_path, "ros2-json")


def laughs(depth: int) -> str:
    uses = "".join(
        f'<g id="g{k + 1}">' + f'<use href="#g{k}"/>' * 10 + "</g>" for k in range(depth)
    )  # fmt: skip
    return SVG.format('<g id="g0"><circle r="3"/></g>' + uses)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (laughs(9), "it unfolds to [0-9,]+ elements"),
        (SVG.format('<g id="a"><use href="#a"/></g>'), "repeat themselves"),
        (SVG.format("<g>" * 200 + "</g>" * 200), "nested too deep"),
        (SVG.format('<use href="#nothing"/><circle r="3"/>'), "refers to nothing in this drawing"),
        (SVG.format('<path d="M 0 0' + "C 1 2 3 4 5 6 " * 110_000 + '"/>'), "numbers and commands"),
        (SVG.format('<path d="M 0 0 L 1 1 L oops"/><circle r="3"/>'), "cannot be read as SVG"),
    ],
    ids=["laughs", "itself", "deep", "nothing", "curves", "half a path"],
)
def test_svg_that_would_not_end_is_refused(tmp_path, text, words):
    with pytest.raises(ToolpathError, match=words):
        read_lines(written(tmp_path, "a.svg", text), 1e-5)


@pytest.mark.parametrize(
    "style", ["a" * 200_000, " " * 200_000 + "x", "{" * 100_000, ".a{fill:red}" * 20_000, "/*" * 50_000]
)
def test_hostile_styles_take_no_time(tmp_path, style):
    text = SVG.format(
        f"<style>{style}</style><style>.h{{display:none}}</style><circle r='3'/><circle class='h' r='2'/>"
    )
    assert len(read_lines(written(tmp_path, "a.svg", text), 1e-5)) == 1


def test_a_dxf_circle_beyond_the_earth_is_refused(tmp_path):
    text = fuzzed_files._dxf()
    for radius in (b"1e300", b"1e12", b"inf"):
        changed = text.replace(b"\n 40\n4\n", b"\n 40\n" + radius + b"\n").replace(
            b"\n 40\n4.0\n", b"\n 40\n" + radius + b"\n"
        )
        assert changed != text
        with pytest.raises(ToolpathError):
            read_lines(written(tmp_path, "a.dxf", changed), 1e-6)


def test_pictures_of_sixteen_bits_keep_their_grey(tmp_path):
    """All but the darkest levels came out white."""
    from PIL import Image

    grey = np.linspace(0, 65535, 12).astype(np.uint16).reshape(3, 4)
    Image.fromarray(grey).save(tmp_path / "a.png")
    np.testing.assert_allclose(read_darkness(tmp_path / "a.png"), 1 - grey / 65535.0, atol=1e-12)


def test_a_picture_that_grows_is_refused_and_no_program_is_started_for_one(tmp_path):
    from PIL import Image

    Image.new("L", (6_000, 4_000)).save(tmp_path / "a.png")
    with pytest.raises(ToolpathError, match=r"too large|too many pixels|exceeds"):
        read_darkness(tmp_path / "a.png")
    eps = b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n%%EndComments\nshowpage\n"
    with pytest.raises(ToolpathError, match="save it as one of PNG"):
        read_darkness(written(tmp_path, "a.png", eps))


def fuzz(seed: int, count: int, *names: str) -> None:
    """Read spoiled files in a process of its own, with bounds on memory, and on the time of each."""
    command = [sys.executable, fuzzed_files.__file__, str(seed), str(count), *names]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    last = "".join(done.stderr.splitlines()[-1:])
    assert done.returncode == 0, f"the process ended with {done.returncode}, {last}"
    assert not done.stdout, done.stdout


def test_spoiled_files_get_an_error_of_input_and_nothing_else():
    fuzz(7, 12, "a.stl", "b.stl", "a.ply", "b.ply", "a.obj", "a.3mf",
         "3dmodel.model", "points.csv", "path.csv", "path.npz", "path.ngc", "npz",
         "program.csv", "job.toml", "machine.toml", "a.png")  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(fuzzed_files.readers()))
def test_many_spoiled_files_get_an_error_of_input_and_nothing_else(name):
    fuzz(11, 40 if name.endswith(("dxf", "glb", "step")) else 400, name)


def test_messages_of_any_value_are_one_short_line():
    deep: list[object] = []
    for _ in range(100_000):
        deep = [deep]
    for value in (deep, int("9" * 4000) ** 2, "x" * 10_000, "a\nb"):
        text = str(InputError("wrong", key="k\x1b[2J\n" * 90, value=value))
        assert len(text) < 900
        assert text.isprintable()
