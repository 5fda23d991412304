"""Files as CAM systems write them (`cam/`): each is read with the geometry for which it was made.

The geometry is stated here in closed form: passes on a ball of 40 mm with the tool along its normal for files with
rotary axes, circles, points and planes for the others. The files were written from it by formulas that are not those of
the reader: inverse kinematics of each machine.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pentapod.base.errors import ToolpathError
from pentapod.toolpath import SegmentKind
from pentapod.toolpath.formats import read_toolpath
from pentapod.toolpath.formats.rotary import RotaryAxes

CAM = Path(__file__).parent / "cam"
CENTRE, PIVOT, BALL = (12e-3, -7e-3, -55e-3), 0.18, 40.0

MACHINES = {
    "table_table_no_tcp.nc": RotaryAxes.of(["table C", "table A"], CENTRE),
    "head_head_no_tcp.nc": RotaryAxes.of(["head C", "head A"], None, PIVOT),
    "head_table_no_tcp.nc": RotaryAxes.of(["table C", "head B"], CENTRE, PIVOT),
    "linuxcnc_dual_table.ngc": RotaryAxes.of(["table A", "table B"]),
    "indexed_a.nc": RotaryAxes.of(["table A"], (0.0, 0.0, 0.0)),
}
NARROW = ("table_table_no_tcp.nc", "head_head_no_tcp.nc", "head_table_no_tcp.nc")
DOMES = (
    "fusion_ac_table.nc", "fusion_bc_table.nc", "fork_head_inch.tap", "fanuc_vectors.nc", "haas_g234.nc",
    "nx_bc_mixed.ptp", *NARROW, "sinumerik_fusion_bc.mpf", "sinumerik_traori_ic.mpf", "sinumerik_nx_vectors.mpf",
    "linuxcnc_xyzac.ngc", "linuxcnc_xyzbc.ngc", "linuxcnc_pentakins.ngc", "linuxcnc_dual_table.ngc",
)  # fmt: skip
REFUSED = ("refused_compensation.nc", "refused_loop.ngc", "refused_program.mpf")


def read(name, **options):
    return read_toolpath(CAM / name, rotary=MACHINES.get(name), **options)


def cuts(path):
    """Tips in mm and axes of all cuts, with the pose before each."""
    segments = [s for s in path.segments if s.kind is SegmentKind.CUT]
    return np.concatenate([s.tips for s in segments]) * 1e3, np.concatenate([s.axes for s in segments])


def nearest(points, to):
    """Index of, and distance to, the nearest of `points` for each of `to`."""
    apart = np.linalg.norm(points[None] - np.asarray(to, dtype=float)[:, None], axis=2)
    return apart.argmin(axis=1), apart.min(axis=1)


def on_ball(name):
    """Normals at the ends of the blocks of the three passes."""
    step, most = (2, 20) if name in NARROW else (10, 60)
    polar = np.radians([[10.0], [25.0], [40.0]])
    around = np.radians(np.arange(-most, most + 1, step))
    parts = (np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar) + 0.0 * around)
    return np.stack(parts, axis=-1)


@pytest.mark.parametrize("name", DOMES)
def test_passes_on_a_ball(name):
    normals = on_ball(name)
    tips, axes = cuts(read(name))
    for row in normals:
        at, distance = nearest(tips, BALL * row)
        assert distance.max() < 1.1e-3
        assert (np.diff(at) > 0).all()
        np.testing.assert_allclose(axes[at], row, atol=5e-5)
    # Between the blocks the tool stays on straight chords, or on the curve that the machine's axes make.
    lengths = np.linalg.norm(tips, axis=1)
    lengths = lengths[lengths < BALL + 0.01]
    assert lengths.min() > (BALL - 0.02 if name in NARROW else BALL * np.cos(np.radians(10.0)) - 0.01)
    feeds = [s.feed * 6e4 for s in read(name).segments if s.kind is SegmentKind.CUT]
    assert min(feeds) > 500


@pytest.mark.parametrize("name", DOMES)
def test_rapids_between_passes_stay_clear_of_the_ball(name):
    for segment in read(name).segments:
        if segment.kind is SegmentKind.RAPID:
            share = np.linspace(0.0, 1.0, 50)[:, None, None]
            between = segment.tips[:-1] + share * np.diff(segment.tips, axis=0)
            assert np.linalg.norm(between, axis=2).min() * 1e3 > BALL - 0.1


def test_angles_between_two_blocks_turn_evenly():
    """The tool axis of a block that turns A and C follows the angles, not the shortest way."""
    path = read("fusion_ac_table.nc")
    for segment in path.segments:
        if segment.kind is SegmentKind.CUT:
            tilt = np.degrees(np.arccos(segment.axes[:, 2]))
            np.testing.assert_allclose(tilt, np.round(tilt / 5) * 5, atol=0.021)


def test_feeds_of_inverse_time():
    feeds = [s.feed * 6e4 for s in read("haas_g234.nc").segments if s.kind is SegmentKind.CUT]
    np.testing.assert_allclose([f for f in feeds if f > 700], 900.0, rtol=1e-3)
    feeds = [round(s.feed * 6e4, 2) for s in read("feeds.nc").segments if s.kind is SegmentKind.CUT]
    np.testing.assert_allclose(feeds, [300, 400, 4 * 5 * np.pi, 200, 250], rtol=1e-3)


def line(*points):
    return np.array(points, dtype=float)


def arc(centre, radius, begin, sweep, plane="xy", end=None):
    """A finely drawn arc or helix: angles in degrees from the plane's first axis to its second; end: last height."""
    first, second = ("xyz".index(letter) for letter in plane)
    share = np.linspace(0.0, 1.0, 2 + int(abs(sweep) * 4))
    points = np.repeat(np.array([centre], dtype=float), len(share), axis=0)
    angle = np.radians(begin + share * sweep)
    points[:, first] += radius * np.cos(angle)
    points[:, second] += radius * np.sin(angle)
    if end is not None:
        height = 3 - first - second
        points[:, height] += share * (end - centre[height])
    return points


