"""Toolpath files: each is read back as it was written; what is wrong with one is told with its line and word."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pentapod.base.errors import InputError, ToolpathError
from pentapod.toolpath import Segment, SegmentKind, Toolpath
from pentapod.toolpath.formats import FORMATS, format_of, read_toolpath, write_toolpath


def some_toolpath(seed=0, tilt_centre=3e-3):
    """Rapids, links and cuts at different feeds, axes that wander over a pole."""
    rng = np.random.default_rng(seed)
    count = 41
    tips = np.cumsum(rng.normal(size=(count, 3)), axis=0) * 2e-3
    axes = np.stack([np.linspace(-0.6, 0.6, count), 0.3 * np.sin(np.arange(count) / 5), np.ones(count)], 1)
    axes[20] = [0.0, 0.0, 1.0]
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    cuts = [0, 5, 8, 20, 26, 30, 40]
    kinds = ["rapid", "link", "cut", "cut", "link", "rapid"]
    feeds = [np.inf, 0.05, 0.025, 1 / 60, 0.05, np.inf]
    powers = [1.0, 1.0, 0.25, 0.6, 1.0, 1.0]
    dwells = [None, 0.0, None, 1.25, 0.003, 2.0]
    return Toolpath(
        tuple(
            Segment(SegmentKind(kind), tips[a : b + 1], axes[a : b + 1], feed, power, dwell)
            for kind, feed, power, dwell, a, b in zip(kinds, feeds, powers, dwells, cuts, cuts[1:], strict=False)
        ),
        tilt_centre,
        wait=0.5,
    )


def stands(path):
    """Seconds by waypoint."""
    return {int(at): seconds for at, seconds in zip(path.starts, path.dwells, strict=True) if seconds is not None}


def round_trip(format_name: str, toolpath: Toolpath, folder: Path) -> Toolpath:
    """Write, read, compare what the format can tell; writing again gives the same bytes."""
    form = FORMATS[format_name]
    file = write_toolpath(toolpath, folder / f"path{form.suffixes[0] if form.suffixes else '.txt'}", format_name)
    again = read_toolpath(file, format_name, tilt_centre=toolpath.tilt_centre, feed=1.0)
    np.testing.assert_allclose(again.tips, toolpath.tips, atol=1.1e-10, rtol=0)
    np.testing.assert_allclose(again.axes, toolpath.axes, atol=3e-12, rtol=0)
    assert again.tilt_centre == pytest.approx(toolpath.tilt_centre, abs=1e-15)
    owners = [path.segment_of_interval for path in (toolpath, again)]
    kinds = [np.array([path.segments[k].kind for k in o]) for path, o in zip((toolpath, again), owners, strict=True)]
    feeds = [np.array([path.segments[k].feed for k in o]) for path, o in zip((toolpath, again), owners, strict=True)]
    if "links" in form.loses:
        kinds = [np.where(k == "link", "cut", k) for k in kinds]
    assert (kinds[0] == kinds[1]).all()
    np.testing.assert_allclose(feeds[1], feeds[0], rtol=2e-6)
    powers = [[path.segments[k].power for k in o] for path, o in zip((toolpath, again), owners, strict=True)]
    np.testing.assert_allclose(powers[1], 1.0 if "power" in form.loses else powers[0], atol=1e-9)
    assert stands(again) == ({} if "dwell" in form.loses else pytest.approx(stands(toolpath), abs=1e-9))
    assert form.write(toolpath) == file.read_bytes()
    return again


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("seed", [0, 1])
def test_round_trip(tmp_path, name, seed):
    round_trip(name, some_toolpath(seed), tmp_path)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10**6), name=st.sampled_from(sorted(FORMATS)))
def test_round_trip_of_random_toolpaths(tmp_path_factory, seed, name):
    rng = np.random.default_rng(seed)
    scale = 10.0 ** rng.uniform(-4, 0)
    tips, axes = rng.normal(size=(9, 3)) * scale, rng.normal(size=(9, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    feed = 10.0 ** rng.uniform(-4, 0)
    path = Toolpath(
        (Segment(SegmentKind.CUT, tips[:4], axes[:4], feed), Segment(SegmentKind.RAPID, tips[3:], axes[3:], np.inf)),
        rng.uniform(-0.01, 0.01),
    )
    round_trip(name, path, tmp_path_factory.mktemp("formats"))


def test_format_of_a_suffix():
    assert format_of("a/PART.APT").name == "apt"
    assert format_of("x.robodk.csv").name == "robodk"
    assert format_of("x.csv").name == "csv"
    assert format_of("x.ngc").name == "xyzab"
    assert format_of("x.txt", "xyzbc").name == "xyzbc"
    with pytest.raises(ToolpathError, match=r"no toolpath format.*\.apt"):
        format_of("x.step")
    with pytest.raises(ToolpathError, match='did you mean "robodk"'):
        format_of("x.csv", "robodck")


APT = """\
PARTNO BLADE 7
$$ a remark
UNITS/INCHES
MULTAX/ON
CUTTER/0.5,0.25
FEDRAT/10,IPM
RAPID
GOTO/0,0,1,0,0,1
GOTO/ 0, 0, $
  0, 0, 0.6, 0.8
