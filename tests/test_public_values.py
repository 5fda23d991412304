"""Public values: a short repr, pickles, chains without isinstance, frames, notebooks and plots."""

from __future__ import annotations

import importlib
import inspect
import math
import pickle
import pkgutil
import sys
from collections.abc import Iterator
from dataclasses import fields, is_dataclass, replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest
from matplotlib import pyplot

import pentapod
from pentapod import (
    Certificate,
    Job,
    LegPath,
    NotJudged,
    PlacedPath,
    PlacementConstraints,
    Program,
    Refusal,
    RefusalError,
    RigidTransform,
    Segment,
    Toolpath,
    Trajectory,
    Verdict,
    leg_path,
    plan,
    retime,
    run,
    sample,
    write_csv,
)
from pentapod.base import InputError, Value
from pentapod.cli.commands.new import dome_stl
from pentapod.timing import explain
from pentapod.toolpath.formats import RotaryAxis
from pentapod.verify import Place, verify
from usual_job import job_text

PACKAGES = [f"pentapod.{m.name}" for m in pkgutil.iter_modules(pentapod.__path__)]
LIMITS = {"path_tolerance": 50e-6, "axis_tolerance": math.radians(0.5)}


@pytest.fixture(scope="module")
def reached(tmp_path_factory):
    """What the usual job reached."""
    folder = tmp_path_factory.mktemp("usual")
    (folder / "part.stl").write_bytes(dome_stl(cells=12))
    (folder / "job.toml").write_text(job_text(), encoding="utf-8")
    return run(Job.load(folder / "job.toml"), folder / "out")


def played(reached):
    """What a simulation of the program's beginning takes and gives, and what posts and links are told."""
    program = replace(reached.find(Program), legs=reached.find(Program).legs[:300])
    reference = pentapod.Reference(program, reached.machine)
    style = pentapod.LinkStyle(np.array([0.0, 0.0, 1.0]), 0.05, 1e-3, spacing=1e-3, feed=0.05)
    return reference, pentapod.simulate_servo(reference).unwrap(), pentapod.PostInput(program, reached.machine), style


def values_in(value: Any, seen: dict[int, Any]) -> Iterator[Value]:
    """Yield the values of pentapod in a value, itself included, each once."""
    if id(value) in seen:
        return
    seen[id(value)] = value
    if isinstance(value, tuple | list):
        for item in value:
            yield from values_in(item, seen)
    elif is_dataclass(value):
        if isinstance(value, Value):
            yield value
        for field in fields(value):
            yield from values_in(getattr(value, field.name), seen)


@pytest.fixture(scope="module")
def values(reached):
    """Values of every class that a planned job gives, and some by hand: one of each class, the first that is met."""
    part, tool = pentapod.load_mesh(reached.job.mesh_path, "mm"), pentapod.BallCutter(5e-3)
    coverage = pentapod.Coverage.of(part, tool, OPTIONS, path_tolerance=50e-6)
    bodies = pentapod.CollisionWorld.of(reached.machine, tool, part)
    by_hand = [*BY_HAND, *played(reached), coverage, bodies, pentapod.Cutting.of(part, tool, coverage=coverage)]
    found: dict[type, Value] = {}
    for value in values_in([reached, by_hand], {}):
        found.setdefault(type(value), value)
    return found


CURVES = [np.array([[0.0, 0.0], [0.01, 0.0], [0.01, 0.01]])]
OPTIONS = pentapod.RasterOptions(stepover=15e-3)
BY_HAND = [
    OPTIONS,
    pentapod.BallCutter(5e-3),
    pentapod.FlatEnd(5e-3),
    pentapod.BullNose(5e-3, 1e-3),
    pentapod.Lollipop(5e-3, 2e-3, 0.03, shank=(pentapod.Cone(0.02, 4e-3, 4e-3),)),
    pentapod.StandOff(0.1),
    pentapod.Orientation(),
    pentapod.GougeOptions(),
    PlacementConstraints.free(),
    pentapod.Weights(strokes=2.0),
    pentapod.Normal(),
    pentapod.Fixed((0.0, 0.0, 1.0)),
    pentapod.Pointed((0.0, 0.0, 0.1)),
    pentapod.Between(np.array([[0.0, 0, 0], [0.1, 0, 0]]), np.array([[0.0, 0, 1], [0, 1, 0]])),
    pentapod.CrossHatchOptions(stepover=3e-3),
    pentapod.WaterlineOptions(stepover=3e-3),
    pentapod.OffsetOptions(stepover=3e-3),
    pentapod.SpiralOptions(stepover=3e-3),
    pentapod.PencilOptions(),
    pentapod.RotaryAxes((RotaryAxis("C"),)),
    pentapod.EdgeOptions(),
    pentapod.CurveOptions(lines=CURVES),
    pentapod.DrawingOptions(file=Path(__file__).parents[1] / "toolpaths" / "flower.svg"),
    pentapod.TextOptions(text="pentapod"),
    pentapod.PolylineOptions(lines=[np.array([[0.0, 0, 0], [0.01, 0, 0]])]),
    pentapod.ImageOptions(darkness=np.ones((2, 2)), width=0.01, stepover=1e-3),
    pentapod.Region(),
    pentapod.Sweep(Path("sweep.toml"), (), (), ""),
    pentapod.Certificate("feed", False, 1.0, 2.0, "mm/s", Place(1.0, 2, 3), "measured"),
    NotJudged("gouge", "nobody said"),
    Refusal("placement", "it does not fit", remedy="a smaller part"),
]


