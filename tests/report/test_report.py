"""The report: self-contained, small, the verdict first, and true to the numbers."""

from __future__ import annotations

import re
from dataclasses import replace
from html import unescape
from html.parser import HTMLParser
from itertools import chain, pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from page_arrays import page_arrays, page_data
from pentapod.cli.commands.new import dome_stl
from pentapod.geometry import RigidTransform
from pentapod.job import Job, Outcome, run
from pentapod.job.build.placement import job_constraints, rotation_angles_deg
from pentapod.job.build.specification import job_collision_world
from pentapod.job.build.values import job_machine, job_mesh
from pentapod.planning import PlacedPath
from pentapod.program import Program
from pentapod.report import write_report
from pentapod.report.decimate import thinned_mesh
from pentapod.report.page.claims import KINDS as CLAIM_KINDS
from pentapod.report.page.claims import kind_of as claim_kind
from pentapod.report.signals import Signals
from pentapod.report.words import duration, number, opening, placement_sentences
from pentapod.timing import Trajectory
from pentapod.toolpath import Mesh, Toolpath, load_mesh
from pentapod.verify import NotJudged, Verdict
from pentapod.verify.judge import CLAIM_NAMES

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
    links = [] if outcome.refusal is not None else ["href=sheet.html"]
    assert page.outside == links, "nothing is fetched from elsewhere"
    assert len(text) < 1.2e6
    return text, page


def test_report_of_a_passed_job(usual_run, tmp_path):
    outcome = usual_run[2]
    text, page = page_of(outcome, tmp_path)
    count = len(outcome.verdict.certificates)
    assert page.text.index(f"All {count} claims") < page.text.index("cycle time") < page.text.index("Worst places")
    for certificate in outcome.verdict.certificates:
        assert certificate.claim in page.text
    for stage in outcome.stages:
        assert stage.name in page.text
    assert outcome.job.digest in page.text
    assert outcome.machine.digest in page.text
    assert "prefers-color-scheme: dark" in text
    assert "@media print" in text

    data, arrays = page_data(text), page_arrays(text)
    program, machine = outcome.find(Program), outcome.machine
    assert program is not None
    lengths, rates, *_ = data["plots"]["rows"]
    assert [curve["name"] for curve in lengths["series"]] == [f"leg {k}" for k in range(1, 6)]
    drawn = arrays[lengths["array"]]
    assert drawn.min(axis=0) == pytest.approx(1e3 * program.legs.min(axis=0), abs=6e-3)
    assert drawn.max(axis=0) == pytest.approx(1e3 * program.legs.max(axis=0), abs=6e-3)
    assert lengths["limits"] == pytest.approx(1e3 * np.unique([machine.legs.min_length, machine.legs.max_length]))
    assert rates["limits"] == pytest.approx(1e3 * np.unique([-machine.legs.max_velocity, machine.legs.max_velocity]))
    assert [mesh["name"] for mesh in data["scene"]["meshes"]] == ["part"]
    assert len(data["scene"]["machine"]["legs"]) == 5
    assert data["scene"]["machine"]["beside"] == []


def test_claims_are_folded_by_kind_with_the_nearest_of_each(usual_run, tmp_path):
    outcome = usual_run[2]
    text, _ = page_of(outcome, tmp_path)
    folded = re.findall(r'<details class="group good">(.*?)</details>\n', text, re.S)
    assert len(folded) == 6
    claims = {c.claim: c for c in outcome.verdict.certificates}
    groups = re.split(r'<details class="group', unescape(text))[1:]
    told = [re.findall(r'<td class="claim">([^<]*)</td>', group) for group in groups]
    assert sorted(chain(*told)) == sorted(claims)
    first = re.search(r'class="near">([^<]*)</span>', folded[0])
    assert first is not None
    own = [claims[name] for name in told[0] if claims[name].value]
    nearest = max(own, key=lambda c: c.value / (c.allowed or c.bound))
    assert first[1].startswith(f"{nearest.claim}: ")


def test_kinds_of_claims_that_others_add_or_that_name_a_set_up():
    assert claim_kind("set-up 2: legs clear of the part") == CLAIM_KINDS.index("Nothing touches")
    assert claim_kind("tip jerk") == CLAIM_KINDS.index("The machine keeps its limits")
    assert claim_kind("noise below 60 dB") == len(CLAIM_KINDS)
    for claim in (*CLAIM_NAMES, "readable"):
        assert claim_kind(claim) < len(CLAIM_KINDS), claim


