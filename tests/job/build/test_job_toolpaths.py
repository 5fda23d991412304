"""Jobs with other tools, axes and toolpath files: from the job file to a judged program."""

from __future__ import annotations

import json
import os
import re
from contextlib import contextmanager
from itertools import groupby

import numpy as np
import pytest

from pentapod.base.errors import JobError
from pentapod.cli.commands.new import dome_stl
from pentapod.cli.main import run as run_cli
from pentapod.geometry import angle_between
from pentapod.job import Job, run
from pentapod.job.build.toolpath import job_toolpath, tool_in_world
from pentapod.job.build.values import job_mesh
from pentapod.timing import Explanation
from pentapod.toolpath import SegmentKind, toolpath_with_report
from pentapod.toolpath.formats import read_toolpath

BALL = 'type = "ball"\ndiameter_mm = 10'
STRATEGY = "stepover_mm = 15\nspacing_mm = 4"


@pytest.mark.parametrize("name", ["path.apt", "path.ngc", "path.nc", "path.robodk.csv", "path.csv", "path.npz"])
def test_toolpath_writes_by_suffix_and_a_job_reads_it(make_job, tmp_path, name):
    out = tmp_path / name
    job = make_job()
    assert run_cli(["toolpath", str(job), "-o", str(out), "-q"]) == 0
    made = job_toolpath(Job.load(job), job_mesh(Job.load(job)))[0]
    again = make_job((STRATEGY, f'strategy = "file"\nfile = "{name}"'), name="again.toml")
    path, report = job_toolpath(Job.load(again), job_mesh(Job.load(again)))
    np.testing.assert_allclose(path.tilt_centres, made.tilt_centres, atol=1e-9)
    np.testing.assert_allclose(path.axes, made.axes, atol=1e-9)
    assert path.tilt_centre == 5e-3
    assert f"{name}: " in str(report)
    assert "gouge check" in str(report)


def test_a_toolpath_file_goes_through_the_whole_of_plan(make_job, tmp_path):
    assert run_cli(["toolpath", str(make_job()), "-o", str(tmp_path / "path.apt"), "-q"]) == 0
    job = make_job((STRATEGY, 'strategy = "file"\nfile = "path.apt"'), name="again.toml")
    outcome = run(Job.load(job), tmp_path / "out")
    assert outcome.passed
    assert json.loads((tmp_path / "out" / "verdict.json").read_text())["passed"]
    assert len(read_toolpath(tmp_path / "path.apt")) > 20


def test_jobs_for_one_part_share_its_mesh_until_its_file_or_its_keys_change(make_job):
    job = Job.load(make_job())
    mesh = job_mesh(job)
    elsewhere = job.with_(placement={"position_mm": [0.0, 0.0, 500.0]})
    assert job_mesh(elsewhere) is mesh
    assert job_mesh(job.with_(part={"scale": 0.5})).bounds == pytest.approx(0.5 * mesh.bounds)
    os.utime(job.mesh_path, (0, 0))  # as if it had been written again
    again = job_mesh(job)
    assert again is not mesh
    assert again.bounds == pytest.approx(mesh.bounds)


def test_the_digest_follows_the_toolpath_file(make_job, tmp_path):
    assert run_cli(["toolpath", str(make_job()), "-o", str(tmp_path / "path.csv"), "-q"]) == 0
    job = make_job((STRATEGY, 'strategy = "file"\nfile = "path.csv"'), name="again.toml")
    before = Job.load(job).digest
    with (tmp_path / "path.csv").open("a") as stream:
        stream.write("\n")
    assert Job.load(job).digest != before