def test_every_exported_dataclass_is_a_value():
    for package in PACKAGES:
        module = importlib.import_module(package)
        for name in getattr(module, "__all__", ()):
            thing = getattr(module, name)
            if inspect.isclass(thing) and is_dataclass(thing):
                assert issubclass(thing, Value), f"{package}.{name}"
                assert thing.__repr__ is Value.__repr__, f"{package}.{name}"


def test_these_are_the_values_that_are_exported_at_the_top(values):
    classes = {thing for name in pentapod.__all__ if inspect.isclass(thing := getattr(pentapod, name))}
    missing = {thing.__name__ for thing in classes if issubclass(thing, Value)} - {kind.__name__ for kind in values}
    assert missing == set()


def test_repr_is_short_and_says_something(values):
    for kind, value in values.items():
        text = repr(value)
        assert len(text) <= 300, text
        assert text.startswith(f"{kind.__name__}("), text
        assert "object at 0x" not in text, text
        if fields(value):
            assert "=" in text, text


def test_repr_of_the_stages(reached):
    told = {kind: repr(reached.find(kind)) for kind in (Toolpath, PlacedPath, LegPath, Trajectory, Program)}
    assert told[Toolpath].startswith("Toolpath(waypoints=284, cut_length=0.306")
    assert "smallest_margin=0." in told[PlacedPath]
    assert "length=0.39" in told[LegPath]
    assert "duration=7." in told[Trajectory]
    assert "×5] 0." in told[Program]
    assert "m, interpolation='cubic'" in told[Program]
    assert repr(reached.verdict).startswith("Verdict(answer='passed', certificates=3")


def test_every_value_comes_back_from_a_pickle_equal(values, reached):
    for kind, value in values.items():
        again = pickle.loads(pickle.dumps(value))
        assert again == value, kind
        assert hash(again) == hash(value), kind
    again = pickle.loads(pickle.dumps(reached))
    assert again == reached
    assert not again.find(Program).legs.flags.writeable
    trajectory = again.find(Trajectory)
    times = np.linspace(0.0, trajectory.duration, 7)
    np.testing.assert_array_equal(trajectory(times), reached.find(Trajectory)(times))


def test_values_that_differ_are_not_equal(reached):
    program, toolpath = reached.find(Program), reached.find(Toolpath)
    legs = program.legs.copy()
    legs[-1, 3] += 1e-11
    assert replace(program, legs=legs) != program
    assert replace(toolpath, tilt_centre=1e-3) != toolpath
    assert replace(toolpath) == toolpath


def test_a_chain_of_stages_needs_no_isinstance(reached, tmp_path):
    machine, toolpath = reached.machine, reached.find(Toolpath)
    here = PlacementConstraints.fixture([reached.find(PlacedPath).placement.transform])

    placed = plan(toolpath, machine, constraints=here)
    trajectory = retime(leg_path(placed, machine, **LIMITS), machine)
    program = write_csv(sample(trajectory, machine, placed), tmp_path / "program.csv")
    verdict = verify(program, machine, toolpath, tilt=0.0, constraints=here, **LIMITS).unwrap()

    assert all(claim.passed for claim in verdict.certificates)
    assert retime(leg_path(placed, machine, **LIMITS), machine).unwrap().duration == pytest.approx(
        reached.find(Program).duration, abs=2e-3
    )


def test_a_chain_hands_a_refusal_on_to_its_end(reached, tmp_path):
    machine, toolpath = reached.machine, reached.find(Toolpath)
    away = PlacementConstraints.fixture([RigidTransform(np.eye(3), np.array([9.0, 0.0, 0.0]))])

    placed = plan(toolpath, machine, constraints=away)
    trajectory = retime(leg_path(placed, machine, **LIMITS), machine)
    program = write_csv(sample(trajectory, machine, placed), tmp_path / "program.csv")
    answer = verify(program, machine, toolpath, tilt=0.0, constraints=away, **LIMITS)

    assert isinstance(placed, Refusal)
    assert answer is trajectory is explain(trajectory, machine) is placed
    assert not (tmp_path / "program.csv").exists()
    with pytest.raises(RefusalError, match="placement: ") as caught:
        answer.unwrap()
    assert caught.value.refusal is placed
    with pytest.raises(RefusalError):
        sample(reached.find(Trajectory), machine, placed)
    assert pickle.loads(pickle.dumps(placed)) == placed
    assert len(repr(placed)) <= 300