GOTO/1,0,0,0,0.6,0.8
FINI
"""

NGC = """\
%
G20 G90 G94 (inches)
g0 x0 y0 z1 a0 b0
N30 G1 Z0 F10 ; down
G91 X1 B90
G90 G93 X0 F2
M2
%
"""


def test_apt_of_other_programs(tmp_path):
    (tmp_path / "a.apt").write_text(APT)
    path = read_toolpath(tmp_path / "a.apt")
    np.testing.assert_allclose(path.tips, np.array([[0, 0, 1], [0, 0, 0], [1, 0, 0]]) * 0.0254, atol=1e-15)
    np.testing.assert_allclose(path.axes[2], [0, 0.6, 0.8])
    assert [s.kind for s in path.segments] == ["cut"]  # RAPID was the first GOTO's alone
    assert path.segments[0].feed == pytest.approx(10 * 0.0254 / 60)
    assert path.tilt_centre == pytest.approx(0.25 * 0.0254)
    (tmp_path / "small.apt").write_text(APT.lower())
    np.testing.assert_array_equal(read_toolpath(tmp_path / "small.apt").tips, path.tips)


def test_gcode_modes(tmp_path):
    (tmp_path / "a.ngc").write_text(NGC)
    path = read_toolpath(tmp_path / "a.ngc")
    np.testing.assert_allclose(path.tips, np.array([[0, 0, 1], [0, 0, 0], [1, 0, 0], [0, 0, 0]]) * 0.0254, atol=1e-15)
    np.testing.assert_allclose(path.axes[2:], [[1, 0, 0]] * 2, atol=1e-15)
    feeds = [path.segments[k].feed for k in path.segment_of_interval]
    np.testing.assert_allclose(feeds, [10 * 0.0254 / 60, 10 * 0.0254 / 60, 0.0254 * 2 / 60])


def test_apt_delays(tmp_path):
    text = APT.replace("FEDRAT/10", "DELAY/3\nFEDRAT/10").replace("GOTO/1,0", "DELAY/1.5\nDELAY/.25\nGOTO/1,0")
    (tmp_path / "a.apt").write_text(text.replace("FINI", "DELAY/0\nFINI"))
    path = read_toolpath(tmp_path / "a.apt")
    assert path.wait == 3.0
    assert stands(path) == {0: 3.0, 1: 1.75, 2: 0.0}


LONG = """\
G21 G90 G94{extra}
G0 X0 Y0 Z0 {a}0 {b}0
{first}
G1 X1 F60
X2 {second}
{third}
X3
{fourth}
M2
"""


@pytest.mark.parametrize(
    ("name", "blocks", "expected"),
    [
        # By the book of each: LinuxCNC's P is in seconds; elsewhere P is in milliseconds, X and U in seconds.
        ("a.ngc", ("G4 P2", "", "G4 P0.25", ""), {0: 2.0, 2: 0.25}),
        ("a.ngc", ("G61.1", "", "G64 P0.01", ""), {1: 0.0, 2: 0.0}),
        ("a.ngc", ("G61", "", "", "N7 G04 P0"), {3: 0.0}),
        ("a.nc", ("G4 P2000", "", "G04 X0.25", "G4 U1.5"), {0: 2.0, 2: 0.25, 3: 1.5}),
        ("a.nc", ("G61", "", "G64", ""), {1: 0.0, 2: 0.0}),
        ("a.nc", ("", "G9", "", ""), {2: 0.0}),
    ],
)
def test_gcode_dwells_and_exact_stops(tmp_path, name, blocks, expected):
    a, b = "AB" if name == "a.ngc" else "BC"
    words = dict(zip(("first", "second", "third", "fourth"), blocks, strict=True))
    text = LONG.format(a=a, b=b, extra="" if name == "a.ngc" else " G43.4 H1", **words)
    (tmp_path / name).write_text(text)
    path = read_toolpath(tmp_path / name)
    assert len(path) == 4
    assert stands(path) == expected


def test_rotary_angles_match_rotation_matrices(tmp_path):
    """XYZAB against rotation matrices of the kinematics notes, XYZBC against C on B."""
    from scipy.spatial.transform import Rotation

    from pentapod.toolpath.formats.rotary import AB, BC

    rng = np.random.default_rng(0)
    angles = rng.uniform(-80, 80, (100, 2))
    for rotary, order in ((AB, "YX"), (BC, "ZY")):
        matrices = Rotation.from_euler(order, angles[:, ::-1], degrees=True).as_matrix()
        np.testing.assert_allclose(rotary.axis(angles), matrices[:, :, 2], atol=1e-15)
        np.testing.assert_allclose(rotary.axis(rotary.angles(rotary.axis(angles))), rotary.axis(angles), atol=1e-14)
    turn = np.radians(np.arange(0, 1080, 10.0))
    cone = np.stack([0.6 * np.cos(turn), 0.6 * np.sin(turn), 0.8 + 0 * turn], 1)
    assert np.abs(np.diff(BC.angles(cone)[:, 1])).max() < 10.1  # three turns, no jump


PLAIN = "x_mm,y_mm,z_mm,i,j,k,kind,feed_mm_min\n0,0,0,0,0,1,start,\n"

BAD = {
    "a.apt": [
        (APT.replace("UNITS/INCHES\n", ""), r"a.apt:4: CUTTER: the unit is missing"),
        (APT.replace("UNITS/INCHES", "UNITS/CUBITS"), r"a.apt:3: UNITS: unknown unit"),
        (APT.replace("MULTAX/ON\n", ""), r"a.apt:7: GOTO: wrong number.*MULTAX/ON is missing"),
        (APT.replace(",IPM", ""), r"a.apt:6: FEDRAT: a feed needs its unit"),
        (APT.replace("RAPID", "CUTCOM/LEFT"), r"a.apt:7: CUTCOM"),
        (APT.replace("RAPID", "TRACUT/LAST"), r"a.apt:7: TRACUT"),
        (APT.replace("RAPID", "RAPPID"), r'a.apt:7: RAPPID: an unknown word; did you mean "RAPID"'),
        (APT.replace("0.6,0.8\nFINI", "0.6,0.9\nFINI"), r"a.apt:11: GOTO: the tool axis has not unit length"),
        (APT.replace("GOTO/1,0", "GOTO/1,O"), r"a.apt:11: GOTO: not a finite number \(got 'O'\)"),
        (APT.replace("FINI\n", ""), r"FINI is missing"),
        (APT.replace("RAPID", "DELAY/5,REV"), r"a.apt:7: DELAY: not a time"),
        (APT.replace("RAPID", "DELAY/-5"), r"a.apt:7: DELAY: a time below 0"),
        (APT.replace("FINI\n", "FINI\nGOTO/0,0,0,0,0,1\n"), r"a.apt:13: GOTO: a word after FINI"),
        (APT.replace("FEDRAT/10,IPM\n", ""), r"FEDRAT before it"),
    ],
    "a.ngc": [
        (NGC.replace("G20 ", ""), r"a.ngc:3: X: the unit is missing"),
        (NGC.replace("g0 x0", "g0"), r"a.ngc:4: Z: a move on feed to an unknown place: X is not known"),
        (NGC.replace("G1 Z0", "G2 Z0"), r"a.ngc:4: G2: an arc without its centre or radius"),
        (NGC.replace("G1 Z0 F10", "G1 Z0"), r"a.ngc:4: F: the feed is missing"),
        (NGC.replace("X0 F2", "X0"), r"a.ngc:6: F: in G93 every move needs its own feed"),
        (NGC.replace("B90", "B9O"), r"a.ngc:5: O: not a word with a number"),
        (NGC.replace("X1 B90", "X1 X2"), r"a.ngc:5: X: a word that comes twice"),
        (NGC.replace("X1 B90", "X1 E90"), r"a.ngc:5: E: an unknown word"),
        (NGC.replace("X1 B90", "X1 B30 C9").replace("X0 F2", "A4"), r"a.ngc:6: C: rotary axes A, B and C: which"),
        (NGC.replace("X1", "X[#1+2]"), r"a.ngc:5: X\[#1\+2\]: an expression with a variable: .*; export numbers"),
        (NGC.replace("X1", "X[#1+2]"), r"X\[#1\+2\]: .* not computed"),
        (NGC.replace("X1", "@10 ^45"), r"a.ngc:5: @10: polar coordinates; export X and Y"),
        (NGC.replace("M2\n%\n", ""), r"M2 or M30 is missing"),
        (NGC.replace("G1 Z0 F10", "G1 Z0 F-10"), r"F-10: the feed must be positive"),
        (NGC.replace("M2\n", "G4\nM2\n"), r"a.ngc:7: G4: a dwell without its time"),
        (NGC.replace("M2\n", "G4 P-1\nM2\n"), r"a.ngc:7: G4: a dwell without its time"),
        (NGC.replace("M2\n", "G4 X1\nM2\n"), r"a.ngc:7: G4: a dwell without its time"),
        (NGC.replace("M2\n", "G4 P0.5 G0 X1\nM2\n"), r"a.ngc:7: X1: a dwell and other words in one block; .*own"),
    ],
    "a.nc": [
        (NGC.replace("M2\n", "G4 P2.5\nM2\n").replace("%\nG20", "%\nG43.4 H1 G20").replace("a0 b0", "b0 c0"),
         r"a.nc:7: P2.5: seconds or milliseconds\?"),
        (NGC.replace("a0 b0", "b0 c0"), r"a.nc:5: X: .*without tool centre point programming: .*in line 6"),
    ],
    "a.csv": [
        ("x,y,z,i,j,k\n0,0,0,0,0,1\n", r"a.csv:1: the columns x, y, z have no unit"),
        (PLAIN + "1,0,0,0,0,1,glide,5\n", r"a.csv:3: kind: unknown"),
        (PLAIN + "1,0,0,0,0,1,cut,\n", r"a.csv:3: feed_mm_min"),
        (PLAIN.replace("min\n", "min,power\n").replace("rt,", "rt,,1") + "1,0,0,0,0,1,cut,9,2\n", r"csv:3: power"),
        (PLAIN.replace("min\n", "min,power,dwell_s\n").replace("rt,", "rt,,1,") + "1,0,0,0,0,1,cut,9,1,-2\n",
         r"a.csv:3: dwell_s: a time below 0"),
        ("x_mm,y_mm,z_mm,i,j,k\n0,0,0,0,0\n", r"a.csv:2: wrong number of columns"),
        ("# waypoints = 3\n" + PLAIN + "1,0,0,0,0,1,cut,9\n", r"the file was cut"),
    ],
    "a.robodk.csv": [
        ("0,0,0,0,0,1,5\n0,0,nan,0,0,1,5\n", r"csv:2: Z: not a finite number"),
        ("0,0,0,0,0,1,5\n0,0,1,0,0,1\n", r"csv:2: wrong number of columns"),
        ("0,0,0,0,0,1\n0,0,1,0,0,1\n", r"csv:1: SPEED: the speed is missing"),
        ("0,0,0,0,0,1,5\n0,0,0,0,0,1,5\n", r"no motion"),
    ],
}  # fmt: skip


@pytest.mark.parametrize(("name", "text", "message"), [(n, t, m) for n, cases in BAD.items() for t, m in cases])
def test_errors_name_line_and_word(tmp_path, name, text, message):
    (tmp_path / name).write_text(text)
    with pytest.raises(ToolpathError, match=message) as caught:
        read_toolpath(tmp_path / name)
    assert "\n" not in str(caught.value)


def refused(file, name):
    """Whether reading is refused with one line about this file; any other exception fails the test."""
    message = ""
    try:
        read_toolpath(file, name, feed=0.01)
    except InputError as error:
        message = str(error)
    assert not message or str(file) in message
    assert "\n" not in message
    return bool(message)


@pytest.mark.parametrize("name", FORMATS)
def test_files_cut_off_anywhere_are_refused(tmp_path, name):
    data = FORMATS[name].write(some_toolpath())
    file = tmp_path / "cut"
    for size in np.linspace(0, len(data) - 1, 50).astype(int):
        file.write_bytes(data[:size])
        # Rows without any end mark are whole after every line; everything else must be refused.
        whole_rows = "end" in FORMATS[name].loses and data[:size].endswith(b"\n") and data[:size].count(b"\n") > 2
        assert refused(file, name) or whole_rows or data[size:].strip() in (b"", b"%"), size


@pytest.mark.parametrize("name", FORMATS)
def test_a_changed_word_is_refused_or_read_but_never_crashes(tmp_path, name):
    data = bytearray(FORMATS[name].write(some_toolpath()))
    rng, file, count = np.random.default_rng(0), tmp_path / "changed", 0
    for _ in range(50):
        changed = data.copy()
        at = int(rng.integers(len(data)))
        changed[at : at + 1] = bytes(rng.choice([b"?", b"x", b"--", b"\xff", b"1e999", b"\n"]))
        file.write_bytes(changed)
        count += refused(file, name)
    assert count > 15


@pytest.mark.parametrize("name", FORMATS)
def test_other_encodings_nothing_and_a_gigabyte_of_zeros(tmp_path, name):
    import tracemalloc

    text = FORMATS[name].write(some_toolpath())
    file = tmp_path / "bad"
    for data in (
        b"",
        b" \n\n",
        b"\xff\xfe" + text[:400].decode("latin-1").encode("utf-16-le"),
        b"\xe9t\xe9\n" + text[:300],
    ):
        file.write_bytes(data)
        assert refused(file, name)
    with file.open("wb") as stream:
        stream.truncate(10**9)
    tracemalloc.start()
    assert refused(file, name)
    assert tracemalloc.get_traced_memory()[1] < 10_000_000
    tracemalloc.stop()
    assert refused(tmp_path / "missing", name)
    assert refused(tmp_path, name)


def test_archives_with_wrong_arrays_are_refused(tmp_path):
    file = write_toolpath(some_toolpath(), tmp_path / "a.npz")
    arrays = dict(np.load(file))
    for key, value in (("toolpath.segment_starts", np.array([0, 3])), ("toolpath.axes", 2 * arrays["toolpath.axes"]),
                       ("toolpath.tips_mm", np.array("x"))):  # fmt: skip
        np.savez(file, **{**arrays, key: value})
        with pytest.raises(ToolpathError, match=r"a\.npz"):
            read_toolpath(file)
    del arrays["toolpath.axes"]
    np.savez(file, **arrays)
    with pytest.raises(ToolpathError, match="an array is missing"):
        read_toolpath(file)
