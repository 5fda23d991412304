"""Trials for programs that fail their verdict: what is left is estimated, what gouges is left out."""

from __future__ import annotations

import pytest

from pentapod.job import Job
from pentapod.job.advice.failed_claims import FailedClaims
from pentapod.job.advice.options import AdviceOptions
from pentapod.job.build.toolpath import job_toolpath
from pentapod.job.build.values import job_machine, job_mesh
from pentapod.verify.claims import gouge, slowness
from pentapod.verify.surface import surface_left
from pentapod.verify.verdict.verdict import Certificate, Place
from refused_jobs import REFUSED


def trials(folder, name, claim, value=None, **options):
    return trials_of(Job.load(REFUSED[name].write(folder)), claim, value, **options)


def trials_of(job, claim, value=None, also=(), left=None, **options):
    machine, mesh, told = job_machine(job), job_mesh(job), []
    failed = {each.name: Certificate(each.name, False, value, 0.1, "%", Place(), "") for each in (claim, *also)}
    path, _ = job_toolpath(job, mesh, machine=machine)
    given = AdviceOptions(surface_points=4000, **options)
    return job, list(FailedClaims(job, machine, mesh, path, failed, given, told.append, left).all()), told


def test_nearer_passes_are_those_that_leave_as_little_as_was_asked(tmp_path):
    """Passes 3 mm apart leave 0.40 mm under a ball of 6 mm, 2.1 mm 0.19, 1.5 mm 0.10; 0.2 mm may be left."""
    job, found, told = trials(tmp_path, "passes too far apart", surface_left.CLAIMS[0], 40.0, nearer=(0.9, 0.5))
    assert told[:2] == ["passes nearer together", "passes nearer together"]
    assert next(trial.changes["toolpath"]["stepover_mm"] for trial in found if "toolpath" in trial.changes) == 1.5
    assert all("tolerance" not in trial.changes for trial in found)
    assert found[0].kept == 1.0
    job.with_(**found[0].changes)


@pytest.mark.parametrize(
    ("cleared", "shares"), [((0.31, 0.6, 1.0), [0.7, 0.5, 0.3]), ((0.45, 1.0), [0.7, 0.5, 0.3]), ((0.25, 1.0), [0.7])]
)
def test_passes_come_nearer_only_as_long_as_the_nearest_may_clear_all(cleared, shares, tmp_path, monkeypatch):
    """Passes of the job clear these shares of parts of the region, nearer ones more, in proportion."""

    def left(_, changes, *__):
        share = changes.get("toolpath", {}).get("stepover_mm", 3.0) / 3.0
        if "tool" not in changes:
            tried.append(share)
        return sum(max(1.0 - each / share, 0.0) for each in cleared) / len(cleared)

    tried: list[float] = []
    monkeypatch.setattr(FailedClaims, "_left", left)
    _, found, told = trials(tmp_path, "passes too far apart", surface_left.CLAIMS[0], 40.0)
    assert [each for each in dict.fromkeys(tried) if each < 1.0] == pytest.approx(shares)
    assert any("stepover_mm" in each.changes.get("toolpath", {}) for each in found) == (min(cleared) > min(shares))
    assert told.count("a smaller cutter") == 1


@pytest.mark.slow
def test_what_a_run_of_an_end_has_tried_by_itself_is_not_tried_again(tmp_path):
    job = Job.load(REFUSED["passes too far apart"].write(tmp_path))
    flat = job.with_(tool={"type": "flat"}, axis={"mode": "fixed", "direction": [0.0, 0.0, 1.0], "tilt_deg": 0.0})
    _, found, _ = trials_of(flat, surface_left.CLAIMS[0], 5.0)
    assert all("stepover_mm" not in each.changes.get("toolpath", {}) for each in found)
    _, found, _ = trials_of(flat, surface_left.CLAIMS[0], 5.0, nearer=(0.5, 0.2))
    (apart,) = {each.changes["toolpath"]["stepover_mm"] for each in found if "toolpath" in each.changes}
    assert apart == pytest.approx(0.2 * flat.toolpath.stepover_mm, rel=0.01)