def test_long_work_on_a_toolpath_shows_its_progress(make_job, tmp_path, monkeypatch):
    told = []

    @contextmanager
    def recorder(*, quiet):
        assert not quiet
        yield lambda stage, fraction, note="": told.append((stage, fraction, note))

    monkeypatch.setattr("pentapod.cli.commands.toolpath.progress_bar", recorder)
    mesh = dome_stl(cells=11)  # of no other test, whose passes are known
    assert run_cli(["toolpath", str(make_job(mesh=mesh)), "-o", str(tmp_path / "path.csv")]) == 0
    assert [note for stage, _, note in told if stage == "mesh" and note] == ["reading", "welding", "edges"]
    assert {stage for stage, _, _ in told} == {"mesh", "toolpath", "writing"}
    steps = [(fraction, note) for stage, fraction, note in told if stage == "toolpath"]
    names = ["", "drive surface", "passes", "waypoints and links", "gouge check", ""]
    assert [name for name, _ in groupby(note for _, note in steps)] == names
    assert [fraction for fraction, _ in steps] == sorted(fraction for fraction, _ in steps)
    assert (steps[0][0], steps[-1][0]) == (0.0, 1.0)


@pytest.mark.parametrize(
    ("tool", "tilt_centre"),
    [
        ('type = "bull"\ndiameter_mm = 10\ncorner_mm = 2\nflute_mm = 15', 0.0),
        ('type = "flat"\ndiameter_mm = 6\nshank_mm = [[20, 6, 6]]\nholder_mm = [[10, 12, 20], [30, 20, 20]]', 0.0),
        ('type = "lollipop"\ndiameter_mm = 8\nneck_mm = 4\nreach_mm = 25', 4e-3),
        ('type = "standoff"\nstandoff_mm = 5\nshank_mm = [[20, 1, 10]]', -5e-3),
    ],
)
def test_every_tool_makes_a_toolpath(make_job, tool, tilt_centre):
    job = Job.load(make_job((BALL, tool)))
    path, report = job_toolpath(job, job_mesh(job))
    assert path.tilt_centre == tilt_centre
    assert "gouge check" in str(report)


def test_axes_and_remedies_of_the_job_are_used(make_job):
    fixed = ("tilt_deg = 0", 'tilt_deg = 0\nmode = "fixed"\ndirection = [0, 0, 1]')
    job = Job.load(make_job(fixed))
    path, _ = job_toolpath(job, job_mesh(job))
    np.testing.assert_allclose(path.axes, np.tile([0.0, 0.0, 1.0], (len(path), 1)), atol=1e-12)
    # A wide holder just over the ball hits the dome's top while the ball is at its foot: lifted, or else dropped.
    wide = (BALL, BALL + "\nflute_mm = 5.1\nholder_mm = [[20, 40, 40]]")
    job = Job.load(make_job(fixed, wide, ("[feed]", '[gouge]\nremedy = ["lift", "drop"]\n\n[feed]')))
    path, report = job_toolpath(job, job_mesh(job))
    assert "holder" in str(report)
    assert "problem" not in str(report).splitlines()[-1]
    assert "links replaced by others that are clear" in str(report)
    assert any(segment.kind is SegmentKind.CUT for segment in path.segments)


def test_what_gouges_is_dropped_but_never_out_of_somebody_elses_toolpath(make_job, tmp_path):
    """A job that says nothing of gouges: of its own path the cuts in the way of the holder go, from a file none."""
    fixed = ("tilt_deg = 0", 'tilt_deg = 0\nmode = "fixed"\ndirection = [0, 0, 1]')
    wide = (BALL, BALL + "\nflute_mm = 5.1\nholder_mm = [[20, 40, 40]]")
    job = Job.load(make_job(fixed, wide))
    _, report = job_toolpath(job, job_mesh(job))
    assert "motions dropped" in str(report)
    assert "motions gouge by" not in str(report)
    assert run_cli(["toolpath", str(make_job(fixed)), "-o", str(tmp_path / "path.csv"), "-q"]) == 0
    given = read_toolpath(tmp_path / "path.csv")
    job = Job.load(make_job(fixed, wide, (STRATEGY, 'strategy = "file"\nfile = "path.csv"')))
    path, report = job_toolpath(job, job_mesh(job))
    assert "motions gouge by" in str(report)
    np.testing.assert_array_equal(path.tips, given.tips)


