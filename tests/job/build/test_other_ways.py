"""A job done by an upright tool or with passes nearer together: what it is, who says so, and who takes it up."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from trimesh.convex import convex_hull

import concave_parts
import toolpath_surfaces as surfaces
from pentapod.base.errors import MeshError, ProgramError, ToolpathError
from pentapod.base.progress import silent
from pentapod.base.refusal import Refusal, Shortfall
from pentapod.cli.commands.new import dome_stl
from pentapod.job import Job, judge, run
from pentapod.job.advice.options import OPTIONS
from pentapod.job.build.left import FORBIDDEN, foreseen
from pentapod.job.build.other_ways import (
    as_made,
    may_stand,
    nearer,
    nearer_share,
    nearer_words,
    standing,
    stands,
    stepover_share,
)
from pentapod.job.build.pieces import program_toolpath
from pentapod.job.build.region import rolls
from pentapod.job.build.specification import job_coverage
from pentapod.job.build.toolpath import Reports, job_toolpath
from pentapod.job.build.values import job_mesh
from pentapod.job.mending import FailedMend, FailedWay, other_way
from pentapod.job.outcome import Outcome, Stage
from pentapod.job.pipeline import attempt, other_attempts
from pentapod.job.pipeline.other_attempts import ANOTHER_WAY
from pentapod.job.pipeline.stages import with_advice
from pentapod.job.stage_runner import StageRunner
from pentapod.job.task import Task
from pentapod.machine.machine import Machine
from pentapod.mesh.io.stl import write_stl
from pentapod.planning import PlacedPath
from pentapod.program import read_header, write_csv
from pentapod.toolpath import SegmentKind
from pentapod.toolpath.gouge.report import GougeReport
from pentapod.toolpath.surfaces.tip_surface import TipSurface
from pentapod.verify import Verdict
from pentapod.verify.surface.surface_left import SURFACE_LEFT
from pentapod.verify.verdict.verdict import Certificate, Place
from refused_jobs import REFUSED
from short_motion import motion

SLOPE = float(np.tan(np.radians(20.0)))
TABLES = {
    "part": {"mesh": "part.stl", "unit": "mm"},
    "machine": {"name": "desk"},
    "tool": {"type": "ball", "diameter_mm": 6.0},
    "toolpath": {"stepover_mm": 6.0},
    "axis": {"mode": "auto", "tilt_deg": 60.0},
    "feed": {"cut_mm_min": 1500.0},
    "placement": {"mode": "table", "table_z_mm": 471.0},
}


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dome")
    (folder / "part.stl").write_bytes(dome_stl(cells=8))
    return Job.from_dict(TABLES, folder)


def test_an_upright_job_keeps_the_digest_and_stands_along_the_view(job):
    made = standing(job)
    assert made.digest == job.digest
    assert made.asked is job
    assert (made.axis.mode, made.axis.direction, made.axis.tilt_deg) == ("fixed", (0.0, 0.0, 1.0), 0.0)
    assert made.toolpath.under_mm == 0.0
    assert made.with_(feed={"cut_mm_min": 1500.0}).digest != job.digest


def test_an_upright_tool_may_do_jobs_whose_axis_is_the_planners(job):
    assert may_stand(job)
    assert not may_stand(standing(job))
    assert not may_stand(job.with_(axis={"mode": "normal"}))
    assert not may_stand(job.with_(toolpath={"strategy": "edges", "stepover_mm": None}))
    beam = {"type": "standoff", "standoff_mm": 40.0, "diameter_mm": None}
    assert not may_stand(job.with_(tool=beam, axis={"tilt_deg": None}))
    flat = job.with_(tool={"type": "flat"}, axis={"tilt_deg": None})
    assert may_stand(flat)
    made = standing(flat)
    assert (made.axis.mode, made.toolpath.under_mm) == ("fixed", None)
    assert rolls(made)
    assert not rolls(flat)


def test_both_ways_together_are_told_apart_from_what_was_asked_for(job):
    flat = job.with_(tool={"type": "flat"}, axis={"tilt_deg": None})
    made = nearer(standing(flat), 0.5)
    assert made.asked is flat
    assert made.digest == flat.digest
    assert (stands(made), stepover_share(made)) == (True, 0.5)
    assert "third attempt" in nearer_words(made)
    assert not may_stand(made)
    assert nearer_share(made) == 0.3
    header = replace(motion(0.1)[0].provenance, upright=True, stepover_share=0.5)
    assert as_made(flat, header).tables == made.tables


def test_the_header_says_that_the_tool_is_upright_and_the_toolpath_is_made_so(job, tmp_path):
    program, _ = motion(0.1)
    file = write_csv(replace(program, provenance=replace(program.provenance, upright=True)), tmp_path / "a.csv")
    assert read_header(file).provenance.upright
    assert np.array_equal(np.unique(program_toolpath(job, job_mesh(job), file).axes, axis=0), [[0.0, 0.0, 1.0]])
    plain = write_csv(program, tmp_path / "b.csv")
    assert "upright" not in plain.read_text()
    assert len(np.unique(program_toolpath(job, job_mesh(job), plain).axes, axis=0)) > 1


@pytest.mark.parametrize(
    ("key", "value", "wrong"),
    [
        ("upright", True, "1"),
        ("stepover_share", 0.5, "true"),
        ("stepover_share", 0.5, "1.0"),
        ("stepover_share", 0.5, "0.05"),
        ("stepover_share", 0.5, "nan"),
    ],
)
def test_a_header_with_another_value_is_refused(key, value, wrong, tmp_path):
    program, _ = motion(0.1)
    file = write_csv(replace(program, provenance=replace(program.provenance, **{key: value})), tmp_path / "a.csv")
    right = "true" if value is True else repr(value)
    text = file.read_text()
    assert f"# {key} = {right}\n" in text
    file.write_text(text.replace(f"# {key} = {right}", f"# {key} = {wrong}"))
    with pytest.raises(ProgramError, match=key):
        read_header(file)


FLAT = {
    "tool": {"type": "flat", "diameter_mm": 6.8},
    "axis": {"mode": "fixed", "direction": [0.0, 0.0, 1.0], "tilt_deg": 0.0},
}


def test_passes_come_nearer_with_the_bound_of_what_was_asked_for(job):
    flat = job.with_(**FLAT)
    made = nearer(flat, 0.5)
    assert made.digest == flat.digest
    assert made.asked is flat
    assert made.toolpath.stepover_mm == 3.0
    assert stepover_share(made) == 0.5
    assert not stands(made)
    assert stands(standing(job))
    left = [job_coverage(each, job_mesh(each)).left for each in (flat, made)]
    assert left[0] == pytest.approx(left[1], rel=1e-12)
    bounded = flat.with_(tolerance={"left_mm": 0.3})
    assert nearer(bounded, 0.5).tolerance.left_mm == 0.3


def test_ridges_of_a_quarter_of_the_height_are_half_as_far_apart(job):
    bull = {"tool": {"type": "bull", "diameter_mm": 6.0, "corner_mm": 1.0}, "axis": FLAT["axis"]}
    made = nearer(job.with_(toolpath={"stepover_mm": None, "scallop_mm": 0.04}, **bull), 0.5)
    assert made.toolpath.scallop_mm == pytest.approx(0.01)
    assert stepover_share(made) == pytest.approx(0.5)


def test_passes_come_nearer_twice(job):
    flat = job.with_(**FLAT)
    assert nearer_share(flat) == 0.5
    near = nearer(flat, 0.5)
    assert nearer_share(near) == 0.3
    nearest = nearer(near, 0.3)
    assert nearer_share(nearest) is None
    assert nearest.toolpath.stepover_mm == pytest.approx(0.3 * flat.toolpath.stepover_mm)
    assert nearest.tolerance.left_mm == near.tolerance.left_mm
    assert nearest.digest == flat.digest
    assert [nearer_words(each).split(" ")[0] for each in (near, nearest)] == ["second", "third"]
    assert nearer_share(job) == 0.5
    assert nearer_share(flat.with_(toolpath={"strategy": "edges", "stepover_mm": None})) is None


@pytest.mark.parametrize("key", ["stepover_mm", "scallop_mm"])
def test_rounding_of_the_distance_makes_no_further_attempt(job, key):
    """0.3 of 0.7, over 0.7, is not 0.3 in floating-point numbers; nor is the root of its square."""
    rng = np.random.default_rng(3)
    for value in rng.uniform(0.01, 5.0, 200):
        flat = job.with_(**FLAT, toolpath={"stepover_mm": None, "scallop_mm": None, key: float(value)})
        near = nearer(flat, 0.5)
        nearest = nearer(near, 0.3)
        assert nearer_share(near) == 0.3
        assert nearer_share(nearest) is None
        assert [nearer_words(each).split(" ")[0] for each in (near, nearest)] == ["second", "third"]


def test_the_header_says_how_near_the_passes_are_and_the_toolpath_is_made_so(job, tmp_path):
    flat, program = job.with_(**FLAT), motion(0.1)[0]
    file = write_csv(replace(program, provenance=replace(program.provenance, stepover_share=0.5)), tmp_path / "a.csv")
    plain = write_csv(program, tmp_path / "b.csv")
    assert "stepover_share" not in plain.read_text()
    near, far = (program_toolpath(flat, job_mesh(flat), each) for each in (file, plain))
    cuts = [sum(segment.kind is SegmentKind.CUT for segment in path.segments) for path in (near, far)]
    assert cuts[0] > 1.5 * cuts[1]
    # A header that says so of a job that does not do it changes nothing.
    edges = flat.with_(toolpath={"strategy": "edges", "stepover_mm": None})
    assert as_made(edges, replace(program.provenance, stepover_share=0.5)) is edges


def failing(job, *claims, limits=(), left=2.0):
    """The outcome of a job whose program fails claims, or whose placement exceeds limits."""
    refusal = Refusal(
        "verdict" if claims else "placement", "no", tuple(Shortfall(n, ((0, 9),), 0.2, "mm") for n in limits)
    )
    certificates = tuple(Certificate(name, False, left, 0.1, "%", Place(), "") for name in claims)
    return Outcome(job, Machine.load("desk"), (Stage("refused", 0.0, refusal),), Verdict(certificates))


def test_a_way_that_failed_tells_what_it_left_where_nothing_else_was_wrong(job):
    assert FailedWay.of(failing(job, SURFACE_LEFT, left=0.2)) == FailedWay(frozenset((SURFACE_LEFT,)), 0.2)
    assert FailedWay.of(failing(job, SURFACE_LEFT, "lowest feed", left=0.2)).left is None
    assert FailedWay.of(failing(job, limits=("leg 1 too long",))).left is None


def test_a_way_that_failed_tells_the_heights_at_which_the_tool_meets_the_part_where_nothing_else_was_wrong(job):
    mesh = job_mesh(job)
    path = job_toolpath(job, mesh)[0]

    def way(*limits):
        failed = failing(job, limits=limits)
        stages = Stage("mesh", 0.0, mesh), Stage("toolpath", 0.0, (path, ""))
        return FailedWay.of(replace(failed, stages=(*stages, *failed.stages)))

    assert way("spindle touches the part").meets[-1] == pytest.approx(path.tips[:10, 2].max())
    assert way("spindle touches the part", "leg 1 too long").meets == ()
    assert FailedWay.of(failing(job, SURFACE_LEFT)).meets == ()


@pytest.mark.parametrize("first", [0.1, 0.3])
def test_advice_gets_what_another_way_left_and_at_which_heights_the_tool_met_the_part(first, job, monkeypatch):
    def advised(*given, **_):
        told.append(given[-2:])
        return SimpleNamespace(advice=(), sentence="nothing")

    told = []
    monkeypatch.setattr("pentapod.job.pipeline.stages.advised", advised)
    refused, runner = failing(job, limits=("leg 1 too long",)), StageRunner(silent)
    no = frozenset(("no",))
    ways = [FailedMend(first), FailedWay(no), FailedWay(no, 0.3, (1.0, 2.0)), FailedWay(no, 0.2, (3.0,))]
    runner.stages = [*refused.stages, *(Stage(ANOTHER_WAY, 0.0, way) for way in ways)]
    task = SimpleNamespace(job=job, machine=refused.machine, toolpath=None)
    attempt = SimpleNamespace(task=task, runner=runner, mesh=None, refused=lambda refusal: refusal)
    with_advice(attempt, replace(refused, stages=tuple(runner.stages)), run, OPTIONS)
    assert told == [(min(first, 0.2), (1.0, 2.0))]


def test_what_may_be_left_is_judged_on_the_program_only_if_that_leaves_no_more(job, monkeypatch):
    """Else the job is planned: another way to do it leaves less than this program."""

    def advised(*given, **_):
        planned.append(given[4])
        return SimpleNamespace(advice=(), sentence="nothing")

    def again(job, _, *, left_first):
        return "again", job.tolerance.left_share, left_first

    planned = []
    monkeypatch.setattr("pentapod.job.pipeline.stages.advised", advised)
    refused, runner = failing(job, SURFACE_LEFT, left=0.3), StageRunner(silent)
    runner.stages = list(refused.stages)
    task = SimpleNamespace(job=job, machine=refused.machine, toolpath=None)
    attempt = SimpleNamespace(
        task=task, runner=runner, mesh=None, ended=lambda _: None, tried_with=lambda share, _: ("judged", share)
    )
    monkeypatch.setattr("pentapod.job.pipeline.stages.more_left_out", lambda *_: None)
    with_advice(attempt, refused, again, OPTIONS)
    (plan,) = planned
    assert plan(job.with_(tolerance={"left_share": 0.004}), silent) == ("judged", 0.004)
    assert plan(job.with_(tolerance={"left_share": 0.002}), silent) == ("again", 0.002, True)


@pytest.mark.parametrize(("second", "expected"), [((SURFACE_LEFT,), "second"), ((), "first")])
def test_what_nearer_passes_leave_is_compared_with_the_last_way_that_left_too_much(job, second, expected, monkeypatch):
    """The second way may have had no program of which that is known, as where the tool touches the part."""
    first, last = failing(job, SURFACE_LEFT, left=1.0), failing(job, SURFACE_LEFT, left=0.9)
    between = failing(job, *second, limits=("tool body touches the part",))
    outcomes, compared = iter([between, last]), []

    class Planned(SimpleNamespace):
        def with_task(self, **_):
            return self

        def judged_on_toolpath(self):
            return None

        def planned(self):
            return next(outcomes)

        def withheld(self):
            return None

        def put_back(self, failed, _):
            return failed

    def other(made, _, before):
        compared.append({id(first): "first", id(between): "second"}[id(before)])
        return (made, "third attempt") if len(compared) == 1 else None

    for name, stub in (("job_specification", lambda *_, **__: None), ("mended", lambda _, outcome: outcome)):
        monkeypatch.setattr(other_attempts, name, stub)
    monkeypatch.setattr(other_attempts, "other_way", other)
    task = SimpleNamespace(job=job, machine=None, specification=SimpleNamespace(sources=SimpleNamespace(machine=None)))
    attempt = Planned(task=task, mesh=None, runner=SimpleNamespace(progress=silent, stages=[]))
    other_attempts._otherwise(attempt, first, job, "second attempt")
    assert compared == ["first", expected]


@pytest.mark.parametrize(("way", "begins"), [(lambda job: nearer(job, 0.5), True), (standing, False)])
@pytest.mark.parametrize("refused", [False, True])
def test_nearer_passes_begin_at_the_placement_of_the_run_before(way, begins, refused, job, monkeypatch):
    """An upright tool does not; and where that start does not help, all is searched for again."""
    tips = np.zeros((1, 3))
    placed = PlacedPath([0], None, None, tips, tips, np.ones((1, 1)), ())
    failed, starts, stages = failing(job, SURFACE_LEFT, left=0.9), [], []

    class Planned(SimpleNamespace):
        def with_task(self, *, start=None, **_):
            return Planned(**{**vars(self), "start": start})

        def judged_on_toolpath(self):
            return None

        def planned(self):
            starts.append(self.start)
            stages.append(len(self.runner.stages))
            self.runner.stages.append(None)
            limits = ("leg 1 too long",) if refused and self.start is not None else ()
            return failing(job, *(() if limits else (SURFACE_LEFT,)), limits=limits)

        def withheld(self):
            return None

        def put_back(self, failed, _):
            return failed

    for name, stub in (("job_specification", lambda *_, **__: None), ("mended", lambda _, outcome: outcome)):
        monkeypatch.setattr(other_attempts, name, stub)
    monkeypatch.setattr(other_attempts, "other_way", lambda *_: None)
    task = SimpleNamespace(job=job, machine=None, specification=SimpleNamespace(sources=SimpleNamespace(machine=None)))
    attempt = Planned(task=task, mesh=None, runner=SimpleNamespace(progress=silent, stages=[]), start=None)
    before = replace(failed, stages=(Stage("placement", 0.0, placed), *failed.stages))
    other_attempts._otherwise(attempt, before, way(job), "second attempt")
    assert starts == ([placed] if begins else []) + ([None] if refused or not begins else [])
    assert len(set(stages)) == 1, "what was tried first leaves no stages"


@pytest.mark.parametrize("stepover", [6.0, 3.0])
def test_another_way_whose_toolpath_leaves_too_much_is_not_planned(stepover, job, tmp_path, monkeypatch):
    """Passes of 6 mm leave more than a ridge of 3 mm, and no program is needed to tell."""
    planned = []
    wide = job.with_(toolpath={"stepover_mm": stepover}, tolerance={"left_mm": 0.5})

    def as_asked(self):
        planned.append(stands(self.task.job))
        return failing(self.task.job, limits=("tool body touches the part",))

    monkeypatch.setattr(attempt.Attempt, "planned", as_asked)
    outcome = run(wide, tmp_path / "out", advice=None)
    assert planned == ([False] if stepover == 6.0 else [False, True])
    way = outcome.find(FailedWay)
    assert way.claims == ({SURFACE_LEFT} if stepover == 6.0 else set())
    if stepover == 6.0:
        assert way.left > 20.0
        said = next(stage.remark for stage in outcome.stages if stage.name == ANOTHER_WAY)
        assert f"the program would fail its own verdict: {SURFACE_LEFT}" in said


def test_what_fails_decides_on_the_other_way(job):
    upright, flat = job.with_(**FLAT), job.with_(tool={"type": "flat"}, axis={"tilt_deg": None})
    assert stepover_share(other_way(upright, failing(upright, SURFACE_LEFT))[0]) == 0.5
    assert other_way(upright, failing(upright, SURFACE_LEFT, "lowest feed")) is None
    assert other_way(upright, failing(upright, limits=("leg 1 too long",))) is None
    made, first = nearer(upright, 0.5), failing(upright, SURFACE_LEFT)
    assert stepover_share(other_way(made, failing(made, SURFACE_LEFT, left=0.2), first)[0]) == pytest.approx(0.3)
    assert other_way(made, failing(made, SURFACE_LEFT, left=1.9), first) is None
    last = nearer(made, 0.3)
    assert other_way(last, failing(last, SURFACE_LEFT, left=0.2), failing(made, SURFACE_LEFT)) is None
    assert stands(other_way(flat, failing(flat, limits=("leg 1 too long",)))[0])
    assert other_way(job, failing(job, SURFACE_LEFT)) is None
    assert stepover_share(other_way(job, failing(job, SURFACE_LEFT, left=0.9))[0]) == 0.5
    assert stands(other_way(job, failing(job, limits=("tool body touches the part",)))[0])


def test_another_way_that_has_no_surface_leaves_the_first_refusal(job, tmp_path, monkeypatch):
    flat = job.with_(tool={"type": "flat"}, axis={"tilt_deg": None})
    refusal = Refusal("placement", "no", (Shortfall("leg 1 too long", ((0, 9000),), 0.2, "mm"),))

    def too_large(*given, **more):
        raise MeshError("the tip surface is too fine for this part", key="step")

    monkeypatch.setattr(Task, "program", lambda self, file: self.runner.run("placement", lambda: refusal))
    monkeypatch.setattr(TipSurface, "of", too_large)
    done = run(flat, tmp_path / "out", advice=None)
    assert done.refusal == refusal
    assert not (tmp_path / "out" / "program.csv").exists()


def test_an_end_that_leaves_out_much_along_the_normals_is_planned_upright_first(job, tmp_path, monkeypatch):
    """Where that is refused, too, it is planned along the normals, and this refusal is told."""
    planned: list[bool] = []

    def refused(self, file):
        planned.append(stands(self.job))
        refusal = Refusal("placement", f"no {len(planned)}", (Shortfall("leg 1 too long", ((0, 9000),), 0.2, "mm"),))
        self.runner.run("placement", lambda: refusal)
        return refusal

    monkeypatch.setattr(Task, "program", refused)
    much = GougeReport(motions=3000, gouging=100, depths=(5e-4, 0.0, 0.0), dropped=100, dropped_share=0.19)
    flat = job.with_(tool={"type": "flat"}, axis={"tilt_deg": None})
    toolpath = job_toolpath(flat, job_mesh(flat))[0]
    assert "the tool would cut into the part on 19 %" in str(
        foreseen(flat, Reports((much,)), toolpath, None, upright=True)
    )
    assert foreseen(flat, Reports((much,)), toolpath, None) is None
    less = replace(much, dropped_share=0.04)
    assert foreseen(flat, Reports((less,)), toolpath, None, upright=True) is None

    def always(*_, upright=False):
        return Refusal(FORBIDDEN, "much") if upright else None

    monkeypatch.setattr(attempt, "foreseen", always)
    outcome = run(flat, tmp_path / "out", advice=None)
    assert planned == [True, False]
    assert outcome.refusal.cause == "no 2"
    names = [stage.name for stage in outcome.stages]
    assert "foreseen" not in names
    assert names.count(ANOTHER_WAY) == 1
    planned.clear()
    run(flat.with_(placement={"setups": 2}), tmp_path / "split", advice=None)
    assert True not in planned
    # Where it passes along the normals, nothing of the upright attempt is told.
    real = attempt.Attempt.planned

    def along_normals(self):
        if stands(self.task.job):
            return real(self)
        holds = Certificate("all", True, 0.0, 1.0, "", Place(), "")
        return Outcome(self.task.job, self.task.machine, tuple(self.runner.stages), Verdict((holds,)))

    monkeypatch.setattr(attempt.Attempt, "planned", along_normals)
    passed = run(flat, tmp_path / "passed", advice=None)
    assert passed.passed
    assert [stage.name for stage in passed.stages] == ["mesh", "toolpath"]


@pytest.mark.slow
def test_where_leaning_makes_the_tool_touch_the_part_it_stays_upright_and_the_output_says_so(
    job, tmp_path, monkeypatch
):
    """The placement with leans is refused, as if the tool touched something there."""
    real = Task.program

    def once(self, file):
        if self.job.asked is not None:
            return real(self, file)
        refusal = Refusal("placement", "no", (Shortfall("tool body touches the part", ((0, 9000),), 0.2, "mm"),))
        self.runner.run("placement", lambda: refusal)
        return refusal

    monkeypatch.setattr(Task, "program", once)
    done = run(job, tmp_path / "out", advice=None)
    assert done.passed
    assert done.job is job
    assert any("the tool stays upright" in stage.remark for stage in done.stages)
    assert "\n# upright = true\n" in (tmp_path / "out" / "program.csv").read_text()[:4000]
    verdict = judge(job, tmp_path / "out")
    assert {c.claim: c.passed for c in verdict.certificates}["surface left on the region"]
    assert verdict.passed


@pytest.mark.slow
def test_a_bull_end_whose_axis_is_the_planners_machines_ribs_upright(tmp_path):
    """Along the normals of the ribs the end would cut into their neighbours: much would be left."""
    mesh = concave_parts.mesh("ribs")
    scale = 45.0 / np.ptp(mesh.bounds, axis=0).max()
    (tmp_path / "part.stl").write_bytes(write_stl(scale * mesh.vertices[mesh.faces], "ribs"))
    tool = {"type": "bull", "diameter_mm": 5.7, "corner_mm": 1.4}
    toolpath = {"strategy": "offset", "stepover_mm": 3.4}
    job = Job.from_dict({**TABLES, "tool": tool, "toolpath": toolpath, "axis": {"mode": "auto"}}, tmp_path)
    done = run(job, tmp_path / "out", advice=None)
    assert done.passed
    assert any("the tool keeps one direction" in stage.remark for stage in done.stages)
    assert read_header(tmp_path / "out" / "program.csv").provenance.upright
    assert judge(job, tmp_path / "out").passed


@pytest.mark.slow
def test_a_flat_end_on_a_slope_comes_nearer_and_the_output_says_so(tmp_path):
    """Half a roof of 20°: stairs of 1.13 mm between passes 3.5 mm apart, where 0.64 mm may be left."""
    corners = [
        (x, y, z) for x in (0.0, 40.0) for y, z in ((0.0, 0.0), (0.0, 3.0), (24.0, 0.0), (24.0, 3.0 + 24.0 * SLOPE))
    ]
    convex_hull(np.array(corners)).export(tmp_path / "part.stl")
    tables = {**TABLES, "toolpath": {"stepover_mm": 3.5, "direction_deg": 0.0}}
    job = Job.from_dict({**tables, "tool": FLAT["tool"], "axis": FLAT["axis"]}, tmp_path)
    done = run(job, tmp_path / "out", advice=None)
    assert done.passed
    assert done.job is job
    assert any("0.5 times as far apart as asked" in stage.remark for stage in done.stages)
    assert "\n# stepover_share = 0.5\n" in (tmp_path / "out" / "program.csv").read_text()[:4000]
    verdict = judge(job, tmp_path / "out")
    left = {c.claim: c for c in verdict.certificates}["surface left on the region"]
    assert left.passed
    assert verdict.passed


@pytest.mark.slow
def test_a_ball_that_leaves_a_little_too_much_comes_nearer(tmp_path):
    """At the steep rim of a cap the last passes leave a little more than a thousandth of the region."""
    asked = REFUSED["passes too far apart at the rim"]
    closer = replace(asked, tables={**asked.tables, "toolpath": {"stepover_mm": 2.5}})
    job = Job.load(closer.write(tmp_path))
    done = run(job, tmp_path / "out", advice=None)
    assert done.passed
    assert any("0.5 times as far apart as asked" in stage.remark for stage in done.stages)
    assert judge(job, tmp_path / "out").passed


def test_a_bull_end_that_cuts_nowhere_along_the_normals_stands_upright(tmp_path):
    """In a trough its flat bottom would cut into both sides: that was an error, without another attempt."""
    vertices, faces = surfaces.grid(lambda x, y: -np.sqrt(64e-6 - y**2), cells=24, width=0.012)
    (tmp_path / "part.stl").write_bytes(write_stl(1e3 * vertices[faces], "trough"))
    tool = {"type": "bull", "diameter_mm": 8.0, "corner_mm": 1.0}
    job = Job.from_dict({**TABLES, "tool": tool, "toolpath": {"stepover_mm": 2.0}, "axis": {"mode": "auto"}}, tmp_path)
    with pytest.raises(ToolpathError, match="no cut is left"):
        job_toolpath(job, job_mesh(job))
    done = run(job, tmp_path / "out", advice=None)
    assert done.passed
    assert done.job == job
    remarks = {stage.name: stage.remark for stage in done.stages}
    assert "the tool keeps one direction" in remarks["another way"]
    assert "surface left on the region" in remarks["left"]
    assert judge(job, tmp_path / "out").passed  # as the header of its program says
