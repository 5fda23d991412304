"""Advice for refused jobs: what is printed was planned, and passes when it is put into the job."""

from __future__ import annotations

import html
import json
import signal
import tomllib
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from pentapod.base.errors import JobError
from pentapod.base.progress import silent
from pentapod.base.refusal import Advice, Change, Shortfall
from pentapod.cli.main import run as run_cli
from pentapod.geometry.rigid import RigidTransform
from pentapod.job import AdviceOptions, Job, advise, run
from pentapod.job.advice.options import Tried
from pentapod.job.advice.parts import Regions
from pentapod.job.advice.search import Advised, advised
from pentapod.job.advice.settings import Settings
from pentapod.job.build.tool import job_tool
from pentapod.job.build.toolpath import job_toolpath
from pentapod.job.build.values import job_machine, job_mesh
from pentapod.job.pipeline.advice_on_errors import can_help
from pentapod.job.pipeline.attempt import Attempt
from pentapod.job.pipeline.run import tried
from pentapod.verify.surface.surface_left import SURFACE_LEFT
from pentapod.verify.verdict.verdict import Certificate, Place
from refused_jobs import REFUSED

TOO_FAR = ("position_mm = [", "position_mm = [1000.0, 0, 700] # [")
FIXED = ("mode", "position_mm", "rotation_deg")
METRES = ('unit = "mm"', 'unit = "m"')


def pasted(job, advice: Advice) -> Job:
    """The job with the TOML of an advice put into its tables, and what it says to take out left out."""
    content = tomllib.loads(job.read_text(encoding="utf-8"))
    for table, keys in tomllib.loads(advice.toml).items():
        content.setdefault(table, {}).update(keys)
    table = ""
    for line in advice.toml.splitlines():
        table = line.strip("[]") if line.startswith("[") else table
        if line.startswith("# take out "):
            del content[table][line.removeprefix("# take out ")]
    return Job.from_dict(content, job.parent)


def test_a_refusal_holds_advice_that_passes(make_job, tmp_path, capsys):
    job, out = make_job(TOO_FAR), tmp_path / "out"
    assert run_cli(["plan", str(job), "-o", str(out)]) == 1
    said = capsys.readouterr().err
    (written,) = json.loads((out / "verdict.json").read_text())["refusal"]["advice"]
    assert written["kept"] == 1.0
    assert written["toml"] in said
    assert "keeps all of the area" in said
    assert written["toml"] in html.unescape((out / "report.html").read_text())
    changes = tuple(
        Change(table, key, value) for table, keys in written["changes"].items() for key, value in keys.items()
    )
    advice = Advice(changes, written["words"], written["kept"], written["whole"])
    assert run(pasted(job, advice), tmp_path / "again", advice=None).passed


def test_an_error_about_the_size_is_followed_by_advice_where_it_is_asked_for(make_job, tmp_path, capsys):
    job = make_job(
        METRES, ('mode = "fixed"', 'mode = "free" #'), ("position_mm", "# position_mm"), ("rotation", "# rotation")
    )
    assert run_cli(["plan", str(job), "-o", str(tmp_path / "out"), "--json"]) == 2
    said = capsys.readouterr()
    assert said.err.startswith("error: ")
    assert 'unit = "mm"' in said.err
    assert said.out == ""  # the message says what to change: nobody waits for a search
    assert run_cli(["plan", str(job), "-o", str(tmp_path / "out"), "--json", "--advice", "1"]) == 2
    said = capsys.readouterr()
    (found,) = json.loads(said.out)["advice"]
    assert found["changes"]["part"] == {"unit": "mm"}
    assert not (tmp_path / "out").exists()


def test_no_search_where_none_is_wanted(make_job, tmp_path):
    outcome = run(Job.load(make_job(TOO_FAR)), tmp_path / "out", advice=None)
    assert outcome.refusal.advice == ()
    assert outcome.refusal.remedy == ""
    assert "advice" not in {stage.name for stage in outcome.stages}


def searched(folder, name, planned, progress=silent, **options) -> Advised:
    job = Job.load(REFUSED[name].write(folder))
    given = (job, job_machine(job), job_mesh(job), None, planned, AdviceOptions(**options))
    return advised(*given, progress)


