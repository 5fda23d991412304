"""Drawings, points and pictures: shapes come out as they are; what is broken gets one clear line."""

from __future__ import annotations

import io

import numpy as np
import pytest

from pentapod.base.errors import InputError, ToolpathError
from pentapod.toolpath import read_darkness, read_lines, read_points

SVG = '<svg xmlns="http://www.w3.org/2000/svg" width="100mm" height="50mm" viewBox="0 0 100 50">{}</svg>'
CSV = "x_mm,y_mm,z_mm\n0,0,0\n10,0,0\n10,5,1\n"


def dxf(unit=4, more=lambda document: None):
    import ezdxf

    document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = unit
    model = document.modelspace()
    model.add_circle((10, 5), 4)
    model.add_lwpolyline([(0, 0), (20, 0, 0, 0, 1), (20, 10)], format="xyseb")
    model.add_line((0, 0), (3, 4))
    more(document)
    text = io.StringIO()
    document.write(text)
    return text.getvalue().encode()


def test_svg_shapes_have_their_size_and_y_points_up(tmp_path):
    path = tmp_path / "a.svg"
    shapes = (
        '<circle cx="50" cy="20" r="10"/><path d="M 0 0 L 10 0 L 10 5 Z"/><g transform="rotate(90)"><line x2="7"/></g>'
    )
    path.write_text(SVG.format(shapes))
    circle, corner, line = read_lines(path, 1e-6)
    away = np.linalg.norm(circle - [0.05, -0.02], axis=1)
    assert np.abs(away - 0.01).max() < 2e-6
    middle = 0.5 * (circle[1:] + circle[:-1])
    assert np.abs(np.linalg.norm(middle - [0.05, -0.02], axis=1) - 0.01).max() < 1.5e-6
    np.testing.assert_allclose(corner, np.array([[0, 0], [10, 0], [10, -5], [0, 0]]) * 1e-3, atol=2e-8)
    np.testing.assert_allclose(line, [[0, 0], [0, -7e-3]], atol=2e-8)


def test_dxf_entities_have_their_size(tmp_path):
    path = tmp_path / "a.dxf"
    for unit, metre in ((4, 1e-3), (1, 25.4e-3), (6, 1.0)):
        path.write_bytes(dxf(unit))
        circle, bulge, line = read_lines(path, 1e-3 * metre)
        assert np.abs(np.linalg.norm(circle / metre - [10, 5], axis=1) - 4).max() < 2e-3
        np.testing.assert_allclose(line / metre, [[0, 0], [3, 4]], atol=1e-9)
        assert np.ptp(bulge[:, 0]) / metre == pytest.approx(25, abs=0.01)  # a half circle of radius 5 beyond 20
    path.write_bytes(dxf(0))
    with pytest.raises(ToolpathError, match="does not say its unit"):
        read_lines(path, 1e-6)


