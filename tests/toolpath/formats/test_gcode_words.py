"""What words of G-code and APT mean where a wrong reading moves the tool to a wrong place, or at a wrong feed."""

from __future__ import annotations

import numpy as np
import pytest

from pentapod.base.errors import ToolpathError
from pentapod.toolpath.formats import read_toolpath, write_toolpath
from pentapod.toolpath.formats.rotary import RotaryAxes

HEAD, END = "%\nG21 G90 G94 G17 F100\n", "M30\n%\n"
MPF = "G71 G90 G94 F100\n"


@pytest.fixture
def read(tmp_path):
    def of(text, suffix=".nc", **options):
        file = tmp_path / f"a{suffix}"
        file.write_text(text)
        return read_toolpath(file, **options)

    return of


def tips(path):
    return path.tips * 1e3


@pytest.mark.parametrize(
    ("block", "suffix", "head"),
    [
        ("G5.1 Q3 X0 Y0 Z0", ".nc", HEAD),
        ("G05 P10000", ".nc", HEAD),
        ("G22 X100 Y100 Z100 I-100 J-100 K-100", ".nc", HEAD),
        ("G10.6 Z100", ".nc", HEAD),
        ("G25 X-10 Y-10", ".mpf", MPF),
        ("G26 X100 Y100", ".mpf", MPF),
    ],
)
def test_axis_words_that_are_no_places(read, block, suffix, head):
    """Axes to smooth, limits of the working area, a way to retract: the tool stays where it is."""
    path = read(f"{head}G0 X50 Y50 Z50\n{block}\nG1 X60\nM30\n", suffix)
    np.testing.assert_allclose(tips(path), [[50, 50, 50], [60, 50, 50]])


def test_whole_turns_in_one_block(read):
    """A helix of two turns about x that ends above where it begins, on a table."""
    path = read(f"{HEAD}G0 X0 Y0 Z10 A0\nG1 X10 A720\n{END}", rotary=RotaryAxes.of(["table A"], (0.0, 0.0, 0.0)))
    angle = np.radians(72.0 * tips(path)[:, 0])
    np.testing.assert_allclose(tips(path)[:, 1:], 10.0 * np.stack([-np.sin(angle), np.cos(angle)], axis=1), atol=1e-9)
    np.testing.assert_allclose(path.axes[:, 1:], np.stack([-np.sin(angle), np.cos(angle)], axis=1), atol=1e-9)
    assert np.diff(angle).max() < np.radians(10.0)
    # With it, the tip goes straight and the axis round.
    path = read(f"{HEAD}G43.4 H1\nG0 X0 Y0 Z10 B45 C0\nG1 X10 C720\n{END}")
    angle = np.radians(72.0 * tips(path)[:, 0])
    half = np.sqrt(0.5)
    axes = np.stack([half * np.cos(angle), half * np.sin(angle), half + 0.0 * angle], axis=1)
    np.testing.assert_allclose(path.axes, axes, atol=1e-9)


def test_table_that_turns_back_to_zero(read):
    """On the way to an angle of 0 the table is still turned."""
    path = read(f"{HEAD}G0 X0 Y0 Z10 A90\nG1 X9 A0\n{END}", rotary=RotaryAxes.of(["table A"], (0.0, 0.0, 0.0)))
    assert len(path) > 10
    angle = np.radians(90.0 - 10.0 * tips(path)[:, 0])
    np.testing.assert_allclose(tips(path)[:, 1:], 10.0 * np.stack([-np.sin(angle), np.cos(angle)], axis=1), atol=1e-9)


@pytest.mark.parametrize(
    ("text", "same", "suffix"),
    [
        ("G43.4 H1\nG0 X0 Y0 Z10 A 30. C 20.\n", "G43.4 H1\nG0 X0 Y0 Z10 A30. C20.\n", ".nc"),
        ("#1=30\n#2=20\nG0 X0 Y0 Z10 A#1 B#2\n", "G0 X0 Y0 Z10 A30 B20\n", ".ngc"),
        ("TRAORI\nR1=30\nG0 X0 Y0 Z10 A=R1 C=DC(20)\n", "TRAORI\nG0 X0 Y0 Z10 A30 C20\n", ".mpf"),
    ],
)
def test_rotary_words_in_whatever_way_they_are_written(read, text, same, suffix):
    head, end = (MPF, "M30\n") if suffix == ".mpf" else (HEAD, END)
    found, wanted = (read(f"{head}{part}G1 X10\n{end}", suffix) for part in (text, same))
    np.testing.assert_allclose(found.axes, wanted.axes, atol=1e-12)


def rotation(axis, degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.roll([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]], axis, axis=(0, 1))


