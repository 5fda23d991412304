"""Drawings of the set-up: every label can be read, dimensions are true, all families of machines are drawn."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pentapod.geometry import RigidTransform
from pentapod.job import Job
from pentapod.job.build.tool import job_tool
from pentapod.job.build.values import job_mesh
from pentapod.machine import Machine
from pentapod.mesh import Mesh
from pentapod.report.drawings.planned_run import PlannedRun
from pentapod.report.drawings.touch_off import touch_off_points
from pentapod.report.drawings.views import machine_drawings, setup_drawings
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath

MACHINES = ("desk", "steep", "guide", "bench-general", "hexa", "spr", "prpu")
TEXT = re.compile(r'<text(?: class="(\w+)")? x="([-\d.]+)" y="([-\d.]+)" font-size="([\d.]+)"[^>]*?'
                  r'text-anchor="(\w+)"[^>]*>([^<]*)</text>')  # fmt: skip
LETTER = 0.58
"""Width of the letters of a usual font as a share of their height: a little more than that of digits."""
LIMBS = re.compile(r'<path d="(M[-\d. ]+l[-\d. ]+)" stroke="[^"]+" stroke-width="(?:1\.8|4|1\.6)"')
"""Legs, spindle, tool, and the table's surface."""


def spiral() -> Toolpath:
    """A way about a part of 60 mm, mesh frame."""
    turn = np.linspace(0.0, 6.0 * np.pi, 120)
    tips = np.stack([0.01 * turn / 6.0 * np.cos(turn), 0.01 * turn / 6.0 * np.sin(turn), 0.012 - 1e-4 * turn], axis=-1)
    return Toolpath((Segment(SegmentKind.CUT, tips, np.tile([0.0, 0.0, 1.0], (120, 1)), 0.02),), 0.005)


@pytest.fixture
def standing(make_job):
    """Make a run on a machine whose part stands in its work volume: moved by mm, turned and tilted by degrees."""

    def make(name="desk", shift=(0.0, 0.0, 0.0), turn=0.0, tilt=0.0, *changes) -> PlannedRun:
        machine, job = Machine.load(name), Job.load(make_job(*changes))
        upside = 180.0 if machine.work.centre[2] > 0.0 else 0.0
        rotation = Rotation.from_euler("xyz", [upside, tilt, turn], degrees=True).as_matrix()
        placement = RigidTransform(rotation, machine.work.centre + 1e-3 * np.asarray(shift))
        path = spiral()
        tips, axes = placement.apply(path.tips), placement.rotate(path.axes)
        return PlannedRun(job, machine, job_mesh(job), job_tool(job, machine), path, placement, tips, axes)

    return make


def drawings(text: str) -> list[str]:
    return re.findall(r"<svg.*?</svg>", text, re.S)


def boxes(drawing: str) -> list[tuple[str, tuple[float, float, float, float]]]:
    found = []
    for _, x, y, size, anchor, text in TEXT.findall(drawing):
        wide, high = LETTER * float(size) * len(text), float(size)
        left = float(x) - {"start": 0.0, "middle": 0.5, "end": 1.0}[anchor] * wide
        found.append((text, (left, float(y) - 0.75 * high, left + wide, float(y) + 0.2 * high)))
    return found


def crossed(drawing: str) -> list[str]:
    """Return the words through which a leg, the spindle or the tool goes, by points along these lines."""
    found = set()
    for path in LIMBS.findall(drawing):
        x, y, dx, dy = (float(v) for v in re.findall(r"-?[\d.]+", path))
        line = np.linspace((x, y), (x + dx, y + dy), 500)
        for label, (left, top, right, bottom) in boxes(drawing):
            if len(label) > 2 and ((line > (left, top)) & (line < (right, bottom))).all(axis=1).any():
                found.add(label)
    return sorted(found)