def runs(path):
    """Tips in mm of each uninterrupted motion on feed."""
    found, last = [], None
    for segment in path.segments:
        if segment.kind is SegmentKind.RAPID:
            last = None
        elif last is None:
            last = [segment.tips * 1e3]
            found.append(last)
        else:
            last.append(segment.tips[1:] * 1e3)
    return [np.concatenate(run) for run in found]


def spread(points, count=1500):
    """Points at even distances along a polyline, and its length."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    at = np.linspace(0.0, along[-1], count)
    return np.stack([np.interp(at, along, points[:, k]) for k in range(3)], axis=1), along[-1]


TILTED = np.radians(30.0)
"""Sinumerik's third plane: Rz(90) Ry(-30), and 5 mm along its axis."""


def on_plane(x, y, z):
    """A point of the plane that sinumerik_cycle800.mpf turns to last."""
    z = z + 5
    c, s = np.cos(TILTED), np.sin(TILTED)
    u, v, w = np.array([0, c, s]), np.array([-1, 0, 0]), np.array([0, -s, c])
    return u * x + v * y + w * z


def on_wedge(x, y, z):
    """A point of its second plane: turned by -15 degrees about x at (10, 20, 30)."""
    c, s = np.cos(np.radians(15)), np.sin(np.radians(15))
    return np.array([10 + x, 20 + c * y + s * z, 30 - s * y + c * z])


def wedge_arc():
    flat = arc((15, -5, 0), 5, 90, -90)
    return np.array([on_wedge(*p) for p in flat])


def on_offset(x, y):
    """Height of the tip of a ball cutter of 6 mm on the ball of 40 mm."""
    return np.sqrt(43.0**2 - x * x - y * y) - 3.0