def test_a_tilt_that_breaks_the_cap_on_turning_is_told(make_job):
    """A holder just over the ball meets the dome; tilting clear turns the axis fast, the cap is slow."""
    fixed = ("tilt_deg = 0", 'tilt_deg = 0\nmode = "fixed"\ndirection = [0, 0, 1]\nrate_deg_mm = 0.1')
    wide = (BALL, BALL + "\nflute_mm = 5.1\nholder_mm = [[20, 40, 40]]")
    job = Job.load(make_job(fixed, wide, ("[feed]", '[gouge]\nremedy = ["tilt"]\ncone_deg = 60\n\n[feed]')))
    path, report = job_toolpath(job, job_mesh(job))
    assert "waypoints tilted clear" in str(report)
    assert re.search(
        r"problem: tilted to avoid a gouge, the axis turns by up to \S+ deg/mm, the cap is 0.1", str(report)
    )
    assert angle_between(path.axes[1:], path.axes[:-1]).max() <= np.radians(3.0) * (1 + 1e-8)


@pytest.mark.parametrize("lead", [0, 12])
def test_the_cap_on_steps_holds_in_every_axis_mode(make_job, lead):
    """Near the point that the axis is turned from, the axis turns fast; and with a lead, at every turn of a pass."""
    near = f'tilt_deg = 0\nmode = "toward"\npoint_mm = [0, 0, -30]\nlead_deg = {lead}'
    job = Job.load(make_job(("tilt_deg = 0", near), (STRATEGY, STRATEGY + "\naxis_step_deg = 2")))
    path, _ = job_toolpath(job, job_mesh(job))
    assert angle_between(path.axes[1:], path.axes[:-1]).max() <= np.radians(2.0) * (1 + 1e-8)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ((BALL, BALL + "\ncorner_mm = 1"), r"tool\.corner_mm: means nothing"),
        ((BALL, 'type = "bull"\ndiameter_mm = 10'), r"tool\.corner_mm: missing"),
        ((BALL, BALL + "\nshank_mm = [[0, 1, 1]]"), r"tool\.shank_mm: an impossible piece"),
        (("tilt_deg = 0", 'tilt_deg = 0\nmode = "fixed"'), r"axis\.direction: missing for axis mode"),
        (("tilt_deg = 0", "tilt_deg = 0\npoint_mm = [0, 0, 1]"), r"axis\.point_mm: means nothing"),
        ((STRATEGY, 'strategy = "file"'), r"toolpath\.file: the key is missing"),
        ((STRATEGY, STRATEGY + '\nfile = "part.stl"'), r'toolpath\.file: the strategy "raster" has no such key'),
        ((STRATEGY, 'strategy = "file"\nfile = "none.apt"'), r"toolpath\.file: no such file"),
        (("[feed]", '[gouge]\nremedy = ["pray"]\n\n[feed]'), r"gouge\.remedy"),
    ],
)
def test_mistakes_name_their_key(make_job, change, message):
    with pytest.raises(JobError, match=message):
        Job.load(make_job(change))


def test_a_flat_end_may_not_tilt(make_job):
    with pytest.raises(JobError, match="cannot tilt"):
        Job.load(make_job((BALL, 'type = "flat"\ndiameter_mm = 6'), ("tilt_deg = 0", "tilt_deg = 5")))
    for mode in ('mode = "normal"', 'mode = "fixed"\ndirection = [0, 0, 1]'):
        upright = Job.load(make_job((BALL, 'type = "flat"\ndiameter_mm = 6'), ("tilt_deg = 0", mode)))
        assert upright.axis.tilt_deg == 0.0


def test_auto_axes_start_from_normals_and_leave_stem_and_holder_to_the_planner(make_job):
    thick = (BALL, f"{BALL}\nflute_mm = 30\nholder_mm = [[20, 40, 40]]")
    normal = Job.load(make_job(thick, name="normal.toml"))
    auto = Job.load(make_job(thick, ("tilt_deg = 0", 'mode = "auto"')))
    mesh = job_mesh(auto)
    made, plain = job_toolpath(auto, mesh)[0], job_toolpath(normal, mesh)[0]
    cuts = [segment for segment in made.segments if segment.kind is SegmentKind.CUT]
    others = [segment for segment in plain.segments if segment.kind is SegmentKind.CUT]
    np.testing.assert_allclose(np.concatenate([s.axes for s in cuts]), np.concatenate([s.axes for s in others]))
    kinds = [(solid.kind, solid.low, solid.high) for solid in tool_in_world(auto).solids]
    assert [kind for kind, _, _ in kinds] == ["cutter", "shank", "holder"]
    assert kinds[1][1:] == pytest.approx((10e-3, 30e-3))  # the flute above the ball must not touch the part
    assert [solid.kind for solid in tool_in_world(normal).solids].count("shank") == 0