def test_the_best_that_passes_comes_first_and_what_fails_is_no_advice(tmp_path):
    planned: list[Job] = []

    def plan(job: Job, _) -> Tried:
        planned.append(job)
        return Tried(None, 0.3) if len(planned) > 2 else Tried("placement")

    found = searched(tmp_path, "table too low", plan, points=32, plans=4, wanted=3)
    assert len(planned) == 4
    assert [each.margin for each in found.advice] == [0.3, 0.3]
    assert 300.0 < planned[0].placement.table_z_mm < 600.0
    assert planned[0].axis == Job.load(tmp_path / "job.toml").axis
    (table, keys), *_ = found.advice[0].tables.items()
    assert all(getattr(getattr(planned[2].tables, table), key) == value for key, value in keys.items())
    assert found.advice[0].kept >= found.advice[1].kept
    assert found.sentence.startswith("It can be done with: ")


def test_where_the_tool_body_touches_an_upright_tool_comes_first(make_job):
    job = Job.load(make_job())
    machine, mesh = job_machine(job), job_mesh(job)
    toolpath = job_toolpath(job, mesh, machine=machine)[0]
    touch = [Shortfall("tool body touches the part", ((3, 5),), 0.3, "mm")]
    for under in (None, 0.0):
        job = job.with_(toolpath={"under_mm": under})
        given = (job, machine, mesh, toolpath, lambda *_: Tried(None), AdviceOptions(plans=1), lambda *_: None)
        found = advised(*given, short=touch).advice
        upright = [each for each in found if each.toml == "[toolpath]\nunder_mm = 0.0"]
        assert [each.kept for each in upright] == pytest.approx([1.0] if under is None else [])


LEFT_ALONE = frozenset((SURFACE_LEFT,))


@pytest.fixture
def all_fits(monkeypatch):
    """By estimate every setting fits."""

    def estimated(_, kinds, *__, **___):
        return SimpleNamespace(
            margin=0.2, shortfalls=(), samples=kinds[0], candidate=SimpleNamespace(transform=RigidTransform.identity())
        )

    monkeypatch.setattr(Settings, "_best", estimated)
    monkeypatch.setattr(Settings, "beyond_a_single_place", lambda _: ())


@pytest.mark.usefixtures("all_fits")
@pytest.mark.parametrize("known", [frozenset(), LEFT_ALONE], ids=["first plan tells", "run tells"])
def test_axes_that_leave_too_much_are_not_tried_at_other_places(known, tmp_path):
    """Wherever the part is, they leave it: other axes are tried, and less of the surface."""

    def plan(job: Job, _) -> Tried:
        planned.append(job)
        return Tried("placement", failed=LEFT_ALONE)

    planned: list[Job] = []
    job = Job.load(REFUSED["table too low"].write(tmp_path))
    options = AdviceOptions(plans=5, replans=3)
    advised(job, job_machine(job), job_mesh(job), None, plan, options, silent, otherwise=known)
    assert len(planned) == (3 if known else 5)
    same = [each for each in planned if each.axis == job.axis and each.part == job.part]
    assert len(same) == (0 if known else 1)
    axes = [each.axis for each in planned if each.part == job.part and each.tool == job.tool]
    assert len(axes) == len({str(axis) for axis in axes})


@pytest.mark.usefixtures("all_fits")
@pytest.mark.parametrize("least", [3.0, 9.0])
def test_what_a_plan_leaves_may_stay_where_nothing_else_passes(least, tmp_path):
    """Of plans that fail in that alone, the one that keeps most is made again, once all others have failed."""

    def plan(job: Job, progress) -> Tried:
        planned.append(job)
        progress("placement", 0.5)
        return Tried(None if job.tolerance.left_share > 0.001 else "placement", 0.1, LEFT_ALONE, (), left[len(planned)])

    def told(_stage: str, share: float, note: str = "") -> None:
        assert 0.0 <= share <= 1.0
        notes.append(note)

    planned: list[Job] = []
    notes: list[str] = []
    left = [0.0, 40.0, least + 1.0, least, 20.0, least]
    job = Job.load(REFUSED["table too low"].write(tmp_path)).with_(tolerance={"left_share": 0.001})
    found = advised(job, job_machine(job), job_mesh(job), None, plan, AdviceOptions(plans=4), told)
    if least == 9.0:  # a tenth of the region is too much to stay
        assert not found.advice
        assert len(planned) == 4
    else:
        (advice,) = found.advice
        assert advice.kept == pytest.approx(0.964)
        assert "at most 3.6 % of the region stays" in str(advice)
        assert [each.tolerance.left_share for each in planned] == [0.001] * 4 + [0.036]
        assert planned[4].with_(tolerance={"left_share": 0.001}).tables == planned[2].tables
        assert any(note.startswith("plan 5 of at most 5: ") for note in notes)