@pytest.mark.slow
def test_the_bound_that_follows_from_the_passes_stays(tmp_path):
    """Else less would be asked of nearer passes, and they would fail again."""
    job = Job.load(REFUSED["passes too far apart"].write(tmp_path)).with_(tolerance={"left_mm": None})
    ridge = 3.0 - (9.0 - 1.5**2) ** 0.5
    _, found, _ = trials_of(job, surface_left.CLAIMS[0], 5.0)
    (bound,) = {trial.changes["tolerance"]["left_mm"] for trial in found if "toolpath" in trial.changes}
    assert bound == pytest.approx(1.25 * ridge + 0.05 + 0.1, rel=0.01)


def test_gouges_that_were_only_reported_are_left_out(tmp_path):
    _, (trial,), _ = trials(tmp_path, "gouges only reported", gouge.CLAIMS[0], 0.3)
    assert trial.changes == {"gouge": {"remedy": ["drop"]}}
    assert 0.0 < trial.kept < 1.0


def test_a_feed_that_is_not_reached_is_lowered(tmp_path):
    job, (trial,), _ = trials(tmp_path, "too far", slowness.CLAIMS[0], 0.5)
    assert trial.changes == {"feed": {"cut_mm_min": 0.6 * job.feed.cut_mm_min}}


@pytest.mark.parametrize("percent", [0.11, 0.19034, 1.6])
def test_a_little_that_is_left_may_stay(tmp_path, percent):
    """The share is a little more than was found, and what is asked for besides stays as it is."""
    _, found, _ = trials(tmp_path, "passes too far apart", surface_left.CLAIMS[0], percent, nearer=(), thinner=0.99)
    (trial,) = (each for each in found if "left_share" in each.changes.get("tolerance", {}))
    share = trial.changes["tolerance"]["left_share"]
    assert 1.1 * percent < 100.0 * share < 1.4 * percent
    assert trial.changes == {"tolerance": {"left_share": share}}
    assert trial.kept == 1.0 - share
    assert trial.words.startswith("at most ")


@pytest.mark.parametrize(("percent", "long", "first"), [(0.4, 10**6, True), (1.5, 10**6, False), (1.5, 100, True)])
def test_what_is_left_comes_first_where_it_is_very_little_or_other_plans_take_long(percent, long, first, tmp_path):
    _, found, _ = trials(tmp_path, "passes too far apart", surface_left.CLAIMS[0], percent, nearer=(0.3,), long=long)
    stays = ["left_share" in each.changes.get("tolerance", {}) for each in found]
    assert sum(stays) == 1
    assert len(found) > 1
    assert stays[0] == first


@pytest.mark.parametrize(("claim", "percent"), [(surface_left.CLAIMS[0], 13.0), (slowness.CLAIMS[0], 0.5)])
def test_a_little_that_another_way_leaves_may_stay(tmp_path, claim, percent):
    """Where the run does the job in this way again, its program passes then."""
    given = {"nearer": (), "thinner": 0.99, "left": 0.1415}
    _, found, _ = trials(tmp_path, "passes too far apart", claim, percent, **given)
    shares = [
        each.changes["tolerance"]["left_share"] for each in found if "left_share" in each.changes.get("tolerance", {})
    ]
    assert shares == [0.0017]


@pytest.mark.parametrize(("own", "other", "share"), [(0.2037, 0.1709, 0.0025), (5.0, 0.5, 0.006)])
def test_what_may_stay_is_what_the_program_leaves_unless_another_way_leaves_much_less(tmp_path, own, other, share):
    job = Job.load(REFUSED["passes too far apart"].write(tmp_path))
    _, found, _ = trials_of(job, surface_left.CLAIMS[0], own, left=other, nearer=(), thinner=0.99)
    bounds = [each.changes.get("tolerance", {}) for each in found]
    shares = [each["left_share"] for each in bounds if "left_share" in each]
    assert shares == [share]


@pytest.mark.parametrize(("percent", "also"), [(1.7, ()), (0.2, slowness.CLAIMS)])
def test_much_that_is_left_may_not_stay_nor_a_little_beside_other_faults(tmp_path, percent, also):
    name, given = "passes too far apart", {"nearer": (), "thinner": 0.99}
    _, found, _ = trials(tmp_path, name, surface_left.CLAIMS[0], percent, also=also, **given)
    assert all("left_share" not in each.changes.get("tolerance", {}) for each in found)