def test_points_are_split_by_line_and_by_empty_row(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("# remark\nline,x_mm,y_cm,z_m\na,1,2,3\na,2,2,3\nb,0,0,0\nb,1,1,1\n\nb,5,5,5\nb,6,6,6\n")
    lines = read_points(path)
    assert [len(line) for line in lines] == [2, 2, 2]
    np.testing.assert_allclose(lines[0], [[1e-3, 2e-2, 3], [2e-3, 2e-2, 3]])


def test_pictures_are_dark_where_they_are_black(tmp_path):
    path = tmp_path / "a.pgm"
    path.write_text("P2\n3 2\n255\n0 255 51\n255 0 102\n")
    np.testing.assert_allclose(read_darkness(path), [[1, 0, 0.8], [0, 1, 0.6]], atol=1e-12)


BAD = {
    "empty.svg": (b"", "empty"),
    "words.svg": (b"a letter, not a drawing", "not a whole SVG"),
    "cut.svg": (SVG.format("<circle r='3'/>").encode()[:-9], "not a whole SVG"),
    "nothing.svg": (SVG.format("").encode(), "no line"),
    "utf16.svg": (SVG.format("<circle r='3'/>").encode("utf-16"), "UTF-8|cannot be read"),
    "words.dxf": (b"a letter, not a drawing", "EOF is missing"),
    "part.dwg": (b"AC1032", "unknown kind of drawing"),
    "empty.csv": (b"\n \n", "empty"),
    "no_unit.csv": (CSV.replace("x_mm", "x").encode(), "no_unit.csv:1.*unknown column.*did you mean"),
    "no_z.csv": (b"x_mm,y_mm\n0,0\n1,1\n", "no_z.csv:1.*a column is missing.*z_mm"),
    "twice.csv": (b"x_mm,x_cm,y_mm,z_mm\n0,0,0,0\n", "there twice"),
    "word.csv": (CSV.replace("10,5", "ten,5").encode(), "word.csv:4.*x.*not a finite number.*ten"),
    "nan.csv": (CSV.replace("10,5", "nan,5").encode(), "nan.csv:4.*finite"),
    "short.csv": (CSV.encode() + b"1,2\n", "short.csv:5.*columns"),
    "one.csv": (b"x_mm,y_mm,z_mm\n0,0,0\n", "no polyline"),
    "zeros.csv": (bytes(4096), "empty"),
    "latin.csv": ("x_mm,y_mm,z_mm\n# \u00e4\n".encode("latin-1"), "UTF-8"),
    "words.png": (b"a letter, not a picture", "cannot be read as a picture"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_files_get_one_clear_line(tmp_path, name):
    content, message = BAD[name]
    path = tmp_path / name
    path.write_bytes(content)
    read = {"csv": read_points, "png": read_darkness}.get(name[-3:], lambda p: read_lines(p, 1e-5))
    with pytest.raises(ToolpathError, match=message) as caught:
        read(path)
    assert "\n" not in str(caught.value)
    assert name in str(caught.value)


def block(document):
    document.blocks.new("hole").add_circle((0, 0), 2)
    document.modelspace().add_blockref("hole", (5, 5))


LEFT_OUT = {
    "block.dxf": (dxf(more=block), "handle.*INSERT is not read.*explode blocks"),
    "text.dxf": (dxf(more=lambda d: d.modelspace().add_text("N 1")), "TEXT is not read.*turn text into lines"),
    "mtext.dxf": (dxf(more=lambda d: d.modelspace().add_mtext("N 1")), "MTEXT is not read.*turn text into lines"),
    "text.svg": (SVG.format('<circle r="3"/><text id="n" x="3" y="9">N 1</text>').encode(), "id n: <text> is not read"),
    "in_a_group.svg": (
        SVG.format('<g><text>N<tspan>1</tspan></text></g><circle r="3"/>').encode(),
        "turn text into paths",
    ),
    "picture.svg": (SVG.format('<circle r="3"/><image href="a.png" width="9" height="9"/>').encode(), "<image> is not"),
}


@pytest.mark.parametrize("name", LEFT_OUT)
def test_drawings_with_text_blocks_or_pictures_are_refused(tmp_path, name):
    content, message = LEFT_OUT[name]
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ToolpathError, match=message) as caught:
        read_lines(tmp_path / name, 1e-5)
    assert "\n" not in str(caught.value)


def test_drawings_entities_without_lines_are_ignored(tmp_path):
    path = tmp_path / "a.svg"
    path.write_text(SVG.format('<title>N 1</title><defs><text id="t">N</text></defs><text/><circle r="3"/>'))
    assert len(read_lines(path, 1e-5)) == 1
    path = tmp_path / "a.dxf"
    path.write_bytes(dxf(more=lambda document: document.modelspace().add_point((1, 1))))
    assert len(read_lines(path, 1e-5)) == 3


def picture():
    from PIL import Image

    data = io.BytesIO()
    grey = np.random.default_rng(0).integers(0, 255, (12, 9)).astype(np.uint8)
    Image.fromarray(grey).save(data, "png")
    return data.getvalue()


WHOLE = {
    "svg": lambda: SVG.format('<circle r="3"/><path d="M 0 0 C 1 2 3 4 5 6"/>').encode(),
    "dxf": dxf,
    "csv": CSV.encode,
    "png": picture,
}
POINTS = {"csv": read_points, "png": read_darkness}
READ = {**POINTS, **dict.fromkeys(["svg", "dxf"], lambda path: read_lines(path, 1e-5))}


def refused(path):
    """Whether reading is refused with one line about this file; any other exception fails the test."""
    message = ""
    try:
        READ[path.suffix[1:]](path)
    except InputError as error:
        message = str(error)
    assert not message or (path.name in message and "\n" not in message)
    return bool(message)


@pytest.mark.parametrize("suffix", WHOLE)
def test_files_cut_off_anywhere_are_refused(tmp_path, suffix):
    """But for what ends a file and says nothing; rows of points are whole after every line."""
    whole, path = WHOLE[suffix](), tmp_path / f"cut.{suffix}"
    path.write_bytes(whole)
    assert not refused(path)
    for length in np.unique(np.linspace(0, len(whole) - 1, 50).astype(int)):
        path.write_bytes(whole[:length])
        whole_rows = suffix == "csv" and whole[:length].count(b"\n") > 2 and whole[:length].endswith(b"\n")
        end = suffix == "png" and length >= len(whole) - 20  # checksums and the end mark: all points are there
        assert refused(path) or whole_rows or end or not whole[length:].strip(), length


@pytest.mark.parametrize("suffix", WHOLE)
def test_a_changed_word_is_refused_or_read_but_never_crashes(tmp_path, suffix):
    whole, path, count = bytearray(WHOLE[suffix]()), tmp_path / f"changed.{suffix}", 0
    random = np.random.default_rng(1)
    for _ in range(50):
        changed = whole.copy()
        at = int(random.integers(len(whole)))
        changed[at : at + 1] = bytes(random.choice([b"?", b"x", b"<", b"\xff", b"1e999", b"\n"]))
        path.write_bytes(changed)
        count += refused(path)
    assert count > 0


@pytest.mark.parametrize("suffix", WHOLE)
def test_other_encodings_and_a_gigabyte_of_zeros(tmp_path, suffix):
    import tracemalloc

    path = tmp_path / f"bad.{suffix}"
    text = WHOLE["csv" if suffix == "png" else suffix]().decode("latin-1")
    for data in (b"", b" \n", text.encode("utf-16"), text.encode("utf-32"), bytes(5000)):
        path.write_bytes(data)
        assert refused(path)
    with path.open("wb") as file:
        file.truncate(10**9)
    tracemalloc.start()
    with pytest.raises(ToolpathError, match="too large"):
        READ[suffix](path)
    assert tracemalloc.get_traced_memory()[1] < 1_000_000
    tracemalloc.stop()


def test_a_missing_package_names_the_extra(tmp_path, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "svgelements", None)
    path = tmp_path / "a.svg"
    path.write_text(SVG.format('<circle r="3"/>'))
    with pytest.raises(InputError, match=r"pentapod\[drawings\]"):
        read_lines(path, 1e-5)