@pytest.mark.usefixtures("all_fits")
@pytest.mark.parametrize(("leaves", "share"), [(0.009, 0.011), (None, None)])
def test_that_the_few_places_out_of_limits_are_left_out_is_planned_first_and_besides_all_else(leaves, share, tmp_path):
    def plan(job: Job, _) -> Tried:
        planned.append(job)
        return Tried("placement")

    planned: list[Job] = []
    job = Job.load(REFUSED["dome of 60 deg, no cone"].write(tmp_path))
    machine, mesh = job_machine(job), job_mesh(job)
    toolpath = job_toolpath(job, mesh, machine=machine)[0]
    short = [Shortfall("leg 1 too long", ((0, 1),), 1.0, "mm")]
    advised(job, machine, mesh, toolpath, plan, AdviceOptions(plans=2), silent, short=short, leaves=leaves)
    own = job.tolerance.left_share
    assert [each.tolerance.left_share for each in planned] == [own if share is None else share, own, own][
        : 2 + bool(share)
    ]


@pytest.mark.usefixtures("all_fits")
@pytest.mark.parametrize("claim", [SURFACE_LEFT, "tip deviation"])
def test_where_its_program_leaves_too_much_set_ups_and_other_tool_lengths_are_not_tried(claim, tmp_path):
    """They leave as much; where another claim fails, they are tried."""

    def plan(job: Job, _) -> Tried:
        planned.append(job)
        return Tried("verdict", failed=frozenset((claim,)))

    planned: list[Job] = []
    job = Job.load(REFUSED["dome of 60 deg, no cone"].write(tmp_path))
    machine, mesh = job_machine(job), job_mesh(job)
    toolpath = job_toolpath(job, mesh, machine=machine)[0]
    failed = {claim: Certificate(claim, False, 13.0, 0.1, "%", Place(), "")}
    options = AdviceOptions(plans=12, replans=12, nearer=(), thinner=0.99, surface_points=2000)
    advised(job, machine, mesh, toolpath, plan, options, silent, failed=failed)
    lengths = {each.tool.length_mm for each in planned if each.part == job.part} - {job.tool.length_mm}
    assert bool(lengths) == (claim != SURFACE_LEFT)


@pytest.mark.usefixtures("all_fits")
@pytest.mark.parametrize(("percent", "share"), [(3.0, 0.036), (8.5, None)])
def test_more_than_a_little_that_is_left_may_stay_where_nothing_else_was_found(percent, share, tmp_path):
    """It keeps most of the area; it costs no plan, and is not one of those that may be made."""

    def plan(job: Job, _) -> Tried:
        planned.append(job.tolerance.left_share)
        passes = share is not None and job.tolerance.left_share == share
        return Tried(None if passes else "verdict", failed=frozenset((SURFACE_LEFT,)))

    planned: list[float] = []
    job = Job.load(REFUSED["dome of 60 deg, no cone"].write(tmp_path))
    machine, mesh = job_machine(job), job_mesh(job)
    toolpath = job_toolpath(job, mesh, machine=machine)[0]
    failed = {SURFACE_LEFT: Certificate(SURFACE_LEFT, False, percent, 0.1, "%", Place(), "")}
    options = AdviceOptions(nearer=(), thinner=0.99, surface_points=2000)
    found = advised(job, machine, mesh, toolpath, plan, options, silent, failed=failed)
    if share is None:
        assert not found.advice
        assert set(planned) == {job.tolerance.left_share}
    else:
        (advice,) = found.advice
        assert advice.kept == pytest.approx(1.0 - share)
        assert planned[-1] == share
        assert len(planned) <= options.replans + 1


@pytest.mark.usefixtures("all_fits")
@pytest.mark.parametrize(("failed", "there"), [("component kept", 1), ("tip deviation", 2)])
def test_another_place_is_tried_next_where_a_program_is_near_a_singular_surface(failed, there, tmp_path):
    """Other tool axes hardly help there; for other claims a second one is tried at the same place."""

    def plan(job: Job, _) -> Tried:
        planned.append(job)
        return Tried("verdict", failed=frozenset((failed,)))

    planned: list[Job] = []
    job = Job.load(REFUSED["table too low"].write(tmp_path))
    advised(job, job_machine(job), job_mesh(job), None, plan, AdviceOptions(plans=4), silent)
    assert [each.placement == job.placement for each in planned].index(False) == there