@pytest.mark.slow
def test_auto_axes_machine_a_steep_dome_and_the_verdict_judges_the_lean(make_job, tmp_path):
    free = tuple((line, "") for line in ("rotation_deg = [180, 0, 0]\n", 'component = "++"\n'))
    text = make_job(('mode = "fixed"', 'mode = "free"'), *free, ("tilt_deg = 0", 'mode = "auto"\ntilt_deg = 40'))
    text.write_text(re.sub("position_mm = .*\n", "", text.read_text()))
    outcome = run(Job.load(text), tmp_path / "out")
    assert outcome.passed
    judged = json.loads((tmp_path / "out" / "verdict.json").read_text())
    (lean,) = [claim for claim in judged["certificates"] if claim["claim"] == "axis deviation"]
    assert lean["value"] <= 40.5
    assert "tilt cone 40 deg" in lean["method"]


def noisy_dome(scale):
    """A scan of a dome of 60 mm: heights are off by as many millimetres, as standard deviation."""
    content = np.frombuffer(dome_stl(cells=60)[84:], dtype=[("n", "<f4", 3), ("p", "<f4", (3, 3)), ("spare", "<u2")])
    facets, rng = content.copy(), np.random.default_rng(4)
    heights = {}
    for facet in facets["p"]:
        for corner in facet:  # the same noise wherever facets share a corner
            corner[2] += heights.setdefault((corner[0], corner[1]), rng.normal(scale=scale))
    return dome_stl(cells=60)[:84] + facets.tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("scale", [0.02, 0.1])
def test_the_cycle_on_a_noisy_scan_is_at_most_a_tenth_above_its_bound(scale, make_job, tmp_path):
    """At the feed that `new` proposes; at twice that feed the turns between passes of 60 mm alone cost 7 %."""
    feed = ("cut_mm_min = 3000", "cut_mm_min = 1500")
    text = make_job(("15\nspacing_mm = 4", "3"), ("tilt_deg = 0", ""), feed, mesh=noisy_dome(scale))
    outcome = run(Job.load(text), tmp_path / "out", advice=None)
    assert outcome.passed
    story = outcome.find(Explanation)
    assert story.duration <= 1.1 * story.lower_bound


@pytest.mark.slow
def test_axes_on_a_noisy_scan_turn_as_little_as_without_noise(make_job):
    noisy, turns = noisy_dome(0.05), []
    for text, mesh in (
        ("tilt_deg = 0", dome_stl(cells=60)),
        ("tilt_deg = 0", noisy),
        ("tilt_deg = 0\nsmoothing_deg = 0", noisy),
    ):
        job = Job.load(make_job(("tilt_deg = 0", text), ("15\nspacing_mm = 4", "3"), mesh=mesh))
        path, _ = job_toolpath(job, job_mesh(job))
        cuts = [segment for segment in path.segments if segment.kind is SegmentKind.CUT]
        turns.append(np.concatenate([angle_between(s.axes[1:], s.axes[:-1]) for s in cuts]).sum())
    clean, smoothed, rough = turns
    assert smoothed < 1.05 * clean
    assert rough > 1.4 * clean


def test_the_passes_of_a_part_in_use_are_made_once(make_job, monkeypatch):
    made: list[object] = []

    def counted(*given):
        made.append(given)
        return toolpath_with_report(*given)

    monkeypatch.setattr("pentapod.job.build.toolpath.toolpath_with_report", counted)
    job = Job.load(make_job(mesh=dome_stl(cells=13)))  # of no other test, whose passes are known
    mesh = job_mesh(job)
    first = job_toolpath(job, mesh)[0]
    again = job_toolpath(job.with_(axis={"tilt_deg": 30.0}), job_mesh(job))[0]
    assert len(made) == 1
    np.testing.assert_array_equal(again.tips, first.tips)
    job_toolpath(job.with_(toolpath={"stepover_mm": 14.0}), mesh)
    assert len(made) == 2