@pytest.mark.parametrize("order", ["123", "321", "231"])
def test_roll_pitch_and_yaw_are_about_x_y_and_z_in_any_order(read, order):
    path = read(f"{HEAD}G68.2 P1 Q{order} X1 Y2 Z3 I10 J20 K30\nG53.1\nG0 X0 Y0 Z10\nG1 Z0\n{END}")
    turned = np.eye(3)
    for digit in order:
        turned = rotation(int(digit) - 1, {"1": 10, "2": 20, "3": 30}[digit]) @ turned
    np.testing.assert_allclose(path.axes[0], turned[:, 2], atol=1e-12)
    np.testing.assert_allclose(tips(path), [[1, 2, 3] + 10 * turned[:, 2], [1, 2, 3]], atol=1e-12)


@pytest.mark.parametrize(
    ("text", "suffix", "words"),
    [
        (f"{MPF}TRANS X10\nG0 A30 C20 X0 Y0 Z10\nG1 X5\nM30\n", ".mpf", "4: .*depends on the machine"),
        (f"{HEAD}G68 X0 Y0 R30\nG0 A30 C20 X0 Y0 Z10\nG1 X5\n{END}", ".nc", "5: .*depends on the machine"),
        (f"{HEAD}G0 X10 Y10 A30 C20\nG43.4 H1 Z100\nG1 Z5\n{END}", ".nc", "5: Z: .*X, Y are not known here"),
        (f"{MPF}G0 X10 Y0 Z0 A3=0 B3=0.6 C3=0.8\nG1 X0\nM30\n", ".mpf", "3: .*with G43.4 or TRAORI"),
        (
            f"{MPF}TRAORI\nG0 X10 Y0 Z0 A3=0 B3=0 C3=1\nG3 X0 Y10 I-10 J0 A3=0 B3=0.6 C3=0.8\nM30\n", ".mpf",
            "4: .*an arc on which the tool axis turns to a vector",
        ),
        ("G70 G90 G94\nG0 X1 Y0 Z1\nG1 X2 F100\nM30\n", ".mpf", "3: F: with G70 the unit of the feed"),
        ("%\nG90 F10\nG52 X1\nG20\nG0 X0 Y0 Z1\nG1 X1\nM30\n%\n", ".nc", "3: X1: the unit is missing"),
        ("G90 F10\nTRANS X1\nG700\nG0 X0 Y0 Z1\nG1 X1\nM30\n", ".mpf", "2: X1: the unit is missing"),
        (f"{HEAD}G0 X0 Y0 Z0\nG1 X1\nG4 P1.\n{END}", ".nc", "5: P1: seconds or milliseconds"),
        (f"{HEAD}G0 X10 Y0 Z0\nG3 X10 Y0 I-10 J0 Z-5 L3\n{END}", ".nc", "4: G3: L in an arc"),
        (f"{HEAD}G0 X10 Y0 Z0\nG3 X0 Y10 I-10 J0 K5\n{END}", ".nc", "4: G3: K in an arc of the plane G17"),
        (f"{HEAD}G0 X0 Y0 Z1\nG81 Z-1 R0.1 L0\nG70 I2. J30. L6\n{END}", ".nc", "5: G70: a cycle that is not read"),
        ("G21 G90 F100\nG7\nG0 X0 Y0 Z10\nG1 X10\nM2\n", ".ngc", "2: G7: X is a diameter"),
        ("G21 G90 F100\nG0 X0 Y0 Z0\nG5.1 X10 Y10 I5\nM2\n", ".ngc", r"3: G5\.1: a spline"),
        ("G21 G90 F100\nG0 X0 Y0 Z0\nG92 X5\nG92.2\nG92.3\nG1 X0\nM2\n", ".ngc", r"5: G92\.3: a word that"),
        ("%\nG21 G90 G93\nG0 X0 Y0 Z10\nG81 X0 Y0 Z-5 R2 F5\nG80\nM30\n%\n", ".nc", "4: F: in G93 every move"),
        (f"{HEAD}G10 L2 P0 X5\nG0 X0 Y0 Z0\nG1 X1\n{END}", ".nc", "3: P0: an offset of all systems"),
        (f"{HEAD}G54 P1\nG0 X0 Y0 Z0\nG1 X9\nG54 P2\nG1 X0\n{END}", ".nc", "7: .*moves in G54.1 P2 after moves in"),
        (f"{MPF}G54\nG0 X0 Y0 Z0\nG1 X9\nG500\nG1 X0\nM30\n", ".mpf", "6: .*moves in G500 after moves in G54"),
        (f"{MPF}G0 X0 Y0 Z9\nCYCLE82(9,0,2,-5,,-3)\nM30\n", ".mpf", "3: .*a dwell in turns of the spindle"),
    ],
)  # fmt: skip
def test_what_depends_on_the_machine_or_means_something_else_is_refused(read, text, suffix, words):
    with pytest.raises(ToolpathError, match=f"a\\{suffix}:{words}"):
        read(text, suffix)