def check_labels(text: str) -> None:
    for drawing in drawings(text):
        width, height = (float(v) for v in re.search(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', drawing).groups())
        labels = boxes(drawing)
        assert len(labels) >= 4
        for label, (left, top, right, bottom) in labels:
            assert left >= -0.5, label
            assert right <= width + 0.5, label
            assert top >= -1.0, label
            assert bottom <= height + 0.5, label
        words = [(label, box) for label, box in labels if len(label) > 1]  # numbers of joints may be behind each other
        for (one, a), (other, b) in combinations(words, 2):
            apart = a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]
            assert apart, f"{one} on {other}"


@pytest.mark.parametrize("name", MACHINES)
def test_setup_is_drawn_on_every_family_with_labels_apart(standing, name):
    run = standing(name, (12.0, -31.0, 3.0), 25.0, 7.0)
    text = setup_drawings(run, touch_off_points(run))
    assert len(drawings(text)) == 4
    check_labels(text)
    assert [crossed(drawing) for drawing in drawings(text)] == [[]] * 4, "no leg goes through a word"
    above = drawings(text)[0]
    numbers = re.findall(r'font-weight="600"[^>]*>(\w+)</text>', above)
    assert numbers == [str(k + 1) for k in range(run.machine.robot.n_legs)]
    circles = np.array(re.findall(r'<circle cx="([\d.]+)" cy="([\d.]+)" r="7', above), dtype=float)
    base = run.machine.robot.base_joints[:, :2] * (1.0, -1.0 if run.hangs else 1.0) * (1.0, -1.0)
    apart, drawn = base - base[0], circles - circles[0]
    scale = np.abs(drawn).max() / np.abs(apart).max()
    assert drawn == pytest.approx(scale * apart, abs=0.2), "no mirror image, one scale"


@pytest.mark.parametrize("tilt", [0.0, pytest.param(3.0, marks=pytest.mark.slow), 30.0])
@pytest.mark.parametrize(
    "shift", [(150, 80, -40), *(pytest.param(s, marks=pytest.mark.slow) for s in ((0, 0, 0), (-85.0, 17.0, 0.0)))]
)
def test_setup_labels_are_apart_wherever_the_part_is(standing, shift, tilt):
    for turn in (0.0, 90.0, -137.0):
        run = standing("desk", shift, turn, tilt)
        text = setup_drawings(run, touch_off_points(run))
        check_labels(text)
        assert [crossed(drawing) for drawing in drawings(text)] == [[]] * 4, "no leg goes through a word"


@pytest.mark.slow
def test_a_part_that_is_moved_is_drawn_where_it_stands_now(standing):
    """Drawings are remembered: each place has its own."""
    runs = [standing("desk", (5.0, 0.0, 0.0), *turned) for turned in ((0.0, 0.0), (44.0, 0.0), (44.0, 20.0))]
    shared = runs[0].mesh
    for run in (*runs, runs[0]):
        drawn, anew = replace(run, mesh=shared), replace(run, mesh=Mesh.of(shared.vertices, shared.faces))
        assert setup_drawings(drawn, touch_off_points(drawn)) == setup_drawings(anew, touch_off_points(anew))


@pytest.mark.parametrize("turn", [0.0, 44.0, 90.0])
def test_numbers_of_touch_off_points_do_not_cover_each_other(standing, turn):
    """From the side, points behind each other have their numbers side by side."""
    run = standing("desk", (0.0, 0.0, 0.0), turn, 0.0)
    points = touch_off_points(run)
    points = [points[0], points[0], points[1]]
    for drawing in drawings(setup_drawings(run, points))[2:]:
        circles = np.array(re.findall(r'<circle cx="([\d.]+)" cy="([\d.]+)" r="(?:7|5\.5)', drawing), dtype=float)
        assert len(circles) == len(points) + 1, "the numbers and the datum"
        assert min(np.linalg.norm(a - b) for a, b in combinations(circles, 2)) > 12.0


def test_setup_dimensions_are_those_of_the_part_and_its_place(standing):
    run = standing("desk", (20.0, 10.0, 5.0), 30.0)
    found = [{kind: [] for kind in ("dimension", "coordinate")} for _ in range(4)]
    for drawing, told in zip(drawings(setup_drawings(run, touch_off_points(run))), found, strict=True):
        for kind, *_, text in TEXT.findall(drawing):
            if kind in told:
                told[kind].append(text.replace("−", "-"))
    x, y, z = 1e3 * run.placement.translation
    assert found[0]["dimension"] == [f"x {x:.2f}", f"y {y:.2f}"]
    assert found[1]["dimension"] == [f"z {z:.2f}"]
    low, high = 1e3 * run.vertices.min(axis=0), 1e3 * run.vertices.max(axis=0)
    extent = high - low
    assert [float(v) for v in found[2]["dimension"]] == pytest.approx(extent[:2], abs=0.006)
    assert [float(v) for v in found[3]["dimension"]] == pytest.approx(extent[[0, 2]], abs=0.006)
    ends = {(v[0], round(float(v[2:]), 2)) for v in found[3]["coordinate"]}
    assert ends == {
        ("x", round(low[0], 2)),
        ("x", round(high[0], 2)),
        ("z", round(low[2], 2)),
        ("z", round(high[2], 2)),
    }


def test_setup_of_a_tilted_part_shows_the_wedge_in_its_true_size(standing):
    run = standing("desk", (0.0, 0.0, 0.0), 40.0, 12.0)
    assert np.degrees(run.stand.lean) == pytest.approx(12.0)
    side = drawings(setup_drawings(run, touch_off_points(run)))[3]
    assert [t[-1] for t in TEXT.findall(side) if t[0] == "angle"] == ["12.00°"]
    # The lowest point of the part is where it leans to: on the right of the drawing.
    lowest = run.vertices[run.vertices[:, 2].argmax()] - run.vertices.mean(axis=0)
    azimuth = run.stand.azimuth
    assert lowest[:2] @ (np.cos(azimuth), np.sin(azimuth)) > 0.02
    flat = standing("desk", (0.0, 0.0, 0.0), 40.0, 0.0)
    assert not flat.stand.is_tilted
    assert np.degrees(flat.stand.turn) == pytest.approx(40.0)


def test_setup_on_a_table_draws_the_table(standing):
    centre = 1e3 * Machine.load("desk").work.centre[2]
    head = ('mode = "fixed"', f'mode = "table"\ntable_z_mm = {centre + 5.0:.3f}')
    gone = [(line, "") for line in ('component = "++"',)]
    run = standing("desk", (0, 0, 5.0), 0.0, 0.0, head, ("position_mm", "#"), ("rotation_deg", "#"), *gone)
    assert f"table z {centre + 5.0:.2f}" in drawings(setup_drawings(run, touch_off_points(run)))[1]
    assert run.table == pytest.approx(run.lowest, abs=1e-6)


@pytest.mark.parametrize("name", MACHINES)
def test_machine_alone_is_drawn_twice(name):
    machine = Machine.load(name)
    text = machine_drawings(machine)
    assert len(drawings(text)) == 2
    check_labels(text)
    told = [label.replace("−", "-") for kind, *_, label in TEXT.findall(text) if kind == "dimension"]
    assert told == [f"{axis} {1e3 * value:.2f}" for axis, value in zip("xyz", machine.work.centre, strict=True)]