INCH = 25.4
RELIEF = [
    [x, 0.1 * row, -0.02 * (1 - np.cos(2 * np.pi * x)) / 2 - 0.001 * row]
    for row in range(5)
    for x in np.linspace(0, 1, 21)[:: 1 if row % 2 == 0 else -1]
]
EXPECTED = {
    "fusion_bore.nc": [
        [
            line((36, 20, 5), (36, 20, 3)),
            arc((38, 20, 3), 2, 180, 90, "xz"),
            arc((30, 20, 1), 8, 0, 540, end=-2),
            arc((30, 20, -2), 8, 180, 180, end=-3),
            arc((30, 20, -3), 8, 0, 360),
            arc((36, 20, -3), 2, 0, 90, "xz"),
        ],
    ],
    "planes.nc": [
        [
            arc((0, 0, 0), 10, 0, -90),
            arc((0, 0, 0), 10, -90, 90),
            arc((0, 0, 0), 10, 0, 270),
            arc((0, 0, 0), 10, 90, 180, "zx"),
            arc((0, 0, 0), 10, -90, -180, "zx"),
            arc((10, 0, 10), 10, 180, -270, "zx"),
            arc((0, 0, 0), 10, 0, -270, "yz"),
            arc((0, 10, 10), 10, 180, 90, "yz"),
            arc((0, 0, 0), 10, 0, 360, "yz"),
            arc((0, 0, 0), 10, 90, -90),
            arc((0, 0, 0), 10, 0, 180),
        ],
    ],
    "nist_disc.ngc": [
        [
            line((2, 0.375, 2.1), (2, 0.375, 1.6875)) * INCH,
            arc((2 * INCH, 2 * INCH, 1.6875 * INCH), 1.625 * INCH, -90, -360),
            line((2, 0.375, 2.1)) * INCH,
        ],
    ],
    "relief_inch.nc": [[line((0, 0, 0.2), *RELIEF) * INCH]],
    "freecad.ngc": [
        [
            line((-2, 0, 5), (-2, 0, -1), (-2, 30, -1)),
            arc((0, 30, -1), 2, 180, -90),
            arc((40, 30, -1), 2, 90, -90),
            arc((40, 0, -1), 2, 0, -90),
            arc((0, 0, -1), 2, -90, -90),
        ],
    ],
    "sinumerik_2d.mpf": [
        [
            line((20, 0, 5)),
            arc((0, 0, 0), 20, 0, 360),
            arc((0, 0, 0), 20, 0, 1080, end=-6),
            arc((20, -20, -6), 20, 90, -270),
        ],
        [line((5, 5, 3), (5, 5, -6.5))],
        [line((-5, 5, 3), (-5, 5, -6.5))],
        [line((0, -5, 3), (0, -5, -4))],
        [line((100, 0, 30), (100, 0, 0), (100, 100, 0))],
    ],
    "feature_planes.nc": [
        [line((25, 15, 5), (25, 15, -5), (25, 35, -5))],
        [line((25, -5, -35), (25, 5, -35), (25, 5, -25)), arc((30, 5, -25), 5, 180, -90, "xz")],
        [line((55, 25, -35), (45, 25, -35)), arc((45, 30, -35), 5, 180, 360, "yz")],
    ],
    "sinumerik_cycle800.mpf": [
        [line((5, 0, 20), (5, 0, 0), (15, 0, 0))],
        [line(on_wedge(0, 0, 20), on_wedge(0, 0, 0), on_wedge(15, 0, 0)), wedge_arc()],
        [line(on_plane(1, 2, 20), on_plane(1, 2, 0), on_plane(1, 12, 0))],
    ],
    "indexed_a.nc": [
        [line((50, 10, 46), (50, 10, 44), (20, 10, 44))],
        [line((50, 46, -10), (50, 44, -10), (20, 44, -10))],
        [line((50, -10, -46), (50, -10, -44), (20, -10, -44)), arc((20, 0, -44), 10, -90, -90)],
    ],
    "offsets.ngc": [
        [line((0, 0, 10), (0, 0, 0), (10, 0, 0))],
        [line((60, 0, 8), (60, 0, -2), (70, 0, -2))],
        [line((0, 30, 10), (0, 30, 0), (10, 30, 0))],
        [line((0, 0, 10), (0, 0, 0), (10, 0, 0))],
        [line((0, 20, 10), (0, 20, 0), (0, 30, 0))],
        [line((5, 30, 10), (5, 30, 0), (7, 33, 0))],
    ],
    "mach_signs.tap": [[line((5, 0, 6)), arc((0, 0, -1), 5, 0, -360)]],
    "router.gcode": [[line((1, 1, 5), (1, 1, -0.5), (11, 1, -0.5), (11, 11, -0.5), (1, 11, -0.5), (1, 1, -0.5))]],
    "feeds.nc": [
        [line((0, 0, 5), (0, 0, 0), (10, 0, 0)), arc((10, 10, 0), 10, -90, 90), line((20, 30, 0), (0, 30, 0))],
    ],
    "ball_three_axes.nc": [
        [line(*([x, y, z] for x, z in ((-side * 24, 45), *((-side * k, on_offset(k, y)) for k in range(24, -25, -2)))))]
        for y, side in ((-20, 1), (-10, -1), (0, 1), (10, -1), (20, 1))
    ],
    "drilling.nc": [
        *([line((x, y, 2), (x, y, -5))] for x, y in ((10, 10), (20, 10), (20, 20), (10, 20))),
        [line((30, 10, 2), (30, 10, -3))],
        *([line((x, 10, a), (x, 10, b))] for x in (40, 50) for a, b in ((2, -2), (-1.5, -6), (-5.5, -9))),
        *([line((x, 10, 2), (x, 10, -5))] for x in (60, 70, 80)),
        [line((90, 10, 2), (90, 10, -4), (90, 10, 2))],
    ],
}