@pytest.mark.parametrize(
    ("stage", "limit", "split"),
    [
        ("placement", "leg 1 too short", True),
        ("verdict", "leg 1 too short", False),
        ("placement", "spindle touches the part", False),
    ],
)
def test_a_program_that_fails_is_not_split_into_setups(stage, limit, split, tmp_path, monkeypatch):
    """What has a place in one set-up is planned in one, and fails again; what fits by a hair is planned before less.

    Where the spindle touches the part it does so in every set-up: less of the part is planned before.
    """

    def estimated(_, kinds, *__, **___):
        one = bool((kinds[0].nominal == kinds[0].nominal[0]).all())
        margin = 0.047 if one else 0.02 if len(kinds) > 1 else -1.0
        return SimpleNamespace(
            margin=margin, shortfalls=(), samples=kinds[0], candidate=SimpleNamespace(transform=None)
        )

    def plan(job: Job, _) -> Tried:
        planned.append(job)
        return Tried(stage)

    monkeypatch.setattr(Settings, "_best", estimated)
    monkeypatch.setattr(Settings, "beyond_a_single_place", lambda _: ())
    planned: list[Job] = []
    job = Job.load(REFUSED["dome of 60 deg, no cone"].write(tmp_path))
    machine, mesh = job_machine(job), job_mesh(job)
    toolpath = job_toolpath(job, mesh, machine=machine)[0]
    short = [Shortfall(limit, ((0, 1),), 1.0, "mm")]
    advised(job, machine, mesh, toolpath, plan, AdviceOptions(plans=4), lambda *_: None, short=short)
    assert [each.axis.mode for each in planned[:2]] == ["fixed", "auto"]
    assert {(each.part.region_box_mm, each.placement.setups) for each in planned[:2]} == {(None, 1)}
    assert any(each.placement.setups > 1 for each in planned) == split


@pytest.mark.usefixtures("all_fits")
@pytest.mark.parametrize("otherwise", [frozenset(), frozenset(("spindle touches the part",))])
@pytest.mark.parametrize("limit", ["spindle", "tool body", "leg 1"])
def test_what_is_higher_than_where_the_spindle_touches_the_part_is_planned(limit, otherwise, tmp_path):
    """First where an upright tool has failed as well, else after what keeps all."""

    def plan(job: Job, _) -> Tried:
        planned.append(job)
        return Tried("placement")

    planned: list[Job] = []
    job = Job.load(REFUSED["dome of 75 deg"].write(tmp_path))
    machine, mesh = job_machine(job), job_mesh(job)
    toolpath = job_toolpath(job, mesh, machine=machine)[0]
    heights = 1e3 * toolpath.tips[:, 2]
    bad = np.flatnonzero(heights < np.quantile(heights, 0.4))
    short = [Shortfall(f"{limit} touches the part", tuple((k, k) for k in bad.tolist()), 1.0, "mm")]
    options = AdviceOptions(plans=8, replans=8)
    advised(job, machine, mesh, toolpath, plan, options, silent, short=short, otherwise=otherwise)
    cuts = [None if each.part.region_box_mm is None else each.part.region_box_mm[0][2] for each in planned]
    first, last = (float(np.quantile(heights[bad], share)) + 0.5 for share in (options.nearly_all, 1.0))
    if limit == "leg 1":
        assert all(cut is None or abs(cut - last) > 0.1 for cut in cuts)
    else:
        at = cuts.index(pytest.approx(first, abs=0.06))
        assert cuts[at + 1] == pytest.approx(last, abs=0.06)
        assert all(cut is None for cut in cuts[:at])
        assert (at <= (limit == "tool body")) == bool(otherwise)  # an upright tool is tried before