def test_an_outcome_unwraps_where_nothing_was_refused(reached):
    assert reached.unwrap() is reached
    refused = replace(reached, stages=(replace(reached.stages[0], value=BY_HAND[-1]),))
    with pytest.raises(RefusalError, match="it does not fit"):
        refused.unwrap()


def test_a_placement_without_component_is_refused(reached):
    placement = reached.find(PlacedPath).placement.transform
    with pytest.raises(InputError, match="component"):
        sample(reached.find(Trajectory), reached.machine, placement)


def test_frames(reached):
    program = reached.find(Program)
    frame = program.to_frame()
    assert list(frame) == ["leg1_mm", "leg2_mm", "leg3_mm", "leg4_mm", "leg5_mm"]
    assert frame.index.name == "time_s"
    np.testing.assert_allclose(frame.to_numpy(), 1e3 * program.legs, atol=1e-9)
    np.testing.assert_array_equal(frame.index, program.times)

    open_ = replace(reached.verdict, not_judged=(NotJudged("gouge", "nobody said"), NotJudged("feed", "why", True)))
    claims = open_.to_frame().set_index("claim")
    assert len(claims) == len(reached.verdict.certificates) + 2
    assert claims.answer["gouge"] == "not judged"
    assert claims.answer["feed"] == "waived"
    assert (claims.answer == "holds").sum() == len(reached.verdict.certificates)
    first = reached.verdict.certificates[5]
    assert claims.method[first.claim] == first.method


def test_a_missing_package_is_told_with_its_extra(reached, monkeypatch):
    for name in ("pandas", "matplotlib.pyplot"):
        monkeypatch.setitem(sys.modules, name, None)
    for show in (reached.verdict.to_frame, reached.find(Program).to_frame):
        with pytest.raises(InputError, match=r'frames need pandas; pip install "pentapod\[pandas\]"'):
            show()
    with pytest.raises(InputError, match=r'plots need matplotlib; pip install "pentapod\[plot\]"'):
        reached.find(Toolpath).plot()


class Balanced(HTMLParser):
    """Checks that tags close in their order, and gathers the text."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open, self.text = [], ""
        self.feed(page)
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: object) -> None:
        if tag != "polyline":
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if tag != "polyline":
            assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


def test_notebooks_show_small_escaped_html_without_colours_of_its_own(reached):
    failed = Certificate("<b>claim</b> & co", False, 2.0, 1.0, "mm", Place(), "measured")
    verdict = Verdict((failed,) * 40, (NotJudged("gouge", 'no "mesh"'),))
    for value, words in (
        (reached.find(Toolpath), "284 waypoints"),
        (reached.find(Program), f"{len(reached.find(Program).legs):,}"),
        (reached.verdict, "passed"),
        (verdict, "<b>claim</b> & co"),
    ):
        page = value._repr_html_()
        assert words in Balanced(page).text
        assert "<b>" not in page
        assert len(page) < 20_000
        assert "#" not in page
        assert "background:none" in page
    assert "29 rows are left out" in Balanced(verdict._repr_html_()).text


def test_plots_show_path_margins_and_rates(reached):
    matplotlib.use("Agg")
    drawn = reached.find(Toolpath).plot()
    assert {line.get_label() for line in drawn.lines} == {"cut", "link", "rapid"}
    placed = reached.find(PlacedPath)
    margins = placed.plot(most=3)
    assert margins.lines[0].get_label() == placed.active_limit
    assert min(margins.lines[0].get_ydata()) == placed.smallest_margin
    assert len(margins.lines) == 4
    speed, rates = reached.find(Trajectory).plot()
    assert max(speed.lines[0].get_ydata()) > 2999.0
    assert [text.get_text() for text in rates.get_legend().texts] == [f"leg {k}" for k in range(1, 6)]
    assert placed.plot(margins) is margins
    pyplot.close("all")


def test_a_segment_tells_its_kind():
    ends = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    up = np.array([[0.0, 0.0, 1.0]] * 2)
    assert repr(Segment("cut", ends, up, 0.05)).startswith(
        "Segment(kind=cut, tips=[2×3] 0…1 m, axes=[2×3] 0…1, feed=0.05"
    )