@pytest.mark.parametrize("name", EXPECTED)
def test_lines_and_arcs(name):
    found, wanted = runs(read(name, chordal=1e-6)), [np.concatenate(parts) for parts in EXPECTED[name]]
    assert len(found) == len(wanted)
    for one, other in zip(found, wanted, strict=True):
        (points, length), (ideal, whole) = spread(one), spread(other)
        assert length == pytest.approx(whole, rel=1e-4)
        assert np.linalg.norm(points - ideal, axis=1).max() < 0.01


def test_heights_of_drilling_rapids():
    """G98 returns to where the cycle began, G99 to R; pecks return to R (G83) or stay in the hole (G73)."""
    path = read("drilling.nc")
    heights = [s.tips[:, 2].max() * 1e3 for s in path.segments if s.kind is SegmentKind.RAPID]
    np.testing.assert_allclose(heights, [25, 25, 25, 2, 25, 25, 2, 2, 25, -1.5, -5.5, 25, 25, 25, 25, 25], atol=1e-9)
    assert [s.dwell for s in path.segments if s.dwell is not None] == [0.5]


def test_what_the_file_says_of_spindle_coolant_and_tool_is_kept():
    path = read("fusion_ac_table.nc")
    assert path.segments[0].words == ("T3", "M06", "S12000", "M03", "M08")
    assert path.segments[-1].words == ("M09", "M05")  # before the move home, of which the way up is left
    notes = "\n".join(path.notes)
    assert "moves to the home position are left out" in notes
    assert "lines 9, 79, 83" in notes
    assert "S12000" in notes
    assert "M32 (line 3)" in "\n".join(read("indexed_a.nc").notes)
    assert "blocks that may be skipped are read (line 7)" in read("mach_signs.tap").notes


def test_words_go_through_other_files(tmp_path):
    from pentapod.toolpath.formats import write_toolpath

    path = read("sinumerik_nx_vectors.mpf")
    for name in ("a.mpf", "a.npz"):
        again = read_toolpath(write_toolpath(path, tmp_path / name))
        assert [s.words for s in again.segments] == [s.words for s in path.segments]
    path = read("fusion_ac_table.nc")
    again = read_toolpath(write_toolpath(path, tmp_path / "a.nc"))
    assert [s.words for s in again.segments] == [s.words for s in path.segments]


@pytest.mark.parametrize("name", REFUSED)
def test_files_that_depend_on_the_controller_are_refused(name):
    with pytest.raises(ToolpathError) as caught:
        read(name)
    every = [caught.value, *caught.value.others]
    expected = {
        "refused_compensation.nc": [
            (7, "G41", "cutter radius"),
            (11, "G84", "spindle"),
            (13, "M98", "another program"),
        ],
        "refused_loop.ngc": [(7, "#1", "variable"), (5, "O100", "loop"), (6, "X[#1]", "variable")],
        "refused_program.mpf": [(2, "R2", "expression"), (4, "IF", "jump"), (5, "Z=R2", "expression")],
    }[name]
    for line, word, why in expected:
        error = next(e for e in every if e.line == line)
        assert error.key.startswith(word)
        assert why in error.what
        assert error.remedy
    assert all("\n" not in str(error) and name in str(error) for error in every)