@pytest.mark.usefixtures("all_fits")
@pytest.mark.parametrize("leans", [True, False])
def test_where_the_tool_touches_the_part_in_a_trial_what_is_higher_comes_next(leans, tmp_path):
    """With the axes and the placement of that trial. Axes that may not lean are not tried in another place."""

    def plan(job: Job, _) -> Tried:
        planned.append(job)
        return Tried("placement", meets=(0.0195,))

    planned: list[Job] = []
    job = Job.load(REFUSED["dome of 75 deg"].write(tmp_path)).with_(placement={"mode": "table", "table_z_mm": 400.0})
    job = job if leans else job.with_(tool={"type": "bull", "corner_mm": 1.0}, axis={"tilt_deg": None})
    machine, mesh = job_machine(job), job_mesh(job)
    toolpath = job_toolpath(job, mesh, machine=machine)[0]
    short = [Shortfall("leg 1 too long", ((0, 1),), 1.0, "mm")]
    advised(job, machine, mesh, toolpath, plan, AdviceOptions(plans=8), silent, short=short)
    same = [each for each in planned if (each.tool, each.placement.setups) == (job.tool, 1)]
    whole = [each for each in same if each.part == job.part]
    fixed = [each.placement.mode for each in whole if each.axis.mode == "fixed"]
    assert fixed == (["table", "free"] if leans else ["table"])
    for each in whole:
        after = planned[planned.index(each) + 1]
        assert after.part.region_box_mm[0][2] == pytest.approx(20.0, abs=0.06)
        assert (after.axis, after.placement) == (each.axis, each.placement)


@pytest.mark.parametrize("direction", ["+x", "-x", "+z", "-z"])
def test_higher_is_along_the_direction_of_the_region(direction, tmp_path):
    """Of a block of 50 x 40 x 15 mm from a side, what is seen 5 mm below its top."""
    side = {"x": [1.0, 0.0, 0.0], "z": [0.0, 0.0, 1.0]}[direction[1]]
    sign = 1.0 if direction[0] == "+" else -1.0
    shape = trimesh.creation.box((50.0, 40.0, 15.0))
    shape.export(tmp_path / "block.stl")
    job = Job.load(REFUSED["block along normals"].write(tmp_path))
    part = {"mesh": "block.stl", "region_direction": [sign * v for v in side], "region_angle_deg": 90.0}
    job = job.with_(part=part)
    mesh, tool = job_mesh(job), job_tool(job)
    regions = Regions.of(job, mesh, tool, None, AdviceOptions())
    deep = {"x": 50.0, "z": 15.0}[direction[1]]
    across = {"x": (40.0, 15.0), "z": (50.0, 40.0)}[direction[1]]
    found = regions.above(1e-3 * (0.5 * deep - 5.0))
    top, walls = across[0] * across[1], 2.0 * (across[0] + across[1])
    assert found.share == pytest.approx((top + 5.0 * walls) / (top + deep * walls), rel=1e-3)
    assert found.words == f"without the lowest {deep - 5.0:g} mm"
    assert regions.above(1e-3 * (0.5 * deep + 0.1)) is None
    assert regions.above(-1e-3 * (0.5 * deep + 0.1)) is None
    leaning = job.with_(part={"region_direction": [0.1 + v for v in part["region_direction"]]})
    assert Regions.of(leaning, mesh, tool, None, AdviceOptions()).above(0.0) is None


def test_a_tool_length_that_hardly_fits_is_planned_after_it_was_tried_with_other_axes(tmp_path, monkeypatch):
    def estimated(settings, kinds, *_, **__):
        one = bool((kinds[0].nominal == kinds[0].nominal[0]).all())
        margin = -0.1 if settings.machine.tool_length < 0.19 else 0.3 if one else 0.03
        return SimpleNamespace(
            margin=margin, shortfalls=(), samples=kinds[0], candidate=SimpleNamespace(transform=None)
        )

    def plan(job: Job, _) -> Tried:
        planned.append(job)
        return Tried("placement")

    monkeypatch.setattr(Settings, "_best", estimated)
    monkeypatch.setattr(Settings, "beyond_a_single_place", lambda _: ())
    planned: list[Job] = []
    job = Job.load(REFUSED["dome of 60 deg, no cone"].write(tmp_path)).with_(tool={"length_mm": 174.0})
    machine, mesh = job_machine(job), job_mesh(job)
    toolpath = job_toolpath(job, mesh, machine=machine)[0]
    advised(job, machine, mesh, toolpath, plan, AdviceOptions(plans=2), lambda *_: None)
    assert [each.tool.length_mm for each in planned] == [machine_length(job)] * 2
    assert [each.axis.mode for each in planned] == ["fixed", job.axis.mode]


def machine_length(job: Job) -> float:
    """The tool length, mm, of the job's machine file."""
    return 1e3 * job_machine(job.with_(tool={"length_mm": None})).tool_length