def test_retract_after_tool_centre_point_programming_is_off(read):
    """X and Y are those of the machine then: the tool passes over the part."""
    text = f"{HEAD}G43.4 H1\nG0 X10 Y10 Z50 A30 C20\nG1 Z5\nG49\nG0 Z100\nG43.4 H1\nG0 X10 Y20 Z50\nG1 Z5\n{END}"
    path = read(text, rotary=RotaryAxes.of(["table C", "table A"], (0.0, 0.0, -50e-3)))
    assert np.abs(tips(path)).max() < 60.0
    np.testing.assert_allclose(tips(path)[[0, 1, -2, -1]], [[10, 10, 50], [10, 10, 5], [10, 20, 50], [10, 20, 5]])


@pytest.mark.parametrize("word", ["Z0", "W0"])
def test_rotary_axes_stay_turned_where_z_alone_goes_home(read, word):
    text = f"G43.4 H1\nG0 X0 Y0 Z10 B30\nG1 X10\nG91 G28 {word}\nG90\nG0 X0 Y0 Z20\nG1 X10\n"
    np.testing.assert_allclose(read(f"{HEAD}{text}{END}").axes, [[0.5, 0.0, np.sqrt(0.75)]] * 6, atol=1e-12)


@pytest.mark.parametrize("code", ["G2", "G3"])
def test_arc_that_ends_beside_its_start_on_the_same_ray_is_a_full_turn(read, code):
    path = read(f"{HEAD}G0 X10 Y0 Z0\n{code} X10.001 Y0 I-10 J0\n{END}")
    assert np.linalg.norm(np.diff(tips(path), axis=0), axis=1).sum() == pytest.approx(20.0 * np.pi, rel=1e-3)


@pytest.mark.parametrize(
    ("offsets", "second", "shift"),
    [
        ("G10 L2 P1 X0 Y0 Z0\nG10 L2 P2 X100 Y0 Z0\n", "G55", 100.0),
        ("G10 L2 P1 X10 Y0 Z0\nG10 L2 P2 X10 Y0 Z0\nG91 G10 L2 P2 X5\nG90\n", "G55", 5.0),
        ("G10 L2 P1 X1 Y0 Z0\nG10 L20 P01 X8 Y0 Z0\n", "G54.1 P1", 7.0),
    ],
)
def test_second_work_offset_where_the_file_says_both(read, offsets, second, shift):
    text = f"{HEAD}{offsets}G54\nG0 X10 Y10 Z10\nG1 X20\n{second}\nG0 X0 Y10 Z10\nG1 X20\n{END}"
    np.testing.assert_allclose(tips(read(text))[-2:], [[shift, 10, 10], [shift + 20, 10, 10]])


def test_dwell_of_a_deep_hole_of_sinumerik(read):
    path = read(f"{MPF}G0 X0 Y0 Z9\nCYCLE83(9,0,2,-5,,-2,,0,1.5,0,1,1)\nM30\n", ".mpf")
    assert [
        (round(tip), dwell) for tip, dwell in zip(tips(path)[path.starts, 2], path.dwells, strict=True) if dwell
    ] == [(-5, 1.5)]


def test_stops_of_the_program_are_kept_and_told(read):
    path = read(f"{HEAD}G0 X0 Y0 Z0\nG1 X1\nM0\nX2\n{END}")
    assert path.segments[1].words == ("M0",)
    assert any("M0 and M1" in note and "line 5" in note for note in path.notes)


APT = (
    "UNITS/MM\nFEDRAT/100,MMPM\nLOADTL/3\nSPINDL/RPM,12000,CLW\nCOOLNT/FLOOD\nRAPID\nGOTO/0,0,10\nGOTO/0,0,0\n"
    "INSERT/M32\nSPINDL/90,SFM,CLW\nGOTO/1,0,0\nCOOLNT/OFF\nSPINDL/OFF\nOPSTOP\nFINI\n"
)


def test_spindle_coolant_and_tool_of_apt_are_kept(read, tmp_path):
    path = read(APT, ".apt")
    said = ("T3", "M6", "S12000", "M3", "M8")
    assert [segment.words for segment in path.segments] == [said, ("M32",)]
    assert path.end_words == ("M9", "M5", "M1")
    assert path.notes == ("not kept: SPINDL/90,SFM,CLW (line 10)",)
    again = read_toolpath(write_toolpath(path, tmp_path / "again.apt"))
    assert [segment.words for segment in again.segments] == [said, ("M32",)]
    assert again.end_words == path.end_words
    as_written = (tmp_path / "again.apt").read_text()
    assert "LOADTL/3\nSPINDL/12000,RPM,CLW\nCOOLNT/ON\nRAPID\nGOTO" in as_written