def test_unit_tool_and_machine_are_asked_for_and_taken(tmp_path):
    file = tmp_path / "two.ngc"
    text = "G90 F100\nT1 M6\nG0 X0 Y0 Z1\nG1 Z0\nX1\nG0 Z1\nT2 M6\nG0 X2\nG1 Z0\nX3\nG0 Z1\nM2\n"
    file.write_text(text)
    with pytest.raises(ToolpathError, match=r'two\.ngc:3: X: the unit is missing; expected G20 or G21 .*unit = "mm"'):
        read_toolpath(file)
    both = read_toolpath(file, unit="inch")
    assert any("2 tools cut: 1 (from line 4), 2 (from line 9)" in note for note in both.notes)
    second = read_toolpath(file, unit="inch", tool="2")
    np.testing.assert_allclose(runs(second)[0], np.array([[2, 0, 1], [2, 0, 0], [3, 0, 0]]) * INCH)
    assert len(runs(second)) == 1
    with pytest.raises(ToolpathError, match=r"tool: the file never takes this tool \(got '3'\); expected 1, 2"):
        read_toolpath(file, unit="inch", tool="3")
    file.write_text(text.replace("X3", "X3 A20 B10").replace("X2", "X2 A10 B5").replace("M2", "#5=[1+1]\nM428"))
    with pytest.raises(ToolpathError, match="rotary axes A and B: which of them") as caught:
        read_toolpath(file, unit="mm")
    assert [error.line for error in caught.value.others] == [12, 13]  # the variable, and the missing end
    (tmp_path / "a.apt").write_text("FINI\n")
    with pytest.raises(ToolpathError, match=r"rotary_axes: only G-code takes this"):
        read_toolpath(tmp_path / "a.apt", rotary=MACHINES["indexed_a.nc"])


@pytest.mark.parametrize(
    ("axes", "remedy"),
    [
        (None, "give rotary_axes, with rotary_centre_mm .table. or pivot_mm .head., in"),
        (RotaryAxes.of(["table C", "head B"], CENTRE), "give pivot_mm in"),
        (RotaryAxes.of(["table C", "head B"]), "give rotary_centre_mm and pivot_mm in"),
    ],
)
def test_what_a_file_without_tool_centre_point_programming_needs(axes, remedy):
    with pytest.raises(ToolpathError, match=f"head_table_no_tcp.nc:12: X: .*depends on the machine; {remedy}"):
        read_toolpath(CAM / "head_table_no_tcp.nc", rotary=axes)


def test_every_axis_that_turns_is_listed():
    with pytest.raises(ToolpathError, match=r"nx_bc_mixed.ptp:9: B: B is turned, and rotary_axes does not list it"):
        read_toolpath(CAM / "nx_bc_mixed.ptp", rotary=RotaryAxes.of(["table C"]))


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (["table C", "desk A"], "unknown rotary axis"),
        (["head C", "table A"], "a table behind a head"),
        (["table C", "head C"], "a rotary axis is there twice"),
    ],
)
def test_rotary_axes_that_no_machine_has(names, words):
    with pytest.raises(ToolpathError, match=words):
        RotaryAxes.of(names)


def test_variables_that_hold_numbers(tmp_path):
    file = tmp_path / "engraved.ngc"
    file.write_text("G21 G90\n#2=-1.5\n#<feed> = 200\nT1 M6\nG0 Z5\n X3 Y4\nG1 Z#2 F#<feed>\n X-#2\nG0 Z5\nM2\n")
    np.testing.assert_allclose(runs(read_toolpath(file))[0], [[3, 4, 5], [3, 4, -1.5], [1.5, 4, -1.5]])
    file.write_text("G21 G90 F1\nG0 X0 Y0 Z5\nG1 Z#3\nX#<_x>\nX5 I1\nM2\n")
    with pytest.raises(ToolpathError, match=r"engraved.ngc:3: Z#3: a variable:") as caught:
        read_toolpath(file)
    assert [(error.line, error.key) for error in caught.value.others] == [(4, "X#<_X>"), (5, "I1")]


def test_a_problem_is_told_once_with_all_its_lines(tmp_path):
    file = tmp_path / "a.nc"
    file.write_text("G21 G90 F100\nG0 X0 Y0 Z0\n" + "G41 D1\nG1 X1\nG40\n" * 9 + "M98 P1\nM30\n")
    with pytest.raises(ToolpathError) as caught:
        read_toolpath(file)
    assert str(caught.value).endswith("(also in lines 6, 9, 12, 15, 18, 21 and 2 more)")
    assert [error.key for error in caught.value.others] == ["M98"]


def test_nearly_all_files_are_read():
    files = sorted(path.name for path in CAM.iterdir())
    assert files == sorted({*DOMES, *EXPECTED, *REFUSED})
    assert len(files) >= 24
    assert len(REFUSED) <= 0.1 * len(files)
