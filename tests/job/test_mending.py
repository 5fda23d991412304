"""Mending: a run goes back, leaves out the few places that cannot be done, and says so."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from pentapod.base.errors import ProgramError, ToolpathError
from pentapod.base.progress import silent
from pentapod.base.refusal import Refusal, Shortfall
from pentapod.cli.commands.new import dome_stl
from pentapod.job import Job, run, task
from pentapod.job.build.pieces import job_without, program_toolpath
from pentapod.job.build.toolpath import job_toolpath
from pentapod.job.build.values import job_mesh
from pentapod.job.mending import FailedMend, mend_of, more_left_out, most_left_out
from pentapod.job.outcome import Outcome, Stage
from pentapod.job.pipeline import attempt, stages
from pentapod.machine.machine import Machine
from pentapod.program import write_csv
from pentapod.toolpath import SegmentKind
from pentapod.toolpath.linking.partition import cutting_intervals
from pentapod.verify import Verdict
from pentapod.verify.surface.surface_left import SURFACE_LEFT
from pentapod.verify.verdict.verdict import Certificate, Place
from short_motion import motion

TABLES = {
    "part": {"mesh": "part.stl", "unit": "mm"},
    "machine": {"name": "desk"},
    "tool": {"type": "ball", "diameter_mm": 6.0},
    "toolpath": {"stepover_mm": 3.0},
    "axis": {"mode": "fixed", "direction": [0.0, 0.0, 1.0]},
    "feed": {"cut_mm_min": 1500.0},
    "placement": {"mode": "table", "table_z_mm": 471.0},
}
STRETCHES = ((120, 130), (400, 404))


@pytest.fixture(scope="module")
def dome(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dome")
    (folder / "part.stl").write_bytes(dome_stl(cells=12))
    job = Job.from_dict(TABLES, folder)
    mesh = job_mesh(job)
    return job, mesh, job_toolpath(job, mesh)[0]


def outcome(job, toolpath, refusal, certificates=()):
    stages = (Stage("toolpath", 0.0, (toolpath, None)), Stage("placement", 0.0, refusal))
    return Outcome(job, Machine.load("desk"), stages, Verdict(tuple(certificates)))


def refused(*waypoints):
    return Refusal("placement", "does not fit", (Shortfall("tool body touches the part", waypoints, 0.2, "mm"),))


def cut_centres(toolpath):
    pairs = np.stack([toolpath.tilt_centres[:-1], toolpath.tilt_centres[1:]], axis=1)
    return np.round(pairs[cutting_intervals(toolpath)], 9)


def test_a_toolpath_without_some_cuts_makes_all_others_in_their_order(dome):
    job, mesh, whole = dome
    kept = cutting_intervals(whole).copy()
    for first, last in STRETCHES:
        kept[first:last] = False
    part = job_without(job, mesh, whole, STRETCHES)
    pairs = np.stack([whole.tilt_centres[:-1], whole.tilt_centres[1:]], axis=1)
    assert np.array_equal(cut_centres(part), np.round(pairs[kept], 9))
    assert sum(s.kind is SegmentKind.RAPID for s in part.segments) == 2 + 2
    with pytest.raises(ToolpathError, match="no cut is left"):
        job_without(job, mesh, whole, ((0, len(whole) - 1),))


def test_what_cannot_be_placed_is_left_out_round_by_round(dome):
    job, mesh, whole = dome
    middle = int(whole.starts[10:12].mean())
    first = mend_of(whole, None, outcome(job, whole, refused((middle - 1, middle + 1))), 0.04)
    assert first is not None
    (a, b), *rest = first.left_out
    assert not rest
    assert a <= middle - 2
    assert b >= middle + 2
    assert "tool body touches the part" in str(first)
    assert 0.5e-3 <= first.length <= 15e-3
    # The next run numbers its waypoints anew; both are named in those of the job's toolpath.
    part = job_without(job, mesh, whole, first.left_out)
    then = int(whole.starts[30:32].mean())
    at = int(np.linalg.norm(part.tilt_centres - whole.tilt_centres[then], axis=1).argmin())
    second = mend_of(whole, first, outcome(job, part, refused((at, at))), 0.04)
    assert second is not None
    assert second.left_out[0] == (a, b)
    assert second.left_out[1][0] < then < second.left_out[1][1]
    assert second.length > first.length


def test_where_much_would_be_left_out_or_the_cause_is_another_nothing_is(dome):
    job, _, whole = dome
    assert mend_of(whole, None, outcome(job, whole, refused((100, 600))), 0.004) is None
    assert mend_of(whole, None, outcome(job, whole, refused((100, 600))), 0.05) is None
    assert mend_of(whole, None, outcome(job, whole, Refusal("timing", "cannot")), 0.004) is None
    left = Certificate("surface left on the region", False, 0.3, 0.1, "%", Place(1.0, 1000, 3), "")
    assert mend_of(whole, None, outcome(job, whole, Refusal("verdict", "fails"), [left]), 0.004) is None


@pytest.mark.parametrize(
    ("claim", "way"), [("lowest feed", "law"), ("toolpath covered", "closer"), ("leg jerks", "gentler")]
)
def test_a_slow_program_or_one_that_is_off_is_made_again_in_a_better_way_once(dome, claim, way):
    job, _, whole = dome
    bad = Certificate(claim, False, 61.0, 90.0, "", Place(1.0, 1000, 3), "")
    failed = outcome(job, whole, Refusal("verdict", "fails"), [bad])
    found = mend_of(whole, None, failed, 0.004)
    assert found is not None
    ways = {name for name in ("law", "closer", "gentler") if getattr(found, name)}
    assert (ways, found.left_out) == ({way}, ())
    assert claim in str(found)
    assert mend_of(whole, found, failed, 0.004) is None


def test_a_link_that_cannot_be_done_takes_the_ends_of_the_cuts_beside_it(dome):
    job, _, whole = dome
    links = np.flatnonzero(~cutting_intervals(whole))
    middle = links[(links > 100) & (links < 500)]
    middle = int(middle[len(middle) // 2])
    found = mend_of(whole, None, outcome(job, whole, refused((middle, middle))), 0.05)
    assert found is not None
    assert len(found.left_out) == 2
    assert found.left_out[0][1] <= middle + 1 <= found.left_out[1][0] + 1


def test_no_cut_may_be_left_out_where_nothing_judges_what_is_left(dome):
    job = dome[0]
    assert most_left_out(job) == pytest.approx(4.0 * job.tolerance.left_share)
    wide = Job.from_dict({**TABLES, "tolerance": {"left_share": 1.0}}, job.mesh_path.parent)
    assert most_left_out(wide) == 0.05
    lines = {**TABLES, "toolpath": {"strategy": "edges"}}
    assert most_left_out(Job.from_dict(lines, job.mesh_path.parent)) == 0.0


def test_advice_gets_how_much_more_than_a_run_leaves_out_by_itself_is_out_of_limits(dome):
    job, _, whole = dome
    few = outcome(job, whole, refused((120, 130)))
    share = mend_of(whole, None, few, 1.0).share
    assert most_left_out(job) < share < 0.05
    assert more_left_out(job, whole, few, 0.05) == share
    assert more_left_out(job, whole, few, 0.9 * share) is None
    tolerant = Job.from_dict({**TABLES, "tolerance": {"left_share": share}}, job.mesh_path.parent)
    assert more_left_out(tolerant, whole, few, 0.05) == most_left_out(tolerant)  # that was left out, and did not help
    assert more_left_out(tolerant, whole, few, 0.9 * most_left_out(tolerant)) is None
    lines = {**TABLES, "toolpath": {"strategy": "edges"}}
    assert more_left_out(Job.from_dict(lines, job.mesh_path.parent), whole, few, 0.05) is None
    assert more_left_out(job, whole, replace(few, stages=few.stages[:1]), 0.05) is None


def test_a_program_that_says_it_leaves_out_much_is_refused(dome, tmp_path):
    job, mesh, whole = dome
    program, _ = motion(0.1)
    for stretches, most in (((0, len(whole) - 1),), 0.05), (STRETCHES, 0.0):
        source = replace(program.provenance, left_out=stretches)
        file = write_csv(replace(program, provenance=source), tmp_path / "program.csv")
        with pytest.raises(ProgramError, match="leaves out more cuts than it may"):
            program_toolpath(job, mesh, file, most=most)
    assert len(program_toolpath(job, mesh, file, most=0.05)) != len(whole)


def test_a_mend_after_which_too_much_is_left_is_told_and_may_be_advised(dome, tmp_path, monkeypatch):
    """The first placement is refused for some waypoints, as above; what is left after the mend is found to be 0.3 %."""
    job, *_ = dome

    def program(self, file):
        if self.left_out:
            write_csv(short, file)
            return short
        return self.runner.run("placement", lambda: refused((123, 125)))

    short = motion()[0]
    left = Certificate(SURFACE_LEFT, False, 0.3, 0.1, "%", Place(), "")
    monkeypatch.setattr(task.Task, "program", program)
    monkeypatch.setattr(attempt, "judged", lambda *_, **__: Verdict((left,)))
    told = []
    done = run(job, tmp_path / "out", writers={"told": lambda _, path: told.append(path.touch())}, advice=None)
    assert len(told) == 1  # of the run, not of each attempt
    assert done.refusal.stage == "placement"
    assert done.find(FailedMend) == FailedMend(0.3)
    (said,) = (stage.remark for stage in done.stages if isinstance(stage.value, FailedMend))
    assert "are left out, because they cannot be done: tool body touches the part. It failed, too: verdict" in said
    assert not (tmp_path / "out" / "program.csv").exists()


@pytest.mark.parametrize("programmed", [True, False])
def test_advice_may_leave_out_more_where_no_program_left_out_the_few_places(dome, tmp_path, monkeypatch, programmed):
    """As above; or what is kept is refused for hundreds of other waypoints."""
    job, *_ = dome
    asked, short = [], motion()[0]

    def program(self, file):
        if self.left_out and programmed:
            write_csv(short, file)
            return short
        return self.runner.run("placement", lambda: refused((200, 900) if self.left_out else (123, 125)))

    def advised(*_, leaves, **__):
        asked.append(leaves)
        return SimpleNamespace(advice=(), sentence="nothing was found")

    left = Certificate(SURFACE_LEFT, False, 0.3, 0.1, "%", Place(), "")
    monkeypatch.setattr(task.Task, "program", program)
    monkeypatch.setattr(attempt, "judged", lambda *_, **__: Verdict((left,)))
    monkeypatch.setattr(stages, "advised", advised)
    assert run(job, tmp_path / "out").refusal.stage == "placement"
    assert asked == [None if programmed else most_left_out(job)]


def test_a_plan_for_advice_that_may_leave_more_goes_on_from_the_run(dome, tmp_path, monkeypatch):
    """What it makes first is known to have no placement; then it is as a run of that job, and leaves no files."""
    job, *_ = dome
    planned, ended, short = [], [], motion()[0]
    more = job.with_(tolerance={"left_share": 0.0125})

    def program(self, file):
        planned.append(self.left_out)
        if len(self.left_out) < 3:
            return self.runner.run("placement", lambda: refused((900, 910) if self.left_out else (123, 125)))
        write_csv(short, file)
        return short

    def judged(_, specification, **__):
        of_more = specification.job_digest == more.digest and specification.cutting.coverage.share == 0.0125
        return Verdict((Certificate("all", of_more, 0.0, 0.1, "", Place(), ""),))

    def advised(*search, **_):
        ended.append(search[4](more, silent))
        return SimpleNamespace(advice=(), sentence="nothing was found")

    monkeypatch.setattr(task.Task, "program", program)
    monkeypatch.setattr(attempt, "judged", judged)
    monkeypatch.setattr(stages, "advised", advised)
    assert run(job, tmp_path / "out").refusal.stage == "placement"
    assert not (tmp_path / "out" / "program.csv").exists()
    assert [each.stage for each in ended] == [None]
    assert [len(left_out) for left_out in planned] == [0, 2, 3]
    found = list(planned)
    planned.clear()
    assert run(more, tmp_path / "more").passed
    assert planned == found


@pytest.mark.slow
def test_a_run_that_went_back_passes_and_its_program_names_what_it_leaves_out(dome, tmp_path, monkeypatch):
    """The first placement is refused for three waypoints, as if the tool touched something there."""
    job, mesh, whole = dome
    job = Job.from_dict({**TABLES, "tolerance": {"left_share": 0.01}}, job.mesh_path.parent)
    real, calls = task.Task.program, []

    def once(self, file):
        calls.append(self.left_out)
        if self.left_out:
            return real(self, file)
        refusal = refused((123, 125))
        self.runner.run("placement", lambda: refusal)
        return refusal

    monkeypatch.setattr(task.Task, "program", once)
    done = run(job, tmp_path / "out", advice=None)
    assert done.passed
    assert calls[0] == ()
    assert any(stage.name == "mended" and "second attempt" in stage.remark for stage in done.stages)
    program = tmp_path / "out" / "program.csv"
    assert f"left_out = {[list(stretch) for stretch in calls[1]]}" in program.read_text()[:4000]
    again = program_toolpath(job, mesh, program)
    assert np.array_equal(cut_centres(again), cut_centres(job_without(job, mesh, whole, calls[1])))