def test_signals_are_those_of_the_program(usual_run):
    outcome = usual_run[2]
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
    data = page_data(text)
    assert data["plots"] is None
    assert data["motion"] is None


def test_a_refusal_is_drawn_in_the_machine_where_it_came_nearest(make_job, tmp_path):
    outcome = run(Job.load(make_job(TOO_FAR)), tmp_path / "out", advice=None)
    text, _ = page_of(outcome, tmp_path)
    data, arrays = page_data(text), page_arrays(text)
    attempt, machine = outcome.refusal.attempt, outcome.machine
    assert attempt.smallest_margin < 0.0
    # The blamed waypoints lie on the path where it was tried, in the machine; lifted a little off the surface.
    groups = {group["name"]: group for group in data["scene"]["dots"]}
    for blame in outcome.refusal.diagnosis:
        points = arrays[groups[blame.constraint]["points"]]
        chosen = np.concatenate([np.arange(a, b + 1) for a, b in blame.waypoints])
        np.testing.assert_allclose(points, 1e3 * attempt.tips[chosen], atol=0.51)
    # The machine stands at the waypoint with the smallest margin.
    worst, pose = int(attempt.margins.min(axis=1).argmin()), data["scene"]["pose"]
    assert pose["tip"] == pytest.approx(1e3 * attempt.tips[worst])
    assert pose["axis"] == pytest.approx(attempt.axes[worst])
    assert data["scene"]["machine"]["base"] == pytest.approx(1e3 * machine.robot.base_joints)


@pytest.mark.parametrize(
    ("frame", "name"), [("part", "fixture"), pytest.param("machine", "table", marks=pytest.mark.slow)]
)
def test_the_fixture_is_drawn(make_job, tmp_path, frame, name):
    path = make_job()
    path.with_name("held.stl").write_bytes(dome_stl(cells=4))
    path.write_text(f'{path.read_text()}\n[fixture]\nmesh = "held.stl"\nunit = "mm"\nframe = "{frame}"\n')
    outcome = run(Job.load(path), tmp_path / frame)
    page, _ = page_of(outcome, tmp_path)
    mesh = next(mesh for mesh in page_data(page)["scene"]["meshes"] if mesh["name"] == name)
    placed = outcome.find(PlacedPath)
    shown = placed if placed is not None else outcome.refusal.attempt
    vertices = load_mesh(path.with_name("held.stl"), "mm").vertices
    wanted = vertices if frame == "machine" else shown.placement.transform.apply(vertices)
    points = page_arrays(page)[mesh["vertices"]]
    np.testing.assert_allclose(np.sort(points, axis=0), np.sort(1e3 * wanted, axis=0), atol=3e-3)
    assert (f"<title>{name}</title>" in page) is (placed is not None)


def test_report_of_a_failed_verdict_puts_the_failures_first(usual_run, tmp_path):
    outcome = usual_run[2]
    broken = outcome.verdict.certificates
    broken = (*broken[:-1], type(broken[-1])("a claim that fails", False, 2.0, 1.0, "mm", broken[-1].where, "by hand"))
    failed = Outcome(outcome.job, outcome.machine, outcome.stages, type(outcome.verdict)(broken))
    _, page = page_of(failed, tmp_path)
    assert "Do not run it" in page.text
    assert page.text.index("a claim that fails") < page.text.index("leg rates")


def test_report_shows_claims_not_judged_with_the_reason(usual_run, tmp_path):
    """A program that fails only by it shows the cause; one that passes by waivers shows them."""
    outcome = usual_run[2]
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
        assert f"{outcome.job.path.parent.name} {'✓' if waived else '✗'} {status}" in text
        assert lead in text
        assert "claims about the program do not hold" not in text
        for name in ("speed of sound", "colour"):
            assert f"{name} {mark} nobody told {name}" in text


def test_report_escapes_names(usual_run, tmp_path):
    job, _, outcome = usual_run
    path = job.path.with_name("a<script>alert(1)</script>&.toml".replace("/", "_"))
    _, page = page_of(replace(outcome, job=replace(job, path=path)), tmp_path)
    assert "a<script>alert(1)<_script>&" in page.text


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


def test_the_setup_sheet_names_the_limit_at_every_place(usual_run, tmp_path):
    """The stretches of the band join to the whole path, and each is told by the limit that is nearest there."""
    outcome = usual_run[2]
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