@pytest.mark.slow
def test_the_share_of_a_search_that_is_done_never_falls(tmp_path):
    """The time that is left is told from it; the plans end at the shares that they were given."""

    def plan(_, progress) -> Tried:
        for stage in ("mesh", "toolpath", "a stage of a plugin", "placement", "timing", "verify"):
            for fraction in (0.0, 0.5, 1.0):
                progress(stage, fraction)
        ends.append(shares[-1][0])
        return Tried("verify")

    ends: list[float] = []
    shares: list[tuple[float, str]] = []
    tell = lambda _, share, note: shares.append((share, note))  # noqa: E731
    searched(tmp_path, "table too low", plan, progress=tell, points=32, plans=3, wanted=3)
    done = [share for share, _ in shares]
    assert done == sorted(done)
    assert ends == pytest.approx([1 / 3, 2 / 3, 1.0][: len(ends)])
    assert len(ends) >= 2
    assert any("plan 2 of at most 3: " in note and note.endswith(": timing") for _, note in shares)


@pytest.mark.parametrize("kept", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_an_interruption_ends_the_search_and_keeps_what_was_found(tmp_path, kept):
    def plan(job: Job, _) -> Tried:
        planned.append(job)
        if len(planned) > kept:
            raise KeyboardInterrupt
        return Tried(None)

    planned: list[Job] = []
    found = searched(tmp_path, "table too low", plan, points=32, plans=4, wanted=3)
    assert found.interrupted
    assert len(planned) == kept + 1
    assert len(found.advice) == kept
    if not kept:
        assert found.sentence.startswith("The search was interrupted; tried until then: ")


def test_a_trial_whose_search_for_a_placement_is_interrupted_ends(tmp_path):
    """A plan would go on with the best placement so far."""
    notes: list[str] = []

    def progress(stage: str, fraction: float, note: str = "") -> None:
        notes.append(note)
        if "best margin so far" in note:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        tried(Job.load(REFUSED["too far"].write(tmp_path)).with_(placement=dict.fromkeys(FIXED)), progress)
    assert any(note.startswith("interrupted") for note in notes)


def test_a_trial_writes_none_of_the_files_of_a_run(tmp_path, monkeypatch):
    monkeypatch.setattr(Attempt, "write", lambda *_: pytest.fail("the files of a trial are for nobody"))
    assert tried(Job.load(REFUSED["too far"].write(tmp_path))).stage == "placement"


def test_nothing_that_works_is_told(tmp_path):
    tried = ("the planner chooses the placement", "a smaller part.scale")
    words = f"Tried, by estimate or plan: {'; '.join(tried)}: none works"
    assert Advised((), tried).sentence == words
    assert Advised((), tried, reasons=("legs touch",)).sentence == f"{words}. Legs touch"


def test_a_part_far_too_large_gets_a_box_within_reach(tmp_path):
    def plan(job: Job, _) -> Tried:
        planned.append(job)
        return Tried(None)

    planned: list[Job] = []
    found = searched(tmp_path, "plate of 3 x 2 m", plan, points=32, halvings=2)
    assert found.advice[0].words == "only what lies in a box"
    low, high = np.array(planned[0].part.region_box_mm)
    assert ((high - low)[:2] > 50.0).all()
    assert ((high - low)[:2] < 500.0).all()


def test_advice_in_toml():
    changes = (
        Change("axis", "mode", "fixed"),
        Change("axis", "direction", [0.0, 0.6, 0.8]),
        Change("axis", "tilt_deg", None),
        Change("part", "flip", True),
    )
    advice = Advice(changes, "one direction", 0.834)
    assert advice.toml.splitlines()[-3:] == ["# take out tilt_deg", "[part]", "flip = true"]
    assert tomllib.loads(advice.toml) == {
        "axis": {"mode": "fixed", "direction": [0.0, 0.6, 0.8]},
        "part": {"flip": True},
    }
    assert str(advice) == "one direction (keeps 83 % of the area)"
    assert "little to spare: its smallest margin is 0.024" in str(
        Advice(changes, "one direction", 0.834, margin=0.0241)
    )
    assert str(Advice(changes, "one direction", 0.834, margin=0.3)) == str(advice)
    assert str(Advice(changes, "smaller", 1.0, whole=False)) == "smaller (keeps all of the area, of another part)"


def test_errors_that_advice_can_help_with(make_job):
    assert can_help(JobError("too wide", key="part.unit"))
    assert not can_help(JobError("mistyped", key="part.unti"))
    with pytest.raises(JobError):
        advise(Job.load(make_job(("diameter_mm = 10", "diameter_mm = 10\nlength_mm = 5"))))
