"""The report: self-contained, small, the verdict first, and true to the numbers."""

from __future__ import annotations

import base64
import json
import re
from html.parser import HTMLParser
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from pentapod.cli.commands.new import dome_stl
from pentapod.geometry import RigidTransform
from pentapod.job import Job, Outcome, run
from pentapod.job.build.placement import job_constraints, rotation_angles_deg
from pentapod.job.build.specification import job_collision_world
from pentapod.job.build.values import job_machine, job_mesh
from pentapod.planning import PlacedPath
from pentapod.program import Program
from pentapod.report import write_report
from pentapod.report.decimate import keep_extremes, thinned_mesh
from pentapod.report.drawings.colours import leg_colour
from pentapod.report.figure import leg_dash
from pentapod.report.signals import Signals
from pentapod.report.words import duration, number, opening, placement_sentences
from pentapod.timing import Trajectory
from pentapod.toolpath import Mesh, Toolpath, load_mesh
from pentapod.verify import NotJudged, Verdict

TOO_FAR = ("position_mm = [", "position_mm = [1000.0, 0, 700] # [")


class Page(HTMLParser):
    """Tags that are opened and closed, links to elsewhere, and the text outside scripts."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.outside: list[str] = []
        self.text = ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        if tag not in ("meta", "input", "br", "link", "img"):
            self.open.append(tag)
        self.outside += [f"{k}={v}" for k, v in attrs if k in ("src", "href") and not v.startswith("#")]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] not in ("script", "style"):
            self.text += data + " "


def page_of(outcome: Outcome, folder) -> tuple[str, Page]:
    text = write_report(outcome, folder / "report.html").read_text(encoding="utf-8")
    page = Page(text)
    assert page.open == []
    assert page.outside == [], "nothing is fetched from elsewhere"
    assert len(text) < 10e6
    return text, page


def data(text: str, name: str):
    match = re.search(rf'id="{name}">(.*?)</script>', text, re.S)
    assert match is not None
    return json.loads(match[1])


def unpacked(array: dict[str, str]) -> np.ndarray:
    return np.frombuffer(base64.b64decode(array["bdata"]), dtype=array["dtype"])


def test_report_of_a_passed_job(make_job, tmp_path):
    outcome = run(Job.load(make_job()), tmp_path / "out")
    text, page = page_of(outcome, tmp_path)
    count = len(outcome.verdict.certificates)
    assert page.text.index(f"All {count} claims") < page.text.index("Verdict") < page.text.index("Worst places")
    for certificate in outcome.verdict.certificates:
        assert certificate.claim in page.text
    for stage in outcome.stages:
        assert stage.name in page.text
    assert outcome.job.digest in page.text
    assert outcome.machine.digest in page.text
    assert "prefers-color-scheme: dark" in text
    assert "@media print" in text

    figures = data(text, "figures")
    program, machine = outcome.find(Program), outcome.machine
    assert program is not None
    by_axis: dict[str, list] = {}
    for trace in figures["time"]["data"]:
        by_axis.setdefault(trace["yaxis"], []).append(trace)
    legs = np.array([[unpacked(t["y"]).min(), unpacked(t["y"]).max()] for t in by_axis["y"][:5]])
    assert legs[:, 0] == pytest.approx(1e3 * program.legs.min(axis=0), rel=1e-6)
    assert legs[:, 1] == pytest.approx(1e3 * program.legs.max(axis=0), rel=1e-6)
    dashed = {float(unpacked(t["y"])[0]) for t in by_axis["y"][5:]}
    assert dashed == {np.float32(v) for v in 1e3 * np.unique([machine.legs.min_length, machine.legs.max_length])}
    kinds = [trace["name"] for trace in figures["scene"]["data"]]
    assert kinds[-8:] == ["leg 1", "leg 2", "leg 3", "leg 4", "leg 5", "platform", "tool", "tip"]
    poses = data(text, "poses")
    assert poses["moving"] == 8
    # Legs drawn have the lengths of the rows they are drawn for.
    legs = np.array(poses["poses"][0]["joints"]) - poses["base"]
    assert np.linalg.norm(legs, axis=1) == pytest.approx(1e3 * program.legs[0], abs=2e-3)


def test_signals_are_those_of_the_program(make_job, tmp_path):
    outcome = run(Job.load(make_job()), tmp_path / "out")
    program, trajectory, toolpath = (outcome.find(kind) for kind in (Program, Trajectory, Toolpath))
    assert program is not None
    assert trajectory is not None
    assert toolpath is not None
    mesh = outcome.find(Mesh)
    assert mesh is not None
    collision_world = job_collision_world(outcome.job, outcome.machine, mesh)
    signals = Signals.of(program, outcome.machine, trajectory, toolpath, collision_world)
    by_claim = {c.claim: c for c in outcome.verdict.certificates}
    rate = by_claim["leg rates"].value
    assert rate is not None
    assert 1e3 * np.abs(signals.rates).max() == pytest.approx(rate, rel=2e-3)
    acceleration = by_claim["leg accelerations"].value
    assert acceleration is not None
    assert 1e3 * np.abs(signals.accelerations).max() == pytest.approx(acceleration, rel=2e-2)
    assert np.abs(signals.rates[[0, -1]]).max() < 1e-9
    assert signals.margins.min() > 0
    # Gaps to the part are margins too, and at the waypoints those of the plan.
    placed = outcome.find(PlacedPath)
    assert placed is not None
    # A stem that no lean brings near a limit is left out of the plan, not of the report.
    planned = [signals.margin_names.index(name) for name in placed.margin_names]
    assert signals.margins[0, planned] == pytest.approx(placed.margins[0], abs=1e-4)
    assert signals.margins[-1, planned] == pytest.approx(placed.margins[-1], abs=1e-4)
    gaps = [k for k, name in enumerate(signals.margin_names) if "the part" in name]
    assert len(gaps) >= 6
    spindle = by_claim["spindle clear of the part"].value
    assert spindle is not None


def test_report_of_a_refused_job(make_job, tmp_path):
    outcome = run(Job.load(make_job(TOO_FAR)), tmp_path / "out", advice=None)
    text, page = page_of(outcome, tmp_path)
    refusal = outcome.refusal
    assert refusal is not None
    assert page.text.index("cannot be done") < page.text.index("Why not")
    for blame in refusal.diagnosis:
        assert blame.constraint in page.text
    assert "time" not in data(text, "figures")
    assert data(text, "poses") == {"poses": []}


def test_a_refusal_is_drawn_in_the_machine_where_it_came_nearest(make_job, tmp_path):
    outcome = run(Job.load(make_job(TOO_FAR)), tmp_path / "out", advice=None)
    text, _ = page_of(outcome, tmp_path)
    traces = {trace["name"]: trace for trace in data(text, "figures")["scene"]["data"]}
    attempt, machine = outcome.refusal.attempt, outcome.machine
    assert attempt.smallest_margin < 0.0
    # The blamed waypoints lie on the path where it was tried, in the machine; lifted a little off the surface.
    for blame in outcome.refusal.diagnosis:
        points = np.stack([unpacked(traces[blame.constraint][axis]) for axis in "xyz"], axis=1)
        chosen = np.concatenate([np.arange(a, b + 1) for a, b in blame.waypoints])
        np.testing.assert_allclose(points, 1e3 * attempt.tips[chosen], atol=0.51)
    # The legs stand at the waypoint with the smallest margin, as long as the pose there needs them.
    worst = int(attempt.margins.min(axis=1).argmin())
    tip, axis = attempt.tips[worst], attempt.axes[worst]
    lengths = np.linalg.norm(machine.robot.leg_vectors(tip + machine.tool_length * axis, -axis), axis=-1)
    for k in range(5):
        ends = np.stack([unpacked(traces[f"leg {k + 1}"][axis]) for axis in "xyz"], axis=1)
        assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(1e3 * lengths[k], abs=0.01)


def test_the_fixture_is_drawn(make_job, tmp_path):
    path = make_job()
    path.with_name("held.stl").write_bytes(dome_stl(cells=4))
    text = path.read_text()
    for frame, name in (("machine", "table"), ("part", "fixture")):
        path.write_text(f'{text}\n[fixture]\nmesh = "held.stl"\nunit = "mm"\nframe = "{frame}"\n')
        outcome = run(Job.load(path), tmp_path / frame)
        page, _ = page_of(outcome, tmp_path)
        trace = next(t for t in data(page, "figures")["scene"]["data"] if t["name"] == name)
        placed = outcome.find(PlacedPath)
        shown = placed if placed is not None else outcome.refusal.attempt
        vertices = load_mesh(path.with_name("held.stl"), "mm").vertices
        wanted = vertices if frame == "machine" else shown.placement.transform.apply(vertices)
        points = np.stack([unpacked(trace[axis]) for axis in "xyz"], axis=1)
        np.testing.assert_allclose(np.sort(points, axis=0), np.sort(1e3 * wanted, axis=0), atol=1e-3)
        assert (f"<title>{name}</title>" in page) is (placed is not None)


def test_report_of_a_failed_verdict_puts_the_failures_first(make_job, tmp_path):
    outcome = run(Job.load(make_job()), tmp_path / "out")
    broken = outcome.verdict.certificates
    broken = (*broken[:-1], type(broken[-1])("a claim that fails", False, 2.0, 1.0, "mm", broken[-1].where, "by hand"))
    failed = Outcome(outcome.job, outcome.machine, outcome.stages, type(outcome.verdict)(broken))
    _, page = page_of(failed, tmp_path)
    assert "Do not run it" in page.text
    assert page.text.index("a claim that fails") < page.text.index("leg rates")


def test_report_shows_claims_not_judged_with_the_reason(make_job, tmp_path):
    """A program that fails only by it shows the cause; one that passes by waivers shows them."""
    outcome = run(Job.load(make_job()), tmp_path / "out")
    for waived, status, lead, mark in (
        (False, "failed", "2 claims were not judged. Do not run it.", "not judged"),
        (True, "passed", "2 more were not judged: the job waives them.", "waived"),
    ):
        unknown = tuple(NotJudged(name, f"nobody told {name}", waived) for name in ("speed of sound", "colour"))
        told = Outcome(
            outcome.job, outcome.machine, outcome.stages, Verdict(outcome.verdict.certificates, unknown)
        )  # fmt: skip
        _, page = page_of(told, tmp_path)
        text = " ".join(page.text.split())
        assert f"job {status}" in text
        assert lead in text
        assert "claims about the program do not hold" not in text
        for name in ("speed of sound", "colour"):
            assert f"{name} {mark} nobody told {name}" in text


def test_report_escapes_names(make_job, tmp_path):
    path = make_job(name="a<script>alert(1)</script>&.toml".replace("/", "_"))
    _, page = page_of(run(Job.load(path), tmp_path / "out"), tmp_path)
    assert "a<script>alert(1)<_script>&" in page.text


@given(st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=400), st.integers(1, 30))
def test_decimation_keeps_extremes_and_ends(values, buckets):
    array = np.array(values)
    keep = keep_extremes(array, buckets)
    assert (np.diff(keep) > 0).all()
    assert len(keep) <= 4 * buckets or len(keep) == len(array)
    assert {keep[0], keep[-1]} == {0, len(array) - 1}
    assert array[keep].min() == array.min()
    assert array[keep].max() == array.max()


def test_report_of_a_long_program_stays_small():
    values = np.sin(np.arange(1_000_000) / 300.0)
    values[777_777] = 9.0
    keep = keep_extremes(values, 600)
    assert len(keep) <= 2400
    assert 777_777 in keep


def test_thinned_mesh_keeps_the_shape():
    x, y = np.meshgrid(np.linspace(0, 1, 201), np.linspace(0, 1, 201), indexing="ij")
    vertices = np.stack([x, y, 0.1 * np.sin(6 * x)], axis=-1).reshape(-1, 3)
    corner = (np.arange(200)[:, None] * 201 + np.arange(200)).ravel()
    faces = np.concatenate(
        [np.stack([corner, corner + 201, corner + 202], 1), np.stack([corner, corner + 202, corner + 1], 1)]
    )
    thin, few = thinned_mesh(vertices, faces, 5000)
    assert 1000 < len(few) <= 5000
    assert np.ptp(thin, axis=0) == pytest.approx(np.ptp(vertices, axis=0), abs=0.05)
    assert thinned_mesh(vertices, faces, 10**6)[1] is faces


@given(st.tuples(*[st.floats(-179, 179)] * 3))
def test_rotation_angles_go_into_a_job_and_back(angles):
    rotation = Rotation.from_euler("xyz", angles, degrees=True).as_matrix()
    again = Rotation.from_euler("xyz", rotation_angles_deg(rotation), degrees=True).as_matrix()
    assert np.allclose(again, rotation, atol=1e-9)


def test_the_placement_shown_can_be_used(make_job, tmp_path):
    outcome = run(Job.load(make_job(("[180, 0, 0]", "[171, 4, 30]"))), tmp_path / "out")
    text, _ = page_of(outcome, tmp_path)
    shown = re.search(r"\[placement\]\n.*?rotation_deg = \[[^\]]*\]", text, re.S)
    assert shown is not None
    job = make_job().read_text().split("[placement]")[0] + shown[0].replace("&#34;", '"')
    (tmp_path / "again.toml").write_text(job)
    jobs = outcome.job, Job.load(tmp_path / "again.toml")
    (first,), (again,) = (job_constraints(job, job_machine(job), job_mesh(job)).poses for job in jobs)
    assert np.abs(first.matrix - again.matrix).max() < 1e-8


def test_numbers_durations_and_placements_as_text():
    assert opening("short") == "short"
    assert opening("held; component ++: for all times") == "held"
    assert opening("a word " * 40) == ("a word " * 14) + "a …"
    assert number(None) == "–"
    assert number(-0.5, "mm") == "−0.5 mm"
    assert (duration(28.08), duration(185), duration(3720)) == ("28.1 s", "3 min 05 s", "1 h 02 min")
    upside = RigidTransform(np.diag([1.0, -1.0, -1.0]), np.array([0.1, -0.2, 0.5]))
    sentences = placement_sentences(upside)
    assert "500.00 mm below the base plane" in sentences[0]
    assert "straight up" in sentences[1]
    high = RigidTransform(np.eye(3), np.array([0.0, 0.0, -0.05]))
    assert "50.00 mm above the base plane" in placement_sentences(high)[0]
    leaning = RigidTransform(np.array([[0, 0, 1.0], [0, 1, 0], [-1, 0, 0]]), np.zeros(3))
    assert "tilted 90.00°" in placement_sentences(leaning)[1]
    assert "towards 0.0°" in placement_sentences(leaning)[1]


def test_the_setup_sheet_names_the_limit_at_every_place(make_job, tmp_path):
    """The stretches of the band join to the whole path, and each is told by the limit that is nearest there."""
    outcome = run(Job.load(make_job()), tmp_path / "out")
    placed = outcome.find(PlacedPath)
    assert placed is not None
    text, page = page_of(outcome, tmp_path)
    told = re.findall(r"<title>([^<]*): waypoints (\d+) to (\d+), smallest margin ([\d.-]+)</title>", text)
    assert int(told[0][1]) == 0
    assert int(told[-1][2]) == len(placed.tips) - 1
    for before, after in pairwise(told):
        assert int(after[1]) == int(before[2]) + 1
    for name, first, last, margin in told:
        stretch = placed.margins[int(first) : int(last) + 1]
        assert float(margin) == pytest.approx(stretch.min(), abs=1e-3)
        assert placed.margin_names[int(stretch.min(axis=0).argmin())] == name.replace("&gt;", ">")
    views = re.findall(r'aria-label="([^"]*)">', text)
    assert [v for v in views if v.startswith("the ")] == [
        "the machine and the part from above",
        "the machine and the part from the front",
        "the part from above",
        "the part from the front",
    ]
    check_touch_off(text, outcome)
    assert "nearest limits" in page.text


def check_touch_off(text, outcome):
    """Three places, where the legs hold the tool such that its ball touches the mesh, by distances of joints alone."""
    rows = re.findall(r"<tr>(.*?)</tr>", text.split('class="touch-off"')[1].split("</table>")[0], re.S)[1:]
    assert len(rows) == 3
    machine, placed, mesh = outcome.machine, outcome.find(PlacedPath), outcome.find(Mesh)
    points = []
    for row in rows:
        cells = re.findall(r"<td>(.*?)</td>", row.replace("−", "-"))
        on_part, there, tip, axis, legs = (np.array([float(v) for v in cell.split(",")]) for cell in cells[1:])
        joints = 1e-3 * tip + (machine.tool_length - machine.robot.offsets)[:, None] * axis
        assert 1e3 * np.linalg.norm(joints - machine.robot.base_joints, axis=1) == pytest.approx(legs, abs=0.05)
        assert 1e3 * placed.placement.transform.apply(1e-3 * on_part) == pytest.approx(there, abs=0.02)
        radius = placed.toolpath.tilt_centre
        assert np.linalg.norm(1e-3 * (there - tip) - radius * axis) == pytest.approx(radius, abs=60e-6)
        assert np.linalg.norm(mesh.vertices - 1e-3 * on_part, axis=1).min() < 5e-3
        points.append(on_part)
    area = np.linalg.norm(np.cross(points[1] - points[0], points[2] - points[0]))
    assert area > 0.1 * np.ptp(mesh.bounds[:, 0]) * np.ptp(mesh.bounds[:, 1]) * 1e6


def test_viewer_draws_few_waypoints_of_a_long_job():
    """100,000 waypoints and 400,000 rows: the path and the plots, thinned, and their extremes kept."""
    from pentapod.machine import Machine
    from pentapod.report.plots import time_figure
    from pentapod.report.scene import path_traces

    count, machine = 400_000, Machine.load("desk")
    random = np.random.default_rng(4)
    legs = 0.7 + 0.1 * random.standard_normal((count, 5))
    axes = np.tile([0.0, 0.0, 1.0], (count, 1))
    speeds = np.abs(random.standard_normal(count))
    margins = random.random((40_000, 20))
    signals = Signals(
        np.arange(count) * 1e-3, legs, legs - 0.7, legs - 0.7, legs[:, :3], axes, speeds, np.full(count, 5.0),
        np.arange(count) // 100, np.arange(count) % 1000 > 99, np.arange(count) // 90 % 7, tuple("abcdefg"),
        margins, np.arange(0, count, 10), tuple(f"margin {k}" for k in range(20)),
    )  # fmt: skip
    plots, traces = time_figure(signals, machine), path_traces(signals)
    assert len(json.dumps(plots)) + len(json.dumps(traces)) < 3e6
    by_leg = [trace for trace in plots["data"] if trace["name"] == "leg 3"]
    assert unpacked(by_leg[0]["y"]).max() == pytest.approx(1e3 * legs[:, 2].max(), rel=1e-6)
    by_margin, by_feed, by_cause, _ = traces
    cut = signals.cutting[::10]
    assert unpacked(by_margin["line"]["color"]).min() <= margins[cut].min() + 1e-6
    assert unpacked(by_feed["line"]["color"]).max() == pytest.approx(20.0 * speeds.max(), rel=1e-6)
    assert set(unpacked(by_cause["line"]["color"])) == set(range(7))
    assert [trace.get("visible", True) for trace in traces] == [True, False, False, "legendonly"]


def test_six_legs_are_told_apart_by_colour_and_dash():
    assert len({leg_colour(leg) for leg in range(6)}) == 6
    assert len({leg_dash(leg) for leg in range(6)}) == 6
